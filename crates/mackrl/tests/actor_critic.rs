//! What an actor-critic learns from, and every place in which a number of an update can be infinite or NaN, once.

mod support;

use mackrl::{
    Error, Stopwatch,
    algorithms::{ActorCritic, ActorCriticSettings, Algorithm, AlgorithmState, StoredState},
    experience::{Collector, Episode, Piece, PlaySettings},
    nn::ParameterLayout,
    objectives::LossAverage,
    policy::{Behaviour, Parameters, Recording, Tally},
};
use mackrl_env::{EpisodeKey, Stream};
use support::team::{FOR_LEARNING, Team, keys, norm, weights};

/// A state that was stored, word for word.
struct Stored(AlgorithmState);

impl Stored {
    fn tensors_of(&self, layout: &ParameterLayout) -> Option<&Vec<f32>> {
        let own = (self.0.tensors.iter()).find(|(own, _)| own.tensors() == layout.tensors());
        own.map(|(_, values)| values)
    }

    /// The tensors whose names begin with `name`.
    fn change(&mut self, name: &str, change: impl Fn(&mut f32)) {
        let mut found = false;
        for (layout, values) in &mut self.0.tensors {
            for tensor in layout.tensors() {
                if tensor.name.starts_with(name) {
                    values[tensor.range.clone()].iter_mut().for_each(&change);
                    found = true;
                }
            }
        }
        assert!(found, "no tensor is called {name}");
    }
}

impl StoredState for Stored {
    fn tensors(&self, layout: &ParameterLayout) -> Result<Vec<f32>, Error> {
        let values = self.tensors_of(layout).cloned();
        values.ok_or_else(|| Error::Data(format!("{:?} are missing", layout.tensors())))
    }

    fn counter(&self, name: &str) -> Result<u64, Error> {
        let count = self.0.counters.get(name).copied();
        count.ok_or_else(|| Error::Data(format!("{name} is missing")))
    }
}

fn settings() -> ActorCriticSettings {
    ActorCriticSettings {
        hidden: 5,
        learning_rate: 1e-3,
        critic_learning_rate: 1e-3,
        target_interval_updates: 1,
        ..ActorCriticSettings::default()
    }
}

/// A Central-V team on the built-in map, and two episodes that it has played.
struct Subject {
    algorithm: ActorCritic,
    collector: Collector,
}

impl Subject {
    fn new(settings: ActorCriticSettings) -> Self {
        Self::playing(settings, [0, 1])
    }

    fn playing(settings: ActorCriticSettings, episodes: [u64; 2]) -> Self {
        let team = Team::central_v(&["env.map=3m"], "hidden = 5");
        let prior = team.world.prior();
        let learners = mackrl::algorithms::Team {
            spec: team.world.spec(),
            prior: &prior,
            seed: 1,
            threads: 1,
        };
        let algorithm = ActorCritic::new(team.hierarchy.clone(), settings, learners);
        let mut collector = team.collector(2, 1);
        let keys = episodes.map(|episode| EpisodeKey::new(1, Stream::Training, episode));
        let behaviour = PlaySettings {
            behaviour: Behaviour::sampled(0.5),
            recording: Recording::ForLearning,
        };
        let played = collector.play(algorithm.parameters(), &keys, behaviour);
        played.expect("masks agree with the world");
        Self {
            algorithm,
            collector,
        }
    }

    fn piece(&mut self) -> &mut Piece {
        self.collector.pieces().next().expect("one shard")
    }

    /// Continues from its own state, in which `change` changes something.
    fn restored(mut self, change: impl FnOnce(&mut Stored)) -> Self {
        let mut stored = Stored(self.algorithm.state());
        change(&mut stored);
        self.algorithm.restore(&stored).expect("its own state");
        self
    }

    fn learn(&mut self) -> Result<Tally, Error> {
        let mut batch: Vec<_> = self.collector.pieces().collect();
        self.algorithm.learn(&mut batch, &mut Stopwatch::default())
    }

    /// The message of an update of episodes with something planted in them.
    fn refused(mut self, plant: impl FnOnce(&mut Episode)) -> String {
        plant(&mut self.piece().experience.episodes[1]);
        let refused = self.learn().expect_err("something is not finite");
        assert!(matches!(refused, Error::NotFinite(_)), "{refused:?}");
        refused.to_string()
    }
}

/// The place of the last number of the state before step 7.
fn late_state(episode: &mut Episode) -> &mut f32 {
    let size = episode.state(0).len();
    &mut episode.state_tg[7 * size + size - 1]
}

#[test]
fn rewards_and_states_that_are_not_finite_are_met_by_the_critic() {
    let mut subject = Subject::new(settings());
    let longest = subject.piece().experience.episodes[1].steps() - 1;
    assert_eq!(
        subject.refused(|episode| episode.reward_t[longest] = f32::NAN),
        format!("critic.λ-return is NaN at episode 1, step {longest}")
    );
    let subject = Subject::new(settings());
    let found = subject.refused(|episode| *late_state(episode) = f32::INFINITY);
    assert_eq!(found, "critic.value is NaN at episode 1, step 7");
}

