//! What each command does.

use mackrl_run::recorded::Grouping;

pub(crate) mod bench;
pub(crate) mod certify;
pub(crate) mod config;
pub(crate) mod diff;
pub(crate) mod evaluate;
pub(crate) mod execute_agent;
pub(crate) mod explain;
pub(crate) mod fidelity;
pub(crate) mod maps;
pub(crate) mod play;
pub(crate) mod plot;
pub(crate) mod replay;
pub(crate) mod report;
pub(crate) mod reproduce;
pub(crate) mod resume;
#[cfg(all(feature = "sc2", target_os = "linux"))]
pub(crate) mod sc2;
#[cfg(not(all(feature = "sc2", target_os = "linux")))]
#[path = "without_sc2.rs"]
pub(crate) mod sc2;
pub(crate) mod serve;
pub(crate) mod sweep;
pub(crate) mod train;

use std::io::{self, Write};

/// Says that runs were left out, if some were.
fn note_left_out(grouping: &Grouping) {
    if grouping.left_out > 0 {
        // The result is the same whether anybody reads this or not.
        let _ = writeln!(
            io::stderr(),
            "note: {} runs are not finished and left out; --unfinished uses them as far as they have come",
            grouping.left_out
        );
    }
}

/// The metric to show: the one that was asked for, or the one that says best how well a team plays in the world of the runs.
fn headline_or(asked: Option<&String>, grouping: &Grouping) -> String {
    let first = || grouping.series.first()?.runs.first();
    (asked.cloned())
        .or_else(|| Some(first()?.headline()))
        .unwrap_or_else(|| "test_return_mean".to_owned())
}
