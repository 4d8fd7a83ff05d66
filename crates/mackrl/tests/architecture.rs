//! ARCHITECTURE.md is true: its tables of imports hold, its folders are all there are, its paths exist.
//!
//! What a crate may import is what its manifest names, so for crates the table is compared with the manifests. Modules of one
//! crate have no such border, and their imports are read from the code.

use std::{
    collections::{BTreeMap, BTreeSet},
    fs,
    path::{Path, PathBuf},
};

/// How much of the world a module sees; each includes those before it.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
enum Sight {
    Nothing,
    Names,
    Views,
    Worlds,
}

/// One row of the table of modules.
#[derive(Debug)]
struct Rule {
    imports: BTreeSet<String>,
    sees: Sight,
}

/// Documents of which every quoted path exists.
const DOCUMENTS: [&str; 2] = ["ARCHITECTURE.md", "PAPER.md"];

/// What names things of the world, or declares settings, and shows nothing of it.
const NAMES: [&str; 12] = [
    "Action",
    "AgentId",
    "Draw",
    "EntityId",
    "EntitySet",
    "EpisodeKey",
    "StepError",
    "Stream",
    "declare_settings",
    "declare_words",
    "random",
    "settings",
];
/// What shows a world without letting anybody step it.
const VIEWS: [&str; 7] = [
    "EnvironmentSpec",
    "EpisodeEnd",
    "KnownEntities",
    "LocalView",
    "ObservationMut",
    "Observations",
    "PriorKnowledge",
];

#[test]
fn every_folder_of_the_library_is_in_the_table_and_no_other() {
    let folders: BTreeSet<String> = fs::read_dir(root().join("crates/mackrl/src"))
        .expect("the library has sources")
        .map(|entry| entry.expect("its sources can be listed"))
        .filter(|entry| entry.path().is_dir())
        .map(|entry| entry.file_name().to_string_lossy().into_owned())
        .collect();
    let table: BTreeSet<String> = module_rules().into_keys().collect();
    assert_eq!(folders, table, "folders (left) and ARCHITECTURE.md (right)");
}

#[test]
fn every_path_in_the_documents_exists() {
    for document in DOCUMENTS {
        let text = fs::read_to_string(root().join(document)).expect("the document exists");
        let paths = paths_in(&text);
        assert!(!paths.is_empty(), "{document} names no path at all");
        for path in paths {
            assert!(
                root().join(&path).exists(),
                "{document} names {path}, which does not exist"
            );
        }
    }
}

#[test]
fn every_test_in_the_table_of_the_paper_exists() {
    let text = fs::read_to_string(root().join("PAPER.md")).expect("PAPER.md exists");
    let quoted: Vec<String> = text.lines().flat_map(quoted).collect();
    let tests: Vec<_> = quoted
        .iter()
        .filter_map(|word| word.split_once("::"))
        .collect();
    assert!(tests.len() >= 6, "PAPER.md names a test for each equation");
    for (file, test) in tests {
        let code = fs::read_to_string(root().join(file)).unwrap_or_default();
        assert!(
            code.contains(&format!("fn {test}(")),
            "PAPER.md names the test {test}, which {file} does not have"
        );
    }
}

#[test]
fn the_table_of_crates_is_what_their_manifests_say() {
    let table = crate_rules();
    let folders = fs::read_dir(root().join("crates")).expect("there are crates");
    let folders: BTreeSet<String> = folders
        .map(|entry| entry.expect("they can be listed").file_name())
        .map(|name| name.to_string_lossy().into_owned())
        .collect();
    assert_eq!(folders, table.keys().cloned().collect(), "crates");
    for (name, imports) in &table {
        let manifest = root().join("crates").join(name).join("Cargo.toml");
        let manifest = fs::read_to_string(manifest).expect("a crate has a manifest");
        let manifest: toml::Table = manifest.parse().expect("a manifest is TOML");
        let targets = manifest.get("target").and_then(toml::Value::as_table);
        let targets = targets.into_iter().flat_map(toml::Table::values);
        let dependencies = [manifest.get("dependencies")].into_iter();
        let named: BTreeSet<String> = dependencies
            .chain(targets.map(|target| target.get("dependencies")))
            .flatten()
            .filter_map(toml::Value::as_table)
            .flat_map(toml::Table::keys)
            .filter(|other| table.contains_key(*other))
            .cloned()
            .collect();
        assert_eq!(named, *imports, "{name}: its manifest (left) and the table");
    }
}

