//! The matrix game on the environment contract.
//!
//! Three entities: the two agents, left and right, and the matrix between them. Features are the position, two flags of an
//! agent, `lit` (the common-knowledge bit: the light is on, and everybody sees that it is) and `attentive` (it sees the
//! matrix), and the matrix's identity, one-hot. An agent sees the other one when it is lit itself, and the matrix when it is
//! attentive. With the bit off nobody sees anybody, so Lemma 1 gives exactly the common knowledge of the game: everything
//! when the bit is on, nothing when it is off. That both may privately see the matrix does not make it common knowledge.

use std::sync::Arc;

use super::{
    ACTIONS, AGENTS, DealtCards, InvalidProbability, MATRIX_GAME, Matrix, Observation,
    ObservationDistribution, Payoffs, payoff, payoff_text,
};
use crate::{
    Action, AgentId, Draw, EntityId, EntitySet, Environment, EnvironmentSpec, EpisodeEnd,
    EpisodeKey, IllegalAction, KnownEntities, ObservationMut, PriorKnowledge, Prototype, Statistic,
    StepError, TimeStep, World, WorldError, WorldKind, declare_settings,
    settings::{Accepts, Setting, Settings, SettingsError},
};

const ENTITIES: usize = AGENTS + 1;
const MATRIX: usize = AGENTS;
const FEATURES: usize = 6;
const LIT: usize = 2;
const ATTENTIVE: usize = 3;
const IDENTITY: usize = 4;

declare_settings! {
    /// What can be chosen about the game: the published figure's game, in the middle of its axis, unless set.
    #[derive(Copy)]
    pub struct MatrixGameSettings {
        /// Which pair of matrices is played: that of the published code, or the one printed in the paper.
        payoffs: Payoffs = Payoffs::Coded, Payoffs::ACCEPTS;
        /// How often agents see the matrix: as in the 2018 paper, or as in the NeurIPS version.
        distribution: ObservationDistribution = ObservationDistribution::Y2018, ObservationDistribution::ACCEPTS;
        /// p, the probability on the horizontal axis of Figure 5.
        common_knowledge: f64 = 0.5, Accepts::within(0.0, 1.0);
    }
}

/// The matrix game as a world of one step.
///
/// Observations are one-hot over [`Observation`]. The state is the matrix, one-hot, then both observations. An episode
/// succeeds if the team earned 1, the best payoff.
#[derive(Debug, Clone)]
pub struct MatrixGame {
    settings: MatrixGameSettings,
    spec: EnvironmentSpec,
    cards: DealtCards,
    won: bool,
}

impl MatrixGame {
    /// Builds the game.
    ///
    /// # Errors
    /// If the probability of common knowledge is not in [0, 1].
    pub fn new(settings: MatrixGameSettings) -> Result<Self, InvalidProbability> {
        let p = settings.common_knowledge;
        if !(0.0..=1.0).contains(&p) {
            return Err(InvalidProbability(p));
        }
        Ok(Self {
            settings,
            spec: EnvironmentSpec {
                name: MATRIX_GAME.into(),
                agents: AGENTS,
                entities: ENTITIES,
                entity_features: FEATURES,
                position_features: 2,
                actions: ACTIONS,
                observation_size: Observation::COUNT,
                state_size: Matrix::ALL.len() + AGENTS * Observation::COUNT,
                episode_limit: 1,
                distance_scale: 1.0,
                statistics: vec![Statistic::new(
                    "best_payoff",
                    "1 if the team earned 1, the best payoff, else 0",
                )],
                success: Some(0),
            },
            cards: DealtCards {
                bit: false,
                matrix: Matrix::A,
                sees_matrix: [false; AGENTS],
            },
            won: false,
        })
    }

    /// What was dealt in this episode.
    #[must_use]
    pub const fn cards(&self) -> DealtCards {
        self.cards
    }

    fn observe(&self, out: &mut ObservationMut<'_>) {
        let matrix = self.cards.matrix.index();
        out.observation_no.fill(0.0);
        out.state_g.fill(0.0);
        out.available_na.fill(true);
        out.entity_mf.fill(0.0);
        out.state_g[matrix] = 1.0;
        for agent in 0..AGENTS {
            let seen = self.cards.observation(agent).index();
            out.observation_no[agent * Observation::COUNT + seen] = 1.0;
            out.state_g[Matrix::ALL.len() + agent * Observation::COUNT + seen] = 1.0;
            let features_f = &mut out.entity_mf[agent * FEATURES..][..FEATURES];
            features_f[0] = [-1.0, 1.0][agent];
            features_f[LIT] = flag(self.cards.bit);
            features_f[ATTENTIVE] = flag(self.cards.sees_matrix[agent]);
        }
        out.entity_mf[MATRIX * FEATURES + IDENTITY + matrix] = 1.0;
        for agent in 0..AGENTS {
            out.visible_n[agent] = self.seen_by(agent);
        }
    }

