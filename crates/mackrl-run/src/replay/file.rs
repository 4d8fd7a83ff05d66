//! A replay as bytes: lines of JSON in gzip, a header and then one line for each step.
//!
//! `gunzip -c FILE | head -1` shows what it is, and any language reads it. A compact binary format would save a third and need
//! a reader of its own. Files come from strangers: whatever they say, no more than [`TEXT_MOST`] bytes are unpacked, nothing is
//! allocated by a length that the file claims, and nothing that it holds is run.

use std::io::{BufRead, BufReader, Read, Write};

use flate2::{Compression, bufread::GzDecoder, write::GzEncoder};
use mackrl_env::EpisodeKey;
use mackrl_skirmish::SIMULATOR_VERSION;
use serde::{Deserialize, Serialize};

use super::{Player, Replay, ReplayError, STEPS_MOST, Step};
use crate::config::{ConfigBuilder, EnvironmentConfig, Registry};

const FORMAT: &str = "mackrl-replay";
const VERSION: u32 = 1;
/// Most bytes of an unpacked replay.
const TEXT_MOST: u64 = 256 << 20;
/// Episodes are counted below this number, so that they can name random draws.
const EPISODES_MOST: u64 = 1 << 56;

/// The first line.
#[derive(Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Header<E> {
    format: String,
    version: u32,
    program: String,
    simulator: u32,
    steps: usize,
    env: E,
    key: EpisodeKey,
    player: Player,
}

/// What every version's first line has.
#[derive(Debug, Deserialize)]
struct Head {
    format: String,
    version: u32,
    program: String,
    simulator: u32,
}

impl Replay {
    /// Greatest length in bytes of a replay on disk.
    pub const FILE_MOST: usize = 64 << 20;

    /// The replay as the content of a file.
    ///
    /// # Panics
    /// Never: plain data can be written as JSON, and memory takes all.
    #[must_use]
    pub fn to_bytes(&self) -> Vec<u8> {
        let header = Header {
            format: FORMAT.to_owned(),
            version: VERSION,
            program: self.program.clone(),
            simulator: SIMULATOR_VERSION,
            steps: self.steps.len(),
            env: &self.env,
            key: self.key,
            player: self.player.clone(),
        };
        let mut lines = vec![json(&header)];
        lines.extend(self.steps.iter().map(json));
        let mut encoder = GzEncoder::new(Vec::new(), Compression::best());
        for line in lines {
            encoder.write_all(&line).expect("memory takes all");
        }
        encoder.finish().expect("memory takes all")
    }

    /// Reads the content of a file.
    ///
    /// # Errors
    /// [`ReplayError::Damaged`] with the line that cannot be understood, [`ReplayError::OtherSimulator`] if another version of
    /// the program plays it.
    pub fn from_bytes(bytes: &[u8]) -> Result<Self, ReplayError> {
        let mut lines = Lines {
            reader: BufReader::new(GzDecoder::new(bytes).take(TEXT_MOST)),
            number: 0,
            line: Vec::new(),
        };
        let header = header(lines.next()?.unwrap_or_default())?;
        let mut steps = Vec::new();
        while let Some(line) = lines.next()? {
            let step: Step = serde_json::from_slice(line)
                .map_err(|error| damaged(&format!("step {}: {error}", steps.len() + 1)))?;
            steps.push(step);
            if steps.len() > header.steps {
                break;
            }
        }
        if steps.len() != header.steps {
            let found = steps.len().min(header.steps + 1);
            let message = format!("{found} steps or more, expected {}", header.steps);
            return Err(damaged(&message));
        }
        Ok(Self {
            program: header.program,
            env: header.env,
            key: header.key,
            player: header.player,
            steps,
        })
    }
}

/// The lines of a packed text.
struct Lines<R> {
    reader: BufReader<R>,
    number: usize,
    line: Vec<u8>,
}

impl<R: Read> Lines<R> {
    /// The next line, `None` after the last.
    fn next(&mut self) -> Result<Option<&[u8]>, ReplayError> {
        self.line.clear();
        self.number += 1;
        let read = self.reader.read_until(b'\n', &mut self.line);
        let length = read.map_err(|error| match self.number {
            1 => ReplayError::Damaged(format!("no replay of mackrl: {error}")),
            line => damaged(&format!("line {line}: {error}")),
        })?;
        Ok((length > 0).then_some(self.line.as_slice()))
    }
}

fn header(line: &[u8]) -> Result<Header<EnvironmentConfig>, ReplayError> {
    let head: Head = serde_json::from_slice(line)
        .map_err(|error| ReplayError::Damaged(format!("no replay of mackrl: {error}")))?;
    if head.format != FORMAT || head.version != VERSION {
        return Err(ReplayError::Damaged(format!(
            "format {:?} version {}, expected {FORMAT:?} version {VERSION}",
            shortened(&head.format),
            head.version
        )));
    }
    if head.simulator != SIMULATOR_VERSION {
        return Err(ReplayError::OtherSimulator {
            program: shortened(&head.program),
            recorded: head.simulator,
            own: SIMULATOR_VERSION,
        });
    }
    let header: Header<toml::Table> =
        serde_json::from_slice(line).map_err(|error| damaged(&format!("header: {error}")))?;
    if header.steps > STEPS_MOST {
        let message = format!("{} steps, expected at most {STEPS_MOST}", header.steps);
        return Err(damaged(&message));
    }
    if header.key.episode >= EPISODES_MOST {
        return Err(damaged("key.episode is 2^56 or more, expected less"));
    }
    let env = ConfigBuilder::new(&Registry::built_in())
        .recorded_environment(&header.env)
        .build_environment()
        .map_err(|error| damaged(&format!("env: {error}")))?;
    let mut names = vec![("env.map", env.map())];
    if let Player::Policy { algorithm, .. } = &header.player {
        names.push(("player.algorithm", algorithm));
    }
    for (key, name) in names {
        if name.chars().any(char::is_control) {
            let message = format!("{key} has control characters, expected a name");
            return Err(damaged(&message));
        }
    }
    Ok(Header {
        env,
        format: header.format,
        version: header.version,
        program: header.program,
        simulator: header.simulator,
        steps: header.steps,
        key: header.key,
        player: header.player,
    })
}

fn damaged(message: &str) -> ReplayError {
    ReplayError::Damaged(format!("damaged replay: {message}"))
}

/// What a stranger wrote, fit to be shown.
fn shortened(text: &str) -> String {
    let plain = text.chars().filter(|c| !c.is_control());
    plain.take(40).collect()
}

fn json(value: &impl Serialize) -> Vec<u8> {
    let mut line = serde_json::to_vec(value).expect("plain data can be written as JSON");
    line.push(b'\n');
    line
}
