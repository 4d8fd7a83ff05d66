//! A replay as one page for the browser: it opens from disk and needs no network.
//!
//! The page is HTML, CSS and JavaScript written by hand, put together here with the replay's data; a framework would be a hundred
//! times its size. Whatever a replay holds reaches the page as JSON in which no mark-up can begin, and the page shows it as
//! text; its content security policy lets it load nothing.

mod data;

use super::{Playback, Replay};
use data::{PageData, Shown};

const PAGE: &str = include_str!("page.html");
const STYLE: &str = include_str!("style.css");
/// In the order of their use.
const SCRIPTS: [&str; 5] = [
    include_str!("knowledge.js"),
    include_str!("battle.js"),
    include_str!("plots.js"),
    include_str!("panel.js"),
    include_str!("player.js"),
];

/// The page of a replay that was played again; it first shows `step`.
///
/// # Panics
/// Never: plain data can be written as JSON, and the template has its marks.
#[must_use]
pub fn page(replay: &Replay, playback: &Playback, step: usize) -> String {
    let shown = Shown::new(replay, playback);
    let json = serde_json::to_string(&PageData::of(&shown, step)).expect("plain data");
    // Marks are looked for in the template alone, never in what was filled in.
    let (before_style, rest) = PAGE.split_once("@STYLE@").expect("the page has a style");
    let (before_data, rest) = rest.split_once("@DATA@").expect("the page has data");
    let (before_script, end) = rest.split_once("@SCRIPT@").expect("the page has a script");
    let script = format!("\"use strict\";\n{}", SCRIPTS.join("\n"));
    let parts = [
        before_style,
        STYLE.trim_end(),
        before_data,
        &escaped(&json),
        before_script,
        script.trim_end(),
        end,
    ];
    parts.concat()
}

/// JSON in which nothing can end the element that it stands in.
fn escaped(json: &str) -> String {
    // These characters occur in JSON's strings alone, where an escape means the same.
    json.replace('<', "\\u003c")
        .replace('>', "\\u003e")
        .replace('&', "\\u0026")
}
