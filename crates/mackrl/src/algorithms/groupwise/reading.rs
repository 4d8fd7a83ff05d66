//! What critics read of a batch, and which row is that of which group's choice.

use mackrl_env::EnvironmentSpec;

use super::Judge;
use crate::{
    critics::{ChoiceCriticSettings, ChoiceRows, MemberCriticSettings, MemberRows},
    experience::{Episode, Piece},
    hierarchy::Factor,
};

/// The choices of one piece's groups.
#[derive(Debug, Default)]
pub(super) struct Choices {
    /// Number of the piece's first episode in the batch.
    pub(super) first: usize,
    /// The groups.
    pub(super) factors: Vec<Factor>,
    /// For each group the row of its choice: an agent's among those of members, a pair's among those of pairs.
    pub(super) row_i: Vec<usize>,
}

impl Choices {
    /// Finds the rows of agents.
    pub(super) fn place(&mut self, rows: &MemberRows, members: usize) {
        let (first, factors) = (self.first, self.factors.iter());
        let row = |factor: &Factor| {
            rows.row([first + factor.episode, factor.step], factor.first, members)
        };
        self.row_i.clear();
        self.row_i.extend(factors.map(row));
    }
}

/// Writes what the critic of members reads: what living agents read, everybody's identity, and what the judge adds. `bank` is the bank
/// of agents.
pub(super) fn read_members<J: Judge>(
    rows: &mut MemberRows,
    spec: &EnvironmentSpec,
    settings: &MemberCriticSettings,
    (batch, bank): (&[&mut Piece], usize),
    episodes: &[&Episode],
) {
    let (agents, observation_size) = (spec.agents, spec.observation_size);
    let inputs = settings.choices.inputs;
    let own = inputs - J::inputs(spec);
    rows.begin(episodes, settings);
    for (b, episode) in episodes.iter().enumerate() {
        for t in 0..episode.steps() {
            for member in 0..agents {
                let row = rows.row([b, t], member, agents);
                let input = &mut rows.rows.input_rf[row * inputs..(row + 1) * inputs];
                input[observation_size + member] = 1.0;
                J::write(spec, episode, t, &[member], &mut input[own..]);
                if settings.choices.outputs > 1 {
                    rows.rows.column_r[row] = episode.actions(t)[member].index();
                }
            }
        }
    }
    let mut first = 0;
    for piece in batch {
        let bank = &piece.experience.banks[bank];
        for (t, step) in bank.steps().iter().enumerate() {
            let read = bank.inputs_of(step).chunks_exact(own);
            for (instance, read) in bank.instances_of(step).iter().zip(read) {
                let place = [first + instance.environment, t];
                let row = rows.row(place, instance.group, agents);
                rows.rows.input_rf[row * inputs..][..own].copy_from_slice(read);
            }
        }
        first += piece.experience.episodes.len();
    }
}

/// Writes what the critic of pairs reads: what both members read, and what the judge adds. Of `choices`, the rows of pairs become
/// those among pairs; `target_r` becomes what they are to be worth: the mean of what their members' are.
pub(super) fn read_pairs<'a, J: Judge>(
    (rows, target_r): (&mut ChoiceRows, &mut Vec<f32>),
    (members, member_target_r): (&MemberRows, &[f32]),
    spec: &EnvironmentSpec,
    settings: &ChoiceCriticSettings,
    choices: impl Iterator<Item = &'a mut Choices>,
    episodes: &[&Episode],
) {
    let choices: Vec<&mut Choices> = choices.collect();
    let longest = episodes.iter().map(|episode| episode.steps()).max();
    let mut count_t = vec![0; longest.unwrap_or(0)];
    let factors = choices.iter().flat_map(|own| &own.factors);
    for factor in factors.filter(|factor| factor.second.is_some()) {
        count_t[factor.step] += 1;
    }
    let inputs = settings.inputs;
    rows.begin(count_t.iter().copied(), inputs);
    target_r.clear();
    target_r.resize(rows.len(), 0.0);
    let mut next_t: Vec<usize> = (0..count_t.len()).map(|t| rows.first(t)).collect();
    let added = J::inputs(spec);
    let own = (inputs - added) / 2;
    for Choices {
        first,
        factors,
        row_i,
    } in choices
    {
        for (factor, row) in factors.iter().zip(row_i) {
            let Some(second) = factor.second else {
                continue;
            };
            let (b, t) = (*first + factor.episode, factor.step);
            let pair = [factor.first, second];
            *row = next_t[t];
            next_t[t] += 1;
            let input = &mut rows.input_rf[*row * inputs..(*row + 1) * inputs];
            for (place, member) in pair.into_iter().enumerate() {
                let member = members.row([b, t], member, spec.agents);
                let read = &members.rows.input_rf[member * (own + added)..][..own];
                input[place * own..(place + 1) * own].copy_from_slice(read);
                target_r[*row] += 0.5 * member_target_r[member];
            }
            J::write(spec, episodes[b], t, &pair, &mut input[2 * own..]);
            let [a, b] = pair.map(|member| episodes[b].actions(t)[member].index());
            rows.column_r[*row] = a * spec.actions + b;
        }
    }
}
