//! `mackrl reproduce ppo`: MACKRL-PPO beside MAPPO and IPPO, on many maps.

use clap::Args;

use super::{
    ClaimSource,
    comparison::{Comparison, ComparisonOptions, Maps, Rule, Score, Statement},
};

/// Compare MACKRL-PPO with MAPPO and IPPO on many maps: one table, curves, and claims with verdicts
///
/// Makes the runs of a plan as `mackrl sweep` does: finished ones are kept, unfinished ones go on, so the command can be stopped
/// and given again. What the comparison needs of each finished run is kept in the folder of the results, and the comparison is
/// drawn from that: --as-it-stands draws it again and makes no run.
///
/// Writes ppo.json, ppo.svg and ppo.png, and fills the table into README.md between `<!-- ppo: begin -->` and
/// `<!-- ppo: end -->`, if it is there. For each learner on each map: how many runs, the battles that they win at the end as
/// mean with standard error and as interquartile mean with a 95 % bootstrap interval, environment steps until 70 and 90 % are won
/// (median over runs, and how many runs get there), what the best weights win in battles that neither training nor tests have
/// seen, and minutes on one thread. Each claim is judged by a rule that stands beside it; one for which there are too few
/// runs is not judged. The plan is results/ppo/plan.toml.
///
/// Examples: mackrl reproduce ppo --jobs 2; mackrl reproduce ppo --as-it-stands
#[derive(Debug, Clone, Args)]
pub(crate) struct PpoOptions {
    #[command(flatten)]
    pub(crate) comparison: ComparisonOptions,
}

/// What is claimed of MACKRL-PPO and MAPPO.
const MAPPO: Statement = Statement {
    claim: "MACKRL-PPO ends at least level with MAPPO on every map",
    source: ClaimSource::Reproduction,
    pair: ["mackrl-ppo", "mappo"],
    maps: Maps::Every,
    score: Score::End,
    rule: Rule::NotBehind,
    // Two standard errors of fewer say nothing.
    runs_least: 3,
    steps_env_least: 0,
};
const IPPO: Statement = Statement {
    claim: "MACKRL-PPO ends at least level with IPPO on every map",
    pair: ["mackrl-ppo", "ippo"],
    ..MAPPO
};

/// The comparison.
pub(crate) const COMPARISON: Comparison = Comparison {
    name: "ppo",
    plans: &["results/ppo/plan.toml"],
    title: "MACKRL-PPO beside MAPPO and IPPO",
    subtitle: "Greedy tests during training; mean over runs, band ± one standard error",
    recorded: &[],
    claims: &[
        MAPPO,
        Statement {
            claim: "MACKRL-PPO ends ahead of MAPPO on at least one map",
            maps: Maps::Some,
            rule: Rule::AheadBy(0.0),
            ..MAPPO
        },
        Statement {
            claim: "MACKRL-PPO learns at least as fast as MAPPO on every map",
            score: Score::All,
            ..MAPPO
        },
        IPPO,
        Statement {
            claim: "MACKRL-PPO ends ahead of IPPO on at least one map",
            maps: Maps::Some,
            rule: Rule::AheadBy(0.0),
            ..IPPO
        },
        Statement {
            claim: "MACKRL-PPO learns at least as fast as IPPO on every map",
            score: Score::All,
            ..IPPO
        },
    ],
};
