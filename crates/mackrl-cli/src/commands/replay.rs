//! `mackrl replay`: pages, pictures and films of a recorded episode.

use crate::{
    args::ReplayArgs,
    failure::Failure,
    output,
    replay::{Opened, Summary, film, page, picture},
};

/// Plays a replay again, writes what was asked for, and says how the episode went.
pub(crate) fn run(args: &ReplayArgs) -> anyhow::Result<()> {
    let draws_a_step = args.svg.is_some() || args.png.is_some();
    if args.step.is_some() && !draws_a_step && args.html.is_none() {
        return Err(Failure::usage(
            "--step says what --svg, --png or --html shows, and none of them is given",
        )
        .into());
    }
    if !args.group.is_empty() && !draws_a_step && args.gif.is_none() {
        return Err(Failure::usage(
            "--group says what --svg, --png or --gif shows, and none of them is given",
        )
        .into());
    }
    let opened = Opened::read(&args.file)?;
    let group = opened.group(&args.group)?;
    if let Some(file) = &args.html {
        let step = opened.check_step(args.step.unwrap_or(0))?;
        output::write_file(file, page(&opened, step)?.as_bytes())?;
    }
    let step = opened.check_step(args.step.unwrap_or(opened.playback.steps() / 2))?;
    if let Some(file) = &args.svg {
        let picture = picture(&opened, step, &group);
        output::write_file(file, picture.to_svg().as_bytes())?;
    }
    if let Some(file) = &args.png {
        output::write_file(file, &picture(&opened, step, &group).to_png()?)?;
    }
    if let Some(file) = &args.gif {
        output::write_file(file, &film(&opened, &group)?)?;
    }
    let summary = Summary::of(&opened);
    if args.json {
        output::print_json(&summary)
    } else {
        output::print(&format!("replayed, every state as recorded: {summary}\n"))
    }
}
