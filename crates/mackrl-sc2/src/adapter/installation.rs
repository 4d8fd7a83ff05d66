//! Where the game is, and which version of it.

use std::{
    fs,
    path::{Path, PathBuf},
};

use thiserror::Error;

use crate::units;

/// Versions that are known by the names that people use: name, number of the folder, hash of the data.
///
/// 4.6.2 and 4.10.0 are the ones that results on SMAC's maps are published for.
const VERSIONS: [(&str, u32, &str); 2] = [
    ("4.6.2", 69232, "B3E14058F1083913B80C20993AC965DB"),
    ("4.10.0", 75689, "B89B5D6FA7CBF6452E721311BFBC6CB2"),
];
/// The game's program below the folder of its version.
const PROGRAM: &str = crate::stand_in::install::PROGRAM;

/// One version of the game in a folder.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Installation {
    /// The folder.
    pub root: PathBuf,
    /// The program of the chosen version.
    pub program: PathBuf,
    /// The number of the chosen version.
    pub base_build: u32,
    /// What `-dataVersion` asks for, if a version was named.
    pub data_version: Option<&'static str>,
}

/// Why the game cannot be used.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
pub enum InstallationProblem {
    /// There is no folder.
    #[error("no StarCraft II in {}", root.display())]
    NoFolder {
        /// Where it was looked for.
        root: PathBuf,
    },
    /// There is no version in it.
    #[error("{} holds no version of the game, expected Versions/Base75689 or another", root.display())]
    NoVersion {
        /// Where it was looked for.
        root: PathBuf,
    },
    /// The version that was asked for is not known or not there.
    #[error("StarCraft II {wanted} is not in {}, which holds {found}", root.display())]
    OtherVersions {
        /// What was asked for.
        wanted: String,
        /// Where it was looked for.
        root: PathBuf,
        /// What is there.
        found: String,
    },
    /// The program is missing.
    #[error("{} is missing", program.display())]
    NoProgram {
        /// Where it should be.
        program: PathBuf,
    },
    /// The program may not be run.
    #[error("{} may not be executed", program.display())]
    NotExecutable {
        /// Where it is.
        program: PathBuf,
    },
    /// A map is missing.
    #[error("the map file {} is missing", file.display())]
    NoMap {
        /// Where it should be.
        file: PathBuf,
    },
}

impl InstallationProblem {
    /// The one command that mends it.
    #[must_use]
    pub fn remedy(&self) -> String {
        match self {
            Self::NoFolder { .. } | Self::NoVersion { .. } => {
                "export SC2PATH=FOLDER with the folder of the game, or lay out a stand-in: mackrl sc2 install ~/StarCraftII".to_owned()
            }
            Self::OtherVersions { .. } => "unset env.sc2.version, which takes the latest".to_owned(),
            Self::NoProgram { program } => {
                let version = program.parent().unwrap_or(program);
                format!("unpack the game again; {} is incomplete", version.display())
            }
            Self::NotExecutable { program } => format!("chmod +x '{}'", program.display()),
            Self::NoMap { file } => {
                let folder = file.parent().unwrap_or(file);
                format!("unzip SMAC_Maps.zip -d '{}'", folder.parent().unwrap_or(folder).display())
            }
        }
    }
}

impl Installation {
    /// The folder in which the game is looked for: `SC2PATH`, or `StarCraftII` at home.
    #[must_use]
    pub fn default_root() -> PathBuf {
        let named = std::env::var_os("SC2PATH").filter(|path| !path.is_empty());
        named.map_or_else(
            || Path::new(&std::env::var_os("HOME").unwrap_or_default()).join("StarCraftII"),
            PathBuf::from,
        )
    }

