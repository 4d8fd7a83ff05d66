//! What a step pays.

use crate::{
    rules::BattleState,
    settings::{Compatibility, SkirmishSettings},
};

/// How the battle stands after a step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Outcome {
    /// It goes on.
    Undecided,
    /// The agents have won.
    Won,
    /// The agents are dead and enemies are not.
    Lost,
    /// Nobody is left.
    BothDead,
}

/// Computes rewards from what life and shields were before a step and are after it.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Rewards {
    agents: usize,
    /// The greatest return before scaling.
    greatest: f32,
    /// What raw rewards are divided by.
    scale: f32,
    /// Life and shield of every unit before the step; 0 if dead.
    before: Vec<f32>,
}

impl Rewards {
    /// For a battle that starts in `state`, of which the first `agents` units are agents.
    pub(super) fn new(state: &BattleState, agents: usize, settings: &SkirmishSettings) -> Self {
        let enemies = &state.units[agents..];
        let toughness: f32 = enemies.iter().map(|unit| unit.life + unit.shield).sum();
        let greatest =
            toughness + settings.reward_death_value * enemies.len() as f32 + settings.reward_win;
        let mut rewards = Self {
            agents,
            greatest,
            scale: if settings.reward_scale {
                greatest / settings.reward_scale_rate
            } else {
                1.0
            },
            before: vec![0.0; state.units.len()],
        };
        rewards.remember(state);
        rewards
    }

    /// The greatest return before scaling.
    pub(super) const fn greatest(&self) -> f32 {
        self.greatest
    }

    /// Takes `state` as the one before the next step.
    pub(super) fn remember(&mut self, state: &BattleState) {
        for (before, unit) in self.before.iter_mut().zip(&state.units) {
            *before = if unit.is_alive() {
                unit.life + unit.shield
            } else {
                0.0
            };
        }
    }

    /// The reward of the step from the remembered state to `after`, which is remembered in turn.
    pub(super) fn settle(
        &mut self,
        after: &BattleState,
        outcome: Outcome,
        settings: &SkirmishSettings,
    ) -> f32 {
        let raw = if settings.reward_sparse {
            match outcome {
                Outcome::Won => 1.0,
                Outcome::Lost => -1.0,
                Outcome::Undecided | Outcome::BothDead => 0.0,
            }
        } else {
            self.of_battle(after, settings)
                + match outcome {
                    Outcome::Won => settings.reward_win,
                    Outcome::Lost => settings.reward_defeat,
                    Outcome::Undecided | Outcome::BothDead => 0.0,
                }
        };
        self.remember(after);
        raw / self.scale
    }

    /// Damage to enemies D (negative if they regenerate more) and 10 for each kill K: |D + K| as SMAC has it, max(D + K, 0)
    /// if clean, and D + K less half the team's own losses if these count.
    fn of_battle(&self, after: &BattleState, settings: &SkirmishSettings) -> f32 {
        let (damage, deaths) = self.losses(after, self.agents..after.units.len());
        let gain = damage + settings.reward_death_value * deaths;
        if settings.reward_only_positive {
            return match settings.compat {
                Compatibility::Smac => gain.abs(),
                Compatibility::Clean => gain.max(0.0),
            };
        }
        let (own_damage, own_deaths) = self.losses(after, 0..self.agents);
        let loss = own_damage + settings.reward_death_value * own_deaths;
        gain - settings.reward_negative_scale * loss
    }

    /// What the units of a range lost in life and shield, and how many died.
    fn losses(&self, after: &BattleState, range: std::ops::Range<usize>) -> (f32, f32) {
        let mut damage = 0.0;
        let mut deaths = 0.0;
        for (before, unit) in self.before[range.clone()].iter().zip(&after.units[range]) {
            if *before <= 0.0 {
                continue;
            }
            if unit.is_alive() {
                damage += before - (unit.life + unit.shield);
            } else {
                damage += before;
                deaths += 1.0;
            }
        }
        (damage, deaths)
    }
}
