//! What the program itself reads: run folders. They are given to `mackrl`, with a limit on its memory.

use std::{
    fs,
    os::unix::fs::symlink,
    path::{Path, PathBuf},
    process::{Child, Command, ExitStatus, Stdio},
    time::{Duration, Instant},
};

use fastrand::Rng;
use tempfile::TempDir;

use crate::{Target, mutation};

/// Memory that the program may ask for, in KiB: address space, of which threads and the program itself take most.
const ADDRESSES_MAX_KIB: usize = 1 << 20;
/// Time that the program may take to read a run and to play an episode, on a busy machine.
const PATIENCE: Duration = Duration::from_secs(20);
/// Time after which a run that goes on is left: a stranger's settings may ask for a long one.
const TRAINING_WATCHED: Duration = Duration::from_secs(3);
/// What the program may end with: success, usage, configuration, data, input or output. Neither a defect (70) nor a panic (101).
const EXIT_CODES: [i32; 5] = [0, 2, 64, 65, 74];

/// Runs `mackrl` with these words; the error says what it should not have done.
fn run(words: &[&str], folder: &Path) -> Result<(), String> {
    let trains = words[0] == "resume";
    let program = assert_cmd::cargo::cargo_bin("mackrl");
    let mut child = Command::new("sh")
        .arg("-c")
        .arg(format!("ulimit -v {ADDRESSES_MAX_KIB}; exec \"$0\" \"$@\""))
        .arg(program)
        .args(words)
        .current_dir(folder)
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(fs::File::create(folder.join("stderr")).map_err(|error| error.to_string())?)
        .spawn()
        .map_err(|error| error.to_string())?;
    let Some(status) = wait(&mut child, if trains { TRAINING_WATCHED } else { PATIENCE })? else {
        return if trains {
            Ok(())
        } else {
            Err(format!("it did not end within {PATIENCE:?}"))
        };
    };
    let told = fs::read(folder.join("stderr")).unwrap_or_default();
    let told = String::from_utf8_lossy(&told);
    let allowed = status.code().is_some_and(|code| EXIT_CODES.contains(&code));
    if !allowed || told.contains("panicked") || told.len() > 4000 {
        return Err(format!(
            "`mackrl {}` ended with {status}:\n{told:.2000}",
            words.join(" ")
        ));
    }
    Ok(())
}

/// Waits for the end, or ends what has not ended in time.
fn wait(child: &mut Child, patience: Duration) -> Result<Option<ExitStatus>, String> {
    let start = Instant::now();
    while start.elapsed() < patience {
        let status = child.try_wait().map_err(|error| error.to_string())?;
        if status.is_some() {
            return Ok(status);
        }
        std::thread::sleep(Duration::from_millis(1));
    }
    child.kill().map_err(|error| error.to_string())?;
    child.wait().map_err(|error| error.to_string())?;
    Ok(None)
}

/// Runs `mackrl` and expects success.
fn succeed(line: &str, folder: &Path) {
    let words: Vec<&str> = line.split_whitespace().collect();
    let status = Command::new(assert_cmd::cargo::cargo_bin("mackrl"))
        .args(words)
        .current_dir(folder)
        .output()
        .expect("the program starts");
    assert!(status.status.success(), "mackrl {line}: {status:?}");
}

fn folder() -> TempDir {
    tempfile::tempdir().expect("a folder")
}

/// Run folders. An input is a list of changes to a sound one: `file NUL what NUL content NUL`, so that inputs can be kept as files.
pub(crate) struct RunFolders {
    folder: TempDir,
}

/// The file of the run folder's neighbour, which nothing may change.
const MINE: &str = "mine";
/// What stands in it.
const MINE_CONTENT: &str = "run.seed = 1\n";
/// What a stranger's run folder may hold.
const FILES: &[&str] = &[
    "config.toml",
    "run.json",
    "metrics.jsonl",
    "weights.safetensors",
    "weights",
    "weights/best.safetensors",
    "CHECKPOINT/best.safetensors",
    "lock",
    "run.json.tmp",
    "CHECKPOINT",
    "CHECKPOINT/manifest.json",
    "CHECKPOINT/counters.json",
    "CHECKPOINT/tensors.safetensors",
    "checkpoints",
    "checkpoints/000000000099",
    "checkpoints/000000000099.tmp",
    "checkpoints/..tmp",
];

