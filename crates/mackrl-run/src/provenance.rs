//! Where a result comes from: code, map data, configuration, seeds, and how the team was judged.
//!
//! Every result carries a [`Provenance`], so that results which differ in more than their seeds are not taken for repetitions of
//! one experiment. It stands
//!
//! - in full in `run.json` of a run folder, as the list `provenance`: one entry, and one more for each other version of this
//!   program that went on with the run;
//! - by its `id` in every row of `metrics.jsonl`, as `provenance`;
//! - in full in `provenance` of what `evaluate --json` and `certify --json` print and of every file of `reproduce`, which has a
//!   list where several experiments meet in a file.
//!
//! What a run computes is named by two [`Versions`], of the simulator and of learning, which are raised when it changes: a golden run
//! (`crates/mackrl-run/tests/golden_runs.rs`) holds them. The hash of the sources stands beside them as information: it changes with
//! every comment, so results that differ in it alone are taken together, and it refuses nothing.
//!
//! Nothing in it depends on the clock, the machine, the folder or the number of threads: equal work has an equal provenance.

use std::fmt;

use mackrl_skirmish::SIMULATOR_VERSION;
use serde::{Deserialize, Serialize};
use sha2::{Digest, Sha256};

use crate::config::{Config, EnvironmentConfig};

/// The version of the code that results come from: the crates' version and the first digits of the hash of the libraries'
/// sources and data (see `build.rs`).
pub const CODE: &str = concat!(env!("CARGO_PKG_VERSION"), "+", env!("MACKRL_SOURCE"));

/// Version of everything between the worlds and the weights: raised when a run with the same configuration, in the same version of
/// the simulator, no longer gives the same weights.
///
/// 1: mackrl 0.1.0, which drew and learnt with the exponential function of the platform. 2: our own, the same on every machine.
/// 3: the policy loss of the paper's learner over a buffer of fixed size. 4: recurrent states normalised under a clipped surrogate.
/// 5: IAC and COMA differentiate the policy with exploration mixed in.
pub const LEARNING_VERSION: u32 = 5;

/// The versions of runs that do not say, which mackrl 0.1.0 made.
const FIRST: Versions = Versions {
    simulator: 2,
    learning: 1,
};

/// [`Provenance::code`] of results that do not say.
const UNKNOWN: &str = "unknown";

/// Hexadecimal digits of an id.
const ID_DIGITS: usize = 16;

/// What a result was computed by: equal versions compute the same from the same configuration.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
pub struct Versions {
    /// [`SIMULATOR_VERSION`].
    pub simulator: u32,
    /// [`LEARNING_VERSION`].
    pub learning: u32,
}

impl Versions {
    /// Those of this program.
    pub const OWN: Self = Self {
        simulator: SIMULATOR_VERSION,
        learning: LEARNING_VERSION,
    };

    const fn first() -> Self {
        FIRST
    }

    fn are_first(&self) -> bool {
        *self == FIRST
    }
}

/// "simulator 2, learning 2"
impl fmt::Display for Versions {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(
            formatter,
            "simulator {}, learning {}",
            self.simulator, self.learning
        )
    }
}

/// Where a result comes from.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize)]
pub struct Provenance {
    /// Names this provenance: the first 16 digits of the SHA-256 of all that follows.
    pub id: String,
    /// [`CODE`] of the program that made the result, for information.
    pub code: String,
    /// What it was computed by; results of mackrl 0.1.0 do not say.
    #[serde(
        default = "Versions::first",
        skip_serializing_if = "Versions::are_first"
    )]
    pub versions: Versions,
    /// The map's name.
    pub map: String,
    /// SHA-256 of the map's file and the unit statistics it is played with: `cat maps/3m.toml units/lotv.toml | sha256sum`.
    pub map_sha256: String,
    /// SHA-256 of the configuration without its seed, equal for the repetitions of an experiment:
    /// `grep -v '^seed = ' config.toml | sha256sum`.
    pub config_sha256: String,
    /// The seeds of the runs in the result, or of the episodes if only episodes were played.
    pub seeds: Vec<u64>,
    /// How the team was judged.
    pub evaluation: Judgement,
    /// SHA-256 of the weights that played, if the result is about given weights.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub weights_sha256: Option<String>,
}

/// How a team is judged.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
pub struct Judgement {
    /// How actions are chosen.
    pub actions: Choice,
    /// Episodes of a judgement; 0 if expectations are computed and none is played.
    pub episodes: usize,
}

