//! The settings of the learners with a clipped surrogate.

use mackrl_env::{
    EnvironmentSpec, declare_settings, declare_words,
    settings::{Accepts, EXACT, SettingsError, WrongSetting},
};

use crate::{
    Error,
    algorithms::{Automatic, Levels, PartitionChoice},
    common_knowledge::CommonKnowledgeFeatures,
    nn::OptimiserKind,
    objectives::ValueLoss,
    policy::{Declaration, Delegation, Memory, Selection},
};

declare_words! {
    /// What is weighed by itself, with a ratio, an advantage and an entropy of its own.
    pub enum Groups {
        /// Pairs that commonly know a joint action, and single agents.
        #[default]
        Choosing = "choosing",
        /// All pairs that are formed of living agents, and single agents.
        Formed = "formed",
    }
}

declare_words! {
    /// How long a pair's controller remembers.
    pub enum PairMemory {
        /// As long as the pair is formed.
        #[default]
        Formed = "formed",
        /// The whole episode, formed or not.
        Episode = "episode",
    }
}

declare_settings! {
    /// Sizes of the networks, and how they learn from a batch of episodes in several epochs.
    pub struct PpoSettings {
        /// Units in each hidden layer and each recurrent state of the controllers.
        hidden: usize = 64, Accepts::integer(1, 4096);
        /// Units in each hidden layer of the critic.
        critic_hidden: usize = 64, Accepts::integer(1, 4096);
        /// Step size of the controllers at the first environment step.
        learning_rate: f64 = 5e-4, Accepts::above_within(0.0, 1.0);
        /// Step size of the critic at the first environment step.
        critic_learning_rate: f64 = 5e-4, Accepts::above_within(0.0, 1.0);
        /// Environment steps over which step sizes and the weight of the entropy change linearly to what they are in the end. Unless set, a
        /// million where a team is outnumbered.
        schedule_steps_env: u64 = 200_000, Accepts::integer(1, EXACT);
        /// What both step sizes are multiplied by in the end.
        learning_rate_finish: f64 = 0.3, Accepts::above_within(0.0, 1.0);
        /// Times that a batch is gone through. Activations are computed anew each time, from the first step of each episode to the last.
        epochs: usize = 10, Accepts::integer(1, 1000);
        /// Parts into which an epoch cuts a batch, for each of which controllers and critic take one step. A part is one shard or
        /// more, so that there are no more parts than shards.
        minibatches: usize = 1, Accepts::integer(1, 4096);
        /// How far a group's ratio of probabilities may move from 1 before it gains nothing more. Where a ratio is that of the whole
        /// team, this is divided by the square root of the number of groups. Unless set, .1 where a team is outnumbered.
        clip: f64 = 0.2, Accepts::above_within(0.0, 1.0);
        /// How far a value may move within an update before its loss stops falling, in standard deviations of returns.
        value_clip: f64 = 0.2, Accepts::above(0.0);
        /// Errors of values beyond this count linearly, in standard deviations of returns.
        huber: f64 = 10.0, Accepts::above(0.0);
        /// Discount γ of one environment step.
        gamma: f64 = 0.99, Accepts::within(0.0, 1.0);
        /// λ of the generalised advantages: 0 looks one step ahead, 1 to the end of the episode.
        lambda: f64 = 0.9, Accepts::within(0.0, 1.0);
        /// Weight of the entropy of what each group does, over all ways to it, beside its normalised advantage, at the first
        /// environment step.
        entropy_weight: f64 = 0.02, Accepts::within(0.0, 1.0);
        /// The same in the end.
        entropy_weight_finish: f64 = 0.005, Accepts::within(0.0, 1.0);
        /// Longest gradient (Euclidean norm over all parameters of the policy, or of the critic); longer ones are shortened.
        gradient_norm_max: f64 = 10.0, Accepts::above(0.0);
        /// What the orthogonal initial weights of the controllers' last layers are multiplied by: small numbers make the first choices
        /// almost even.
        policy_gain: f64 = 0.01, Accepts::above_within(0.0, 100.0);
        /// Environments that run side by side; each gives one episode to an update.
        environments: usize = 16, Accepts::integer(1, 4096);
        /// Pieces into which the environments are cut for work in parallel; as many threads as this can be used. It decides the
        /// last bits of a result, which the number of threads does not.
        shards: usize = 2, Accepts::integer(1, 4096);
    }
}

