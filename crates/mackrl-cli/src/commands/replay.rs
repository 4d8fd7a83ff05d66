//! `mackrl replay`: pages, pictures and films of a recorded episode.

use crate::{
    args::ReplayArgs,
    failure::Failure,
    output,
    replay::{Opened, film, picture},
};

/// Plays a replay again, writes what was asked for, and says how the episode went.
pub(crate) fn run(args: &ReplayArgs) -> anyhow::Result<()> {
    if args.step.is_some() && args.svg.is_none() && args.html.is_none() {
        return Err(
            Failure::usage("--step says what --svg or --html shows, and neither is given").into(),
        );
    }
    if !args.group.is_empty() && args.svg.is_none() && args.gif.is_none() {
        return Err(
            Failure::usage("--group says what --svg or --gif shows, and neither is given").into(),
        );
    }
    let opened = Opened::read(&args.file)?;
    let group = opened.group(&args.group)?;
    if let Some(file) = &args.html {
        let step = opened.check_step(args.step.unwrap_or(0))?;
        output::write_file(file, opened.page(step).as_bytes())?;
    }
    let step = opened.check_step(args.step.unwrap_or(opened.playback.steps() / 2))?;
    if let Some(file) = &args.svg {
        let picture = picture(&opened, step, &group);
        output::write_file(file, picture.to_svg().as_bytes())?;
    }
    if let Some(file) = &args.gif {
        output::write_file(file, &film(&opened, &group)?)?;
    }
    let summary = opened.summary();
    if args.json {
        output::print_json(&summary)
    } else {
        output::print(&format!("replayed, every state as recorded: {summary}\n"))
    }
}
