//! `mackrl report`: what many runs show together.

mod findings;
mod marl_eval;
mod scores;
mod table;

use mackrl_run::{
    recorded::{find, group},
    run_folder,
};

use crate::{args::ReportArgs, output};
use findings::Findings;
use scores::Scores;

/// Judges the runs, prints the findings, and exports what was asked for.
pub(crate) fn run(args: &ReportArgs) -> anyhow::Result<()> {
    let grouping = group(find(&args.runs.paths)?, &args.runs.selection())?;
    super::note_left_out(&grouping);
    let metric = super::headline_or(args.metric.as_ref(), &grouping);
    let scores = Scores::read(&grouping, &metric, args.at)?;
    if let Some(path) = &args.export_marl_eval {
        let json = serde_json::to_string_pretty(&marl_eval::experiments(&grouping)?)? + "\n";
        run_folder::replace(path, json.as_bytes())?;
    }
    let findings = Findings::new(&scores, metric, args, grouping.provenance());
    if args.json {
        output::print_json(&findings)
    } else {
        output::print(&table::text(&findings))
    }
}