declare_settings! {
    /// The hierarchy of MACKRL-PPO.
    pub struct MackrlPpoSettings {
        /// Which features of commonly known entities the controllers read: all of them, or those of the authors' code.
        common_knowledge: CommonKnowledgeFeatures = CommonKnowledgeFeatures::Complete, CommonKnowledgeFeatures::ACCEPTS;
        /// The levels of groups between the team and single agents: pairs, or fours that divide into pairs, among which controllers choose; for
        /// at most 8 agents, and the team is weighed as a whole.
        levels: Levels = Levels::Pairs, Levels::ACCEPTS;
        /// Which partitions into pairs there are, where the team divides into pairs. `round-robin` has one in force at a time, so that each group is weighed by itself;
        /// the others leave the choice to the pair selector and weigh the team as a whole.
        partitions: PartitionChoice = PartitionChoice::RoundRobin, PartitionChoice::ACCEPTS;
        /// Environment steps for which a partition of `round-robin` stays in force; 0 for the whole episode.
        hold_steps_env: u64 = 1, Accepts::integer(0, EXACT);
        /// How long a pair's controller remembers, under `round-robin`: as long as the pair is formed, or the whole episode.
        pair_memory: PairMemory = PairMemory::Formed, PairMemory::ACCEPTS;
        /// How a partition is chosen where there are several: the pair selector decides, or, as an ablation, all are equally likely.
        selector: Selection = Selection::Learned, Selection::ACCEPTS;
        /// When pairs delegate: their controllers decide, or, as ablations, always, or only where no joint action is commonly known.
        delegation: Delegation = Delegation::Learned, Delegation::ACCEPTS;
        /// Logit of delegating, of an untrained pair controller, above that of a joint action.
        delegation_logit: f64 = 3.0, Accepts::within(-1000.0, 1000.0);
        /// What is weighed by itself: pairs that commonly know a joint action and single agents, or all pairs that are formed.
        groups: Groups = Groups::Choosing, Groups::ACCEPTS;
        /// Weight of the private loss, which trains the agents' own controllers while their pairs act jointly, under `round-robin`: what they would learn
        /// if the pair had delegated. Without it they learn in proportion to delegation.
        private_weight: f64 = 0.0, Accepts::within(0.0, 100.0);
    }
}

impl PpoSettings {
    /// Adam with a larger ε than usual, so that small gradients make small steps.
    pub(super) const OPTIMISER: OptimiserKind = OptimiserKind::Adam {
        beta1: 0.9,
        beta2: 0.999,
        epsilon: 1e-5,
    };

    /// What step sizes are multiplied by after so many environment steps.
    #[must_use]
    pub fn learning_rate_factor(&self, steps_env: u64) -> f64 {
        1.0 + (self.learning_rate_finish - 1.0) * self.progress(steps_env)
    }

    /// The weight of the entropy after so many environment steps.
    #[must_use]
    pub fn entropy_weight_at(&self, steps_env: u64) -> f64 {
        let (start, finish) = (self.entropy_weight, self.entropy_weight_finish);
        start + (finish - start) * self.progress(steps_env)
    }

    fn progress(&self, steps_env: u64) -> f64 {
        (steps_env as f64 / self.schedule_steps_env as f64).min(1.0)
    }

    /// Smaller and slower steps for a team that is outnumbered: it wins only if it keeps trying for long, and does not have to win soon.
    pub(super) fn automatic(spec: &EnvironmentSpec) -> Vec<Automatic> {
        if spec.entities <= 2 * spec.agents {
            return Vec::new();
        }
        let why = "the team is outnumbered";
        let careful = |name, value| Automatic { name, value, why };
        vec![
            careful("schedule_steps_env", 1_000_000.into()),
            careful("clip", 0.1.into()),
        ]
    }

    /// Checks what a setting asks of others.
    pub(super) fn check(&self) -> Result<(), SettingsError> {
        if self.minibatches <= self.shards {
            return Ok(());
        }
        Err(SettingsError::AtOdds(Box::new([
            wrong(
                "minibatches",
                self.minibatches.to_string(),
                "as many as shards, or fewer",
            ),
            wrong(
                "shards",
                self.shards.to_string(),
                "as many as minibatches, or more",
            ),
        ])))
    }

    /// What makes a value wrong.
    pub(super) fn value_loss(&self) -> ValueLoss<f32> {
        use crate::Real;
        ValueLoss {
            clip: Real::from_f64(self.value_clip),
            huber: Real::from_f64(self.huber),
        }
    }
}

impl MackrlPpoSettings {
    /// Checks what settings ask of each other and of the team of `spec`.
    pub(super) fn check(&self, spec: &EnvironmentSpec) -> Result<(), SettingsError> {
        self.levels.check(self.partitions, spec)?;
        let [cause, found, needed] = match (self.levels, self.partitions) {
            (Levels::Pairs, PartitionChoice::RoundRobin) => return Ok(()),
            (Levels::Pairs, other) => ["partitions", &other.to_string(), "round-robin"],
            (Levels::Fours, _) => ["levels", self.levels.word(), "pairs"],
        };
        let hold = self.hold_steps_env.to_string();
        let private = format!("{:?}", self.private_weight);
        for [name, value, without] in [
            ["hold_steps_env", &hold, "1"],
            ["private_weight", &private, "0.0"],
        ] {
            if value == without {
                continue;
            }
            let kept = format!("{without}, unless algorithm.{cause} is \"{needed}\"");
            let changed = format!("\"{needed}\", unless algorithm.{name} is {without}");
            return Err(SettingsError::AtOdds(Box::new([
                wrong(name, value.to_owned(), &kept),
                wrong(cause, format!("\"{found}\""), &changed),
            ])));
        }
        Ok(())
    }

