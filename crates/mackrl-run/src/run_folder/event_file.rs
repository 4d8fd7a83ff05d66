//! Metrics for TensorBoard: an event file with the names of `metrics.jsonl`, which are PyMARL's.
//!
//! The format is two small ones, one in the other: records of length, checksum, data and checksum (`TFRecord`), and in each a
//! protocol-buffer message `Event` with a step and some named numbers. Both are short enough to be written here; crates that
//! know them bring a compiler of protocol buffers along.
//!
//! A process that goes on with a run writes a file of its own, which begins with the step from which TensorBoard shall forget what
//! earlier files say: what was computed again is shown once. Nothing here is ever read back.

use std::{
    fs::File,
    io::ErrorKind,
    path::{Path, PathBuf},
    time::SystemTime,
};

use cap_std::fs::OpenOptions;
use serde_json::{Map, Value};

use super::disk::{Disk, cannot_write};
use crate::{
    error::{Context, Result, RunError},
    folder::Folder,
};

/// Most event files of processes with one number in one second.
const SUFFIXES: u32 = 10_000;

/// Numbers of the fields of `Event`, `Summary`, `Summary.Value` and `SessionLog`, with their kinds of encoding.
const WALL_TIME: u8 = 1 << 3 | FIXED_64;
const STEP: u8 = 2 << 3 | VARIABLE;
const FILE_VERSION: u8 = 3 << 3 | DELIMITED;
const SUMMARY: u8 = 5 << 3 | DELIMITED;
const SESSION_LOG: u8 = 7 << 3 | DELIMITED;
const VALUE: u8 = 1 << 3 | DELIMITED;
const TAG: u8 = 1 << 3 | DELIMITED;
const SIMPLE_VALUE: u8 = 2 << 3 | FIXED_32;
const STATUS: u8 = 1 << 3 | VARIABLE;

const VARIABLE: u8 = 0;
const FIXED_64: u8 = 1;
const DELIMITED: u8 = 2;
const FIXED_32: u8 = 5;

/// `SessionLog.START`
const START: u8 = 1;

/// An event file that is being written.
#[derive(Debug)]
pub(super) struct EventFile {
    path: PathBuf,
    file: File,
}

impl EventFile {
    /// Begins a file in the folder of a run; what earlier files say from the environment step `steps_env` on holds no more.
    ///
    /// # Errors
    /// Path, bytes and what the operating system says.
    pub(super) fn create(disk: &dyn Disk, run: &Folder, steps_env: u64) -> Result<Self> {
        let wall_s = wall_s();
        // A file of this name would be that of another process with this number in this second, as containers have them; a link
        // could lead anywhere.
        let mut options = OpenOptions::new();
        options.create_new(true).append(true);
        let stem = format!(
            "events.out.tfevents.{wall_s:010.0}.mackrl.{}",
            std::process::id()
        );
        let mut attempt = 0;
        let (name, file) = loop {
            let name = format!("{stem}.{attempt}");
            match run.open_with(Path::new(&name), &options) {
                Err(error) if error.kind() == ErrorKind::AlreadyExists && attempt < SUFFIXES => {
                    attempt += 1;
                }
                file => break (name, file),
            }
        };
        let file = file.with_context(|| run.cannot("create", Path::new(&name)))?;
        let path = run.shown(name);
        let mut events = Self { path, file };
        let opening = [
            record(&opening(wall_s)),
            record(&beginning(wall_s, steps_env)),
        ];
        events.write(disk, &opening.concat())?;
        Ok(events)
    }

    /// Adds a row of metrics, given as a JSON object with the environment step under `t_env`.
    ///
    /// # Errors
    /// Path, bytes and what the operating system says.
    pub(super) fn append(&mut self, disk: &dyn Disk, row: &str) -> Result<()> {
        let row: Map<String, Value> =
            serde_json::from_str(row).map_err(|error| RunError::BadData {
                message: format!("a row of metrics is not a JSON object: {error}"),
            })?;
        self.write(disk, &record(&scalars(wall_s(), &row)))
    }

    fn write(&mut self, disk: &dyn Disk, bytes: &[u8]) -> Result<()> {
        disk.write(&mut self.file, bytes)
            .with_context(|| cannot_write(&self.path, bytes.len()))
    }
}

/// Seconds since 1970, by which TensorBoard can draw curves, too.
fn wall_s() -> f64 {
    #[expect(
        clippy::disallowed_methods,
        reason = "shown by TensorBoard, part of no result"
    )]
    let since_1970 = SystemTime::now().duration_since(SystemTime::UNIX_EPOCH);
    since_1970.map_or(0.0, |since| since.as_secs_f64())
}

