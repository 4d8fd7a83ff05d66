//! Gives the program the hash of the code that its results come from.
//!
//! What is hashed are the sources of the two libraries and the data that they embed: files of tests, and this crate, change no
//! result. A commit's name would need git at build time, would say nothing of changes that are not committed, and would have
//! this crate built anew after every commit.

use std::{
    fs,
    path::{Path, PathBuf},
};

use sha2::{Digest, Sha256};

/// Folders that results come from, relative to this crate. Those that are not there, as in a packaged crate, are left out.
const SOURCES: [&str; 7] = [
    "../mackrl/src",
    "../mackrl-run/src",
    "../mackrl-run/presets",
    "../mackrl-env/src",
    "../mackrl-skirmish/src",
    "../mackrl-skirmish/maps",
    "../mackrl-skirmish/units",
];

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    let mut hasher = Sha256::new();
    for folder in SOURCES.iter().map(Path::new).filter(|path| path.exists()) {
        println!("cargo::rerun-if-changed={}", folder.display());
        let mut files = Vec::new();
        collect(folder, &mut files);
        files.sort();
        for file in files {
            let content = fs::read(&file).expect("a source file can be read");
            hasher.update(file.to_string_lossy().replace('\\', "/"));
            hasher.update((content.len() as u64).to_le_bytes());
            hasher.update(content);
        }
    }
    let hash = hasher.finalize();
    let digits: String = hash[..6].iter().map(|byte| format!("{byte:02x}")).collect();
    println!("cargo::rustc-env=MACKRL_SOURCE={digits}");
}

/// Adds every file below `folder` that is not a test's.
fn collect(folder: &Path, files: &mut Vec<PathBuf>) {
    let entries = fs::read_dir(folder).expect("a source folder can be read");
    for entry in entries {
        let path = entry.expect("a source folder can be read").path();
        let is_test = path.file_stem().is_some_and(|stem| stem == "tests");
        if path.is_dir() && !is_test {
            collect(&path, files);
        } else if path.is_file() && !is_test {
            files.push(path);
        }
    }
}