    /// Finds a version of the game below `root`: the one called `version`, such as `4.10.0` or `75689`, or the latest.
    ///
    /// # Errors
    /// [`InstallationProblem`] with what is missing.
    pub fn find(root: &Path, version: Option<&str>) -> Result<Self, InstallationProblem> {
        let root = root.to_owned();
        if !root.is_dir() {
            return Err(InstallationProblem::NoFolder { root });
        }
        let builds = builds(&root);
        let Some(latest) = builds.last() else {
            return Err(InstallationProblem::NoVersion { root });
        };
        let (base_build, data_version) = match version {
            None => (*latest, None),
            Some(wanted) => {
                let known = VERSIONS.into_iter().find(|(name, ..)| *name == wanted);
                let build = known
                    .map(|(_, build, _)| build)
                    .or_else(|| wanted.parse().ok());
                let build = build.filter(|build| builds.contains(build));
                let other = || InstallationProblem::OtherVersions {
                    wanted: wanted.to_owned(),
                    root: root.clone(),
                    found: builds
                        .iter()
                        .map(|build| name(*build))
                        .collect::<Vec<_>>()
                        .join(", "),
                };
                (build.ok_or_else(other)?, known.map(|(.., hash)| hash))
            }
        };
        let program = root
            .join("Versions")
            .join(format!("Base{base_build}"))
            .join(PROGRAM);
        if !program.is_file() {
            return Err(InstallationProblem::NoProgram { program });
        }
        if !is_executable(&program) {
            return Err(InstallationProblem::NotExecutable { program });
        }
        Ok(Self {
            root,
            program,
            base_build,
            data_version,
        })
    }

    /// The file of a map.
    ///
    /// # Errors
    /// [`InstallationProblem::NoMap`] if there is none.
    pub fn map_file(&self, map: &str) -> Result<PathBuf, InstallationProblem> {
        let file = self.root.join("Maps").join(units::map_path(map));
        if file.is_file() {
            Ok(file)
        } else {
            Err(InstallationProblem::NoMap { file })
        }
    }

    /// The version as people write it, if it is known, and its number.
    #[must_use]
    pub fn version(&self) -> String {
        name(self.base_build)
    }
}

fn name(build: u32) -> String {
    match VERSIONS.iter().find(|(_, known, _)| *known == build) {
        Some((name, ..)) => format!("{name} ({build})"),
        None => build.to_string(),
    }
}

/// Numbers of the versions below `root`, in order.
fn builds(root: &Path) -> Vec<u32> {
    let entries = fs::read_dir(root.join("Versions"))
        .into_iter()
        .flatten()
        .flatten();
    let mut builds: Vec<u32> = entries
        .filter_map(|entry| {
            entry
                .file_name()
                .to_str()?
                .strip_prefix("Base")?
                .parse()
                .ok()
        })
        .collect();
    builds.sort_unstable();
    builds
}

#[cfg(unix)]
fn is_executable(program: &Path) -> bool {
    use std::os::unix::fs::PermissionsExt;
    fs::metadata(program).is_ok_and(|data| data.permissions().mode() & 0o111 != 0)
}

#[cfg(not(unix))]
fn is_executable(_: &Path) -> bool {
    true
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stand_in::install::install;

    #[test]
    fn the_version_that_is_named_is_found_and_else_the_latest() {
        let folder = tempfile::tempdir().unwrap();
        install(folder.path(), Path::new("/bin/true")).unwrap();
        let found = Installation::find(folder.path(), None).unwrap();
        assert_eq!((found.base_build, found.data_version), (75689, None));
        assert_eq!(found.version(), "4.10.0 (75689)");
        let named = Installation::find(folder.path(), Some("4.10.0")).unwrap();
        assert!(
            named
                .data_version
                .is_some_and(|hash| hash.starts_with("B89B")),
            "{named:?}"
        );
        assert!(found.map_file("3m").is_ok());
    }

    #[test]
    fn what_is_missing_is_named_with_its_remedy() {
        let folder = tempfile::tempdir().unwrap();
        let root = folder.path().join("game");
        let problem = |version| Installation::find(&root, version).unwrap_err();
        assert!(matches!(
            problem(None),
            InstallationProblem::NoFolder { .. }
        ));
        fs::create_dir_all(root.join("Versions")).unwrap();
        assert!(matches!(
            problem(None),
            InstallationProblem::NoVersion { .. }
        ));
        let installed = install(&root, Path::new("/bin/true")).unwrap();
        let other = problem(Some("4.6.2")).to_string();
        assert!(
            other.contains("4.6.2") && other.contains("4.10.0 (75689)"),
            "{other}"
        );
        #[cfg(unix)]
        {
            use std::os::unix::fs::PermissionsExt;
            fs::set_permissions(&installed.program, fs::Permissions::from_mode(0o644)).unwrap();
            assert!(problem(None).remedy().starts_with("chmod +x "));
        }
        fs::remove_file(&installed.program).unwrap();
        assert!(matches!(
            problem(None),
            InstallationProblem::NoProgram { .. }
        ));
    }
}
