//! What can be typed: the commands and their flags, as text for `--help` and as values for `commands`.

mod bench;
mod configuration;
mod play;
mod replay;
mod runs;
mod sc2;

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand};

use crate::{
    provenance::CODE,
    reproduce::{figure5::Figure5Options, figure6::Figure6Options, figure7::Figure7Options},
};
pub(crate) use bench::{
    BenchArgs, BenchCommand, BenchEnvironmentArgs, BenchTrainArgs, BenchUpdateArgs,
};
pub(crate) use configuration::{ConfigurationArgs, read_scenario, with_scenario};
pub(crate) use play::{PlayArgs, PolicyChoice};
pub(crate) use replay::{ExplainArgs, ReplayArgs};
pub(crate) use runs::{CertifyArgs, EvaluateArgs, ExecuteAgentArgs, ResumeArgs, TrainArgs};
pub(crate) use sc2::{
    DoctorArgs, ExecGameArgs, InstallArgs, KillArgs, PsArgs, RecordArgs, Sc2Args, Sc2Command,
    ServeArgs, UnitsChoice,
};

/// Teaches teams to coordinate without communicating, by acting jointly on what they commonly know.
///
/// Multi-Agent Common Knowledge Reinforcement Learning (MACKRL), with a built-in StarCraft micromanagement simulator: no
/// StarCraft, no Python and no GPU are needed.
///
/// Results go to stdout, everything else to stderr. Exit codes: 0 success, 1 a failed certificate, 2 usage, 64 a bad
/// configuration, 65 bad data, 70 a defect of this program, 74 input or output, 75 stopped by a signal: go on with `mackrl resume`.
#[derive(Debug, Parser)]
#[command(name = "mackrl", version = CODE, max_term_width = 100)]
pub(crate) struct Cli {
    #[command(subcommand)]
    pub(crate) command: Command,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    Train(TrainArgs),
    Resume(ResumeArgs),
    Evaluate(EvaluateArgs),
    Certify(CertifyArgs),
    #[command(hide = true)]
    ExecuteAgent(ExecuteAgentArgs),
    Reproduce(ReproduceArgs),
    Play(PlayArgs),
    Replay(ReplayArgs),
    Explain(ExplainArgs),
    Maps(MapsArgs),
    Config(ConfigArgs),
    Bench(BenchArgs),
    Sc2(Sc2Args),
}

/// Reproduce a figure of the paper, and judge what the paper says about it
///
/// Example: mackrl reproduce figure5 --out runs/figure5
#[derive(Debug, Args)]
pub(crate) struct ReproduceArgs {
    #[command(subcommand)]
    pub(crate) figure: Figure,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Figure {
    Figure5(Figure5Options),
    Figure6(Figure6Options),
    Figure7(Figure7Options),
}

/// List the maps that can be played, with the sizes of their arrays, or check a scenario of your own
///
/// A scenario is a TOML file: terrain, units, orders, and unit types of its own if wanted. Every command that takes --map takes
/// a scenario file in place of a name. examples/scenarios/sniper-alley.toml explains every line of one.
///
/// Examples: mackrl maps --json; mackrl maps --check my.toml
#[derive(Debug, Args)]
pub(crate) struct MapsArgs {
    /// Print a JSON array instead of a table
    #[arg(long)]
    pub(crate) json: bool,

    /// List this scenario file instead; an error names line and column, what was found and what was expected
    #[arg(long, value_name = "FILE")]
    pub(crate) check: Option<PathBuf>,
}

/// Print the configuration that a run would have, and where each value comes from; or explain a setting
///
/// Later layers win: built-in values, --preset, --config, the short flags (--map, ...), --set. The output is a complete
/// configuration file.
///
/// Examples: mackrl config --print --preset paper --set learner.gamma=0.95 > mine.toml; mackrl config --explain learner.gamma;
/// mackrl config --explain run; mackrl config --schema > mackrl.schema.json
#[derive(Debug, Args)]
pub(crate) struct ConfigArgs {
    /// Print every setting with its value (the default)
    #[arg(long, conflicts_with_all = ["explain", "schema"])]
    pub(crate) print: bool,

    /// Explain a setting, or all of a section: meaning, unit, values that it takes, its value in each preset and why
    #[arg(long, value_name = "KEY", conflicts_with = "schema")]
    pub(crate) explain: Option<String>,

    /// Print a JSON schema of configuration files (draft 2020-12), for editors and programs
    #[arg(long)]
    pub(crate) schema: bool,

    /// Print JSON instead of text
    #[arg(long)]
    pub(crate) json: bool,

    #[command(flatten)]
    pub(crate) configuration: ConfigurationArgs,
}