#[test]
fn modules_import_only_what_the_table_allows() {
    let source = root().join("crates/mackrl/src");
    let mut violations = Vec::new();
    for (name, rule) in module_rules() {
        for file in sources(&source.join(&name)) {
            for path in imported_paths(&file) {
                if !allows(&rule, &name, &path) {
                    let file = file.strip_prefix(&source).expect("a file of the library");
                    violations.push(format!("{} imports {}", file.display(), path.join("::")));
                }
            }
        }
    }
    assert!(violations.is_empty(), "{violations:#?}");
}

#[test]
fn the_table_of_modules_allows_nothing_that_is_not_used() {
    let source = root().join("crates/mackrl/src");
    for (name, rule) in module_rules() {
        let files = sources(&source.join(&name)).into_iter();
        let paths: Vec<_> = files.flat_map(|file| imported_paths(&file)).collect();
        let used: BTreeSet<String> = (paths.iter())
            .filter(|path| path[0] == "crate" && path.len() > 1)
            .map(|path| path[1].clone())
            .filter(|item| *item != name && !is_shared(item))
            .collect();
        assert_eq!(used, rule.imports, "imports of {name} (left) and the table");
        let seen = (paths.iter())
            .filter(|path| path[0] == "mackrl_env")
            .map(|path| path.get(1).map_or(Sight::Worlds, |item| needed_sight(item)))
            .max();
        let seen = seen.unwrap_or(Sight::Nothing);
        assert_eq!(seen, rule.sees, "what {name} sees (left) and the table");
    }
}

#[test]
fn plots_never_see_the_trainer() {
    let plot = root().join("crates/mackrl-cli/src/plot");
    let files = if plot.exists() {
        sources(&plot)
    } else {
        vec![]
    };
    for file in files {
        for path in imported_paths(&file) {
            let trainer = ["training", "algorithms", "experience"];
            let sees = path[0].starts_with("mackrl")
                && path
                    .get(1)
                    .is_some_and(|module| trainer.contains(&&**module));
            assert!(!sees, "{} imports {}", file.display(), path.join("::"));
        }
    }
}

#[test]
fn a_forbidden_import_would_be_found() {
    let rule = Rule {
        imports: BTreeSet::from(["policy".to_owned()]),
        sees: Sight::Names,
    };
    let violations = |code: &str| {
        paths_of_code(code)
            .into_iter()
            .filter(|path| !allows(&rule, "critics", path))
            .count()
    };
    assert_eq!(violations("use crate::policy::PolicyTable;"), 0);
    assert_eq!(violations("use mackrl_env::{AgentId, EpisodeKey};"), 0);
    assert_eq!(violations("use crate::{policy::A, hierarchy::{B, C}};"), 2);
    assert_eq!(violations("use mackrl_env::{AgentId, Environment};"), 1);
    assert_eq!(violations("let f = crate::experience::f();"), 1);
    assert_eq!(
        violations("use crate::{\n    Error,\n    nn::{self, Linear as L},\n};"),
        2
    );
    assert_eq!(
        violations("// crate::experience\n#[cfg(test)]\nuse crate::experience;"),
        0
    );
}

/// Whether a module called `name` may import `path` under `rule`.
fn allows(rule: &Rule, name: &str, path: &[String]) -> bool {
    let Some(item) = path.get(1) else {
        return path[0] != "mackrl_env" || rule.sees == Sight::Worlds;
    };
    match path[0].as_str() {
        "crate" => item == name || rule.imports.contains(item) || is_shared(item),
        "mackrl_env" => rule.sees >= needed_sight(item),
        _ => true,
    }
}

fn needed_sight(item: &str) -> Sight {
    if NAMES.contains(&item) {
        Sight::Names
    } else if VIEWS.contains(&item) {
        Sight::Views
    } else {
        Sight::Worlds
    }
}

/// Whether everybody may use it: the errors, the numbers and the threads at the root of the crate.
fn is_shared(item: &str) -> bool {
    item.starts_with(char::is_uppercase) || item == "parallel"
}

/// Crate → crates that it may import.
fn crate_rules() -> BTreeMap<String, BTreeSet<String>> {
    table_below("| crate | imports |")
        .into_iter()
        .map(|cells| {
            (
                quoted(&cells[0]).concat(),
                quoted(&cells[1]).into_iter().collect(),
            )
        })
        .collect()
}

/// Module of the library → what it may import and see.
fn module_rules() -> BTreeMap<String, Rule> {
    let rule = |cells: &[String]| Rule {
        imports: quoted(&cells[2]).into_iter().collect(),
        sees: match cells[3].as_str() {
            "nothing" => Sight::Nothing,
            "names" => Sight::Names,
            "views" => Sight::Views,
            "worlds" => Sight::Worlds,
            other => panic!("ARCHITECTURE.md: `{other}` is not nothing, names, views or worlds"),
        },
    };
    table_below("| module | what it is | imports | sees of the world |")
        .iter()
        .map(|cells| (quoted(&cells[0]).concat(), rule(cells)))
        .collect()
}

