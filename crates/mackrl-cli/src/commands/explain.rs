//! `mackrl explain`: who knew what at one step of a replay.

use crate::{
    args::ExplainArgs,
    failure::Failure,
    output,
    replay::{About, Explanation, Opened},
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
    let name = |typed: &[String]| -> Result<Vec<String>, Failure> {
        let agents = opened.group(typed)?.into_iter();
        Ok(agents.map(|agent| opened.names.agent(agent)).collect())
    };
    let about = match &args.agent {
        Some(agent) => About::Agent(name(std::slice::from_ref(agent))?.concat()),
        None if args.group.is_empty() => About::All,
        None => About::Group(name(&args.group)?),
    };
    let explanation = Explanation::of(&opened, args.step).only(&about);
    if args.json {
        output::print_json(&explanation)
    } else {
        output::print(&explanation.to_string())
    }
}
