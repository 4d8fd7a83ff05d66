//! Learning group by group: where one division of the team is in force at a step, p(u) is the product of its groups' marginals
//! `q_g(u_g)`, and each can be weighed by itself.
//!
//! A group is what can choose for itself: a pair that commonly knows a joint action, or an agent. A pair that can only divide is
//! two agents that choose independently. So a hierarchy in which pairs never act jointly has the factors of one without pairs.
//!
//! An epoch of learning costs the networks and little more: tables, walks and posteriors over partitions are not needed here.

use super::{
    Hierarchy, Parts,
    activations::{Activations, BankActivations},
};
use crate::{
    Error,
    experience::{Experience, Instance, Piece},
    marginalisation::pair::{PairGradient, PairRows, gradient_alone},
    nn::elementary::exponentials,
    policy::{Parameters, Reads, Recording, TEAM},
};

/// No row.
const NONE: usize = usize::MAX;

/// The level of pairs, where there is one.
const PAIRS: usize = 1;

/// The choice of one group at one step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Factor {
    /// b: the episode.
    pub episode: usize,
    /// t: the step.
    pub step: usize,
    /// Its first member, or the only one.
    pub first: usize,
    /// Its second member, if it is a pair.
    pub second: Option<usize>,
    /// The pair's row among all that were asked.
    pair_row: usize,
    /// The members' rows among all that were asked.
    rows: [usize; 2],
    /// What they did.
    actions: [usize; 2],
}

/// Which pairs are weighed as one, though they can only divide.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Weighing {
    /// None: a pair that can only divide is two agents.
    #[default]
    Choosing,
    /// All that are formed of living agents.
    Formed,
}

/// What some choices add to a loss: `Σ_i d_log_q_i log q_i`, and their entropy.
#[derive(Debug, Clone, Copy)]
pub struct FactorTerm<'a> {
    /// The choices.
    pub factors: &'a [Factor],
    /// The derivative of the loss with respect to the log q of each.
    pub d_log_q_i: &'a [f32],
    /// The derivative of the loss with respect to `Σ_i H(q_i)`; none where the entropy is not asked for.
    pub entropy_weight: Option<f32>,
}

/// Rows of the networks to go through again: the numbers between passes, kept to save allocation.
#[derive(Debug, Clone, Default)]
pub struct FactorWorkspace {
    log_q: Vec<f32>,
    pair: Vec<f32>,
    first: Vec<f32>,
    second: Vec<f32>,
}

impl Factor {
    /// The members.
    pub fn members(&self) -> impl Iterator<Item = usize> {
        [Some(self.first), self.second].into_iter().flatten()
    }

    /// What each member of a pair did, as if it had been alone.
    #[must_use]
    pub fn apart(&self) -> Option<[Self; 2]> {
        let second = self.second?;
        Some([0, 1].map(|place| Self {
            first: [self.first, second][place],
            second: None,
            pair_row: NONE,
            rows: [self.rows[place], NONE],
            actions: [self.actions[place], 0],
            ..*self
        }))
    }
}

impl Hierarchy {
    /// Whether one division of the team is in force at every step, into pairs and agents.
    #[must_use]
    pub fn factorises(&self) -> bool {
        let declaration = &self.parts.declaration;
        let levels = declaration.levels();
        let alone = levels[declaration.alone()].reads == Reads::OwnObservation;
        levels[TEAM].divisions == 1 && alone && (levels.len() == 2 || declaration.is_pairwise())
    }

