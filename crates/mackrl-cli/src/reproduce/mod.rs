//! One command for each figure of the paper.

mod claim;
pub(crate) mod figure5;
pub(crate) mod figure6;
pub(crate) mod figure7;
mod learning;
pub(crate) mod meter;

use std::path::Path;

pub(crate) use claim::{Claim, ClaimSource};
pub(crate) use meter::Meter;

use crate::run_folder;

/// Writes a file whole: a reader finds the old one or the new one, never a part.
fn write(folder: &Path, name: &str, bytes: &[u8]) -> anyhow::Result<()> {
    run_folder::replace(&folder.join(name), bytes)
}