impl Default for RunFolders {
    fn default() -> Self {
        Self { folder: folder() }
    }
}

impl RunFolders {
    fn sound(&self) -> PathBuf {
        self.folder.path().join("sound")
    }

    /// The path of a name in [`FILES`] below a run folder.
    fn place(&self, run: &Path, name: &str) -> PathBuf {
        let checkpoint = fs::read_dir(self.sound().join("checkpoints"))
            .into_iter()
            .flatten()
            .flatten()
            .map(|entry| entry.file_name().to_string_lossy().into_owned())
            .max()
            .unwrap_or_default();
        run.join(name.replace("CHECKPOINT", &format!("checkpoints/{checkpoint}")))
    }

    /// Makes one change: another content, or something that is no file.
    fn change(&self, run: &Path, name: &str, what: &str, content: &[u8]) {
        let path = self.place(run, name);
        let _ = fs::remove_file(&path);
        match what {
            "content" => drop(fs::write(&path, content)),
            "link" => drop(symlink(self.folder.path().join(MINE), &path)),
            "folder link" => {
                let _ = fs::remove_dir_all(&path);
                drop(symlink(self.folder.path(), &path));
            }
            "folder" => drop(fs::create_dir_all(&path)),
            "nothing" => drop(fs::remove_dir_all(&path)),
            "pipe" => drop(Command::new("mkfifo").arg(&path).output()),
            "endless" => drop(fs::File::create(&path).and_then(|file| file.set_len(1 << 42))),
            _ => {}
        }
    }

    /// Makes the manifest agree with what it lists, so that what lies behind the hashes is read.
    fn mend(&self, run: &Path) {
        let place = self.place(run, "CHECKPOINT/manifest.json");
        let text = plain(&place).unwrap_or_default();
        let Ok(mut manifest) = serde_json::from_slice::<serde_json::Value>(&text) else {
            return;
        };
        if !manifest.is_object() || !manifest["files"].is_object() {
            return;
        }
        for name in ["tensors.safetensors", "counters.json"] {
            let path = place.with_file_name(name);
            if let Some(fingerprint) = fingerprint(&path) {
                manifest["files"][name] = fingerprint;
            }
        }
        for (key, name) in [("config", "config.toml"), ("metrics", "metrics.jsonl")] {
            if let Some(fingerprint) = fingerprint(&run.join(name)) {
                manifest[key] = fingerprint;
            }
        }
        let _ = fs::write(&place, manifest.to_string());
    }
}

/// The content of a plain file that is not too long: a pipe would block, and a link lead elsewhere.
fn plain(path: &Path) -> Option<Vec<u8>> {
    let metadata = fs::symlink_metadata(path).ok()?;
    let plain = metadata.is_file() && metadata.len() < 1 << 20;
    if plain { fs::read(path).ok() } else { None }
}

/// Length and hash of a plain file.
fn fingerprint(path: &Path) -> Option<serde_json::Value> {
    use sha2::{Digest, Sha256};

    let content = plain(path)?;
    let hash: String = Sha256::digest(&content)
        .iter()
        .map(|byte| format!("{byte:02x}"))
        .collect();
    Some(serde_json::json!({ "bytes": content.len(), "sha256": hash }))
}

fn copy(from: &Path, to: &Path) {
    fs::create_dir_all(to).expect("a folder can be made");
    for entry in fs::read_dir(from).into_iter().flatten().flatten() {
        let (path, copied) = (entry.path(), to.join(entry.file_name()));
        if path.is_dir() {
            copy(&path, &copied);
        } else {
            fs::copy(&path, &copied).expect("a file can be copied");
        }
    }
}

