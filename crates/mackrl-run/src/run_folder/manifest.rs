//! What belongs to a checkpoint, by length and hash.

use std::{
    collections::BTreeMap,
    io::{self, Read},
};

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use super::kept::Kept;
use crate::provenance::hexadecimal;

/// Version of the manifest; it changes when an older program could not read it.
///
/// 1: without kept weights, which are none then.
pub(super) const FORMAT: u64 = 2;

/// Length and hash of a file, or of the beginning of one that grows.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Fingerprint {
    pub(super) bytes: u64,
    /// SHA-256 in hexadecimal, as `sha256sum` prints it.
    pub(super) sha256: String,
}

impl Fingerprint {
    /// Of these bytes.
    pub(super) fn of(content: &[u8]) -> Self {
        let mut growing = Growing::default();
        growing.append(content);
        growing.fingerprint()
    }

    /// Whether what `reader` gives begins with what this is the fingerprint of; gives that beginning's own length and hash.
    pub(super) fn begins(&self, reader: impl Read) -> io::Result<Option<Growing>> {
        let beginning = Growing::read(reader.take(self.bytes))?;
        Ok((beginning.fingerprint() == *self).then_some(beginning))
    }
}

/// The fingerprint of a file that grows.
#[derive(Debug, Clone, Default)]
pub(super) struct Growing {
    bytes: u64,
    hasher: Sha256,
}

impl Growing {
    /// Follows the file.
    pub(super) fn append(&mut self, content: &[u8]) {
        self.bytes += content.len() as u64;
        self.hasher.update(content);
    }

    /// Follows what `reader` gives to its end, however long it is.
    pub(super) fn read(mut reader: impl Read) -> io::Result<Self> {
        let mut so_far = Self::default();
        let mut buffer = [0; 1 << 16];
        loop {
            match reader.read(&mut buffer) {
                Ok(0) => return Ok(so_far),
                Ok(length) => so_far.append(&buffer[..length]),
                Err(error) if error.kind() == io::ErrorKind::Interrupted => {}
                Err(error) => return Err(error),
            }
        }
    }

    /// Its length so far.
    pub(super) const fn bytes(&self) -> u64 {
        self.bytes
    }

    /// Of everything so far.
    pub(super) fn fingerprint(&self) -> Fingerprint {
        let hash = self.hasher.clone().finalize();
        Fingerprint {
            bytes: self.bytes,
            sha256: hexadecimal(&hash),
        }
    }
}

/// The table of contents of a checkpoint: its own files, and those of the run that it continues.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Manifest {
    pub(super) format: u64,
    /// Version of the code that wrote it, as `provenance::CODE`.
    pub(super) code: String,
    /// The configuration, which never changes.
    pub(super) config: Fingerprint,
    /// The metrics so far; what stands behind them is cut off when the run continues.
    pub(super) metrics: Fingerprint,
    /// The kept weights of the run, its best aside, which the checkpoint holds itself.
    #[serde(default)]
    pub(super) weights: Kept,
    /// The files beside the manifest.
    pub(super) files: BTreeMap<String, Fingerprint>,
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fingerprint_is_that_of_sha256sum_however_the_file_grew() {
        let mut growing = Growing::default();
        growing.append(b"a");
        growing.append(b"bc");
        let fingerprint = growing.fingerprint();
        assert_eq!(
            (fingerprint.bytes, fingerprint.sha256.as_str()),
            (
                3,
                "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad"
            )
        );
        let begins = |content: &[u8]| fingerprint.begins(content).unwrap().is_some();
        assert!(begins(b"abcd"));
        assert!(!begins(b"abd"));
        assert!(!begins(b"ab"));
    }
}