/// How actions are chosen when a team is judged.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Choice {
    /// The most likely ones.
    Greedy,
    /// Sampled in some episodes, greedy in as many others.
    SampledAndGreedy,
    /// All of them, weighted by their probabilities.
    Expected,
}

impl Provenance {
    /// Of a training run: judged by its greedy tests.
    pub fn of_run(config: &Config) -> Self {
        let judgement = Judgement {
            actions: Choice::Greedy,
            episodes: config.test.episodes,
        };
        Self::new(
            &config.env,
            &without_seed(config),
            vec![config.run.seed],
            judgement,
        )
    }

    /// Of a training run by a version of the code that is not known.
    pub fn of_unknown_code(config: &Config) -> Self {
        let provenance = Self {
            code: UNKNOWN.to_owned(),
            versions: FIRST,
            ..Self::of_run(config)
        };
        provenance.identified()
    }

    /// Of results taken together: one for each experiment, with the seeds of all its repetitions.
    pub fn merged<'a>(of: impl IntoIterator<Item = &'a Self>) -> Vec<Self> {
        let mut experiments: Vec<Self> = Vec::new();
        for one in of {
            let same =
                |other: &&mut Self| one.code == other.code && one.differences(other).is_empty();
            match experiments.iter_mut().find(same) {
                Some(experiment) => experiment.seeds.extend(&one.seeds),
                None => experiments.push(one.clone()),
            }
        }
        experiments.into_iter().map(Self::identified).collect()
    }

    /// Of episodes that these weights played, drawn from `seed`.
    pub fn of_weights(config: &Config, weights: &[u8], seed: u64, judgement: Judgement) -> Self {
        let mut provenance = Self::of_run(config);
        provenance.seeds = vec![seed];
        provenance.evaluation = judgement;
        provenance.weights_sha256 = Some(sha256(weights));
        provenance.identified()
    }

    /// Of work in the world `env` that `settings` describe in words of their own.
    pub fn new(
        env: &EnvironmentConfig,
        settings: &str,
        seeds: Vec<u64>,
        evaluation: Judgement,
    ) -> Self {
        let provenance = Self {
            id: String::new(),
            code: CODE.to_owned(),
            versions: Versions::OWN,
            map: env.map().to_owned(),
            map_sha256: sha256(env.data().as_bytes()),
            config_sha256: sha256(settings.as_bytes()),
            seeds,
            evaluation,
            weights_sha256: None,
        };
        provenance.identified()
    }

    /// What makes this another experiment than `other`: the names of the fields that differ, seeds and weights aside.
    pub fn differences(&self, other: &Self) -> Vec<&'static str> {
        let fields = [
            ("versions", self.versions != other.versions),
            (
                "map",
                (&self.map, &self.map_sha256) != (&other.map, &other.map_sha256),
            ),
            ("config", self.config_sha256 != other.config_sha256),
            ("evaluation", self.evaluation != other.evaluation),
        ];
        let differing = fields.into_iter().filter(|(_, differs)| *differs);
        differing.map(|(name, _)| name).collect()
    }

    fn identified(mut self) -> Self {
        self.id.clear();
        let json = serde_json::to_vec(&self).expect("a provenance can be written");
        self.id = sha256(&json)[..ID_DIGITS].to_owned();
        self
    }
}

/// The configuration as a run folder holds it, without the line of its seed.
fn without_seed(config: &Config) -> String {
    let text = config.to_toml();
    let lines = text.lines().filter(|line| !line.starts_with("seed = "));
    lines.flat_map(|line| [line, "\n"]).collect()
}

/// SHA-256 in hexadecimal, as `sha256sum` prints it.
pub fn sha256(content: &[u8]) -> String {
    hexadecimal(&Sha256::digest(content))
}

/// Two digits for each byte.
pub fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().map(|byte| format!("{byte:02x}")).collect()
}

#[cfg(test)]
mod tests {
    use std::path::Path;

    use super::*;

    fn provenance(change: impl FnOnce(&mut Config)) -> Provenance {
        let mut config = Config::default();
        change(&mut config);
        Provenance::of_run(&config)
    }

    #[test]
    fn repetitions_differ_in_their_seeds_and_ids_alone() {
        let one = provenance(|_| ());
        let other = provenance(|config| config.run.seed = 7);
        assert_eq!(one, provenance(|_| ()));
        assert_ne!(one.id, other.id);
        assert_eq!(one.differences(&other), [""; 0]);
        assert_eq!(
            Provenance {
                id: one.id.clone(),
                seeds: vec![1],
                ..other
            },
            one
        );
    }