impl Target for RunFolders {
    fn name(&self) -> &'static str {
        "run-folder"
    }

    fn seeds(&self) -> Vec<Vec<u8>> {
        let settings = "--set algorithm.hidden=2 --set algorithm.environments=1 --set test.episodes=1 --steps 150";
        succeed(
            &format!("train --map 3m --out sound --threads 1 {settings}"),
            self.folder.path(),
        );
        // A finished run would be left alone.
        let record = self.sound().join("run.json");
        let text = fs::read_to_string(&record).expect("a run has a record");
        fs::write(&record, text.replace("\"finished\"", "\"running\"")).expect("it can be written");
        Vec::new()
    }

    fn words(&self) -> Vec<String> {
        [
            "bytes",
            "sha256",
            "files",
            "../../mine",
            "/etc/passwd",
            "steps_env",
            "null",
            "\"running\"",
            "\"interrupted\"",
            "F32",
        ]
        .map(str::to_owned)
        .to_vec()
    }

    fn input(&self, _: &[Vec<u8>], words: &[String], rng: &mut Rng) -> Vec<u8> {
        let mut input = Vec::new();
        for _ in 0..rng.usize(1..=2) {
            let name = mutation::pick(FILES, rng).copied().unwrap_or_default();
            let others = [
                "link",
                "folder link",
                "folder",
                "nothing",
                "pipe",
                "endless",
            ];
            let what = match rng.u8(..3) {
                0 => mutation::pick(&others, rng).copied().unwrap_or_default(),
                _ => "content",
            };
            let sound = fs::read(self.place(&self.sound(), name)).unwrap_or_default();
            let content = mutation::mutated(&[sound], words, rng);
            for part in [name.as_bytes(), what.as_bytes(), &hexadecimal(&content)] {
                input.extend_from_slice(part);
                input.push(0);
            }
        }
        input
    }

    fn read(&mut self, input: &[u8]) -> Result<(), String> {
        let outside = self.folder.path().join(MINE);
        fs::write(&outside, MINE_CONTENT).map_err(|error| error.to_string())?;
        let run_folder = self.folder.path().join("run");
        copy(&self.sound(), &run_folder);
        if !input.len().is_multiple_of(3) {
            // Then the weights are those of the checkpoint.
            let _ = fs::remove_file(run_folder.join("weights.safetensors"));
        }
        let parts: Vec<&[u8]> = input.split(|byte| *byte == 0).collect();
        for change in parts.chunks_exact(3) {
            let text = |part: &[u8]| String::from_utf8_lossy(part).into_owned();
            self.change(
                &run_folder,
                &text(change[0]),
                &text(change[1]),
                &bytes(change[2]),
            );
        }
        if !input.len().is_multiple_of(4) {
            self.mend(&run_folder);
        }
        let before = names(self.folder.path());
        let outcome = run(
            &["evaluate", "run", "--episodes", "1", "--threads", "1"],
            self.folder.path(),
        )
        .and_then(|()| run(&["resume", "run", "--threads", "1"], self.folder.path()));
        fs::remove_dir_all(&run_folder).map_err(|error| error.to_string())?;
        outcome?;
        if fs::read_to_string(&outside).ok().as_deref() != Some(MINE_CONTENT) {
            return Err("a file outside the run folder was changed".to_owned());
        }
        if names(self.folder.path())
            != before
                .iter()
                .filter(|name| *name != "run")
                .cloned()
                .collect::<Vec<_>>()
        {
            return Err("something outside the run folder was made or removed".to_owned());
        }
        Ok(())
    }
}

fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = fs::read_dir(folder)
        .into_iter()
        .flatten()
        .flatten()
        .map(|entry| entry.file_name().to_string_lossy().into_owned())
        .filter(|name| name != "stderr")
        .collect();
    names.sort();
    names
}

fn hexadecimal(bytes: &[u8]) -> Vec<u8> {
    bytes
        .iter()
        .flat_map(|byte| format!("{byte:02x}").into_bytes())
        .collect()
}

fn bytes(hexadecimal: &[u8]) -> Vec<u8> {
    hexadecimal
        .chunks_exact(2)
        .filter_map(|digits| u8::from_str_radix(std::str::from_utf8(digits).ok()?, 16).ok())
        .collect()
}
