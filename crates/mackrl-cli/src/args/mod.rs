//! What can be typed: the commands and their flags, as text for `--help` and as values for `commands`.

mod analysis;
mod bench;
mod configuration;
mod fidelity;
mod inquiry;
mod play;
mod replay;
mod runs;
#[cfg(all(feature = "sc2", target_os = "linux"))]
mod sc2;
#[cfg(not(all(feature = "sc2", target_os = "linux")))]
#[path = "without_sc2.rs"]
mod sc2;
mod serve;
mod shell;
mod sweep;

use std::{
    num::{NonZeroU64, NonZeroUsize},
    path::PathBuf,
    sync::LazyLock,
};

use clap::{Args, Parser, Subcommand};
use mackrl::nn::InstructionSet;
use mackrl_run::provenance::CODE;

use crate::reproduce::{
    ablations::AblationOptions, all::AllOptions, calibration::CalibrationOptions,
    figure4_neurips::Figure4Options, figure5::Figure5Options, figure6::Figure6Options,
    figure7::Figure7Options, ppo::PpoOptions, protocol::ProtocolOptions, zoo::ZooOptions,
};
pub(crate) use analysis::{CurveAxis, CurveStatistic, PlotArgs, ReportArgs};
pub(crate) use bench::{
    BenchArgs, BenchCommand, BenchEnvironmentArgs, BenchTrainArgs, BenchUpdateArgs,
};
pub(crate) use configuration::{ConfigurationArgs, without_scenario, world};
pub(crate) use fidelity::FidelityArgs;
pub(crate) use inquiry::DiffArgs;
pub(crate) use play::PlayArgs;
pub(crate) use replay::{ExplainArgs, ReplayArgs};
pub(crate) use runs::{CertifyArgs, EvaluateArgs, ResumeArgs, TrainArgs};
pub(crate) use sc2::Sc2Args;
#[cfg(all(feature = "sc2", target_os = "linux"))]
pub(crate) use sc2::{
    DoctorArgs, ExecGameArgs, InstallArgs, KillArgs, PsArgs, RecordArgs, Sc2Command, ServeArgs,
    UnitsChoice,
};
pub(crate) use serve::ServeRunsArgs;
pub(crate) use shell::{CompletionsArgs, ManArgs};
pub(crate) use sweep::SweepArgs;

/// Teaches teams to coordinate without communicating, by acting jointly on what they commonly know.
///
/// Multi-Agent Common Knowledge Reinforcement Learning (MACKRL), with a built-in StarCraft micromanagement simulator: no
/// StarCraft, no Python and no GPU are needed.
///
/// Results go to stdout, everything else to stderr. Exit codes: 0 success, 1 a failed certificate or a
/// difference, 2 usage, 64 a bad
/// configuration, 65 bad data, 70 a defect of this program, 74 input or output, 75 stopped by a signal: go on with `mackrl resume`.
#[derive(Debug, Parser)]
#[command(name = "mackrl", version = CODE, long_version = long_version(), max_term_width = 120)]
pub(crate) struct Cli {
    #[command(subcommand)]
    pub(crate) command: Command,
}

/// Most episodes that can be asked for: years of them.
const EPISODES_MOST: usize = 1_000_000_000;
/// Most that counts without a limit of their own can be: what every configuration can hold, 2⁵³.
pub(crate) const MOST: u64 = 1 << 53;

/// Reads a whole number from `least` to `most`, as people type it, and converts it.
fn whole<T>(
    least: u64,
    most: u64,
    convert: fn(u64) -> Option<T>,
) -> impl Fn(&str) -> Result<T, String> + Clone + Send + Sync {
    let range = if most < MOST {
        format!("from {least} to {most}")
    } else {
        format!("from {least} on")
    };
    move |text| {
        mackrl_run::number::whole(text)
            .filter(|number| (least..=most).contains(number))
            .and_then(convert)
            .ok_or_else(|| format!("expected a whole number {range}, such as 20000, 20_000 or 2e4"))
    }
}

/// Reads a whole number from `least` to `most`.
pub(crate) fn number(
    least: u64,
    most: u64,
) -> impl Fn(&str) -> Result<u64, String> + Clone + Send + Sync {
    whole(least, most, Some)
}

/// Reads a whole number from `least` to `most` that counts what can be in memory.
pub(crate) fn size(
    least: u64,
    most: u64,
) -> impl Fn(&str) -> Result<usize, String> + Clone + Send + Sync {
    whole(least, most, |number| usize::try_from(number).ok())
}

/// Reads a count from 1 to `most`, of what takes memory or time for each.
fn count_to(most: usize) -> impl Fn(&str) -> Result<NonZeroUsize, String> + Clone + Send + Sync {
    whole(1, most as u64, |number| {
        NonZeroUsize::new(usize::try_from(number).ok()?)
    })
}

