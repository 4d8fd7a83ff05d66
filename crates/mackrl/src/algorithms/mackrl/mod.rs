//! Pairwise MACKRL, the learner of the paper: a pair selector, pair controllers and agent controllers under one central critic.

mod settings;

use mackrl_env::{
    EnvironmentSpec,
    settings::{Setting, SettingsError},
};

use crate::{
    Error,
    algorithms::{
        ActorCritic, ActorCriticSettings, Algorithm, AlgorithmKind, Automatic, Preset, Team,
        shared_settings::{defaults_of_both, read_both},
    },
    hierarchy::Hierarchy,
    partition::PartitionSchedule,
};

pub use settings::{Levels, MackrlSettings, PartitionChoice};

/// The kind `mackrl`.
#[derive(Debug, Clone, Copy, Default)]
pub struct Mackrl;

impl Mackrl {
    /// The settings of the hierarchy and of its learning, which stand side by side in one table.
    ///
    /// # Errors
    /// As [`Settings::read`](mackrl_env::settings::Settings::read).
    pub fn read(
        table: &toml::Table,
    ) -> Result<(MackrlSettings, ActorCriticSettings), SettingsError> {
        read_both(table)
    }
}

impl AlgorithmKind for Mackrl {
    fn name(&self) -> &'static str {
        "mackrl"
    }

    fn summary(&self) -> &'static str {
        "Pairwise MACKRL: a pair selector, pair controllers and agent controllers."
    }

    fn settings(&self) -> Vec<Setting> {
        [MackrlSettings::SETTINGS, ActorCriticSettings::SETTINGS].concat()
    }

    fn defaults(&self) -> toml::Table {
        defaults_of_both::<MackrlSettings, ActorCriticSettings>()
    }

    fn automatic(&self, table: &toml::Table, spec: &EnvironmentSpec) -> Vec<Automatic> {
        let all = PartitionChoice::All.to_string();
        let takes_all = table.get("partitions").and_then(toml::Value::as_str) == Some(&*all);
        if !takes_all || spec.agents <= PartitionSchedule::MOST_AGENTS_ENUMERATED {
            return Vec::new();
        }
        vec![Automatic {
            name: "partitions",
            value: PartitionChoice::RoundRobin.to_string().into(),
            why: "more than 8 agents have too many partitions to take all",
        }]
    }

    fn check(
        &self,
        table: &toml::Table,
        spec: &EnvironmentSpec,
    ) -> Result<toml::Table, SettingsError> {
        let (settings, learning) = Self::read(table)?;
        learning.check()?;
        settings.levels.check(settings.partitions, spec)?;
        Ok(table.clone())
    }

    fn build(&self, table: &toml::Table, team: Team<'_>) -> Result<Box<dyn Algorithm>, Error> {
        let (hierarchy, settings) = parts(table, team)?;
        Ok(Box::new(ActorCritic::new(hierarchy, settings, team)))
    }

    fn size(&self, table: &toml::Table, team: Team<'_>) -> Result<usize, Error> {
        let (hierarchy, settings) = parts(table, team)?;
        Ok(ActorCritic::size(&hierarchy, &settings, team))
    }

    fn presets(&self) -> &'static [Preset] {
        &[
            Preset {
                name: "fours",
                text: include_str!("presets/fours.toml"),
            },
            Preset {
                name: "paper",
                text: include_str!("presets/paper.toml"),
            },
            Preset {
                name: "paper-code",
                text: include_str!("presets/paper-code.toml"),
            },
            Preset {
                name: "paper-figures",
                text: include_str!("presets/paper-figures.toml"),
            },
        ]
    }
}

/// The declared hierarchy, and how it learns.
fn parts(table: &toml::Table, team: Team<'_>) -> Result<(Hierarchy, ActorCriticSettings), Error> {
    let (settings, learning) = Mackrl::read(table).map_err(Error::setting)?;
    let declaration = settings.declaration([team.spec.agents, team.spec.actions], team.seed)?;
    let hierarchy = team.hierarchy(declaration, settings.common_knowledge, learning.hidden);
    Ok((hierarchy, learning))
}