    fn seen_by(&self, agent: usize) -> EntitySet {
        let mut seen = EntitySet::EMPTY;
        seen.insert(EntityId::new(agent));
        if self.cards.bit {
            seen = seen.union(EntitySet::first(AGENTS));
        }
        if self.cards.sees_matrix[agent] {
            seen.insert(EntityId::new(MATRIX));
        }
        seen
    }
}

impl Environment for MatrixGame {
    fn spec(&self) -> &EnvironmentSpec {
        &self.spec
    }

    fn prior_knowledge(&self) -> Arc<dyn PriorKnowledge> {
        Arc::new(Rules)
    }

    fn reset(&mut self, key: EpisodeKey, out: &mut ObservationMut<'_>) {
        let [bit, matrix, first, second] = [0, 1, 2, 3].map(|i| key.uniform(0, Draw::World(i)));
        let p = self.settings.common_knowledge;
        let distribution = self.settings.distribution;
        self.cards = distribution.deal(p, bit, matrix, [first, second]);
        self.won = false;
        self.observe(out);
    }

    fn step(
        &mut self,
        actions: &[Action],
        out: &mut ObservationMut<'_>,
    ) -> Result<TimeStep, StepError> {
        let &[first, second] = actions else {
            panic!("{} actions for {AGENTS} agents", actions.len());
        };
        for (agent, action) in [first, second].into_iter().enumerate() {
            if action.index() >= ACTIONS {
                let agent = AgentId::new(agent);
                return Err(IllegalAction { agent, action }.into());
            }
        }
        let (payoffs, matrix) = (self.settings.payoffs, self.cards.matrix);
        let reward = payoff(payoffs, matrix, first.index(), second.index());
        self.won = reward == 1.0;
        self.observe(out);
        Ok(TimeStep {
            reward: to_f32(reward),
            end: Some(EpisodeEnd::Terminated),
        })
    }

    fn statistics(&self, statistics_s: &mut [f64]) {
        statistics_s[0] = f64::from(u8::from(self.won));
    }

    /// Gives the other agent other luck, and this one another matrix if it does not see the matrix.
    fn alter_unseen(
        &mut self,
        agent: AgentId,
        _key: EpisodeKey,
        out: &mut ObservationMut<'_>,
    ) -> bool {
        if self.cards.bit {
            return false;
        }
        let other = 1 - agent.index();
        self.cards.sees_matrix[other] = !self.cards.sees_matrix[other];
        if !self.cards.sees_matrix[agent.index()] {
            self.cards.matrix = match self.cards.matrix {
                Matrix::A => Matrix::B,
                Matrix::B => Matrix::A,
            };
        }
        self.observe(out);
        true
    }
}

/// Matrix games as a kind of world.
#[derive(Debug, Clone, Copy, Default)]
pub struct MatrixGameKind;

impl MatrixGameKind {
    /// The world of these settings.
    ///
    /// # Errors
    /// [`WorldError`] if the probability of common knowledge is not in [0, 1].
    pub fn world(settings: MatrixGameSettings) -> Result<Arc<dyn World>, WorldError> {
        if let Some(violation) = settings.violation() {
            return Err(SettingsError::from(violation).into());
        }
        let game = MatrixGame::new(settings)
            .map_err(|error| WorldError::Unavailable(error.to_string()))?;
        let world = Prototype::new(MATRIX_GAME, game)?.data(payoff_text(settings.payoffs));
        Ok(Arc::new(world))
    }
}

impl WorldKind for MatrixGameKind {
    fn name(&self) -> &str {
        MATRIX_GAME
    }

    fn summary(&self) -> &str {
        "the paper's game of one step: two agents, five actions, two payoff matrices"
    }

    fn settings(&self) -> Vec<Setting> {
        MatrixGameSettings::DECLARED.to_vec()
    }

    fn defaults(&self) -> toml::Table {
        MatrixGameSettings::defaults()
    }

    fn build(&self, table: &toml::Table) -> Result<Arc<dyn World>, WorldError> {
        Self::world(MatrixGameSettings::read(table)?)
    }
}

/// The rules, which everybody knows.
#[derive(Debug)]
struct Rules;

impl PriorKnowledge for Rules {
    fn sees(
        &self,
        observer: AgentId,
        observer_f: &[f32],
        entity: EntityId,
        _entity_f: &[f32],
    ) -> bool {
        if entity.index() == MATRIX {
            observer_f[ATTENTIVE] > 0.5
        } else {
            entity == observer.into() || observer_f[LIT] > 0.5
        }
    }

    fn available(&self, known: KnownEntities<'_>, agent: AgentId, available_a: &mut [bool]) {
        available_a.fill(known.set().contains(agent));
    }

    fn action_on(&self, _entity: EntityId) -> Option<Action> {
        None
    }
}

fn flag(set: bool) -> f32 {
    f32::from(u8::from(set))
}

