//! What clients start the game with: long options with one dash, each with a value of its own.

use std::net::{IpAddr, Ipv4Addr};

use thiserror::Error;

/// The options that matter to a stand-in.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct GameArguments {
    /// `-listen`: where to wait for the client; a loopback address.
    pub listen: IpAddr,
    /// `-port`.
    pub port: u16,
    /// `-dataDir`: the installation.
    pub data_folder: Option<String>,
    /// `-tempDir`: a folder for this process alone.
    pub temporary_folder: Option<String>,
    /// `-dataVersion`: a hash of the data that the client asks for.
    pub data_version: Option<String>,
}

/// An option that is not understood.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum InvalidArgument {
    /// Not an option of the game.
    #[error("unknown option {found:?}, expected one of {}", OPTIONS.join(", "))]
    Unknown {
        /// What was given.
        found: String,
    },
    /// An option without its value, or with one that is none.
    #[error("option {option} has {found:?}, expected {expected}")]
    Value {
        /// The option.
        option: &'static str,
        /// What was given.
        found: String,
        /// What it takes.
        expected: &'static str,
    },
}

/// Options with a value that have a meaning here.
const OPTIONS: [&str; 5] = ["-listen", "-port", "-dataDir", "-tempDir", "-dataVersion"];
/// Options with a value that concern windows and pictures.
const PICTURES: [&str; 7] = [
    "-displayMode",
    "-windowwidth",
    "-windowheight",
    "-windowx",
    "-windowy",
    "-eglpath",
    "-osmesapath",
];
/// Options without a value.
const SWITCHES: [&str; 4] = ["-verbose", "-verboseMP", "-ipv6", "-headlessNoRender"];

impl GameArguments {
    /// Understands what follows the program's name.
    ///
    /// # Errors
    /// [`InvalidArgument`] names the first option that is not understood.
    pub fn parse(arguments: &[String]) -> Result<Self, InvalidArgument> {
        let mut parsed = Self {
            listen: IpAddr::V4(Ipv4Addr::LOCALHOST),
            port: 0,
            data_folder: None,
            temporary_folder: None,
            data_version: None,
        };
        let mut rest = arguments.iter();
        while let Some(found) = rest.next() {
            if SWITCHES.contains(&found.as_str()) {
                continue;
            }
            let known = OPTIONS
                .into_iter()
                .chain(PICTURES)
                .find(|option| option == found);
            let option = known.ok_or_else(|| InvalidArgument::Unknown {
                found: found.clone(),
            })?;
            let value = rest.next().ok_or_else(|| InvalidArgument::Value {
                option,
                found: String::new(),
                expected: "a value",
            })?;
            parsed.take(option, value)?;
        }
        Ok(parsed)
    }

    fn take(&mut self, option: &'static str, value: &str) -> Result<(), InvalidArgument> {
        let wrong = |expected: &'static str| InvalidArgument::Value {
            option,
            found: value.to_owned(),
            expected,
        };
        match option {
            "-listen" => {
                let address: Option<IpAddr> = value.parse().ok();
                self.listen = address
                    .filter(IpAddr::is_loopback)
                    .ok_or_else(|| wrong("an address of this machine, such as 127.0.0.1"))?;
            }
            "-port" => self.port = value.parse().map_err(|_| wrong("a number in 0..=65535"))?,
            "-dataDir" => self.data_folder = Some(value.to_owned()),
            "-tempDir" => self.temporary_folder = Some(value.to_owned()),
            "-dataVersion" => self.data_version = Some(value.to_owned()),
            _ => {}
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn parse(line: &str) -> Result<GameArguments, InvalidArgument> {
        let words: Vec<String> = line.split(' ').map(str::to_owned).collect();
        GameArguments::parse(&words)
    }

    #[test]
    fn what_clients_pass_is_understood() {
        let parsed = parse(
            "-listen 127.0.0.1 -port 18321 -dataDir /games/StarCraftII/ -tempDir /tmp/sc-x1/ -headlessNoRender \
             -dataVersion B89B5D6FA7CBF6452E721311BFBC6CB2 -eglpath libEGL.so -displayMode 0",
        )
        .unwrap();
        assert_eq!(parsed.port, 18321);
        assert_eq!(parsed.temporary_folder.as_deref(), Some("/tmp/sc-x1/"));
        assert_eq!(
            parsed.data_version.as_deref(),
            Some("B89B5D6FA7CBF6452E721311BFBC6CB2")
        );
    }

    #[test]
    fn what_is_no_option_is_named() {
        for (line, part) in [
            ("-listen 0.0.0.0", "an address of this machine"),
            ("-listen 192.168.1.1", "an address of this machine"),
            ("-port 99999", "-port has \"99999\""),
            ("-port", "expected a value"),
            ("--port 1", "unknown option \"--port\""),
        ] {
            let error = parse(line).unwrap_err().to_string();
            assert!(error.contains(part), "{line}: {error}");
        }
    }
}
