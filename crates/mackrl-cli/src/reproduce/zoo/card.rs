//! The card of a published team: what it is, what it wins, and how to see and use it.

use mackrl_run::{run_folder::WhichWeights, training::Score};

use super::{
    BATTLE,
    report::{Team, won},
};
use crate::reproduce::page;

/// The card as a page in Markdown. `replay` is the name of the replay that [`BATTLE`] shows.
pub(super) fn card(team: &Team, replay: &str, versions: &str) -> String {
    let Team {
        map,
        algorithm,
        steps_env,
        seed,
        wall_s,
        ..
    } = team;
    let last = Some((WhichWeights::Last, &team.judged.last));
    let best = team.judged.best.as_ref();
    let best = best.map(|score| (WhichWeights::Best, score));
    let row = |(which, score): (WhichWeights, &Score)| {
        vec![
            format!("{which} (`{}`)", which.path().display()),
            score.steps_env.to_string(),
            won(score),
        ]
    };
    let rows: Vec<_> = best.into_iter().chain(last).map(row).collect();
    format!(
        "# A trained team for {map}\n\n\
         Trained with `{algorithm}` for {steps_env} environment steps with seed {seed}, in {:.1} minutes on one thread.\n\
         `config.toml` has every setting, `metrics.jsonl` the course of the training, `run.json` where the team comes from.\n\n\
         {}\n\
         Mean ± standard error over {} battles that neither training nor tests have seen. Made by {versions}.\n\n\
         **See it:** open `{BATTLE}` in a browser. It needs no network and no installation.\n\n\
         **Use it:** this folder is a run folder.\n\n\
         ```sh\n\
         mackrl evaluate . --checkpoint best     # the same battles again\n\
         mackrl certify . --checkpoint best      # each agent alone acts as in the team\n\
         mackrl replay replays/{replay} --html {BATTLE}\n\
         ```\n",
        wall_s / 60.0,
        page::table(&["weights", "of step", "win"], &rows),
        team.judged.last.episodes,
    )
}
