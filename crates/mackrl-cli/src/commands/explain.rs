//! `mackrl explain`: who knew what at one step of a replay.

use crate::{
    args::ExplainArgs,
    failure::Failure,
    output,
    replay::{Explanation, Opened},
};

/// Prints the facts of one step.
pub(crate) fn run(args: &ExplainArgs) -> anyhow::Result<()> {
    let opened = Opened::read(&args.file)?;
    let steps = opened.playback.steps();
    if args.step >= steps {
        let message = format!(
            "--step {} is no decision of this episode, expected less than {steps}",
            args.step
        );
        return Err(Failure::Usage { message }.into());
    }
    let explanation = Explanation::of(&opened, args.step);
    if args.json {
        output::print_json(&explanation)
    } else {
        output::print(&explanation.to_string())
    }
}