#[expect(
    clippy::cast_possible_truncation,
    reason = "rounding a payoff to the nearest f32 is what is asked for"
)]
const fn to_f32(value: f64) -> f32 {
    value as f32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{Observations, Stream, contract::check_environment};

    fn game(distribution: ObservationDistribution, common_knowledge: f64) -> MatrixGame {
        MatrixGame::new(MatrixGameSettings {
            payoffs: Payoffs::Printed,
            distribution,
            common_knowledge,
        })
        .unwrap()
    }

    #[test]
    fn its_worlds_are_configured_by_a_table() {
        let table = "common_knowledge = 1.0\npayoffs = \"printed\"".parse();
        let world = MatrixGameKind.build(&table.unwrap()).unwrap();
        assert_eq!((world.kind(), world.name()), (MATRIX_GAME, MATRIX_GAME));
        assert_eq!(world.data(), payoff_text(Payoffs::Printed));
        let mut environment = world.make();
        let mut observations = Observations::new(world.spec(), 1);
        let key = EpisodeKey::new(1, Stream::Other, 0);
        environment.reset(key, &mut observations.row_mut(0));
        assert_eq!(observations.visible(0), [EntitySet::first(ENTITIES); 2]);
        let wrong = "common_knowledge = 1.5".parse().unwrap();
        let error = MatrixGameKind.build(&wrong).unwrap_err();
        assert_eq!(
            error.to_string(),
            "setting `common_knowledge` is 1.5, expected a number in [0, 1]"
        );
    }

    fn best_payoff(game: &MatrixGame) -> f64 {
        let mut statistics_s = [f64::NAN];
        game.statistics(&mut statistics_s);
        statistics_s[0]
    }

    /// Deals `episodes` games and hands each to `check`.
    fn deal(
        mut game: MatrixGame,
        episodes: u64,
        mut check: impl FnMut(&MatrixGame, &Observations),
    ) {
        let mut observations = Observations::new(game.spec(), 1);
        for episode in 0..episodes {
            let key = EpisodeKey::new(5, Stream::Other, episode);
            game.reset(key, &mut observations.row_mut(0));
            check(&game, &observations);
        }
    }

    #[test]
    fn it_keeps_the_contract() {
        for distribution in [
            ObservationDistribution::Y2018,
            ObservationDistribution::NeurIps2019,
        ] {
            for p in [0.0, 0.5, 1.0] {
                let coverage = check_environment(&mut game(distribution, p), 40);
                let is_all_common = p == 1.0 && distribution == ObservationDistribution::Y2018;
                assert_eq!(
                    coverage.alterations == 0,
                    is_all_common,
                    "{p}: {coverage:?}"
                );
            }
        }
    }

    #[test]
    fn the_agents_see_each_other_and_the_matrix_exactly_when_the_bit_is_on() {
        let mut both_see_privately = 0;
        deal(
            game(ObservationDistribution::Y2018, 0.4),
            200,
            |game, observations| {
                let [first, second] = *observations.visible(0) else {
                    panic!("two agents");
                };
                if game.cards().bit {
                    assert_eq!([first, second], [EntitySet::first(ENTITIES); 2]);
                } else {
                    assert!(
                        !first.contains(AgentId::new(1)),
                        "the first agent sees in the dark"
                    );
                    assert!(
                        !second.contains(AgentId::new(0)),
                        "the second agent sees in the dark"
                    );
                    both_see_privately += usize::from(game.cards().sees_matrix == [true; 2]);
                }
            },
        );
        assert!(
            both_see_privately > 0,
            "the case that matters never came up"
        );
    }

    #[test]
    fn deals_are_as_frequent_as_their_probabilities() {
        let (distribution, p, episodes) = (ObservationDistribution::NeurIps2019, 0.6, 20_000);
        let mut dealt = Vec::new();
        deal(game(distribution, p), episodes, |game, _| {
            dealt.push(game.cards());
        });
        for expected in distribution.deals(p).unwrap() {
            let count = dealt
                .iter()
                .filter(|cards| **cards == expected.cards)
                .count();
            let frequency = count as f64 / episodes as f64;
            // Five standard deviations of a frequency among 20 000 are below 0.018.
            assert!(
                (frequency - expected.probability).abs() < 0.018,
                "{expected:?} came up with frequency {frequency}"
            );
        }
    }

    #[test]
    fn the_reward_is_the_payoff_and_an_unknown_action_is_refused() {
        let mut game = game(ObservationDistribution::Y2018, 1.0);
        let mut observations = Observations::new(game.spec(), 1);
        game.reset(
            EpisodeKey::new(1, Stream::Other, 0),
            &mut observations.row_mut(0),
        );
        let refused = game.step(&[0, 5].map(Action::new), &mut observations.row_mut(0));
        let expected = IllegalAction {
            agent: AgentId::new(1),
            action: Action::new(5),
        };
        assert_eq!(refused.unwrap_err(), expected.into());
        assert_eq!(best_payoff(&game), 0.0);
        let best = match game.cards().matrix {
            Matrix::A => [4, 4],
            Matrix::B => [4, 0],
        };
        let step = game
            .step(&best.map(Action::new), &mut observations.row_mut(0))
            .unwrap();
        assert_eq!((step.reward, step.end), (1.0, Some(EpisodeEnd::Terminated)));
        assert_eq!(best_payoff(&game), 1.0);
    }
}
