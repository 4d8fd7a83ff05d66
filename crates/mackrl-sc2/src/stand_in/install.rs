//! A folder that clients take for an installation of StarCraft II.

use std::{
    fs, io,
    path::{Path, PathBuf},
};

use mackrl_skirmish::scenario::map_names;

use super::answers::{BASE_BUILD, GAME_VERSION};
use crate::units;

/// Name of the game's program on Linux.
pub const PROGRAM: &str = "SC2_x64";
/// What a map file holds: clients send it, and the server looks at the map's name alone.
const MARKER: &str =
    "This is no StarCraft II map. mackrl's stand-in knows the map by the name of this file.\n";

/// What was laid out.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Installed {
    /// The program that clients start.
    pub program: PathBuf,
    /// The folder of maps.
    pub maps: PathBuf,
    /// Version of the game that clients see.
    pub version: &'static str,
}

/// Lays out `folder`: a program that runs `server` (a `mackrl`) and passes its arguments on after `--`, and a file for every map.
/// What is there already under the same names is replaced if an earlier version of this function wrote it.
///
/// # Errors
/// [`io::ErrorKind::AlreadyExists`] if the folder holds a real game; otherwise what the operating system says.
pub fn install(folder: &Path, server: &Path) -> io::Result<Installed> {
    let versions = folder.join("Versions").join(format!("Base{BASE_BUILD}"));
    let (program, maps) = (
        versions.join(PROGRAM),
        folder.join("Maps").join(units::MAP_FOLDER),
    );
    if is_real(&program)? {
        let message = format!(
            "{} is another program, which is left alone",
            program.display()
        );
        return Err(io::Error::new(io::ErrorKind::AlreadyExists, message));
    }
    for folder in [&versions, &maps, &folder.join("Libs")] {
        fs::create_dir_all(folder)?;
    }
    fs::write(&program, script(server))?;
    make_executable(&program)?;
    for map in map_names() {
        let file = maps.join(format!("{map}.{}", units::MAP_EXTENSION));
        if !file.exists() {
            fs::write(file, MARKER)?;
        }
    }
    Ok(Installed {
        program,
        maps,
        version: GAME_VERSION,
    })
}

/// Whether there is a program that this module did not write.
fn is_real(program: &Path) -> io::Result<bool> {
    if !program.exists() {
        return Ok(false);
    }
    Ok(!is_stand_in(program))
}

/// Whether the program is the stand-in's.
#[must_use]
pub fn is_stand_in(program: &Path) -> bool {
    // The game has hundreds of megabytes; nothing but a short text can be ours.
    let is_short = fs::metadata(program).is_ok_and(|data| data.len() < 4096);
    is_short && fs::read_to_string(program).is_ok_and(|text| text.contains(SIGNATURE))
}

const SIGNATURE: &str = "Laid out by `mackrl sc2 install`";

fn script(server: &Path) -> String {
    let quoted = server.display().to_string().replace('\'', r"'\''");
    format!(
        "#!/bin/sh\n# {SIGNATURE}: answers the StarCraft II API from MACKRL's simulator.\n\
         exec '{quoted}' sc2 serve -- \"$@\"\n"
    )
}

#[cfg(unix)]
fn make_executable(program: &Path) -> io::Result<()> {
    use std::os::unix::fs::PermissionsExt;
    fs::set_permissions(program, fs::Permissions::from_mode(0o755))
}

#[cfg(not(unix))]
fn make_executable(_: &Path) -> io::Result<()> {
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_layout_is_that_of_the_game_and_can_be_laid_again() {
        let folder = tempfile::tempdir().unwrap();
        for server in ["/opt/mackrl", "/home/o'neill/mackrl"] {
            let installed = install(folder.path(), Path::new(server)).unwrap();
            let text = fs::read_to_string(&installed.program).unwrap();
            assert!(text.starts_with("#!/bin/sh\n"), "{text}");
            assert!(text.contains(" sc2 serve -- \"$@\"\n"), "{text}");
            assert!(is_stand_in(&installed.program), "{text}");
        }
        let script = folder.path().join("Versions/Base75689/SC2_x64");
        assert!(
            fs::read_to_string(script)
                .unwrap()
                .contains(r"'/home/o'\''neill/mackrl'")
        );
        assert_eq!(
            fs::read_dir(folder.path().join("Maps/SMAC_Maps"))
                .unwrap()
                .count(),
            23
        );
    }

    #[test]
    fn a_real_game_is_left_alone() {
        let folder = tempfile::tempdir().unwrap();
        let version = folder.path().join("Versions/Base75689");
        fs::create_dir_all(&version).unwrap();
        fs::write(version.join("SC2_x64"), [0x7F, b'E', b'L', b'F']).unwrap();
        let error = install(folder.path(), Path::new("mackrl")).unwrap_err();
        assert_eq!(error.kind(), io::ErrorKind::AlreadyExists);
        assert_eq!(
            fs::read(version.join("SC2_x64")).unwrap(),
            [0x7F, b'E', b'L', b'F']
        );
    }
}
