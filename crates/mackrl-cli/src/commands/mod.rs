//! What each command does.

use mackrl_run::recorded::Grouping;

use crate::failure::printable;

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
pub(crate) mod shell;
mod sizes;
pub(crate) mod sweep;
pub(crate) mod train;

use std::{
    io::{self, Write},
    path::PathBuf,
};

/// Where this program lies, to start it once more. Where the system does not tell, as without `/proc`, it is found again by the
/// name by which it was called.
fn this_program() -> anyhow::Result<PathBuf> {
    let called = || std::env::args_os().next().map(PathBuf::from);
    match std::env::current_exe() {
        Ok(program) => Ok(program),
        Err(error) => called()
            .ok_or_else(|| anyhow::Error::new(error).context("cannot find this program's file")),
    }
}

/// Says that runs were left out, or that rows of a run are missing, if some are.
fn note_left_out(grouping: &Grouping) {
    if grouping.left_out > 0 {
        // The result is the same whether this can be written or not.
        let _ = writeln!(
            io::stderr(),
            "note: {} runs are not finished and left out; --unfinished uses them as far as they have come",
            grouping.left_out
        );
    }
    let runs = grouping.series.iter().flat_map(|series| &series.runs);
    for run in runs.filter(|run| run.misses_rows) {
        let _ = writeln!(
            io::stderr(),
            "warning: {}: metrics were damaged and put aside when the run continued; rows before that are missing",
            printable(&run.path.display().to_string())
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