#[test]
fn values_of_the_critic_that_are_not_finite_are_named() {
    // The target copy still is finite where the critic is not: states of 1e36 times weights that have grown.
    let subject = Subject::new(settings()).restored(|stored| {
        stored.change("critic.", |parameter| *parameter = 1e3);
        let updates = stored.0.counters["critic.updates"];
        stored.0.add_counter("critic.updates_at_refresh", updates);
    });
    let found = subject.refused(|episode| *late_state(episode) = 1e36);
    assert_eq!(found, "critic.value is inf at episode 1, step 7");
}

#[test]
fn gradients_moments_and_parameters_of_the_critic_are_named() {
    let found = Subject::new(settings()).refused(|episode| *late_state(episode) = 1e25);
    assert!(found.starts_with("gradient of critic."), "{found}");
    let long = ActorCriticSettings {
        gradient_norm_max: 1e30,
        ..settings()
    };
    let found = Subject::new(long).refused(|episode| *late_state(episode) = 1e13);
    assert!(found.starts_with("second moment of critic."), "{found}");
    let far = ActorCriticSettings {
        critic_learning_rate: 1e38,
        ..settings()
    };
    let found = Subject::new(far).refused(|_| ());
    assert!(found.starts_with("after the step, critic."), "{found}");
}

/// Makes the first layer's outputs 2¹⁰⁰ times as large and their weights in the next as much smaller: the policy is the same, but
/// its gradient with respect to these weights is not.
fn scale_hidden_layer(stored: &mut Stored) {
    let factor = 2.0_f32.powi(100);
    stored.change("agent_controller.input.", |parameter| *parameter *= factor);
    let next = "agent_controller.gru.weight_ih";
    stored.change(next, |parameter| *parameter /= factor);
}

#[test]
fn gradients_moments_and_parameters_of_the_policy_are_named() {
    let subject = Subject::new(settings()).restored(scale_hidden_layer);
    let found = subject.refused(|episode| episode.reward_t[3] = 1e15);
    let expected = "gradient of agent_controller.gru.weight_ih is ";
    assert!(found.starts_with(expected), "{found}");
    let long = ActorCriticSettings {
        gradient_norm_max: 1e30,
        ..settings()
    };
    let subject = Subject::new(long).restored(scale_hidden_layer);
    let found = subject.refused(|_| ());
    let expected = "second moment of agent_controller.gru.weight_ih is inf";
    assert!(found.starts_with(expected), "{found}");
    let far = ActorCriticSettings {
        learning_rate: 1e38,
        ..settings()
    };
    let found = Subject::new(far).refused(|_| ());
    let expected = "after the step, agent_controller.";
    assert!(found.starts_with(expected), "{found}");
}

#[test]
fn a_log_likelihood_that_is_not_finite_is_named() {
    let broken = |stored: &mut Stored| {
        stored.change("agent_controller.output.bias", |bias| *bias = f32::NAN);
    };
    let found = Subject::new(settings()).restored(broken).refused(|_| ());
    assert_eq!(found, "sum of A log p(u) is NaN");
}

#[test]
fn a_logit_that_is_not_finite_is_named_before_anything_acts() {
    let mut subject = Subject::new(settings());
    let mut broken = subject.algorithm.parameters().values().to_vec();
    broken[0] = f32::NAN;
    let keys = [0, 1].map(|episode| EpisodeKey::new(1, Stream::Training, episode));
    let greedy = PlaySettings {
        behaviour: Behaviour::GREEDY,
        recording: Recording::Off,
    };
    let played = (subject.collector).play(&Parameters::new(broken), &keys, greedy);
    assert_eq!(
        played.expect_err("a logit is NaN").to_string(),
        "logits of agent_controller is NaN at episode 0, step 0, agent 0, column 0"
    );
}

#[test]
fn the_average_decides_what_steps_count_for_and_nothing_else() {
    let [steps, slots] = [LossAverage::Steps, LossAverage::Slots].map(|loss_average| {
        let settings = ActorCriticSettings {
            loss_average,
            ..settings()
        };
        // Episodes of one length count alike.
        let subjects = (1..20).map(|later| Subject::playing(settings.clone(), [0, later]));
        let differ = |subject: &mut Subject| {
            let episodes = subject.piece().experience.episodes.iter();
            let lengths: Vec<usize> = episodes.map(Episode::steps).collect();
            lengths[0] != lengths[1]
        };
        let mut subject = subjects
            .filter_map(|mut subject| differ(&mut subject).then_some(subject))
            .next()
            .expect("episodes of two lengths");
        subject.learn().expect("finite gradients")
    });
    let mean = |report: &Tally, name: &str| {
        let found = report.means().find(|(found, _)| *found == name);
        found.expect("it is reported").1
    };
    let differ = |name: &str| mean(&steps, name) != mean(&slots, name);
    assert!(differ("agent_grad_norm"));
    let same = [
        "advantage_mean",
        "critic_loss",
        "critic_grad_norm",
        "td_error_abs",
        "target_mean",
    ];
    for name in same {
        assert!(!differ(name), "{name}");
    }
}

