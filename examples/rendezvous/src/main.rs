//! `mackrl` with one more world: `cargo run --release --package rendezvous -- train --map rendezvous`.

use std::{process::ExitCode, sync::Arc};

use mackrl_env::DeclaredKind;
use mackrl_run::config::Registry;
use rendezvous::{Rendezvous, RendezvousSettings};

fn main() -> ExitCode {
    let kind = DeclaredKind::new(
        "rendezvous",
        "robots that see a few cells, and two buttons that pay only if two press at once",
        |settings: RendezvousSettings| Ok(Rendezvous::new(settings)),
    );
    mackrl_cli::run(Registry::built_in().with_world(Arc::new(kind)))
}