    /// The choices of an experience, group by group, of living agents.
    ///
    /// # Panics
    /// If the hierarchy does not [factorise](Self::factorises), or the experience is not one of its own.
    #[must_use]
    pub fn factors(&self, experience: &Experience, weighing: Weighing) -> Vec<Factor> {
        assert!(self.factorises(), "one division at a time");
        let parts = &*self.parts;
        let declaration = &parts.declaration;
        let agents = declaration.agents();
        let alone = declaration.alone();
        let bank = &experience.banks[alone];
        let mut factors = Vec::with_capacity(bank.steps().len() * agents);
        let mut row_bn = vec![NONE; experience.episodes.len() * agents];
        for (t, step) in bank.steps().iter().enumerate() {
            row_bn.fill(NONE);
            for (place, &row) in bank.asked_of(step).iter().enumerate() {
                let Instance { environment, group } = bank.instances_of(step)[row];
                row_bn[environment * agents + group] = step.asked.start + place;
            }
            let action = |b: usize, agent: usize| experience.episodes[b].actions(t)[agent].index();
            if parts.banks[PAIRS].is_some() && alone != PAIRS {
                let pairs = &experience.banks[PAIRS];
                let step = &pairs.steps()[t];
                let masks = pairs.masks_of(step).chunks_exact(pairs.columns());
                for ((place, &row), mask) in pairs.asked_of(step).iter().enumerate().zip(masks) {
                    let Instance { environment, group } = pairs.instances_of(step)[row];
                    let members = &declaration.levels()[PAIRS].groups[group];
                    let [first, second] = [members[0].index(), members[1].index()];
                    let places = [first, second].map(|agent| environment * agents + agent);
                    let rows = places.map(|place| row_bn[place]);
                    let chooses = weighing == Weighing::Formed || mask[1..].contains(&true);
                    if !chooses || rows.contains(&NONE) {
                        continue;
                    }
                    places.into_iter().for_each(|place| row_bn[place] = NONE);
                    factors.push(Factor {
                        episode: environment,
                        step: t,
                        first,
                        second: Some(second),
                        pair_row: step.asked.start + place,
                        rows,
                        actions: [first, second].map(|agent| action(environment, agent)),
                    });
                }
            }
            for (place, &row) in row_bn.iter().enumerate() {
                if row == NONE {
                    continue;
                }
                let (episode, agent) = (place / agents, place % agents);
                factors.push(Factor {
                    episode,
                    step: t,
                    first: agent,
                    second: None,
                    pair_row: NONE,
                    rows: [row, NONE],
                    actions: [action(episode, agent), 0],
                });
            }
        }
        factors
    }