#[test]
fn learning_from_nothing_is_an_error_and_changes_nothing() {
    let mut subject = Subject::new(settings());
    let before = subject.algorithm.state();
    let nothing = subject.collector.play(
        &Parameters::new(subject.algorithm.parameters().values().to_vec()),
        &[],
        FOR_LEARNING,
    );
    nothing.expect("no episode takes no time");
    let no_episode = subject.learn();
    let no_piece = subject.algorithm.learn(&mut [], &mut Stopwatch::default());
    for refused in [no_episode, no_piece] {
        let error = refused.expect_err("there is nothing to learn from");
        assert!(matches!(error, Error::Data(_)), "{error:?}");
        assert_eq!(error.to_string(), "there is no step to learn from");
    }
    assert!(subject.algorithm.state() == before);
}

/// Teams of each kind of declaration: fixed partitions, partitions that change, groups of four, agents alone.
fn teams() -> [Team; 4] {
    [
        Team::mackrl(&["env.map=3m"], "hidden = 7"),
        Team::mackrl(
            &["env.map=2s3z"],
            "hidden = 7\npartitions = \"round-robin\"",
        ),
        Team::fours(&["env.map=2s3z"], 7),
        Team::central_v(&["env.map=3m"], "hidden = 7"),
    ]
}

/// log p(u) of every step and the gradient of its weighted sum, of a piece under `parameters`.
fn differentiate(
    team: &Team,
    parameters: &Parameters,
    piece: &mut Piece,
) -> (Vec<Vec<f32>>, Vec<f32>) {
    let evaluated = team.hierarchy.evaluate(parameters, piece);
    let (experience, activations) = evaluated.expect("its own experience");
    let log_p_bt = activations.log_p_bt().to_vec();
    let mut gradient = vec![0.0; parameters.values().len()];
    let weight_bt = weights(&experience.episodes);
    team.hierarchy.backward(
        parameters,
        experience,
        activations,
        &weight_bt,
        &mut gradient,
    );
    (log_p_bt, gradient)
}

#[test]
fn a_piece_can_be_learnt_from_twice_and_gives_the_same_bits() {
    for team in teams() {
        let parameters = Parameters::new(team.initialise());
        let mut collector = team.collector(5, 1);
        let played = collector.play(&parameters, &keys(5), FOR_LEARNING);
        played.expect("masks agree with the world");
        let piece = collector.pieces().next().expect("one shard");
        let experience = piece.experience.clone();
        let first = differentiate(&team, &parameters, piece);
        let acted_with = experience.episodes.iter();
        let acted_with: Vec<_> = acted_with.map(|episode| &episode.log_p_t).collect();
        assert!(first.0.iter().eq(acted_with));
        let length: Vec<f64> = first.1.iter().map(|&g| f64::from(g)).collect();
        assert!(norm(&length) > 0.1, "there is nothing to learn");
        // The activations are spent now; what follows is computed from the inputs.
        for _ in 0..2 {
            assert!(differentiate(&team, &parameters, piece) == first);
        }
        assert!(
            piece.experience == experience,
            "learning changes what happened"
        );
    }
}

#[test]
fn activations_of_other_parameters_are_computed_again() {
    for team in teams() {
        let before = team.initialise();
        let moved: Vec<f32> = before.iter().map(|parameter| parameter * 1.0001).collect();
        let [before, after] = [before, moved].map(Parameters::new);
        let [mut stale, mut fresh] = [&before, &after].map(|parameters| {
            let mut collector = team.collector(5, 1);
            let played = collector.play(parameters, &keys(5), FOR_LEARNING);
            played.expect("masks agree with the world");
            collector
        });
        let [stale, fresh] =
            [&mut stale, &mut fresh].map(|collector| collector.pieces().next().expect("one shard"));
        let happened = |piece: &Piece| -> Vec<_> {
            let episodes = piece.experience.episodes.iter();
            episodes
                .map(|episode| (episode.action_tn.clone(), episode.reward_t.clone()))
                .collect()
        };
        assert!(happened(stale) == happened(fresh), "an action changed");
        let expected = differentiate(&team, &after, fresh);
        assert!(differentiate(&team, &after, stale) == expected);
        assert!(differentiate(&team, &before, stale) != expected);
    }
}

#[test]
fn a_second_update_from_the_same_batch_follows_the_changed_policy() {
    let mut subject = Subject::new(settings());
    subject.learn().expect("finite gradients");
    let first = subject.algorithm.gradient().to_vec();
    subject.learn().expect("finite gradients");
    assert_ne!(subject.algorithm.gradient(), first);
    assert_eq!(subject.algorithm.updates(), 2);
    assert_eq!(subject.algorithm.policy().layout().len(), first.len());
}
