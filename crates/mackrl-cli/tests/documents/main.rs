//! What the pages say is so: their commands run, their files are read, and the pages of reference are the program's own words.
//!
//! A block of a page is a command (`sh`), a file (`toml`) or an output (`text`). A comment in the line above tells what the page
//! leaves out:
//!
//! ```text
//! <!-- not run: needs Slurm -->         it cannot run here; the reason is one of `REASONS`
//! <!-- with: 200000 = 600; 320 = 2 -->  it runs with these words replaced, since the page's own would take too long
//! <!-- file: plan.toml -->              it is written to this file before the blocks below it run, with words
//!                                       replaced where some follow: `file: plan.toml; 20000 = 300`
//! <!-- output -->                       it is what the command above printed; `output: 1-9` says which lines of it
//! <!-- from: crates/…/deploy.rs -->     it is this file, without its first lines of attributes
//! ```
//!
//! Blocks of Python are run by `python/tests/test_documents.py`, and the pages of Rust are compiled as part of the libraries.
//! `INSTA_UPDATE=always cargo test -p mackrl --test documents` writes outputs, copies and pages of reference anew.
#![cfg(target_os = "linux")]

mod blocks;
mod reference;
mod shell;

use std::{
    env, fs,
    path::{Path, PathBuf},
};

use blocks::{Block, Directive, blocks};

/// Why a block may stand on a page without being run.
const REASONS: &[&str] = &[
    "needs Slurm",
    "needs Ray",
    "needs a browser",
    "needs StarCraft II",
    "a program of its own",
    "tested by .ci/run",
    "takes hours",
];

/// How many blocks may stand on the pages without being run: as few as possible.
const NOT_RUN_MAX: usize = 40;

/// The folder of the repository.
fn root() -> PathBuf {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    folder.canonicalize().expect("the repository")
}

/// README.md and every page of `docs/`, by their paths in the repository.
fn pages() -> Vec<String> {
    let mut found = vec!["README.md".to_owned()];
    for folder in ["docs", "docs/reference"] {
        for entry in fs::read_dir(root().join(folder)).expect("a folder of pages") {
            let name = entry.expect("an entry").file_name();
            let name = name.to_str().expect("names of pages are UTF-8");
            if Path::new(name).extension().is_some_and(|ext| ext == "md") {
                found.push(format!("{folder}/{name}"));
            }
        }
    }
    found.sort();
    found
}

fn read(page: &str) -> String {
    fs::read_to_string(root().join(page)).unwrap_or_else(|error| panic!("{page}: {error}"))
}

/// A block as it stands on a page.
fn fenced(language: &str, text: &str) -> String {
    format!("```{language}\n{text}```")
}

/// Compares a part of a page with what it should be, or writes it anew.
fn expect_same(page: &str, before: &str, after: &str) {
    if before == after {
        return;
    }
    assert!(
        env::var("INSTA_UPDATE").is_ok_and(|update| update == "always"),
        "{page} is not what the program says; INSTA_UPDATE=always cargo test -p mackrl --test documents\n\
         --- the page\n{before}\n--- the program\n{after}"
    );
    let text = fs::read_to_string(root().join(page)).unwrap_or_default();
    let new = if before.is_empty() {
        after.to_owned()
    } else {
        text.replacen(before, after, 1)
    };
    fs::write(root().join(page), new).expect("the page can be written");
}

#[test]
fn every_command_of_the_pages_runs() {
    let pages = pages();
    let half = |first: usize| -> Vec<String> {
        let pages = pages.iter().skip(first).step_by(2);
        pages.filter_map(|page| shell::run(page).err()).collect()
    };
    // Two at a time: most of them wait for a program on one thread.
    let faults = std::thread::scope(|scope| {
        let other = scope.spawn(|| half(1));
        [half(0), other.join().expect("the other half")].concat()
    });
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}

#[test]
fn blocks_that_are_not_run_say_why_and_are_few() {
    let mut not_run = 0;
    let mut run = 0;
    for page in pages() {
        for block in blocks(&read(&page)) {
            match &block.directive {
                Some(Directive::NotRun(reason)) => {
                    let known = REASONS.iter().any(|known| reason.starts_with(known));
                    assert!(known, "{page}:{}: not run, as `{reason}`", block.line);
                    not_run += 1;
                }
                _ if ["sh", "python", "toml", "rust"].contains(&&*block.language) => run += 1,
                Some(Directive::Output(_) | Directive::From(_)) => run += 1,
                _ => {
                    let shown = ["text", "json"].contains(&&*block.language);
                    assert!(
                        shown,
                        "{page}:{}: a block of `{}`",
                        block.line, block.language
                    );
                }
            }
        }
    }
    assert!(not_run <= NOT_RUN_MAX, "{not_run} blocks are not run");
    assert!(run > 3 * not_run, "{run} blocks are run, {not_run} are not");
}

#[test]
fn files_of_the_pages_can_be_read() {
    for page in pages() {
        for block in blocks(&read(&page))
            .iter()
            .filter(|block| block.language == "toml")
        {
            let parsed = block.text.parse::<toml::Table>();
            assert!(parsed.is_ok(), "{page}:{}: {parsed:?}", block.line);
        }
    }
}

#[test]
fn programs_on_the_pages_are_those_that_are_built() {
    for page in pages() {
        for Block {
            directive, text, ..
        } in blocks(&read(&page))
        {
            if let Some(Directive::From(file)) = directive {
                let program = read(&file);
                let shown = program.lines().filter(|line| !line.starts_with("#!["));
                let shown: String = shown.map(|line| format!("{line}\n")).collect();
                expect_same(&page, &fenced("rust", &text), &fenced("rust", &shown));
            }
        }
    }
}

#[test]
fn pages_of_reference_are_the_words_of_the_program() {
    for (page, text) in [
        ("docs/reference/commands.md", reference::commands()),
        ("docs/reference/settings.md", reference::settings()),
        ("docs/reference/metrics.md", reference::metrics()),
        ("docs/reference/maps.md", reference::maps()),
    ] {
        let before = fs::read_to_string(root().join(page)).unwrap_or_default();
        expect_same(page, &before, &text);
    }
}

#[test]
fn every_exit_code_has_a_row() {
    let help = shell::mackrl("--help");
    let help = help.split_whitespace().collect::<Vec<_>>().join(" ");
    let (_, codes) = help.split_once("Exit codes: ").expect("the codes");
    let (codes, _) = codes
        .split_once(". Usage")
        .or_else(|| codes.split_once("Usage"))
        .expect("an end");
    let page = read("docs/reference/exit-codes.md");
    let mut found = 0;
    for code in codes.split(", ").filter_map(|part| part.split(' ').next()) {
        if code.parse::<u8>().is_ok() {
            assert!(page.contains(&format!("\n| {code} |")), "exit code {code}");
            found += 1;
        }
    }
    assert!(found >= 8, "{codes}");
}