    /// The piece's experience and its activations under `parameters`: those that its actor kept, if they serve, else computed
    /// again without the marginal of the whole team.
    ///
    /// # Errors
    /// [`Error::Data`] if another kind of policy played it.
    pub fn networks<'a>(
        &self,
        parameters: &Parameters,
        piece: &'a mut Piece,
    ) -> Result<(&'a Experience, &'a mut Activations), Error> {
        self.present(parameters, piece, Self::recompute_networks)
    }

    /// Computes all networks on an experience's inputs, without the marginal of the whole team.
    ///
    /// # Panics
    /// If the experience is not one of this hierarchy's, recorded for learning.
    pub fn recompute_networks(
        &self,
        parameters: &Parameters,
        experience: &Experience,
        activations: &mut Activations,
    ) {
        let parts = &*self.parts;
        let weights = parts.weights(parameters);
        activations.begin(parameters.version(), Recording::ForLearning);
        for (level, own) in activations.banks.iter_mut().enumerate() {
            let (Some(own), Some(bank), Some(weights)) =
                (own, &parts.banks[level], &weights[level])
            else {
                continue;
            };
            let rows = &experience.banks[level];
            let epsilon = parts.epsilon(level, experience.exploration);
            for step in rows.steps() {
                own.compute(&bank.network, weights, (rows, step), epsilon);
            }
        }
    }

    /// Writes log q of every factor under the parameters that the activations belong to.
    ///
    /// # Shapes
    /// `log_q_i` becomes as long as `factors`.
    ///
    /// # Panics
    /// If a factor is a pair of a hierarchy without pairs.
    pub fn log_q(&self, activations: &Activations, factors: &[Factor], log_q_i: &mut Vec<f32>) {
        let (pairs, agents) = self.parts.split(activations);
        log_q_i.clear();
        log_q_i.extend(factors.iter().map(|factor| match factor.second {
            Some(_) => {
                let pairs = pairs.expect("a pair has a controller");
                pair_rows(pairs, agents, factor).log_q(factor.actions)
            }
            None => agents.log_p(factor.rows[0])[factor.actions[0]],
        }));
    }

    /// Writes what each group can expect of a value of its own choice, exploration included, under the parameters that the activations
    /// belong to: `Σ_u q(u) v(u)`, over an agent's actions or a pair's joint actions.
    ///
    /// # Shapes
    /// `value` gives for the factor at a place \[A\] of an agent or \[A·A\] of a pair, the first member's action outermost;
    /// `expected_i` becomes as long as `factors`.
    ///
    /// # Panics
    /// If a factor is a pair of a hierarchy without pairs.
    pub fn expectations<'v>(
        &self,
        activations: &Activations,
        factors: &[Factor],
        value: impl Fn(usize) -> &'v [f32],
        expected_i: &mut Vec<f32>,
    ) {
        let (pairs, agents) = self.parts.split(activations);
        let actions = agents.law().columns;
        let [mut first, mut second] = [vec![0.0; actions], vec![0.0; actions]];
        let mut joint = vec![0.0; pairs.map_or(0, |pairs| pairs.law().columns)];
        expected_i.clear();
        expected_i.extend(factors.iter().enumerate().map(|(place, factor)| {
            let log_p = factor.rows.map(|row| match row {
                NONE => &[][..],
                row => agents.log_p(row),
            });
            exponentials(log_p[0], &mut first);
            if factor.second.is_none() {
                let terms = first.iter().zip(value(place));
                return terms.map(|(p, value)| p * value).sum::<f32>();
            }
            let pairs = pairs.expect("a pair has a controller");
            let log_joint = pairs.log_p(factor.pair_row);
            exponentials(log_p[1], &mut second);
            exponentials(log_joint, &mut joint);
            let rows = PairRows {
                pair: [&joint, log_joint],
                first: [&first, log_p[0]],
                second: [&second, log_p[1]],
            };
            rows.expectation(value(place))
        }));
    }

    /// Adds the gradient of the sum of `terms` to `gradient`, and gives `Σ_i H(q_i)` of those whose entropy is asked for. The
    /// activations are used up.
    ///
    /// # Shapes
    /// The derivatives of a term as its factors, `gradient` as the layout.
    ///
    /// # Panics
    /// If the activations are spent or belong to other parameters; where exploration is mixed into choices, if there is not just one
    /// term, or if its entropy is asked for.
    pub fn backward_factors(
        &self,
        parameters: &Parameters,
        experience: &Experience,
        activations: &mut Activations,
        terms: &[FactorTerm<'_>],
        workspace: &mut FactorWorkspace,
        gradient: &mut [f32],
    ) -> f64 {
        assert!(
            activations.serve(parameters.version()),
            "activations are those of these parameters, and unspent"
        );
        let mut banks = activations.banks.iter().flatten();
        let explores = banks.any(|bank| bank.epsilon > 0.0);
        let parts = &*self.parts;
        let alone = parts.declaration.alone();
        for own in activations.banks.iter_mut().flatten() {
            own.trace.all_logits_gradient_mut().fill(0.0);
        }
        let (before, rest) = activations.banks.split_at_mut(alone);
        let agents = rest[0].as_mut().expect("agents have controllers");
        let mut pairs = before.get_mut(PAIRS).and_then(Option::as_mut);
        let mut entropy = 0.0;
        for term in terms {
            assert_eq!(
                term.factors.len(),
                term.d_log_q_i.len(),
                "a derivative of each factor"
            );
            if explores {
                let plain = terms.len() == 1 && term.entropy_weight.is_none();
                assert!(
                    plain,
                    "one term of choices that explore, without their entropy"
                );
                for (factor, &weight) in term.factors.iter().zip(term.d_log_q_i) {
                    write_explored(pairs.as_deref_mut(), agents, factor, weight);
                }
            } else {
                entropy += add_term(pairs.as_deref_mut(), agents, term, workspace);
            }
        }
        let weights = parts.weights(parameters);
        for (level, own) in activations.banks.iter_mut().enumerate() {
            let (Some(own), Some(bank), Some(weights)) =
                (own, &parts.banks[level], &weights[level])
            else {
                continue;
            };
            let inputs = experience.banks[level].input_rf();
            bank.network
                .backward(weights, inputs, &mut own.trace, gradient);
        }
        entropy
    }
}

