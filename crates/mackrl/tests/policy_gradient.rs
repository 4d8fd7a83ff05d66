//! The gradient that the learner follows, through the marginal, the softmax and all recurrent networks, against finite
//! differences of Σ w log p(u) over episodes in which agents die.
//!
//! Each layer alone is compared in double precision elsewhere. Here the whole policy is, as it runs, so in single precision:
//! the derivative along a direction, from objectives whose rounding errors are far smaller than their differences.

mod support;

use mackrl::experience::Episode;
use support::team::{Played, Team, keys, norm};

/// A team, its parameters and what they did.
struct Subject {
    team: Team,
    parameters: Vec<f32>,
    played: Played,
    episodes: u64,
    replay: Replay,
}

/// What log p(u) is computed of under other parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Replay {
    /// Episodes that are played with them, in which nothing else must happen.
    Played,
    /// The episodes that were played, from their inputs.
    Recomputed,
}

impl Subject {
    fn new(team: Team, episodes: u64, replay: Replay) -> Self {
        let parameters = team.initialise();
        let played = team.learnable(&parameters, &keys(episodes));
        Self {
            team,
            parameters,
            played,
            episodes,
            replay,
        }
    }

    /// (J(θ + h d) − J(θ − h d)) / 2h, without the term in h² (Richardson). A draw is compared with cumulative
    /// probabilities, so a small h leaves all actions as they were, which is asserted.
    fn slope(&self, direction: &[f64], h: f64) -> f64 {
        let central = |h: f64| {
            let [above, below] = [h, -h].map(|h| {
                let moved: Vec<f32> = (self.parameters.iter().zip(direction))
                    .map(|(&parameter, d)| mackrl::Real::from_f64(f64::from(parameter) + h * d))
                    .collect();
                let keys = keys(self.episodes);
                if self.replay == Replay::Recomputed {
                    return self.team.objective_of(&self.parameters, &keys, &moved);
                }
                let played = self.team.learnable(&moved, &keys);
                assert!(played.episodes == self.played.episodes, "an action changed");
                played.objective
            });
            (above - below) / (2.0 * h)
        };
        (4.0 * central(h / 2.0) - central(h)) / 3.0
    }

    /// The names of the levels that have a network.
    fn controllers(&self) -> impl Iterator<Item = &'static str> {
        let levels = self.team.hierarchy.declaration().levels().iter();
        let names = levels.map(|level| level.name);
        names.filter(|name| !self.team.places(name).is_empty())
    }

    /// The part of the gradient that belongs to tensors named so, scaled to length 1, and zero elsewhere.
    fn direction(&self, controller: &str) -> Vec<f64> {
        let mut direction = vec![0.0; self.parameters.len()];
        let places = self.team.places(controller);
        let length = norm(&self.played.gradient_at(&places));
        assert!(
            length > 0.05,
            "{controller} has hardly a gradient: {length}"
        );
        for place in places {
            direction[place] = f64::from(self.played.gradient[place]) / length;
        }
        direction
    }

    /// Largest |g·d − slope| over several directions d, relative to |g|: the gradient's part in each controller, and that
    /// part with its entries in another order.
    fn discrepancy(&self, gradient: &[f64], h: f64) -> f64 {
        let mut worst = 0.0_f64;
        for controller in self.controllers() {
            let along = self.direction(controller);
            let alternating: Vec<f64> = (along.iter().enumerate())
                .map(|(i, d)| if i % 2 == 0 { *d } else { -d })
                .collect();
            for direction in [along, alternating] {
                let product: f64 = gradient.iter().zip(&direction).map(|(g, d)| g * d).sum();
                let length = norm(&self.played.gradient_at(&self.team.places(controller)));
                let difference = (product - self.slope(&direction, h)).abs();
                worst = worst.max(difference / length);
            }
        }
        worst
    }
}

/// Checks a gradient, and that the check would not accept one with a wrong part.
fn check(team: Team, episodes: u64, h: f64, replay: Replay) -> Subject {
    let subject = Subject::new(team, episodes, replay);
    let everything: Vec<usize> = (0..subject.parameters.len()).collect();
    let gradient = subject.played.gradient_at(&everything);
    let found = subject.discrepancy(&gradient, h);
    assert!(found < 0.01, "relative error {found}");
    assert!(
        subject.controllers().count() >= 2,
        "too few controllers learn"
    );
    for controller in subject.controllers() {
        for factor in [-1.0, 0.9] {
            let mut wrong = gradient.clone();
            for place in subject.team.places(controller) {
                wrong[place] *= factor;
            }
            let found = subject.discrepancy(&wrong, h);
            assert!(found > 0.05, "{controller} × {factor} passes: {found}");
        }
    }
    subject
}

#[test]
fn the_gradient_of_whole_episodes_is_that_of_their_log_probability() {
    let subject = check(
        Team::mackrl(&["env.map=3m"], "hidden = 5"),
        3,
        1e-3,
        Replay::Played,
    );
    let dead_allies = subject.team.world.spec().statistic("dead_allies");
    let dead_allies = dead_allies.expect("a statistic of battles");
    let deaths = |episode: &Episode| episode.statistics_s[dead_allies];
    assert!(
        subject.played.episodes.iter().all(|e| deaths(e) > 0.0),
        "nobody dies"
    );
}

#[test]
fn the_gradient_is_right_where_few_pairs_are_asked_and_where_nobody_selects() {
    for setting in [r#"partitions = "round-robin""#, r#"selector = "uniform""#] {
        let team = Team::mackrl(&["env.map=3m"], &format!("hidden = 5\n{setting}"));
        let subject = check(team, 3, 1e-3, Replay::Played);
        assert!(subject.team.places("pair_selector").is_empty(), "{setting}");
    }
}

#[test]
fn the_gradient_of_many_short_episodes_is_that_of_their_log_probability() {
    let team = Team::mackrl(&["env.name=matrix-game"], "hidden = 5");
    check(team, 61, 1e-2, Replay::Played);
}

#[test]
fn the_gradient_of_a_hierarchy_with_fours_is_that_of_its_log_probability() {
    let subject = check(
        Team::fours(&["env.map=2s3z"], 6),
        3,
        1e-2,
        Replay::Recomputed,
    );
    let learning: Vec<&str> = subject.controllers().collect();
    assert_eq!(
        learning,
        [
            "four_selector",
            "four_controller",
            "pair_controller",
            "agent_controller"
        ]
    );
}
