use std::sync::LazyLock;

use proptest::prelude::*;

use super::*;
use crate::UnitData;

static EXAMPLE: LazyLock<String> = LazyLock::new(|| {
    let file = concat!(
        env!("CARGO_MANIFEST_DIR"),
        "/../../examples/scenarios/sniper-alley.toml"
    );
    std::fs::read_to_string(file).unwrap()
});

fn read(text: &str) -> Result<Scenario, ScenarioProblem> {
    let units = UnitTypes::load(UnitData::Liberty).unwrap();
    parse("test", text, &units)
}

fn problem(from: &str, to: &str) -> String {
    assert!(EXAMPLE.contains(from), "the example has no `{from}`");
    read(&EXAMPLE.replacen(from, to, 1))
        .unwrap_err()
        .to_string()
}

#[test]
fn the_example_has_its_own_terrain_and_unit() {
    let scenario = read(&EXAMPLE).unwrap();
    let sniper = scenario
        .field
        .profiles
        .iter()
        .find(|profile| profile.name == "sniper")
        .unwrap();
    assert_eq!(sniper.strike.as_ref().unwrap().range, 8.0);
    assert_eq!(
        sniper.speed,
        2.25 / 16.0,
        "what is not stated is a marine's"
    );
    assert!(
        !scenario.field.terrain.is_walkable(0, 0),
        "a wall is drawn there"
    );
    assert_eq!((scenario.agents, scenario.enemies()), (3, 8));
}

#[test]
fn every_shipped_map_is_a_scenario() {
    for name in crate::map_names() {
        let units = UnitTypes::load(UnitData::Liberty).unwrap();
        let shipped = Scenario::shipped(name, &units).unwrap().unwrap();
        let text = std::fs::read_to_string(format!("maps/{name}.toml")).unwrap();
        let custom = parse(name, &text, &units).unwrap();
        assert_eq!(custom.recruits, shipped.recruits, "{name}");
    }
}

#[test]
fn a_problem_names_line_column_found_and_expected() {
    assert_eq!(
        problem("episode_limit = 150", "episode_limit = 0"),
        "9:17: episode_limit is 0, expected an integer in [1, 100000]"
    );
    assert!(
        problem("race = \"zerg\"", "race = \"orc\"").contains("unknown variant `orc`, expected")
    );
    assert!(problem("unit = \"sniper\"", "unit = \"sniperr\"").contains("expected one of marine"));
    assert!(
        problem("life = 60", "life = -60")
            .contains("life is -60, expected a number in [1, 100000]")
    );
    assert!(problem("life = 60", "life = nan").contains("life is NaN"));
    assert!(problem("life = 60", "live = 60").contains("unknown field `live`, expected"));
    assert!(problem("like = \"marine\"", "like = \"marin\"").contains("unit `marin` is unknown"));
    assert!(
        problem("count = 8", "count = 2000000000000").contains("expected an integer in [1, 100]")
    );
    assert!(problem("count = 8", "count = \"eight\"").contains("expected an integer"));
    assert!(problem("at = [26, 16]", "at = [26, inf]").contains("expected coordinates in [0, 32]"));
    assert!(problem("at = [26, 16]", "at = [0, 0]").contains("where nobody can stand"));
    assert!(problem("####\n", "###x\n").contains("expected `.` (walkable) or `#` (wall)"));
    assert!(problem("terrain = \"\"\"", "terrain = \"\"\"\n###").contains("expected 32"));
}

#[test]
fn a_problem_within_a_unit_type_is_found_where_it_was_written() {
    let place = |from: &str| {
        let line = EXAMPLE.lines().position(|line| line.starts_with(from));
        line.expect("a line of the example") + 1
    };
    let damage = place("damage = 18");
    assert_eq!(
        problem("damage = 18", "damage = \"much\""),
        format!("{damage}:10: found string \"much\", expected a number")
    );
    let misspelt = problem("damage = 18", "damge = 18");
    assert!(
        misspelt.starts_with(&format!("{damage}:9: unknown field `damge`"))
            && misspelt.ends_with("did you mean `damage`?"),
        "{misspelt}"
    );
    let delivery = problem("damage = 18", "delivery = { misile = { speed = 9 } }");
    assert!(
        delivery.starts_with(&format!("{damage}:12: unknown variant `misile`")),
        "{delivery}"
    );
    let missing = problem("like = \"marine\" ", "# ");
    assert!(missing.ends_with("and what differs"), "{missing}");
}

#[test]
fn types_can_have_any_kind_of_weapon() {
    for delivery in [
        "{ missile = { speed = 18.75 } }",
        "{ burst = { radius = 2.2, structure_damage = 80 } }",
        "{ sweep = { half_width = 1.25, spacing = 0.25, radius = 0.15, interval_s = 0.03, delay_s = 0.25, target_delay_s = 0.4 } }",
    ] {
        let weapon = format!("damage = 18\nhits = 2\ndelivery = {delivery}");
        play(read(&EXAMPLE.replacen("damage = 18", &weapon, 1)).unwrap());
    }
    let slow = problem("damage = 18", "delivery = { missile = { speed = 0.5 } }");
    assert!(
        slow.ends_with("speed is 0.5, expected a number in [1, 1000]"),
        "{slow}"
    );
}

