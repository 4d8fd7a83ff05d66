use super::*;
use crate::SkirmishSettings;

fn played(map: &str, policy: Policy, episodes: usize) -> Sample {
    play(
        (map, policy),
        &SkirmishSettings::default(),
        episodes,
        2,
        |_| {},
    )
    .unwrap()
}

#[test]
fn the_numbers_of_the_game_can_be_read_and_have_sources() {
    let references = References::load().unwrap();
    for row in &references.references {
        assert!(crate::map_names().contains(&&*row.map), "{}", row.map);
        assert!(row.tolerance > 0.0 && row.episodes > 0, "{row:?}");
        assert!(!references.source_of(&row.map).is_empty(), "{}", row.map);
    }
    for source in &references.sources {
        let is_hash =
            source.commit.len() == 40 && source.commit.bytes().all(|b| b.is_ascii_hexdigit());
        assert!(is_hash, "{}", source.repository);
    }
    let checks: std::collections::BTreeSet<u8> =
        references.references.iter().map(|row| row.check).collect();
    assert_eq!(
        checks.into_iter().collect::<Vec<_>>(),
        (1..=11).collect::<Vec<_>>()
    );
}

#[test]
fn threads_change_no_sample() {
    let settings = SkirmishSettings::default();
    let by = |threads| play(("3m", Policy::Random), &settings, 37, threads, |_| {}).unwrap();
    assert_eq!(by(1), by(3));
}

#[test]
fn a_team_that_stops_kills_nobody_and_one_that_attacks_the_first_enemy_kills_it() {
    let stop = played("3m", Policy::Stop, 20);
    assert_eq!(stop.value(Quantity::Killed), Some(0.0));
    assert_eq!(stop.value(Quantity::Return), Some(0.0));
    let attack = played("3m", Policy::Attack(0), 20);
    // Once in a while the team dies before the last shot at it.
    assert!(attack.value(Quantity::Killed) >= Some(0.9));
}

#[test]
fn smacs_own_script_attacks_from_where_agents_cannot_and_heals() {
    let rush = played("3s5z", Policy::Heuristic, 10);
    assert!(rush.value(Quantity::Killed) > Some(2.0));
    // Against an enemy that stays at home, agents that stood would time out.
    let siege = played("2s_vs_1sc", Policy::Heuristic, 5);
    assert!(siege.episodes.iter().all(|episode| !episode.timed_out));
}

#[test]
fn a_row_passes_within_its_tolerance_and_is_open_without_a_sample() {
    let references = References::load().unwrap();
    let mut sample = played("3m", Policy::Stop, 2);
    for episode in &mut sample.episodes {
        episode.length = 22;
    }
    let findings = judge(&references, &[sample]);
    let of = |quantity| {
        let mut rows = findings
            .iter()
            .filter(|row| row.policy == Some(Policy::Stop));
        rows.find(|row| row.map == "3m" && row.quantity == quantity)
            .unwrap()
    };
    assert_eq!(of(Quantity::Length).ours, Some(22.0));
    assert_eq!(
        of(Quantity::Length).pass,
        Some(false),
        "0.18 above, 0.15 allowed"
    );
    assert_eq!(of(Quantity::LengthSd).pass, Some(false), "all alike");
    assert_eq!(findings.iter().filter(|row| row.pass.is_some()).count(), 2);
    assert_eq!(passed(&findings), [("check-1".to_owned(), false)]);
}

#[test]
fn a_spread_is_that_of_the_textbook() {
    let values: Vec<f64> = (1..=10).map(f64::from).collect();
    let spread = Spread::of(&values).unwrap();
    assert_eq!(spread.quantiles, [1.0, 3.0, 5.0, 8.0, 9.0]);
    assert!((spread.mean - 5.5).abs() < 1e-12);
    assert!((spread.sd - (82.5_f64 / 9.0).sqrt()).abs() < 1e-12);
    assert_eq!(Spread::of(&[]), None);
}

#[test]
fn policies_are_read_as_they_are_written() {
    for policy in [
        Policy::Random,
        Policy::Stop,
        Policy::Attack(7),
        Policy::Heuristic,
    ] {
        assert_eq!(Policy::try_from(policy.to_string()), Ok(policy));
    }
    Policy::try_from("attack-".to_owned()).unwrap_err();
}