impl Parts {
    /// The activations of pairs, if there are pairs, and of agents.
    fn split<'a>(
        &self,
        activations: &'a Activations,
    ) -> (Option<&'a BankActivations>, &'a BankActivations) {
        let alone = self.declaration.alone();
        let agents = activations.banks[alone].as_ref();
        let pairs = (alone > PAIRS).then(|| activations.banks[PAIRS].as_ref());
        (pairs.flatten(), agents.expect("agents have controllers"))
    }
}

/// Adds the gradient of a term with respect to the logits of its factors' rows, and gives its entropy if it is asked for. No
/// exploration is mixed in.
fn add_term(
    mut pairs: Option<&mut BankActivations>,
    agents: &mut BankActivations,
    term: &FactorTerm<'_>,
    workspace: &mut FactorWorkspace,
) -> f64 {
    let FactorWorkspace {
        log_q,
        pair,
        first,
        second,
    } = workspace;
    let columns = agents.law().columns;
    first.resize(columns, 0.0);
    second.resize(columns, 0.0);
    let mut entropy = 0.0;
    for (factor, &weight) in term.factors.iter().zip(term.d_log_q_i) {
        let weights = [weight, term.entropy_weight.unwrap_or(0.0)];
        let own = if factor.second.is_none() {
            let own = row(agents, factor.rows[0]);
            let own = gradient_alone(own, factor.actions[0], weights, first);
            add_to_logits(agents, factor.rows[0], first);
            own
        } else {
            let pairs = pairs.as_deref_mut().expect("a pair has a controller");
            pair.resize(pairs.law().columns, 0.0);
            let to = PairGradient {
                pair,
                first,
                second,
            };
            let rows = pair_rows(pairs, agents, factor);
            let own = rows.gradient(factor.actions, weights, log_q, to);
            add_to_logits(pairs, factor.pair_row, pair);
            add_to_logits(agents, factor.rows[0], first);
            add_to_logits(agents, factor.rows[1], second);
            own
        };
        if term.entropy_weight.is_some() {
            entropy += f64::from(own);
        }
    }
    entropy
}

/// Adds to the gradient with respect to a row's logits.
fn add_to_logits(bank: &mut BankActivations, row: usize, gradient: &[f32]) {
    let columns = bank.law().columns;
    let to = &mut bank.trace.all_logits_gradient_mut()[row * columns..(row + 1) * columns];
    for (to, gradient) in to.iter_mut().zip(gradient) {
        *to += gradient;
    }
}

/// Writes the gradient of `weight · log q` with respect to the logits of a factor's rows, into whose choices exploration is mixed.
fn write_explored(
    pairs: Option<&mut BankActivations>,
    agents: &mut BankActivations,
    factor: &Factor,
    weight: f32,
) {
    let [a, b] = factor.actions;
    if factor.second.is_none() {
        agents.write_row_gradient(factor.rows[0], &[(a, weight)]);
        return;
    }
    let pairs = pairs.expect("a pair has a controller");
    let [joint, delegated] = pair_rows(pairs, agents, factor)
        .posteriors(factor.actions)
        .map(|posterior| weight * posterior);
    let column = 1 + a * agents.law().columns + b;
    pairs.write_row_gradient(factor.pair_row, &[(0, delegated), (column, joint)]);
    agents.write_row_gradient(factor.rows[0], &[(a, delegated)]);
    agents.write_row_gradient(factor.rows[1], &[(b, delegated)]);
}

/// The probabilities of a row, and their logarithms.
fn row(bank: &BankActivations, row: usize) -> [&[f32]; 2] {
    let columns = bank.law().columns;
    let place = row * columns..(row + 1) * columns;
    [&bank.softmax_rc[place.clone()], &bank.log_p_rc[place]]
}

/// The rows of a pair and its members.
fn pair_rows<'a>(
    pairs: &'a BankActivations,
    agents: &'a BankActivations,
    factor: &Factor,
) -> PairRows<'a, f32> {
    PairRows {
        pair: row(pairs, factor.pair_row),
        first: row(agents, factor.rows[0]),
        second: row(agents, factor.rows[1]),
    }
}