    /// The hierarchy of a team of N agents with A actions each; what is drawn by lot is drawn from `seed`.
    ///
    /// # Errors
    /// [`Error::Config`] if the team is too large for the partitions.
    pub(super) fn declaration(&self, team: [usize; 2], seed: u64) -> Result<Declaration, Error> {
        let how = (self.selector, self.delegation);
        let declaration = self.levels.declaration(self.partitions, how, team, seed)?;
        let declaration = declaration.with_delegation_logit(self.delegation_logit);
        if declaration.is_fixed() {
            return Ok(declaration);
        }
        let hold = usize::try_from(self.hold_steps_env).unwrap_or(usize::MAX);
        Ok(declaration.with_partitions_held(hold, self.pair_memory.into()))
    }
}

impl From<PairMemory> for Memory {
    fn from(memory: PairMemory) -> Self {
        match memory {
            PairMemory::Formed => Self::WhileFormed,
            PairMemory::Episode => Self::Episode,
        }
    }
}

fn wrong(name: &str, found: String, expected: &str) -> WrongSetting {
    WrongSetting {
        name: name.to_owned(),
        found,
        expected: expected.to_owned(),
        nearest: None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn spec(agents: usize) -> EnvironmentSpec {
        EnvironmentSpec {
            name: "some".to_owned(),
            agents,
            entities: 2 * agents,
            entity_features: 3,
            position_features: 2,
            actions: 5,
            observation_size: 8,
            state_size: 16,
            episode_limit: 20,
            distance_scale: 1.0,
            statistics: Vec::new(),
            success: None,
        }
    }

    #[test]
    fn what_has_a_schedule_changes_linearly_and_then_stays() {
        let settings = PpoSettings {
            learning_rate_finish: 0.2,
            entropy_weight: 0.03,
            entropy_weight_finish: 0.01,
            schedule_steps_env: 1000,
            ..PpoSettings::default()
        };
        for (steps, expected) in [(0, 1.0), (500, 0.6), (1000, 0.2), (10_000, 0.2)] {
            let found = settings.learning_rate_factor(steps);
            assert!((found - expected).abs() < 1e-12, "{steps}: {found}");
        }
        assert!((settings.entropy_weight_at(500) - 0.02).abs() < 1e-12);
    }

    #[test]
    fn teams_that_are_outnumbered_take_smaller_and_slower_steps() {
        assert_eq!(PpoSettings::automatic(&spec(5)), []);
        let outnumbered = EnvironmentSpec {
            entities: 11,
            ..spec(5)
        };
        let careful = PpoSettings::automatic(&outnumbered);
        let values = careful
            .iter()
            .map(|setting| (setting.name, setting.value.clone()));
        let expected = [
            ("schedule_steps_env", 1_000_000.into()),
            ("clip", 0.1.into()),
        ];
        assert_eq!(values.collect::<Vec<_>>(), expected);
    }

    #[test]
    fn there_are_no_more_minibatches_than_shards() {
        let cut = |minibatches, shards| PpoSettings {
            minibatches,
            shards,
            ..PpoSettings::default()
        };
        assert!(cut(3, 4).check().is_ok());
        assert!(cut(4, 4).check().is_ok());
        assert!(cut(5, 4).check().is_err());
    }

    #[test]
    fn what_needs_partitions_that_take_turns_is_refused_without_them() {
        let held = MackrlPpoSettings {
            hold_steps_env: 5,
            ..MackrlPpoSettings::default()
        };
        let apart = MackrlPpoSettings {
            private_weight: 0.5,
            ..MackrlPpoSettings::default()
        };
        for (settings, name) in [(held, "hold_steps_env"), (apart, "private_weight")] {
            assert!(settings.check(&spec(3)).is_ok());
            let all = MackrlPpoSettings {
                partitions: PartitionChoice::All,
                ..settings
            };
            let fours = MackrlPpoSettings {
                levels: Levels::Fours,
                ..settings
            };
            for (settings, cause) in [(all, "partitions"), (fours, "levels")] {
                let Err(SettingsError::AtOdds(both)) = settings.check(&spec(3)) else {
                    panic!("{name} with {cause} is accepted");
                };
                assert_eq!(both.map(|wrong| wrong.name), [name, cause]);
            }
        }
    }

    #[test]
    fn only_small_teams_divide_into_fours() {
        let fours = MackrlPpoSettings {
            levels: Levels::Fours,
            ..MackrlPpoSettings::default()
        };
        for (agents, fits) in [(8, true), (9, false)] {
            assert_eq!(fours.check(&spec(agents)).is_ok(), fits, "{agents}");
        }
    }
}
