//! One process of the game, with a port and a temporary folder of its own.
//!
//! Below the folder of temporary files lies one folder for each running game, with a note of whose it is: `mackrl sc2 ps` reads
//! these notes, and so touches no process that this program did not start.

use std::{
    collections::BTreeSet,
    fs::{self, File},
    io,
    net::{Ipv4Addr, SocketAddr, TcpListener},
    path::{Path, PathBuf},
    process::{Child, Command, Stdio},
    sync::{
        Mutex, PoisonError,
        atomic::{AtomicU64, Ordering},
    },
};

use serde::{Deserialize, Serialize};

use super::{Installation, fault::GameFault};
use crate::lifetime;

/// Name of the note in a game's folder.
const NOTE: &str = "game.json";
/// Bytes of a note, at most.
const NOTE_LENGTH_MAX: u64 = 1 << 16;

/// How games are started: a program and its first arguments, after which come `--parent PID -- PROGRAM ARGUMENTS`. It has to
/// call [`lifetime::become_game`].
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Launcher {
    /// The program.
    pub program: PathBuf,
    /// Its first arguments.
    pub arguments: Vec<String>,
}

/// Whose a running game is.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct GameNote {
    /// Number of the game's process.
    pub pid: u32,
    /// When it was started, in the kernel's ticks.
    pub start: u64,
    /// Number of the process that plays.
    pub owner: u32,
    /// Port that the game listens on.
    pub port: u16,
    /// The game's program.
    pub program: PathBuf,
}

/// A running game.
#[derive(Debug)]
pub(super) struct GameProcess {
    child: Child,
    port: u16,
    folder: PathBuf,
}

impl Launcher {
    /// This program itself, as `mackrl sc2 exec-game`.
    ///
    /// # Errors
    /// If this program's file cannot be found.
    pub fn this_program() -> io::Result<Self> {
        Ok(Self {
            program: std::env::current_exe()?,
            arguments: ["sc2", "exec-game"].map(str::to_owned).into(),
        })
    }
}

impl GameProcess {
    pub(super) fn start(
        installation: &Installation,
        launcher: &Launcher,
    ) -> Result<Self, GameFault> {
        let (port, folder) = (take_port()?, new_folder()?);
        match spawn(installation, launcher, port, &folder) {
            Ok(child) => {
                let process = Self {
                    child,
                    port,
                    folder,
                };
                process.write_note(installation)?;
                Ok(process)
            }
            Err(error) => {
                give_port_back(port);
                // What is left of a folder that nothing ran in harms nobody.
                let _ = fs::remove_dir_all(&folder);
                Err(GameFault::Launch(format!(
                    "{}: {error}",
                    installation.program.display()
                )))
            }
        }
    }

    pub(super) const fn address(&self) -> SocketAddr {
        SocketAddr::new(std::net::IpAddr::V4(Ipv4Addr::LOCALHOST), self.port)
    }

    /// What the process said last if it has ended.
    pub(super) fn last_words(&mut self) -> Option<String> {
        let status = self.child.try_wait().ok().flatten()?;
        let log = fs::read_to_string(self.folder.join("log.txt")).unwrap_or_default();
        let last = log
            .lines()
            .rev()
            .find(|line| !line.trim().is_empty())
            .unwrap_or_default();
        Some(
            format!("it ended with {status} {last}")
                .trim_end()
                .to_owned(),
        )
    }

    fn write_note(&self, installation: &Installation) -> Result<(), GameFault> {
        let pid = self.child.id();
        let note = GameNote {
            pid,
            start: lifetime::start_of(pid).unwrap_or_default(),
            owner: std::process::id(),
            port: self.port,
            program: installation.program.clone(),
        };
        let text = serde_json::to_vec(&note).map_err(io::Error::from)?;
        Ok(fs::write(self.folder.join(NOTE), text)?)
    }
}

/// Nothing of a game survives its value.
impl Drop for GameProcess {
    fn drop(&mut self) {
        // It may have ended already; either way it is waited for, so that it does not linger as a zombie.
        let _ = self.child.kill();
        let _ = self.child.wait();
        let _ = fs::remove_dir_all(&self.folder);
        give_port_back(self.port);
    }
}

