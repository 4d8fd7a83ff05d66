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

#[cfg(test)]
mod tests {
    use mackrl_env::{
        EpisodeKey, Stream,
        matrix_game::{ACTIONS, MatrixGameKind, MatrixGameSettings},
    };

    use super::*;
    use crate::{
        algorithms::groupwise::{Counterfactual, GroupwiseSettings},
        common_knowledge::CommonKnowledgeFeatures,
        experience::{Collector, PlaySettings},
        hierarchy::Weighing,
        partition::PartitionSchedule,
        policy::{Behaviour, Declaration, Delegation, Parameters, Policy, Recording, Selection},
    };

    /// On the matrix game with common knowledge both agents are one pair at every step.
    #[test]
    fn a_pairs_row_has_both_members_the_state_and_the_column_of_what_they_did() {
        let game = MatrixGameSettings {
            common_knowledge: 1.0,
            ..MatrixGameSettings::default()
        };
        let world = MatrixGameKind::world(game).unwrap();
        let (environment, spec) = (world.make(), world.spec());
        let prior = environment.prior_knowledge();
        let team = crate::algorithms::Team {
            spec,
            prior: &prior,
            seed: 1,
            threads: 1,
        };
        let declaration = Declaration::pairwise(
            [2, ACTIONS],
            PartitionSchedule::RoundRobin,
            Selection::Learned,
            Delegation::Learned,
            1,
        );
        let settings = GroupwiseSettings::default();
        let features = CommonKnowledgeFeatures::Complete;
        let hierarchy = team.hierarchy(declaration.unwrap(), features, settings.hidden);
        let parameters = Parameters::new(hierarchy.initialise(1));
        let environments = (0..9).map(|_| world.make()).collect();
        let mut collector = Collector::new(&hierarchy, environments, 1, 1);
        let keys: Vec<EpisodeKey> = (0..9)
            .map(|episode| EpisodeKey::new(1, Stream::Training, episode))
            .collect();
        let play = PlaySettings {
            behaviour: Behaviour::sampled(0.5),
            recording: Recording::ForLearning,
        };
        collector.play(&parameters, &keys, play).unwrap();
        let batch: Vec<&mut Piece> = collector.pieces().collect();
        let experience = &batch[0].experience;
        let episodes: Vec<&Episode> = experience.episodes.iter().collect();

        let mut members = MemberRows::default();
        let own = settings.critic::<Counterfactual>(spec);
        let bank = hierarchy.declaration().alone();
        read_members::<Counterfactual>(&mut members, spec, &own, (&batch, bank), &episodes);
        let mut choices = Choices {
            factors: hierarchy.factors(experience, Weighing::Choosing),
            ..Choices::default()
        };
        choices.place(&members, 2);
        let targets: Vec<f32> = (0..18_u8).map(f32::from).collect();
        let (mut rows, mut target_r) = (ChoiceRows::default(), Vec::new());
        let critic = settings.pair_critic::<Counterfactual>(spec);
        read_pairs::<Counterfactual>(
            (&mut rows, &mut target_r),
            (&members, &targets),
            spec,
            &critic,
            std::iter::once(&mut choices),
            &episodes,
        );
        assert_eq!((rows.len(), choices.row_i.len()), (9, 9), "a pair each");
        let reads = spec.observation_size + 2 + ACTIONS;
        let mut columns = std::collections::BTreeSet::new();
        for (factor, &row) in choices.factors.iter().zip(&choices.row_i) {
            let b = factor.episode;
            let [first, second] = [0, 1].map(|agent| episodes[b].actions(0)[agent].index());
            assert_eq!(rows.column_r[row], ACTIONS * first + second);
            columns.insert(rows.column_r[row]);
            let own = [0, 1].map(|member| members.row([b, 0], member, 2));
            assert_eq!(target_r[row], (targets[own[0]] + targets[own[1]]) / 2.0);
            let input = &rows.input_rf[row * critic.inputs..(row + 1) * critic.inputs];
            let width = reads + spec.state_size + 2 * ACTIONS;
            for (place, member) in own.into_iter().enumerate() {
                let read = &members.rows.input_rf[member * width..][..reads];
                assert_eq!(read[spec.observation_size + place], 1.0, "identity");
                assert_eq!(&input[place * reads..(place + 1) * reads], read);
            }
            let (state, others) = input[2 * reads..].split_at(spec.state_size);
            assert_eq!(state, episodes[b].state(0));
            assert!(others.iter().all(|&action| action == 0.0), "nobody else");
        }
        assert!(columns.len() > 4, "hardly any joint action: {columns:?}");
    }
}
