//! Gives the program the hash of the code that its results come from.
//!
//! What is hashed are the sources of the libraries and the data that they embed: files of tests, and the program, change no
//! result. A commit's name would need git at build time, would say nothing of changes that are not committed, and would have
//! this crate built anew after every commit.

use std::{
    fs,
    path::{Path, PathBuf},
};

use sha2::{Digest, Sha256};

/// Folders that results come from, each as its crate's folder in the repository, its package, and its place within.
const SOURCES: [(&str, &str, &str); 6] = [
    ("mackrl", "mackrl-core", "src"),
    ("mackrl-run", "mackrl-run", "src"),
    ("mackrl-env", "mackrl-env", "src"),
    ("mackrl-skirmish", "mackrl-skirmish", "src"),
    ("mackrl-skirmish", "mackrl-skirmish", "maps"),
    ("mackrl-skirmish", "mackrl-skirmish", "units"),
];

fn main() {
    println!("cargo::rerun-if-changed=build.rs");
    let digits = hash_of_sources().unwrap_or_else(|| "unknown".to_owned());
    println!("cargo::rustc-env=MACKRL_SOURCE={digits}");
}

/// The hash, the same in the repository and in unpacked packages of the same sources; nothing if a crate is not beside this one.
fn hash_of_sources() -> Option<String> {
    let mut hasher = Sha256::new();
    for (folder, package, place) in SOURCES {
        let version = env!("CARGO_PKG_VERSION");
        let beside = [format!("../{folder}"), format!("../{package}-{version}")];
        let roots = beside.map(|name| Path::new(&name).join(place));
        let Some(root) = roots.iter().find(|path| path.exists()) else {
            // What is missing now may be there at the next build.
            println!("cargo::rerun-if-changed={}", roots[0].display());
            return None;
        };
        println!("cargo::rerun-if-changed={}", root.display());
        let mut files = Vec::new();
        collect(root, &mut files);
        files.sort();
        for file in files {
            let content = fs::read(&file).expect("a source file can be read");
            let name = file.strip_prefix(root).expect("a file of the folder");
            hasher.update(format!(
                "{folder}/{place}/{}",
                name.to_string_lossy().replace('\\', "/")
            ));
            hasher.update((content.len() as u64).to_le_bytes());
            hasher.update(content);
        }
    }
    let hash = hasher.finalize();
    Some(hash[..6].iter().map(|byte| format!("{byte:02x}")).collect())
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
