//! The kind `mackrl-coma`.

use mackrl_env::{
    EnvironmentSpec, declare_settings,
    settings::{Accepts, EXACT, Setting, SettingsError},
};

use super::{Counterfactual, Groupwise, GroupwiseSettings};
use crate::{
    Error,
    algorithms::{
        Algorithm, AlgorithmKind, PairMemory, Team,
        shared_settings::{defaults_of_both, read_both},
    },
    common_knowledge::CommonKnowledgeFeatures,
    hierarchy::Hierarchy,
    partition::PartitionSchedule,
    policy::{Declaration, Delegation, Selection},
};

declare_settings! {
    /// The hierarchy of MACKRL-COMA, in which partitions into pairs take turns: one is in force at a time, so that each group can be
    /// compared with itself.
    pub struct MackrlComaSettings {
        /// Which features of commonly known entities the controllers read: all of them, or those of the authors' code.
        common_knowledge: CommonKnowledgeFeatures = CommonKnowledgeFeatures::Complete, CommonKnowledgeFeatures::ACCEPTS;
        /// Environment steps for which a partition stays in force; 0 for the whole episode.
        hold_steps_env: u64 = 1, Accepts::integer(0, EXACT);
        /// How long a pair's controller remembers: as long as the pair is formed, or the whole episode.
        pair_memory: PairMemory = PairMemory::Formed, PairMemory::ACCEPTS;
        /// When pairs delegate: their controllers decide, or, as ablations, always (which is COMA), or only where no joint action is
        /// commonly known.
        delegation: Delegation = Delegation::Learned, Delegation::ACCEPTS;
        /// Logit of delegating, of an untrained pair controller, above that of a joint action.
        delegation_logit: f64 = 3.0, Accepts::within(-1000.0, 1000.0);
    }
}

/// The kind `mackrl-coma`: the counterfactual baseline of COMA on the groups of MACKRL.
#[derive(Debug, Clone, Copy, Default)]
pub struct MackrlComa;

impl MackrlComa {
    /// The settings of the hierarchy and of its learning, which stand side by side in one table.
    ///
    /// # Errors
    /// As [`Settings::read`](mackrl_env::settings::Settings::read).
    pub fn read(
        table: &toml::Table,
    ) -> Result<(MackrlComaSettings, GroupwiseSettings), SettingsError> {
        read_both(table)
    }
}

impl AlgorithmKind for MackrlComa {
    fn name(&self) -> &'static str {
        "mackrl-coma"
    }

    fn summary(&self) -> &'static str {
        "MACKRL-COMA: pair controllers and agent controllers, under central critics that compare each group's joint action with its others."
    }

    fn settings(&self) -> Vec<Setting> {
        [MackrlComaSettings::SETTINGS, GroupwiseSettings::SETTINGS].concat()
    }

    fn defaults(&self) -> toml::Table {
        defaults_of_both::<MackrlComaSettings, GroupwiseSettings>()
    }

    fn check(
        &self,
        table: &toml::Table,
        _spec: &EnvironmentSpec,
    ) -> Result<toml::Table, SettingsError> {
        let (_, learning) = Self::read(table)?;
        learning.check()?;
        Ok(table.clone())
    }

    fn build(&self, table: &toml::Table, team: Team<'_>) -> Result<Box<dyn Algorithm>, Error> {
        let (hierarchy, settings) = parts(table, team)?;
        let learner = Groupwise::<Counterfactual>::new(hierarchy, settings, team);
        Ok(Box::new(learner))
    }

    fn size(&self, table: &toml::Table, team: Team<'_>) -> Result<usize, Error> {
        let (hierarchy, settings) = parts(table, team)?;
        Ok(Groupwise::<Counterfactual>::size(
            &hierarchy, &settings, team,
        ))
    }
}

/// The declared hierarchy, and how it learns.
fn parts(table: &toml::Table, team: Team<'_>) -> Result<(Hierarchy, GroupwiseSettings), Error> {
    let (settings, learning) = MackrlComa::read(table).map_err(Error::setting)?;
    let hold = usize::try_from(settings.hold_steps_env).unwrap_or(usize::MAX);
    let declaration = Declaration::pairwise(
        [team.spec.agents, team.spec.actions],
        PartitionSchedule::RoundRobin,
        Selection::Learned,
        settings.delegation,
        team.seed,
    )?
    .with_partitions_held(hold, settings.pair_memory.into())
    .with_delegation_logit(settings.delegation_logit);
    let hierarchy = team.hierarchy(declaration, settings.common_knowledge, learning.hidden);
    Ok((hierarchy, learning))
}