/// Every game of this user that this program started and that still runs; folders of others are cleared away.
///
/// # Errors
/// What the operating system says.
pub fn running_games() -> io::Result<Vec<GameNote>> {
    let mut games = Vec::new();
    let entries = match fs::read_dir(folder_of_games()) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(games),
        entries => entries?,
    };
    for entry in entries {
        let folder = entry?.path();
        match read_note(&folder) {
            Some(note) if lifetime::is_running(note.pid, note.start) => games.push(note),
            // A folder without a note may be about to get one.
            None if owner_runs(&folder) => {}
            _ => drop(fs::remove_dir_all(&folder)),
        }
    }
    games.sort_by_key(|note| note.pid);
    Ok(games)
}

fn read_note(folder: &Path) -> Option<GameNote> {
    let file = folder.join(NOTE);
    let is_short = fs::metadata(&file).is_ok_and(|data| data.len() <= NOTE_LENGTH_MAX);
    let text = fs::read(file).ok().filter(|_| is_short)?;
    serde_json::from_slice(&text).ok()
}

/// Whether the process that made a folder, whose number begins its name, still runs.
fn owner_runs(folder: &Path) -> bool {
    let name = folder
        .file_name()
        .and_then(|name| name.to_str())
        .unwrap_or_default();
    let owner = name.split('-').next().and_then(|pid| pid.parse().ok());
    owner.and_then(lifetime::start_of).is_some()
}

fn folder_of_games() -> PathBuf {
    let user = rustix::process::getuid().as_raw();
    std::env::temp_dir().join(format!("mackrl-sc2-{user}"))
}

fn new_folder() -> io::Result<PathBuf> {
    static GAMES: AtomicU64 = AtomicU64::new(0);
    let number = GAMES.fetch_add(1, Ordering::Relaxed);
    let folder = folder_of_games().join(format!("{}-{number}", std::process::id()));
    if folder.exists() {
        fs::remove_dir_all(&folder)?;
    }
    fs::create_dir_all(&folder)?;
    Ok(folder)
}

fn spawn(
    installation: &Installation,
    launcher: &Launcher,
    port: u16,
    folder: &Path,
) -> io::Result<Child> {
    let log = File::create(folder.join("log.txt"))?;
    let mut command = Command::new(&launcher.program);
    command
        .args(&launcher.arguments)
        .args(["--parent", &std::process::id().to_string(), "--"])
        .arg(&installation.program)
        .args(["-listen", "127.0.0.1", "-port", &port.to_string()])
        .arg("-dataDir")
        .arg(installation.root.join(""))
        .arg("-tempDir")
        .arg(folder.join(""));
    if let Some(data_version) = installation.data_version {
        command.args(["-dataVersion", data_version]);
    }
    let libraries = std::env::var_os("LD_LIBRARY_PATH").filter(|paths| !paths.is_empty());
    let mut paths: Vec<PathBuf> = libraries.iter().flat_map(std::env::split_paths).collect();
    paths.push(installation.root.join("Libs"));
    if let Ok(paths) = std::env::join_paths(paths) {
        command.env("LD_LIBRARY_PATH", paths);
    }
    command
        .stdin(Stdio::null())
        .stdout(log.try_clone()?)
        .stderr(log);
    lifetime::spawn(command)
}

/// Ports of this process's games: the operating system may offer the same free port twice before a game listens on it.
static PORTS: Mutex<BTreeSet<u16>> = Mutex::new(BTreeSet::new());

fn take_port() -> io::Result<u16> {
    let mut taken = PORTS.lock().unwrap_or_else(PoisonError::into_inner);
    // All listeners are kept until one port is new, so that none is offered again.
    let mut listeners = Vec::new();
    loop {
        let listener = TcpListener::bind((Ipv4Addr::LOCALHOST, 0))?;
        let port = listener.local_addr()?.port();
        if taken.insert(port) {
            return Ok(port);
        }
        listeners.push(listener);
    }
}

fn give_port_back(port: u16) {
    PORTS
        .lock()
        .unwrap_or_else(PoisonError::into_inner)
        .remove(&port);
}
