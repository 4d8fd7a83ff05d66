//! Armies that SMAC does not have: any kinds on either side, any numbers, own unit types, own limits of time.

use std::collections::BTreeSet;

use mackrl_env::{Action, AgentId, Environment, EpisodeEnd, EpisodeKey, Observations, Stream};
use mackrl_skirmish::{Skirmish, SkirmishSettings};

const KINDS: [&str; 6] = [
    "marine", "marauder", "medivac", "stalker", "zergling", "baneling",
];
/// Actions before those with a target.
const TARGETS_FROM: usize = 6;

/// Counts of units by type, of the agents and of their enemies.
type Army<'a> = &'a [(&'a str, usize)];

fn skirmish(allies: Army<'_>, enemies: Army<'_>, further: &str) -> Skirmish {
    let groups = |army: Army<'_>, x: u8| -> String {
        let group = |(unit, count): &(&str, usize)| {
            format!("{{ unit = \"{unit}\", count = {count}, at = [{x}, 16] }}, ")
        };
        army.iter().map(group).collect()
    };
    let text = format!(
        "terrain = \"lane\"\nepisode_limit = 40\n\
         [allies]\nrace = \"terran\"\ngroups = [{}]\n\
         [enemies]\nrace = \"zerg\"\norder = \"none\"\ngroups = [{}]\n{further}",
        groups(allies, 14),
        groups(enemies, 17)
    );
    let settings = SkirmishSettings::default();
    mackrl_skirmish::make_custom("army.toml", &text, &settings).expect("valid")
}

fn begin(skirmish: &mut Skirmish) -> Observations {
    let mut observations = Observations::new(skirmish.spec(), 1);
    let key = EpisodeKey::new(1, Stream::Other, 0);
    skirmish.reset(key, &mut observations.row_mut(0));
    observations
}

/// Every choice of one or two kinds, one unit of the first and two of the second.
fn armies() -> Vec<Vec<(&'static str, usize)>> {
    let alone = KINDS.map(|kind| vec![(kind, 1)]);
    let pairs = (0..KINDS.len())
        .flat_map(|i| (i + 1..KINDS.len()).map(move |j| vec![(KINDS[i], 1), (KINDS[j], 2)]));
    alone.into_iter().chain(pairs).collect()
}

#[test]
fn types_are_told_apart_on_both_sides_whatever_they_are() {
    for allies in armies() {
        for enemies in armies() {
            let label = format!("{allies:?} against {enemies:?}");
            let mut skirmish = skirmish(&allies, &enemies, "");
            let kinds: BTreeSet<&str> = allies
                .iter()
                .chain(&enemies)
                .map(|(kind, _)| *kind)
                .collect();
            let is_mixed = allies.len() > 1 || enemies.len() > 1;
            let bits = if is_mixed { kinds.len() } else { 0 };
            assert_eq!(skirmish.layout().type_bits, bits, "{label}");
            // The state ends its rows with the bits: one each, the same for the same kind on one side, others for others.
            let observations = begin(&mut skirmish);
            let (agents, units) = (skirmish.spec().agents, skirmish.spec().entities);
            let layout = skirmish.layout();
            let (own, other) = (layout.state_ally_row(), layout.state_enemy_row());
            let mut seen: Vec<(bool, u8, Vec<f32>)> = Vec::new();
            for unit in 0..units {
                let is_ally = unit < agents;
                let end = if is_ally {
                    (unit + 1) * own
                } else {
                    agents * own + (unit + 1 - agents) * other
                };
                let row = observations.state(0)[end - bits..end].to_vec();
                let is_one_hot = row.iter().sum::<f32>() == 1.0 || bits == 0;
                assert!(is_one_hot, "{label}: unit {unit} has {row:?}");
                let kind = skirmish.scenario().recruits[unit].kind;
                for (side, other_kind, other_row) in &seen {
                    if *side == is_ally && bits > 0 {
                        assert_eq!(kind == *other_kind, row == *other_row, "{label}");
                    }
                }
                seen.push((is_ally, kind, row));
            }
        }
    }
}

#[test]
fn every_fighter_can_be_healed_whatever_the_numbers() {
    for (fighters, healers, enemies) in [(1, 1, 1), (8, 2, 2), (3, 1, 9), (12, 3, 1)] {
        let allies = [("marine", fighters), ("marauder", 1), ("medivac", healers)];
        let mut skirmish = skirmish(&allies, &[("zergling", enemies)], "");
        let patients = fighters + 1;
        let actions = skirmish.spec().actions;
        assert_eq!(actions, TARGETS_FROM + enemies.max(patients));
        let observations = begin(&mut skirmish);
        for agent in 0..skirmish.spec().agents {
            let view = observations.local_view(0, AgentId::new(agent));
            let targets = (TARGETS_FROM..actions).filter(|action| view.available()[*action]);
            // Everybody is near enough of everybody.
            let expected = if agent < patients { enemies } else { patients };
            assert_eq!(targets.count(), expected, "agent {agent} of {allies:?}");
        }
    }
}

#[test]
fn a_team_of_healers_that_are_numbered_first_heals_its_fighters() {
    // Types are in alphabetical order, so these healers come before the marines.
    let first = "[[unit]]\nname = \"a-medic\"\nlike = \"medivac\"\n";
    let mut skirmish = skirmish(&[("marine", 4), ("a-medic", 1)], &[("zergling", 1)], first);
    let observations = begin(&mut skirmish);
    let healer = observations.local_view(0, AgentId::new(0));
    assert_eq!(skirmish.spec().actions, TARGETS_FROM + 4);
    assert!(healer.available()[TARGETS_FROM..].iter().all(|is| *is));
}

#[test]
fn without_healers_there_is_an_action_for_each_enemy_and_no_more() {
    let skirmish = skirmish(&[("marine", 9)], &[("zergling", 2)], "");
    assert_eq!(skirmish.spec().actions, TARGETS_FROM + 2);
}

#[test]
fn cooldowns_of_own_types_are_shown_over_their_own_period() {
    for period_s in [0.2_f32, 1.0, 10.0, 60.0] {
        let own = format!(
            "[[unit]]\nname = \"gunner\"\nlike = \"marine\"\nlife = 10000\nweapon = {{ period_s = {period_s} }}\n"
        );
        let enemies = "[[unit]]\nname = \"wall\"\nlike = \"zergling\"\nlife = 100000\n";
        let mut skirmish = skirmish(&[("gunner", 1)], &[("wall", 1)], &(own + enemies));
        let mut observations = begin(&mut skirmish);
        let mut greatest = 0.0_f32;
        for _ in 0..40 {
            let attack = [Action::new(TARGETS_FROM)];
            skirmish
                .step(&attack, &mut observations.row_mut(0))
                .expect("the enemy is in range");
            greatest = greatest.max(observations.state(0)[1]);
        }
        // A period is lengthened by two loops at most.
        let bound = 1.0 + 2.0 / (16.0 * period_s);
        assert!(
            greatest > 0.0 && greatest <= bound,
            "{greatest} with a period of {period_s} s"
        );
    }
}

#[test]
fn the_limit_of_steps_is_a_setting_and_running_out_of_time_pays_nothing() {
    for (episode_limit, expected) in [(20, 20), (0, 60), (7, 7)] {
        let settings = SkirmishSettings {
            episode_limit,
            reward_defeat: -100.0,
            ..SkirmishSettings::default()
        };
        let mut skirmish = mackrl_skirmish::make("3m", &settings).expect("the map is shipped");
        assert_eq!(skirmish.spec().episode_limit, expected);
        let mut observations = begin(&mut skirmish);
        // A team that stands is lost after 21 or 22 steps.
        let mut steps = 0;
        let last = loop {
            steps += 1;
            let actions: Vec<Action> = (0..3)
                .map(|agent| {
                    let view = observations.local_view(0, AgentId::new(agent));
                    Action::new(usize::from(!view.available()[0]))
                })
                .collect();
            let step = skirmish
                .step(&actions, &mut observations.row_mut(0))
                .expect("standing is available");
            if step.end.is_some() {
                break step;
            }
        };
        let is_late = expected < 21;
        assert_eq!(skirmish.battle_statistics().timed_out, is_late);
        if is_late {
            assert_eq!((last.end, last.reward), (Some(EpisodeEnd::Truncated), 0.0));
            assert_eq!(steps, expected);
        } else {
            assert_eq!(last.end, Some(EpisodeEnd::Terminated));
            assert!(last.reward < 0.0, "a defeat is paid for");
        }
    }
}