/// Reads a number of episodes.
fn episodes() -> impl Fn(&str) -> Result<NonZeroU64, String> + Clone + Send + Sync {
    whole(1, EPISODES_MOST as u64, NonZeroU64::new)
}

/// Reads a count of what is done side by side.
pub(crate) fn side_by_side(text: &str) -> Result<NonZeroUsize, String> {
    count_to(65_536)(text)
}

/// What `--version` tells: the version, and the instructions that this machine computes with.
fn long_version() -> &'static str {
    static TEXT: LazyLock<String> = LazyLock::new(|| {
        let simd = InstructionSet::chosen().map_or("none", InstructionSet::name);
        format!("{CODE}\nsimd {simd}")
    });
    &TEXT
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    Train(TrainArgs),
    Resume(ResumeArgs),
    Evaluate(EvaluateArgs),
    Certify(CertifyArgs),
    /// Act as one agent of a trained team: read its number and the weights, then local views, from stdin, and write actions to stdout
    ///
    /// `mackrl certify` starts one such process per agent.
    #[command(hide = true)]
    ExecuteAgent,
    Sweep(SweepArgs),
    Plot(PlotArgs),
    Report(ReportArgs),
    Reproduce(ReproduceArgs),
    Play(PlayArgs),
    Fidelity(FidelityArgs),
    Replay(ReplayArgs),
    Explain(ExplainArgs),
    Serve(ServeRunsArgs),
    Maps(MapsArgs),
    Diff(DiffArgs),
    Config(ConfigArgs),
    Bench(BenchArgs),
    Sc2(Sc2Args),
    Completions(CompletionsArgs),
    Man(ManArgs),
}

/// Reproduce the figures of the paper and of this project, and judge what is said about them
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
    Ablations(AblationOptions),
    Protocol(ProtocolOptions),
    All(AllOptions),
    Ppo(PpoOptions),
    #[command(name = "figure4-neurips")]
    Neurips(Figure4Options),
    Calibration(CalibrationOptions),
    Zoo(ZooOptions),
}

/// List SMAC's maps with what is known of them, show one of them, or check a scenario of your own
///
/// The list holds the 23 maps of SMAC: sides, races, kind of team, difficulty and the best results in this repository. Besides them, --map takes `matrix-game`, the game of the paper's Figure 5, and a scenario
/// file in place of a name.
///
/// A scenario is a TOML file: terrain, units, orders, and unit types of its own if wanted.
/// examples/scenarios/sniper-alley.toml explains every line of one. `mackrl maps NAME --json` gives the terrain of a map in the
/// form that a scenario takes.
///
/// Examples: mackrl maps --json; mackrl maps 2s3z; mackrl maps --check my.toml
#[derive(Debug, Args)]
pub(crate) struct MapsArgs {
    /// Show this map, or scenario file ending in .toml: its armies, orders, sizes and terrain
    #[arg(value_name = "MAP", conflicts_with = "check")]
    pub(crate) map: Option<String>,

    /// Print JSON: an array of the listed maps, or an object for a map that is shown
    #[arg(long)]
    pub(crate) json: bool,

    /// List this scenario file alone; an error names line and column, what was found and what was expected
    #[arg(long, value_name = "FILE")]
    pub(crate) check: Option<PathBuf>,
}

/// Print the configuration that a run would have, and where each value comes from; or explain a setting
///
/// Later layers win: built-in values, --preset, --config, the short flags (--map, ...), --set. The output is a complete
/// configuration file.
///
/// Examples: mackrl config --print --preset paper --set algorithm.gamma=0.95 > mine.toml; mackrl config --explain algorithm.gamma;
/// mackrl config --explain run; mackrl config --metrics --algorithm mackrl; mackrl config --schema > mackrl.schema.json
#[derive(Debug, Args)]
pub(crate) struct ConfigArgs {
    /// Print every setting with its value (the default)
    #[arg(long, conflicts_with_all = ["explain", "schema", "metrics"])]
    pub(crate) print: bool,

    /// Explain a setting, or all of a section: meaning, unit, values that it takes, its value in each preset and why
    #[arg(long, value_name = "KEY", conflicts_with_all = ["schema", "metrics"])]
    pub(crate) explain: Option<String>,

    /// Explain the metrics that a run of this configuration reports
    #[arg(long, conflicts_with = "schema")]
    pub(crate) metrics: bool,

    /// Print a JSON schema of configuration files (draft 2020-12), for editors and programs
    #[arg(long)]
    pub(crate) schema: bool,

    /// Print JSON instead of text
    #[arg(long)]
    pub(crate) json: bool,

    #[command(flatten)]
    pub(crate) configuration: ConfigurationArgs,
}
