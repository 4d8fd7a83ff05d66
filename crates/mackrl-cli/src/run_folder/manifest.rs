//! What belongs to a checkpoint, by length and hash.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use crate::provenance::hexadecimal;

/// Version of the manifest; it changes when an older program could not read it.
pub(super) const FORMAT: u64 = 1;

/// Length and hash of a file, or of the beginning of one that grows.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Fingerprint {
    pub(super) bytes: u64,
    /// SHA-256 in hexadecimal, as `sha256sum` prints it.
    sha256: String,
}

impl Fingerprint {
    /// Of these bytes.
    pub(super) fn of(content: &[u8]) -> Self {
        let mut growing = Growing::default();
        growing.append(content);
        growing.fingerprint()
    }

    /// Whether `content` begins with what this is the fingerprint of; gives the length of that.
    pub(super) fn begins(&self, content: &[u8]) -> Option<usize> {
        let bytes = usize::try_from(self.bytes).ok()?;
        let beginning = content.get(..bytes)?;
        (Self::of(beginning) == *self).then_some(bytes)
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
        assert_eq!(fingerprint.begins(b"abcd"), Some(3));
        assert_eq!(fingerprint.begins(b"abd"), None);
        assert_eq!(fingerprint.begins(b"ab"), None);
    }
}