    #[test]
    fn whatever_makes_another_experiment_is_named() {
        let one = provenance(|_| ());
        let gamma = provenance(|config| config.algorithm.set("gamma", 0.5).unwrap());
        assert_eq!(one.differences(&gamma), ["config"]);
        let map = provenance(|config| config.env.set("map", "2s3z").unwrap());
        assert_eq!(one.differences(&map), ["map", "config"]);
        let tests = provenance(|config| config.test.episodes = 5);
        assert_eq!(one.differences(&tests), ["config", "evaluation"]);
        let comment = Provenance {
            code: "0.0.1+x".to_owned(),
            ..one.clone()
        };
        assert_eq!(one.differences(&comment), [""; 0]);
        let learning = Provenance {
            versions: FIRST,
            ..one.clone()
        };
        assert_eq!(one.differences(&learning), ["versions"]);
    }

    #[test]
    fn repetitions_are_merged_and_experiments_are_not() {
        let one = provenance(|_| ());
        let two = provenance(|config| config.run.seed = 2);
        let gamma = provenance(|config| config.algorithm.set("gamma", 0.5).unwrap());
        let merged = Provenance::merged([&one, &gamma, &two]);
        assert_eq!(merged.len(), 2);
        assert_eq!((&merged[0].seeds, &merged[1]), (&vec![1, 2], &gamma));
        assert_ne!(merged[0].id, one.id);
        let unknown = Provenance::of_unknown_code(&Config::default());
        assert_eq!(unknown.differences(&one), ["versions"]);
    }

    /// `cat maps/3m.toml units/lotv.toml | sha256sum`, and the same for the matrix game's payoffs.
    #[test]
    fn map_data_are_the_files_of_map_and_units() {
        let data = Path::new(env!("CARGO_MANIFEST_DIR")).join("../mackrl-skirmish");
        let files: String = ["maps/3m.toml", "units/lotv.toml"]
            .map(|file| std::fs::read_to_string(data.join(file)).unwrap())
            .concat();
        assert_eq!(provenance(|_| ()).map_sha256, sha256(files.as_bytes()));
        let liberty = provenance(|config| {
            config.env.set("units", "liberty").unwrap();
        });
        assert_ne!(liberty.map_sha256, provenance(|_| ()).map_sha256);
        let game = provenance(|config| *config = Config::with(&["env.name=matrix-game"]).unwrap());
        let payoffs = "1 0 0 0.4 0\n0 0.2 0.4 0.8 0.4\n0 0 0 0.4 0\n0 0 0 0.2 0\n0 0 0 0 0\n\
                       0 0 0.2 0 1\n0 0 0.4 0 0\n0.2 0.4 0.8 0.4 0.2\n0 0 0.4 0 0\n0 0 0.2 0 0\n";
        assert_eq!(game.map_sha256, sha256(payoffs.as_bytes()));
    }

    /// A provenance as mackrl 0.1.0 wrote it, from `results/figure6`.
    #[test]
    fn results_of_the_first_release_are_read_and_written_as_they_were() {
        let text = r#"{"id":"a42b9325271a7b11","code":"0.1.0+2beb505bad00","map":"2s3z","map_sha256":"5f8621d56ee748976822d75fae788ee07b1994a11922180d9dcb74d0324c414b","config_sha256":"817bd60e498ddef658463627e6ab33a92f1821ae9a69ee8ef4de3f707cc68b90","seeds":[1],"evaluation":{"actions":"greedy","episodes":24}}"#;
        let old: Provenance = serde_json::from_str(text).unwrap();
        assert_eq!(old.versions, FIRST);
        assert_eq!(serde_json::to_string(&old).unwrap(), text);
        assert_eq!(old.clone().identified(), old);
        let own = serde_json::to_value(provenance(|_| ())).unwrap();
        assert_eq!(own["versions"]["learning"], LEARNING_VERSION);
    }

    #[test]
    fn the_code_has_a_version_and_the_hash_of_its_sources() {
        let (version, source) = CODE.split_once('+').unwrap();
        assert_eq!(version, env!("CARGO_PKG_VERSION"));
        assert_eq!(source.len(), 12);
    }

    #[test]
    fn the_seed_is_the_only_line_that_a_configuration_is_hashed_without() {
        let config = Config::default();
        let hashed = without_seed(&config);
        assert_eq!(
            config.to_toml().replace("seed = 1\n", ""),
            hashed,
            "{hashed}"
        );
    }
}
