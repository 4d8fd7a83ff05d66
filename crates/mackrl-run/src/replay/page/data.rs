//! What a page knows of a replay: numbers short enough for a long battle of many units.

use mackrl::policy::{GroupChoice, GroupThought, Mode, PairThought, PartitionThought, Thought};
use mackrl_env::{Action, AgentId, EntityId, Environment};
use mackrl_skirmish::terrain::MAP_SIZE;
use serde::Serialize;

use crate::replay::{Names, Playback, Player, Replay, Step, Summary, living_groups, shot};

/// A replay that was played again.
pub(super) struct Shown<'a> {
    replay: &'a Replay,
    playback: &'a Playback,
    names: Names,
}

/// What the page knows of it.
#[derive(Debug, Serialize)]
pub(super) struct PageData {
    title: String,
    subtitle: String,
    outcome: String,
    /// The step that is shown first.
    start: usize,
    /// Cells along an edge of the map.
    edge: usize,
    /// For each row of the map, from the south, 1 where it can be walked.
    walkable: Vec<String>,
    sight: f64,
    agents: usize,
    entities: Vec<Entity>,
    frames: Vec<Frame>,
    rewards: Vec<f64>,
    decisions: Vec<Decision>,
}

#[derive(Debug, Serialize)]
struct Entity {
    name: String,
    kind: String,
    /// What stands for its type.
    letters: String,
    radius: f64,
    /// Whether its type has shields.
    shield: bool,
    heals: bool,
}

/// One moment.
#[derive(Debug, Serialize)]
struct Frame {
    x: Vec<f64>,
    y: Vec<f64>,
    /// Share of life.
    life: Vec<f64>,
    /// Share of shields.
    shield: Vec<f64>,
    /// Share of the weapon's period until it is ready.
    cooldown: Vec<f64>,
    /// What each agent sees, as bits in hexadecimal.
    views: Vec<String>,
    /// Attacker, target, whether it attacked in the step before.
    shots: Vec<(usize, usize, u8)>,
    missiles: Vec<[f64; 2]>,
}

/// One decision; probabilities are rounded to what can be shown.
#[derive(Debug, Serialize)]
struct Decision {
    actions: Vec<Action>,
    value: Option<f64>,
    partitions: Vec<Partition>,
    chosen: Option<usize>,
    groups: Vec<Group>,
    pairs: Vec<Pair>,
    solo: Vec<Solo>,
    /// Probability of the way that was taken.
    way: Option<f64>,
    /// p(u).
    marginal: Option<f64>,
}

#[derive(Debug, Serialize)]
struct Partition {
    /// Without the dead.
    groups: Vec<Vec<AgentId>>,
    probability: f64,
    posterior: f64,
}

/// A group that divides further, or the whole team, where it acts as one.
#[derive(Debug, Serialize)]
struct Group {
    members: Vec<AgentId>,
    divisions: Vec<Partition>,
    chosen: Option<usize>,
    joint: Vec<(Vec<Action>, f64)>,
}

#[derive(Debug, Serialize)]
struct Pair {
    members: [AgentId; 2],
    /// Number of entities that are common knowledge.
    known: usize,
    delegate: f64,
    choice: Option<GroupChoice>,
    joint: Vec<(Action, Action, f64)>,
}

#[derive(Debug, Serialize)]
struct Solo {
    agent: AgentId,
    options: Vec<(Action, f64)>,
}

impl<'a> Shown<'a> {
    pub(super) fn new(replay: &'a Replay, playback: &'a Playback) -> Self {
        Self {
            replay,
            playback,
            names: Names::new(&playback.skirmish),
        }
    }
}

impl PageData {
    /// The data of a replay whose page first shows the moment after `start` steps.
    pub(super) fn of(shown: &Shown<'_>, start: usize) -> Self {
        let playback = shown.playback;
        let skirmish = &playback.skirmish;
        let summary = Summary::of(shown.replay, playback);
        let terrain = &skirmish.scenario().field.terrain;
        let cells = || 0..i32::try_from(MAP_SIZE).unwrap_or(i32::MAX);
        let row = |y: i32| -> String {
            let cell = |x: i32| if terrain.is_walkable(x, y) { '1' } else { '0' };
            cells().map(cell).collect()
        };
        Self {
            title: format!("{} by {}", skirmish.spec().name, player(shown)),
            subtitle: format!(
                "{}; seed {}, episode {}",
                summary.outcome(),
                shown.replay.key.seed,
                shown.replay.key.episode
            ),
            outcome: summary.outcome(),
            start,
            edge: MAP_SIZE,
            walkable: cells().map(row).collect(),
            sight: f64::from(skirmish.settings().sight_range),
            agents: skirmish.spec().agents,
            entities: (0..playback.moments[0].state.units.len())
                .map(|entity| Entity::of(shown, entity))
                .collect(),
            frames: (0..playback.moments.len())
                .map(|step| Frame::of(shown, step))
                .collect(),
            rewards: playback.reward_t.iter().map(|r| rounded(*r, 4)).collect(),
            decisions: shown.replay.steps.iter().map(Decision::of).collect(),
        }
    }
}

