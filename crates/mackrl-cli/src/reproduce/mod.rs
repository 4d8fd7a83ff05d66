//! One command for each figure of the paper.

mod claim;
pub(crate) mod figure5;
pub(crate) mod figure6;
pub(crate) mod figure7;
mod learning;
pub(crate) mod meter;

use std::{fs, path::Path};

use anyhow::Context as _;

pub(crate) use claim::{Claim, ClaimSource};
pub(crate) use meter::Meter;

/// Writes a file whole: a reader finds the old one or the new one, never a part.
fn write(folder: &Path, name: &str, bytes: &[u8]) -> anyhow::Result<()> {
    let path = folder.join(name);
    let unfinished = folder.join(format!("{name}.tmp"));
    fs::write(&unfinished, bytes).with_context(|| format!("writing {}", unfinished.display()))?;
    fs::rename(&unfinished, &path).with_context(|| format!("writing {}", path.display()))
}