/// The rows of the table of ARCHITECTURE.md that has this heading.
fn table_below(heading: &str) -> Vec<Vec<String>> {
    let text = fs::read_to_string(root().join("ARCHITECTURE.md")).expect("ARCHITECTURE.md exists");
    let rows: Vec<Vec<String>> = text
        .lines()
        .skip_while(|line| *line != heading)
        .skip(2)
        .take_while(|line| line.starts_with('|'))
        .map(|line| {
            let inner = line.trim_matches('|').split(" | ");
            inner.map(|cell| cell.trim().to_owned()).collect()
        })
        .collect();
    assert!(!rows.is_empty(), "ARCHITECTURE.md has no table `{heading}`");
    rows
}

/// What stands in back quotes.
fn quoted(text: &str) -> Vec<String> {
    text.split('`')
        .skip(1)
        .step_by(2)
        .map(str::to_owned)
        .collect()
}

/// Quoted words that are paths of this repository: those with a slash, and files at its root.
fn paths_in(text: &str) -> Vec<String> {
    let is_path = |word: &String| {
        let plain = |c: char| c.is_ascii_alphanumeric() || "/._-".contains(c);
        let at_root = word.ends_with(".md") || word.ends_with(".toml");
        word.chars().all(plain) && (word.contains('/') || at_root)
    };
    text.lines()
        .filter(|line| !line.starts_with("```"))
        .flat_map(quoted)
        .filter(is_path)
        .collect()
}

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// Every Rust file below `folder` that is not a file of tests.
fn sources(folder: &Path) -> Vec<PathBuf> {
    let entries =
        fs::read_dir(folder).unwrap_or_else(|error| panic!("{}: {error}", folder.display()));
    let mut files = Vec::new();
    for entry in entries {
        let path = entry.expect("a folder can be listed").path();
        if path.is_dir() {
            files.extend(sources(&path));
        } else if path.extension().is_some_and(|extension| extension == "rs")
            && !path.ends_with("tests.rs")
        {
            files.push(path);
        }
    }
    files
}

fn imported_paths(file: &Path) -> Vec<Vec<String>> {
    let code =
        fs::read_to_string(file).unwrap_or_else(|error| panic!("{}: {error}", file.display()));
    paths_of_code(&code)
}

/// Every path that begins in this workspace, in `use` items and in expressions, as its segments.
///
/// Comments are left out, and the tests at the end of a file.
fn paths_of_code(code: &str) -> Vec<Vec<String>> {
    let code: String = code
        .lines()
        .take_while(|line| line.trim() != "#[cfg(test)]")
        .map(|line| line.split("//").next().unwrap_or_default())
        .flat_map(|line| [line, "\n"])
        .collect();
    let mut paths = Vec::new();
    for start in ["crate", "mackrl_env", "mackrl_run", "mackrl"] {
        let needle = format!("{start}::");
        for (at, _) in code.match_indices(&needle) {
            let inside = |c: char| c.is_alphanumeric() || "_:$".contains(c);
            if !code[..at].ends_with(inside) {
                let mut rest = code[at + needle.len()..].trim_start();
                expand(&mut rest, &[start.to_owned()], &mut paths);
            }
        }
    }
    paths
}

/// Reads one tree of a `use` item, such as `a::{b, c::D}`, and adds its paths behind `before`.
fn expand(rest: &mut &str, before: &[String], paths: &mut Vec<Vec<String>>) {
    if let Some(inner) = rest.strip_prefix('{') {
        *rest = inner.trim_start();
        while !rest.is_empty() && !rest.starts_with('}') {
            expand(rest, before, paths);
            // Skips what may follow a name, such as `as Other`, up to the next name.
            let end = rest.find([',', '}']).unwrap_or(rest.len());
            *rest = rest[end..].trim_start_matches(',').trim_start();
        }
        *rest = rest.strip_prefix('}').unwrap_or(rest);
        return;
    }
    let end = rest
        .find(|c: char| !c.is_alphanumeric() && c != '_')
        .unwrap_or(rest.len());
    let (name, after) = rest.split_at(end);
    let mut path = before.to_vec();
    if !name.is_empty() && name != "self" {
        path.push(name.to_owned());
    }
    *rest = after;
    match after.strip_prefix("::") {
        Some(inner) => {
            *rest = inner;
            expand(rest, &path, paths);
        }
        None => paths.push(path),
    }
}
