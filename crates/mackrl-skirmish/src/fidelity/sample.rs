//! Many episodes of one map by one policy.

use std::sync::{
    Mutex, PoisonError,
    atomic::{AtomicUsize, Ordering},
};

use mackrl_env::{Action, Environment, EpisodeEnd, EpisodeKey, Observations, Stream};
use serde::Serialize;

use crate::{
    MakeError, Skirmish, SkirmishSettings,
    fidelity::{Policy, Quantity, Spread, policy::Team},
    make,
};

/// Episodes that a thread takes at once.
const PORTION: usize = 16;

/// How an episode went.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Played {
    /// Steps.
    pub length: usize,
    /// Sum of rewards.
    pub total: f64,
    /// Enemies killed.
    pub killed: usize,
    /// Agents lost.
    pub lost: usize,
    /// Whether all agents were lost.
    pub all_lost: bool,
    /// Whether the team won.
    pub won: bool,
    /// Whether the limit ended it.
    pub timed_out: bool,
}

/// The episodes of one map by one policy.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Sample {
    /// The map.
    pub map: String,
    /// Who played.
    pub policy: Policy,
    /// The episodes, in their order.
    #[serde(skip)]
    pub episodes: Vec<Played>,
}

/// Plays episodes 0 to `episodes` of the shipped map `map`; `report` is called with the number of those that are done. The
/// number of threads changes no result.
///
/// # Errors
/// [`MakeError`] if there is no such map.
///
/// # Panics
/// If a thread panics: policies choose available actions only.
pub fn play(
    (map, policy): (&str, Policy),
    settings: &SkirmishSettings,
    episodes: usize,
    threads: usize,
    report: impl Fn(usize) + Sync,
) -> Result<Sample, MakeError> {
    let skirmish = make(map, settings)?;
    let portions = episodes.div_ceil(PORTION);
    let (next, done) = (AtomicUsize::new(0), AtomicUsize::new(0));
    let finished = Mutex::new(Vec::new());
    std::thread::scope(|scope| {
        let work = || {
            let mut player = Player::new(skirmish.clone(), policy);
            loop {
                let portion = next.fetch_add(1, Ordering::Relaxed);
                if portion >= portions {
                    return;
                }
                let range = portion * PORTION..((portion + 1) * PORTION).min(episodes);
                let played: Vec<Played> = range.map(|episode| player.play(episode)).collect();
                report(done.fetch_add(played.len(), Ordering::Relaxed) + played.len());
                let mut finished = finished.lock().unwrap_or_else(PoisonError::into_inner);
                finished.push((portion, played));
            }
        };
        for _ in 0..threads.clamp(1, portions.max(1)) {
            scope.spawn(work);
        }
    });
    let mut finished = finished
        .into_inner()
        .unwrap_or_else(PoisonError::into_inner);
    finished.sort_by_key(|(portion, _)| *portion);
    Ok(Sample {
        map: map.to_owned(),
        policy,
        episodes: finished
            .into_iter()
            .flat_map(|(_, played)| played)
            .collect(),
    })
}

impl Sample {
    /// What `value` is in each episode.
    #[must_use]
    pub fn values(&self, value: impl Fn(&Played) -> f64) -> Vec<f64> {
        self.episodes.iter().map(value).collect()
    }

    /// The spread of `value`; `None` without episodes.
    #[must_use]
    pub fn spread(&self, value: impl Fn(&Played) -> f64) -> Option<Spread> {
        Spread::of(&self.values(value))
    }

    /// The value of a quantity; `None` without episodes.
    #[must_use]
    pub fn value(&self, quantity: Quantity) -> Option<f64> {
        let length = |played: &Played| played.length as f64;
        Some(match quantity {
            Quantity::Length => self.spread(length)?.mean,
            Quantity::LengthSd => self.spread(length)?.sd,
            Quantity::MedianLength => self.spread(length)?.median(),
            Quantity::Return => self.spread(|played| played.total)?.mean,
            Quantity::Killed => self.spread(|played| played.killed as f64)?.mean,
            Quantity::Lost => self.spread(|played| played.lost as f64)?.mean,
            Quantity::AllLost => {
                self.spread(|played| f64::from(u8::from(played.all_lost)))?
                    .mean
            }
            Quantity::Won => self.spread(|played| f64::from(u8::from(played.won)))?.mean,
        })
    }
}

/// One thread's world and team.
struct Player {
    skirmish: Skirmish,
    team: Team,
    observations: Observations,
    actions: Vec<Action>,
}

impl Player {
    fn new(skirmish: Skirmish, policy: Policy) -> Self {
        Self {
            team: Team::new(policy, &skirmish),
            observations: Observations::new(skirmish.spec(), 1),
            actions: vec![Action::default(); skirmish.spec().agents],
            skirmish,
        }
    }

    fn play(&mut self, episode: usize) -> Played {
        let key = EpisodeKey::new(1, Stream::Other, episode as u64);
        self.skirmish.reset(key, &mut self.observations.row_mut(0));
        let (mut total, mut length) = (0.0, 0);
        let end = loop {
            let step = self.team.step(
                &mut self.skirmish,
                &mut self.observations,
                &mut self.actions,
                (key, length),
            );
            let step = step.expect("policies choose available actions");
            total += f64::from(step.reward);
            length += 1;
            if let Some(end) = step.end {
                break end;
            }
        };
        let statistics = self.skirmish.battle_statistics();
        Played {
            length,
            total,
            killed: statistics.dead_enemies,
            lost: statistics.dead_allies,
            all_lost: statistics.dead_allies == self.skirmish.spec().agents,
            won: statistics.battle_won,
            timed_out: end == EpisodeEnd::Truncated,
        }
    }
}