#[test]
fn a_name_that_is_misspelt_is_answered_with_the_nearest() {
    for (from, to, meant) in [
        ("unit = \"zergling\"", "unit = \"zerglin\"", "zergling"),
        ("like = \"marine\"", "like = \"marin\"", "marine"),
        ("race = \"zerg\"", "race = \"Zerg\"", "zerg"),
        ("episode_limit", "episode_limt", "episode_limit"),
        ("{ attack-move =", "{ atack-move =", "attack-move"),
    ] {
        let message = problem(from, to);
        let question = format!("did you mean `{meant}`?");
        assert!(message.ends_with(&question), "{message}");
    }
}

#[test]
fn a_point_has_two_coordinates() {
    for (from, to) in [
        ("at = [26, 16]", "at = [26, 16, 3]"),
        ("at = [26, 16]", "at = [26]"),
        ("attack-move = [8, 16]", "attack-move = [8, 16, 24]"),
        (
            "attack-move = [8, 16]",
            "attack-move-between = [[8, 16], [1, 2, 3]]",
        ),
        ("attack-move = [8, 16]", "attack-move-between = [[8, 16]]"),
    ] {
        let message = problem(from, to);
        assert!(message.contains("found an array of"), "{to}: {message}");
    }
}

#[test]
fn text_that_nests_or_repeats_without_end_is_refused() {
    for deep in ["[", "{a="] {
        let deep = format!("a = {}", deep.repeat(80_000));
        assert!(
            read(&deep).unwrap_err().message.contains("nest too deeply"),
            "{deep:.9}"
        );
    }
    let long = "#".repeat(LENGTH_MAX + 1);
    assert!(
        read(&long)
            .unwrap_err()
            .message
            .contains("expected at most")
    );
    let many = format!(
        "{}\n{}",
        *EXAMPLE,
        "[[unit]]\nname = \"x\"\nlike = \"marine\"\n".repeat(99)
    );
    assert!(
        read(&many)
            .unwrap_err()
            .message
            .contains("expected at most 32")
    );
}

/// Plays a few steps: whatever is accepted can be played.
fn play(scenario: Scenario) {
    use crate::scripted::*;
    use mackrl_env::{Action, Environment, EpisodeKey, Observations, Stream};
    let settings = crate::SkirmishSettings::default();
    let mut skirmish = crate::Skirmish::new(Arc::new(scenario), settings).unwrap();
    let mut team = ScriptedTeam::new(ScriptedPolicy::Nearest, &skirmish);
    let mut observations = Observations::new(skirmish.spec(), 1);
    let mut actions = vec![Action::default(); skirmish.spec().agents];
    let key = EpisodeKey::new(1, Stream::Other, 0);
    skirmish.reset(key, &mut observations.row_mut(0));
    for step in 0..12 {
        team.act(&observations, 0, (key, step), &mut actions);
        let time_step = skirmish
            .step(&actions, &mut observations.row_mut(0))
            .unwrap();
        assert!(
            time_step.reward.is_finite(),
            "a reward of {}",
            time_step.reward
        );
        assert!(
            observations.state(0).iter().all(|x| x.is_finite()),
            "the state is finite"
        );
        if time_step.end.is_some() {
            break;
        }
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 200, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn damaged_scenarios_are_read_or_refused(at in 0.0..1.0_f64, length in 0_usize..12, put in "[-0-9a-z\\[\\]{}=\",.# \n\u{e9}]{0,9}") {
        let characters: Vec<char> = EXAMPLE.chars().collect();
        #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a place in a short text")]
        let start = (at * characters.len() as f64) as usize;
        let end = (start + length).min(characters.len());
        let text: String = characters[..start].iter().copied().chain(put.chars()).chain(characters[end..].iter().copied()).collect();
        if let Ok(scenario) = read(&text) {
            play(scenario);
        }
    }

    #[test]
    fn numbers_out_of_the_blue_are_read_or_refused(line in 0_usize..200, number in prop_oneof![
        Just("nan".to_owned()), Just("-inf".to_owned()), Just("1e300".to_owned()), Just("-1".to_owned()),
        Just("9223372036854775807".to_owned()), any::<f32>().prop_map(|x| format!("{x:?}").to_lowercase()), (0..200_u32).prop_map(|x| x.to_string())])
    {
        let numbered: Vec<usize> = EXAMPLE.lines().enumerate().filter(|(_, line)| line.contains(" = ") && !line.starts_with('#')).map(|(index, _)| index).collect();
        let chosen = numbered[line % numbered.len()];
        let text: Vec<String> = EXAMPLE.lines().enumerate().map(|(index, line)| match line.split_once(" = ") {
            Some((key, _)) if index == chosen => format!("{key} = {number}"),
            _ => line.to_owned(),
        }).collect();
        if let Ok(scenario) = read(&text.join("\n")) {
            play(scenario);
        }
    }

    #[test]
    fn random_toml_is_refused_in_words(text in "([a-z]{1,7}|terrain|allies|unit|groups|order|count)( = |\\.|\\[|\\]|\n){1,2}([0-9]{1,25}|\"[a-z\n]{0,5}\"|\\[|\\{|true|nan)\n?") {
        if let Err(problem) = read(&text) {
            prop_assert!(!problem.message.is_empty() && problem.line >= 1 && problem.column >= 1);
        }
    }
}
