//! Agents whose choices are weighed by advantages of their own: what they compare with, and that they learn.

mod support;

use mackrl::{
    experience::{Piece, PlaySettings},
    hierarchy::Weighing,
    policy::{Behaviour, Parameters, Recording},
};
use mackrl_run::{
    config::{ConfigBuilder, registry},
    training::{Trainer, evaluate},
};
use support::team::{Team, keys};

#[test]
fn what_an_agent_expects_of_a_value_is_its_mean_under_the_policy() {
    let team = Team::central_v(&["env.map=3m"], "hidden = 13");
    let parameters = Parameters::new(team.initialise());
    let mut collector = team.collector(2, 1);
    let settings = PlaySettings {
        behaviour: Behaviour::sampled(0.3),
        recording: Recording::ForLearning,
    };
    collector
        .play(&parameters, &keys(2), settings)
        .expect("masks agree with the world");
    let mut pieces: Vec<&mut Piece> = collector.pieces().collect();
    let hierarchy = &team.hierarchy;
    let (experience, activations) = hierarchy
        .networks(&parameters, pieces[0])
        .expect("its own experience");
    let factors = hierarchy.factors(experience, Weighing::Choosing);
    assert!(factors.len() > 100, "{} choices", factors.len());
    let mut log_q = Vec::new();
    hierarchy.log_q(activations, &factors, &mut log_q);
    let actions = team.world.spec().actions;
    let unit = |action: usize| -> Vec<f32> {
        (0..actions)
            .map(|a| f32::from(u8::from(a == action)))
            .collect()
    };
    let (units, mut total) = ((0..actions).map(unit), vec![0.0; factors.len()]);
    let mut expected = Vec::new();
    for (action, value_a) in units.enumerate() {
        hierarchy.expectations(activations, &factors, |_| &value_a, &mut expected);
        for (place, (factor, &p)) in factors.iter().zip(&expected).enumerate() {
            total[place] += p;
            let taken = experience.episodes[factor.episode].actions(factor.step)[factor.first];
            if taken.index() == action {
                assert!((p - log_q[place].exp()).abs() < 1e-6, "{p}");
            }
        }
    }
    for total in total {
        assert!((total - 1.0).abs() < 1e-6, "{total}");
    }
}

#[test]
fn agents_learn_to_act_on_what_they_observe_and_remember() {
    for (world, algorithm) in [
        ("sanity-observe", "iac"),
        ("sanity-observe", "coma"),
        ("sanity-remember", "coma"),
    ] {
        let settings = [
            format!("env.name={world}"),
            format!("algorithm.name={algorithm}"),
            "algorithm.environments=32".to_owned(),
            "algorithm.optimiser=adam".to_owned(),
            "algorithm.learning_rate=0.002".to_owned(),
            "algorithm.critic_learning_rate=0.005".to_owned(),
            "algorithm.exploration_steps_env=10000".to_owned(),
            "run.steps_env=25000".to_owned(),
            "test.interval_steps_env=25000".to_owned(),
        ];
        let config = settings
            .iter()
            .fold(ConfigBuilder::new(registry()), |builder, setting| {
                builder.set(setting).expect("a known setting")
            })
            .build()
            .expect("settings within their ranges");
        let mut trainer = Trainer::new(&config, 2).expect("a run that can begin");
        while !trainer.finished() {
            trainer.update().expect("finite gradients");
        }
        let found = evaluate(&config, &trainer.weights(), 400, 1, 2).expect("its own weights");
        let success = found.mean("success").expect("a statistic of all three");
        assert!(success >= 0.95, "{algorithm}, {world}: {success}");
    }
}
