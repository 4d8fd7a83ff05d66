//! `mackrl reproduce calibration`: learners of PyMARL on the simulator beside recorded curves of the real game.

use clap::Args;

use super::{
    ClaimSource,
    comparison::{Comparison, ComparisonOptions, Maps, Recorded, Rule, Score, Statement},
};

/// Compare IQL, VDN and QMIX on the simulator with recorded curves of the real game: how hard is the simulator?
///
/// Makes the runs of results/calibration/plan-easy.toml and plan-hard.toml as `mackrl sweep` does: finished ones are kept, unfinished
/// ones go on. What the comparison needs of each finished run is kept beside the plans: --as-it-stands draws it again and makes no
/// run.
///
/// Writes calibration.json, .svg and .png, and fills its tables into README.md between `<!-- calibration: begin -->` and
/// `<!-- calibration: end -->`, if it is there. Recorded points are rings, and stand in a table beside ours. They are one run
/// each, except QMIX on `8m` (two runs) and on `5m_vs_6m` (three). Nothing of the game is tuned to them.
///
/// Examples: mackrl reproduce calibration --jobs 2; mackrl reproduce calibration --as-it-stands
#[derive(Debug, Clone, Args)]
pub(crate) struct CalibrationOptions {
    #[command(flatten)]
    pub(crate) comparison: ComparisonOptions,
}

/// Two points of a learner on a map: training logs of StarCraft II with PyMARL's learners, which are public.
const fn recorded(map: &'static str, learner: &'static str, won: &'static [f64; 2]) -> Recorded {
    Recorded {
        map,
        learner,
        millions: &[1.0, 2.0],
        won,
    }
}

/// The sharpest test there is: on the real game the gap is .87.
const GAP: Statement = Statement {
    claim: "On 2s3z QMIX is far ahead of IQL after a million steps",
    source: ClaimSource::Reproduction,
    pair: ["qmix", "iql"],
    maps: Maps::On("2s3z"),
    score: Score::At(1_000_000),
    rule: Rule::AheadBy(0.5),
    runs_least: 5,
    steps_env_least: 2_000_000,
};

/// The comparison.
pub(crate) const COMPARISON: Comparison = Comparison {
    name: "calibration",
    plans: &[
        "results/calibration/plan-easy.toml",
        "results/calibration/plan-hard.toml",
    ],
    title: "IQL, VDN and QMIX beside recorded curves of the real game",
    subtitle: "Greedy tests; mean over runs, band ± one standard error; rings: recorded on the game itself",
    recorded: &[
        recorded("3m", "iql", &[0.97, 0.98]),
        recorded("8m", "iql", &[0.92, 0.93]),
        recorded("8m", "vdn", &[0.98, 0.99]),
        recorded("8m", "qmix", &[0.98, 0.99]),
        recorded("2s3z", "iql", &[0.10, 0.38]),
        recorded("2s3z", "qmix", &[0.97, 0.98]),
        recorded("3s5z", "qmix", &[0.92, 0.97]),
        recorded("5m_vs_6m", "qmix", &[0.62, 0.65]),
    ],
    claims: &[
        GAP,
        Statement {
            claim: "On 2s3z QMIX is ahead of IQL after two million steps",
            score: Score::At(2_000_000),
            rule: Rule::AheadBy(0.0),
            ..GAP
        },
    ],
};
