//! Nothing is allocated once an environment stands: neither by a step nor by a reset, whatever happens in it.
//!
//! The counter replaces the allocator of this test program and counts the calls of one thread.

use allocation_counter::{AllocationInfo, measure};
use mackrl_env::{Action, AgentId, Draw, Environment, EpisodeKey, Observations, Stream};
use mackrl_skirmish::{BattleStatistics, Skirmish, SkirmishSettings};

/// What an episode of a map has to show, so that not allocating in it means something.
#[derive(Debug, Default, Clone, Copy, PartialEq)]
struct Sights {
    deaths: f64,
    missiles: usize,
    /// Second blades, and beams under way.
    blows: usize,
}

/// How agents choose among their available actions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Manner {
    /// Any.
    Random,
    /// A target if one is offered, else any.
    Fierce,
}

/// Plays `episodes` episodes from reset to end; allocates nothing of its own.
fn play(
    skirmish: &mut Skirmish,
    observations: &mut Observations,
    actions: &mut [Action],
    (manner, episodes): (Manner, u64),
) -> Sights {
    let mut sights = Sights::default();
    for episode in 0..episodes {
        let key = EpisodeKey::new(7, Stream::Other, episode);
        skirmish.reset(key, &mut observations.row_mut(0));
        for step in 0.. {
            for (agent, action) in actions.iter_mut().enumerate() {
                let available = observations.local_view(0, AgentId::new(agent)).available();
                let mut offered = (0..available.len()).filter(|action| available[*action]);
                let target = available.iter().rposition(|available| *available);
                let target = target.filter(|action| *action >= 6 && manner == Manner::Fierce);
                let draw = key.bits(step, Draw::Agent(agent)) % offered.clone().count() as u64;
                let any = usize::try_from(draw).expect("there are few actions");
                let chosen = target.or_else(|| offered.nth(any));
                *action = Action::new(chosen.expect("there is always an action"));
            }
            let time_step = skirmish
                .step(actions, &mut observations.row_mut(0))
                .expect("only available actions are chosen");
            let state = skirmish.battle().state();
            sights.missiles = sights.missiles.max(state.missiles.len());
            sights.blows = sights.blows.max(state.blows.len());
            if time_step.end.is_some() {
                let mut statistics_s = [0.0; BattleStatistics::COUNT];
                skirmish.statistics(&mut statistics_s);
                let [_, dead_allies, dead_enemies, _] = statistics_s;
                sights.deaths += dead_allies + dead_enemies;
                break;
            }
        }
    }
    sights
}

#[test]
fn the_counter_counts() {
    let info = measure(|| drop(std::hint::black_box(vec![1_u8; 11])));
    assert_eq!((info.count_total, info.bytes_total), (1, 11));
}

#[test]
fn whole_episodes_allocate_nothing_on_any_map() {
    let everything = SkirmishSettings {
        obs_last_action: true,
        obs_pathing_grid: true,
        obs_terrain_height: true,
        obs_timestep_number: true,
        state_timestep_number: true,
        ..SkirmishSettings::default()
    };
    for name in mackrl_skirmish::map_names() {
        for settings in [&SkirmishSettings::default(), &everything] {
            // What is played in is a copy of what was built.
            let built = mackrl_skirmish::make(name, settings).expect("a shipped map");
            let mut skirmish = built.clone();
            let mut observations = Observations::new(skirmish.spec(), 1);
            let mut actions = vec![Action::default(); skirmish.spec().agents];
            for manner in [Manner::Random, Manner::Fierce] {
                let mut sights = Sights::default();
                let info = measure(|| {
                    sights = play(&mut skirmish, &mut observations, &mut actions, (manner, 10));
                });
                assert_eq!(
                    info,
                    AllocationInfo::default(),
                    "{name}, {manner:?}: {sights:?}"
                );
                assert!(sights.deaths > 0.0, "{name}, {manner:?}: nobody died");
                if manner == Manner::Fierce {
                    check_sights(name, sights);
                }
            }
        }
    }
}

/// That the weapons of the map's units were seen at work.
fn check_sights(name: &str, sights: Sights) {
    let has_missiles = ["MMM", "MMM2", "2s3z", "3s_vs_5z", "6h_vs_8z"].contains(&name);
    assert!(!has_missiles || sights.missiles > 0, "{name}: {sights:?}");
    let has_blows = ["2s3z", "1c3s5z", "2c_vs_64zg", "corridor"].contains(&name);
    assert!(!has_blows || sights.blows > 0, "{name}: {sights:?}");
}
