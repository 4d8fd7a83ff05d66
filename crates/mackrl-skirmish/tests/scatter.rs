//! Where episodes begin: near the places of the map, a little differently every time.

use mackrl_env::{Action, AgentId, Environment, EpisodeKey, Observations, Stream};
use mackrl_skirmish::{EnemyBehaviour, Skirmish, SkirmishSettings, rules::BattleState};

/// Map units that pushing may add to a scatter, in the densest army.
const PUSHED: f32 = 2.0;

fn make(name: &str, spawn_scatter: f32) -> Skirmish {
    let settings = SkirmishSettings {
        spawn_scatter,
        ..SkirmishSettings::default()
    };
    mackrl_skirmish::make(name, &settings).expect("the map is shipped")
}

fn begin(skirmish: &mut Skirmish, episode: u64) -> BattleState {
    let mut observations = Observations::new(skirmish.spec(), 1);
    let key = EpisodeKey::new(5, Stream::Other, episode);
    skirmish.reset(key, &mut observations.row_mut(0));
    skirmish.battle().state().clone()
}

#[test]
fn without_scatter_everybody_starts_at_the_places_of_the_map() {
    for name in mackrl_skirmish::map_names() {
        let mut skirmish = make(name, 0.0);
        let places: Vec<[f32; 2]> = skirmish.scenario().recruits.iter().map(|r| r.at).collect();
        let state = begin(&mut skirmish, 3);
        for (index, [x, y]) in places.into_iter().enumerate() {
            let (dx, dy) = (state.x[index] - x, state.y[index] - y);
            // Lattices touch to within the overlap that movement leaves alone.
            assert!(dx.abs() + dy.abs() < 0.01, "{name}: unit {index}");
        }
    }
}

#[test]
fn scattered_units_stand_apart_off_the_walls_and_near_their_places() {
    for name in mackrl_skirmish::map_names() {
        let mut skirmish = make(name, 0.5);
        let lattice = make(name, 0.0).battle().state().clone();
        for episode in 0..20 {
            let state = begin(&mut skirmish, episode);
            let profiles = &skirmish.battle().field().profiles;
            for i in 0..state.units.len() {
                let own = &profiles[usize::from(state.units[i].kind)];
                let stray = |j: usize| {
                    (lattice.x[j] - state.x[i])
                        .abs()
                        .max((lattice.y[j] - state.y[i]).abs())
                };
                let alike =
                    (0..state.units.len()).filter(|&j| state.units[j].kind == state.units[i].kind);
                let strayed = alike.map(stray).fold(f32::INFINITY, f32::min);
                let bound = if own.is_immobile() { 0.0 } else { 0.5 + PUSHED };
                assert!(strayed <= bound, "{name}: unit {i} strayed by {strayed}");
                for j in i + 1..state.units.len() {
                    let other = &profiles[usize::from(state.units[j].kind)];
                    let (dx, dy) = (state.x[i] - state.x[j], state.y[i] - state.y[j]);
                    let apart = own.separation_radius + other.separation_radius;
                    assert!(
                        !own.layer.collides_with(other.layer) || dx.hypot(dy) > apart - 0.05,
                        "{name}: units {i} and {j} of episode {episode} stand in each other, {} of {apart} apart",
                        dx.hypot(dy)
                    );
                }
                if let Some(terrain) = skirmish.battle().field().terrain.for_layer(own.layer) {
                    let (x, y) = (state.x[i], state.y[i]);
                    let free = terrain.pushed_out_of_walls(x, y, own.inner_radius - 0.01);
                    assert_eq!(free, (x, y), "{name}: unit {i} starts in a wall");
                }
            }
        }
    }
}

#[test]
fn agents_are_numbered_by_type_then_x_then_y_in_every_episode() {
    for name in mackrl_skirmish::map_names() {
        let mut skirmish = make(name, 0.5);
        let agents = skirmish.spec().agents;
        for episode in 0..20 {
            let state = begin(&mut skirmish, episode);
            let ranks: Vec<(f32, f32)> = (0..agents).map(|i| (state.x[i], state.y[i])).collect();
            for (i, pair) in ranks.windows(2).enumerate() {
                let same_type = state.units[i].kind == state.units[i + 1].kind;
                assert!(!same_type || pair[0] <= pair[1], "{name}: agent {i}");
            }
        }
    }
}

#[test]
fn two_episodes_start_at_different_places() {
    let mut skirmish = make("3m", 0.5);
    let (one, other) = (begin(&mut skirmish, 0), begin(&mut skirmish, 1));
    assert_ne!(one.x, other.x);
    assert_ne!(one.y, other.y);
    assert_eq!(begin(&mut skirmish, 0).x, one.x);
}

#[test]
fn enemies_that_hunt_find_a_team_that_hides_and_those_of_the_map_do_not() {
    for (enemy_order, found) in [(EnemyBehaviour::Map, false), (EnemyBehaviour::Hunt, true)] {
        let settings = SkirmishSettings {
            enemy_order,
            ..SkirmishSettings::default()
        };
        let mut skirmish = mackrl_skirmish::make("3m", &settings).expect("the map is shipped");
        let mut observations = Observations::new(skirmish.spec(), 1);
        let key = EpisodeKey::new(5, Stream::Other, 0);
        skirmish.reset(key, &mut observations.row_mut(0));
        let (stop, north) = (Action::new(1), Action::new(2));
        loop {
            // To the northern edge, and no further; the dead do nothing.
            let actions: Vec<Action> = (0..3)
                .map(|agent| {
                    let available = observations.local_view(0, AgentId::new(agent)).available();
                    [north, stop, Action::new(0)]
                        .into_iter()
                        .find(|action| available[action.index()])
                        .expect("one of them is always available")
                })
                .collect();
            let step = skirmish
                .step(&actions, &mut observations.row_mut(0))
                .expect("the actions are available");
            if step.end.is_some() {
                break;
            }
        }
        let dead = skirmish.battle_statistics().dead_allies;
        assert_eq!(dead == 3, found, "{enemy_order:?}: {dead} dead");
    }
}
