//! One command for each figure of the paper.

pub(crate) mod ablations;
pub(crate) mod all;
mod claim;
pub(crate) mod figure5;
pub(crate) mod figure6;
pub(crate) mod figure7;
mod learning;

use std::path::Path;

pub(crate) use claim::{Claim, ClaimSource};

use mackrl_run::run_folder;

/// Writes a file whole: a reader finds the old one or the new one, never a part.
fn write(folder: &Path, name: &str, bytes: &[u8]) -> anyhow::Result<()> {
    Ok(run_folder::replace(&folder.join(name), bytes)?)
}
