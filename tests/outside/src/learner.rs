//! REINFORCE with the mean return as a baseline.

use mackrl::{
    Error, Phase, Stopwatch,
    algorithms::{Algorithm, AlgorithmState, StoredState, Team},
    experience::{Experience, Piece},
    nn::ParameterLayout,
    policy::{Behaviour, Parameters, Policy, Tally},
};

use crate::{LinearPolicy, ReinforceSettings};

/// Independent agents that learn from the returns of whole episodes.
#[derive(Debug)]
pub struct Reinforce {
    settings: ReinforceSettings,
    policy: LinearPolicy,
    parameters: Parameters,
    updates: u64,
}

impl Reinforce {
    /// A team that has learnt nothing.
    #[must_use]
    pub fn new(settings: ReinforceSettings, team: Team<'_>) -> Self {
        let policy = LinearPolicy::new(team.spec);
        Self {
            settings,
            parameters: Parameters::new(policy.initialise(team.seed)),
            policy,
            updates: 0,
        }
    }

    /// Adds Σ (R − baseline) ∇ log π(u) over an experience to `gradient`.
    fn add_gradient(&self, experience: &Experience, baseline: f64, gradient: &mut [f64]) {
        let rows = &experience.banks[0];
        let actions = self.policy.actions();
        for (t, step) in rows.steps().iter().enumerate() {
            let inputs = rows.inputs_of(step).chunks_exact(rows.inputs());
            let masks = rows.masks_of(step).chunks_exact(actions);
            for ((instance, input), mask) in rows.instances_of(step).iter().zip(inputs).zip(masks) {
                let episode = &experience.episodes[instance.environment];
                let advantage = episode.total_reward() - baseline;
                let taken = episode.actions(t)[instance.group].index();
                let values = self.parameters.values();
                let p_a = self
                    .policy
                    .probabilities(values, instance.group, input, mask);
                for (i, &x) in input.iter().enumerate() {
                    for (action, p) in p_a.iter().enumerate() {
                        let indicator = f64::from(u8::from(action == taken));
                        let place = self.policy.place(instance.group, i, action);
                        gradient[place] += advantage * f64::from(x) * (indicator - p);
                    }
                }
            }
        }
    }
}

impl Algorithm for Reinforce {
    fn policy(&self) -> &dyn Policy {
        &self.policy
    }

    fn parameters(&self) -> &Parameters {
        &self.parameters
    }

    fn environments(&self) -> usize {
        self.settings.environments
    }

    fn shards(&self) -> usize {
        2
    }

    fn behaviour(&self, _steps_env: u64) -> Behaviour {
        Behaviour::sampled(0.0)
    }

    #[expect(
        clippy::cast_possible_truncation,
        reason = "parameters have single precision"
    )]
    fn learn(
        &mut self,
        batch: &mut [&mut Piece],
        stopwatch: &mut Stopwatch,
    ) -> Result<Tally, Error> {
        let episodes = || batch.iter().flat_map(|piece| &piece.experience.episodes);
        let count = episodes().count().max(1) as f64;
        let baseline = episodes()
            .map(|episode| episode.total_reward())
            .sum::<f64>()
            / count;
        let mut gradient = vec![0.0; self.parameters.values().len()];
        for piece in batch.iter() {
            self.add_gradient(&piece.experience, baseline, &mut gradient);
        }
        let rate = self.settings.learning_rate / count;
        self.parameters.change(|values| {
            for (value, g) in values.iter_mut().zip(&gradient) {
                *value += (rate * g) as f32;
            }
        });
        self.updates += 1;
        stopwatch.lap(Phase::Backward);
        let mut tally = Tally::default();
        tally.add("reinforce/baseline", baseline, 1.0);
        Ok(tally)
    }

    fn updates(&self) -> u64 {
        self.updates
    }

    fn metrics(&self) -> &'static [(&'static str, &'static str)] {
        &[("reinforce/baseline", "mean return of a batch")]
    }

    fn models(&self) -> Vec<(&ParameterLayout, &[f32])> {
        vec![(self.policy.layout(), self.parameters.values())]
    }

    fn state(&self) -> AlgorithmState {
        let mut state = AlgorithmState::default();
        state.add_tensors(self.policy.layout(), self.parameters.values());
        state.add_counter("updates", self.updates);
        state
    }

    fn restore(&mut self, stored: &dyn StoredState) -> Result<(), Error> {
        let values = stored.tensors(self.policy.layout())?;
        self.updates = stored.counter("updates")?;
        self.parameters = Parameters::new(values);
        Ok(())
    }

    fn load(&mut self, stored: &dyn StoredState) -> Result<(), Error> {
        self.parameters = Parameters::new(stored.tensors(self.policy.layout())?);
        Ok(())
    }
}