/// The event that every file begins with.
fn opening(wall_s: f64) -> Vec<u8> {
    let mut event = at(wall_s, 0);
    delimited(&mut event, FILE_VERSION, b"brain.Event:2");
    event
}

/// The event from whose step on earlier files are forgotten.
fn beginning(wall_s: f64, steps_env: u64) -> Vec<u8> {
    let mut event = at(wall_s, steps_env);
    delimited(&mut event, SESSION_LOG, &[STATUS, START]);
    event
}

/// The event of a row of metrics.
fn scalars(wall_s: f64, row: &Map<String, Value>) -> Vec<u8> {
    let steps_env = row.get("t_env").and_then(Value::as_f64).unwrap_or(0.0);
    let mut summary = Vec::new();
    for (name, number) in row {
        let Some(number) = number.as_f64().filter(|_| name != "t_env") else {
            continue;
        };
        let mut value = Vec::new();
        delimited(&mut value, TAG, name.as_bytes());
        value.push(SIMPLE_VALUE);
        #[expect(
            clippy::cast_possible_truncation,
            reason = "the format has single precision"
        )]
        value.extend((number as f32).to_le_bytes());
        delimited(&mut summary, VALUE, &value);
    }
    #[expect(
        clippy::cast_possible_truncation,
        reason = "steps are whole and below 2^53"
    )]
    let mut event = at(wall_s, steps_env as u64);
    delimited(&mut event, SUMMARY, &summary);
    event
}

/// The beginning of an event: its time and its step.
fn at(wall_s: f64, step: u64) -> Vec<u8> {
    let mut event = vec![WALL_TIME];
    event.extend(wall_s.to_le_bytes());
    // Zero is what a missing number means.
    if step > 0 {
        event.push(STEP);
        variable(&mut event, step);
    }
    event
}

fn delimited(message: &mut Vec<u8>, field: u8, content: &[u8]) {
    message.push(field);
    variable(message, content.len() as u64);
    message.extend(content);
}

/// Seven bits a byte, the lowest first; the eighth says that more follow.
fn variable(message: &mut Vec<u8>, mut number: u64) {
    loop {
        let [lowest, ..] = number.to_le_bytes();
        number >>= 7;
        if number == 0 {
            return message.push(lowest & 0x7f);
        }
        message.push(lowest | 0x80);
    }
}

/// Length and data, each with its checksum.
fn record(data: &[u8]) -> Vec<u8> {
    let length = (data.len() as u64).to_le_bytes();
    let mut record = length.to_vec();
    record.extend(masked_checksum(&length).to_le_bytes());
    record.extend(data);
    record.extend(masked_checksum(data).to_le_bytes());
    record
}

/// CRC-32C (Castagnoli), turned by 15 bits and shifted, because a checksum of data that hold checksums is weak.
fn masked_checksum(bytes: &[u8]) -> u32 {
    crc32c::crc32c(bytes)
        .rotate_right(15)
        .wrapping_add(0xa282_ead8)
}

#[cfg(test)]
mod tests {
    use super::*;

    // Expected bytes are those of TensorBoard's own writer: scripts/golden/event_file.py.

    fn hexadecimal(bytes: &[u8]) -> String {
        bytes.iter().map(|byte| format!("{byte:02x}")).collect()
    }

    #[test]
    fn a_file_opens_as_tensorboard_expects() {
        assert_eq!(
            hexadecimal(&record(&opening(1.5))),
            "1800000000000000a37f4b2209000000000000f83f1a0d627261696e2e4576656e743a322a28646c"
        );
    }

    #[test]
    fn a_row_is_one_event_with_a_number_for_each_name() {
        let row = serde_json::from_str(r#"{"t_env":300,"test_battle_won_mean":0.25}"#).unwrap();
        assert_eq!(
            hexadecimal(&record(&scalars(2.0, &row))),
            "2b00000000000000861bc34b09000000000000004010ac022a1d0a1b0a14746573745f626174746c655f776f6e5f6d65616e150000803e19c6017b"
        );
    }

    #[test]
    fn a_file_tells_which_steps_earlier_files_lose() {
        assert_eq!(
            hexadecimal(&record(&beginning(3.0, 301))),
            "100000000000000095fbfe1809000000000000084010ad023a02080195f4cd0e"
        );
    }
}
