//! `mackrl sc2 install`: a folder that clients take for StarCraft II.

use anyhow::Context;
use mackrl_sc2::stand_in::install::install;
use serde_json::json;

use crate::{args::InstallArgs, output};

pub(super) fn run(args: &InstallArgs) -> anyhow::Result<()> {
    let server = std::env::current_exe().context("cannot find this program")?;
    let cannot = || format!("cannot lay out {}", args.folder.display());
    let installed = install(&args.folder, &server).with_context(cannot)?;
    let folder = args.folder.canonicalize().with_context(cannot)?;
    if args.json {
        return output::print_json(&json!({
            "folder": folder,
            "program": installed.program,
            "maps": installed.maps,
            "version": installed.version,
        }));
    }
    output::print(&format!(
        "{0} stands in for StarCraft II {1}: start clients with SC2PATH='{0}'\n",
        folder.display(),
        installed.version
    ))
}