/// Who played, and how.
fn player(shown: &Shown<'_>) -> String {
    let name = shown.replay.player.name();
    match shown.replay.player {
        Player::Script { .. } | Player::Client => name,
        Player::Policy { behaviour, .. } => match behaviour.mode {
            Mode::Greedy => format!("{name}, greedy"),
            Mode::Sampled => format!("{name}, sampled"),
        },
    }
}

impl Entity {
    fn of(shown: &Shown<'_>, entity: usize) -> Self {
        let playback = shown.playback;
        let unit = &playback.moments[0].state.units[entity];
        let profile = &playback.skirmish.scenario().field.profiles[usize::from(unit.kind)];
        let id = EntityId::new(entity);
        Self {
            name: shown.names.entity(id),
            kind: shown.names.kind(id).to_owned(),
            letters: shown.names.letters(id).to_owned(),
            radius: rounded(profile.radius, 3),
            shield: profile.shield > 0.0,
            heals: profile.care.is_some(),
        }
    }
}

impl Frame {
    fn of(shown: &Shown<'_>, step: usize) -> Self {
        let playback = shown.playback;
        let moment = &playback.moments[step];
        let before = &playback.moments[step.saturating_sub(1)].state;
        let state = &moment.state;
        let profiles = &playback.skirmish.scenario().field.profiles;
        let share = |part: f32, whole: f32| if whole > 0.0 { part / whole } else { 0.0 };
        let units = || {
            let units = state.units.iter();
            units.map(|unit| (unit, &profiles[usize::from(unit.kind)]))
        };
        let cooldown = units().map(|(unit, profile)| {
            let period = profile.strike.as_ref().map_or(0.0, |strike| strike.period);
            rounded(share(unit.cooldown.max(0.0), period), 2)
        });
        let has_shields = profiles.iter().any(|profile| profile.shield > 0.0);
        let shield = units().map(|(unit, profile)| rounded(share(unit.shield, profile.shield), 3));
        Self {
            x: state.x.iter().map(|x| rounded(*x, 2)).collect(),
            y: state.y.iter().map(|y| rounded(*y, 2)).collect(),
            life: units()
                .map(|(unit, profile)| {
                    // However little is left, the living live.
                    let least = if unit.is_alive() { 1e-3 } else { 0.0 };
                    rounded(share(unit.life, profile.life), 3).max(least)
                })
                .collect(),
            shield: shield.filter(|_| has_shields).collect(),
            cooldown: cooldown.collect(),
            views: (moment.visible_n.iter())
                .map(|view| format!("{:x}", view.bits()))
                .collect(),
            shots: (0..state.units.len())
                .filter_map(|index| shot(state, before, index))
                .map(|shot| (shot.from, shot.to, u8::from(shot.has_fired)))
                .collect(),
            missiles: (state.missiles.iter())
                .map(|missile| [missile.x, missile.y].map(|place| rounded(place, 2)))
                .collect(),
        }
    }
}

impl Decision {
    fn of(step: &Step) -> Self {
        let thought = step.thought.clone().unwrap_or_default();
        let is_known = step.thought.is_some();
        Self {
            actions: step.actions.clone(),
            value: step.value.map(|value| rounded(value, 3)),
            partitions: Partition::all(&thought, &thought.partitions),
            chosen: thought.chosen,
            groups: (thought.groups.iter())
                .map(|group| Group::of(&thought, group))
                .collect(),
            pairs: thought.pairs.iter().map(Pair::of).collect(),
            solo: (thought.agents.iter())
                .map(|agent| Solo {
                    agent: agent.agent,
                    options: (agent.options.iter())
                        .map(|option| (option.action, rounded(option.probability, 4)))
                        .collect(),
                })
                .collect(),
            way: is_known.then(|| thought.log_p_path.exp()),
            marginal: is_known.then(|| thought.log_p.exp()),
        }
    }
}

impl Partition {
    fn all(thought: &Thought, partitions: &[PartitionThought]) -> Vec<Self> {
        let partitions = partitions.iter().map(|partition| Self {
            groups: living_groups(thought, partition),
            probability: rounded(partition.probability, 4),
            posterior: rounded(partition.posterior, 4),
        });
        partitions.collect()
    }
}

impl Group {
    fn of(thought: &Thought, group: &GroupThought) -> Self {
        Self {
            members: group.members.clone(),
            divisions: Partition::all(thought, &group.divisions),
            chosen: group.chosen,
            joint: (group.joint.iter())
                .map(|option| (option.actions.clone(), rounded(option.probability, 4)))
                .collect(),
        }
    }
}

impl Pair {
    fn of(pair: &PairThought) -> Self {
        Self {
            members: pair.members,
            known: pair.known.len(),
            delegate: rounded(pair.delegate, 4),
            choice: pair.choice,
            joint: (pair.joint.iter())
                .map(|option| {
                    let [first, second] = option.actions;
                    (first, second, rounded(option.probability, 4))
                })
                .collect(),
        }
    }
}

/// A number with so many decimal places.
fn rounded(number: f32, places: i32) -> f64 {
    let scale = 10_f64.powi(places);
    (f64::from(number) * scale).round() / scale
}
