//! Misbehaviour on purpose, for testing clients: a game program may hang, crash, lie, or never start.
//!
//! A plan draws, for each request, whether something goes wrong and what. It is switched on by a hidden option of
//! `mackrl sc2 serve` and by nothing else.

use std::{str::FromStr, time::Duration};

use mackrl_env::{Draw, EpisodeKey, Stream};
use thiserror::Error;

/// One way of going wrong.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fault {
    /// Never answers again.
    Hang,
    /// Closes the connection.
    Close,
    /// Answers with nonsense.
    Garbage,
    /// Answers too late.
    Late,
    /// Gives the answer twice.
    Twice,
    /// Refuses what is asked.
    Refuse,
    /// Stops the process (SIGSTOP).
    Stop,
    /// Kills the process (SIGKILL).
    Kill,
    /// Finds its port occupied when it starts.
    Port,
}

impl Fault {
    /// All of them, by their names.
    pub const ALL: [(&'static str, Self); 9] = [
        ("hang", Self::Hang),
        ("close", Self::Close),
        ("garbage", Self::Garbage),
        ("late", Self::Late),
        ("twice", Self::Twice),
        ("refuse", Self::Refuse),
        ("stop", Self::Stop),
        ("kill", Self::Kill),
        ("port", Self::Port),
    ];
}

/// When what goes wrong, such as `rate=0.01,seed=7,late=1.5,kinds=hang+close`.
#[derive(Debug, Clone, PartialEq)]
pub struct FaultPlan {
    /// Part of the requests at which something goes wrong, in \[0, 1\].
    pub rate: f64,
    /// Seed of the draws.
    pub seed: u64,
    /// How late a late answer is.
    pub late: Duration,
    /// What may go wrong.
    pub kinds: Vec<Fault>,
    draws: usize,
}

/// A plan that is none.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error("{found:?} in a plan of faults, expected rate=R,seed=S,late=SECONDS,kinds=KIND+KIND of {}", Fault::ALL.map(|(name, _)| name).join(", "))]
pub struct InvalidPlan {
    found: String,
}

impl FaultPlan {
    /// Something goes wrong at the part `rate` of all requests.
    #[must_use]
    pub fn new(rate: f64, seed: u64, kinds: Vec<Fault>) -> Self {
        Self {
            rate,
            seed,
            late: Duration::from_secs(1),
            kinds,
            draws: 0,
        }
    }

    /// The plan of one process among many: its draws differ from those of others.
    #[must_use]
    pub fn of_process(mut self, number: u64) -> Self {
        self.seed = self.seed.wrapping_mul(1_000_003).wrapping_add(number);
        self
    }

    /// What goes wrong at the next request, if anything does.
    pub fn next(&mut self) -> Option<Fault> {
        let running: Vec<Fault> = self
            .kinds
            .iter()
            .copied()
            .filter(|kind| *kind != Fault::Port)
            .collect();
        let (whether, which) = self.draw();
        let index = (which % running.len().max(1) as u64) as usize;
        running.get(index).copied().filter(|_| whether < self.rate)
    }

    /// Whether the port is occupied at this start.
    pub fn is_port_occupied(&mut self) -> bool {
        let (whether, _) = self.draw();
        self.kinds.contains(&Fault::Port) && whether < 0.2
    }

    /// Bytes that mean nothing, or half of an answer.
    pub fn garbage(&mut self, answer: &[u8]) -> Vec<u8> {
        let (_, which) = self.draw();
        match which % 3 {
            0 => which.to_le_bytes().repeat(1 + (which >> 60) as usize),
            1 => Vec::new(),
            _ => answer[..answer.len() / 2].to_vec(),
        }
    }

    fn draw(&mut self) -> (f64, u64) {
        let key = EpisodeKey::new(self.seed, Stream::Other, 0);
        self.draws += 1;
        (
            key.uniform(self.draws, Draw::World(0)),
            key.bits(self.draws, Draw::World(1)),
        )
    }
}

impl FromStr for FaultPlan {
    type Err = InvalidPlan;

    fn from_str(text: &str) -> Result<Self, InvalidPlan> {
        let mut plan = Self::new(0.01, 1, Fault::ALL.map(|(_, fault)| fault).into());
        for part in text.split(',') {
            let wrong = || InvalidPlan {
                found: part.to_owned(),
            };
            match part.split_once('=').ok_or_else(wrong)? {
                ("rate", rate) => plan.rate = rate.parse().map_err(|_| wrong())?,
                ("seed", seed) => plan.seed = seed.parse().map_err(|_| wrong())?,
                ("late", late) => {
                    let seconds = late.parse().map_err(|_| wrong())?;
                    plan.late = Duration::try_from_secs_f64(seconds).map_err(|_| wrong())?;
                }
                ("kinds", kinds) => {
                    let known = |name| Fault::ALL.iter().find(|(known, _)| *known == name);
                    let kinds = kinds
                        .split('+')
                        .map(|name| known(name).map(|(_, fault)| *fault));
                    plan.kinds = kinds.collect::<Option<_>>().ok_or_else(wrong)?;
                }
                _ => return Err(wrong()),
            }
        }
        Ok(plan)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_plan_goes_wrong_as_often_as_it_says_and_in_every_way() {
        let mut plan: FaultPlan = "rate=0.25,seed=3".parse().unwrap();
        let drawn: Vec<Option<Fault>> = (0..4000).map(|_| plan.next()).collect();
        let wrong = drawn.iter().filter(|fault| fault.is_some()).count();
        assert!((850..1150).contains(&wrong), "{wrong}");
        for (name, fault) in Fault::ALL.iter().filter(|(_, fault)| *fault != Fault::Port) {
            assert!(drawn.contains(&Some(*fault)), "{name} never happens");
        }
        assert!(
            !drawn.contains(&Some(Fault::Port)),
            "a port is occupied at the start only"
        );
    }

    #[test]
    fn what_is_no_plan_is_refused() {
        for text in ["", "rate", "rate=x", "kinds=sneeze", "late=-1"] {
            assert!(text.parse::<FaultPlan>().is_err(), "{text}");
        }
    }
}
