//! The file of metrics, opened to be continued.

use std::{fs::File, path::Path};

use cap_std::fs::OpenOptions;

use super::{
    METRICS,
    disk::{self, RealDisk},
};
use crate::{
    error::{Context, Result},
    folder::Folder,
};

/// Opens the metrics for appending, and cuts off everything after the first `bytes` bytes.
pub(super) fn open(folder: &Folder, bytes: u64) -> Result<File> {
    let path = Path::new(METRICS);
    let mut options = OpenOptions::new();
    options.create(true).append(true);
    let file = folder
        .open_with(path, &options)
        .with_context(|| folder.cannot("open", path))?;
    file.set_len(bytes)
        .and_then(|()| file.sync_all())
        .with_context(|| folder.cannot("cut", path))?;
    Ok(file)
}

/// Gives metrics that are not those of the checkpoint another name, and says which; where there are none, nothing is moved.
pub(super) fn put_aside(folder: &Folder) -> Result<String> {
    let mut name = format!("{METRICS}.damaged");
    let mut number = 1;
    while folder.kind(&name)?.is_some() {
        number += 1;
        name = format!("{METRICS}.damaged{number}");
    }
    if folder.kind(METRICS)?.is_some() {
        disk::rename(&RealDisk, folder, Path::new(METRICS), Path::new(&name))?;
    }
    Ok(name)
}
