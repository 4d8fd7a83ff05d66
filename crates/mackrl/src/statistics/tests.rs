use mackrl_env::{Draw, EpisodeKey, Stream};
use serde_json::Value;

use super::*;

const TOLERANCE: f64 = 1e-12;

fn golden() -> Value {
    serde_json::from_str(include_str!("../../tests/golden/statistics.json")).unwrap()
}

fn scores(golden: &Value, name: &str) -> Vec<Vec<f64>> {
    serde_json::from_value(golden[name].clone()).unwrap()
}

fn bootstrap(golden: &Value) -> Bootstrap {
    Bootstrap {
        seed: golden["seed"].as_u64().unwrap(),
        resamples: usize::try_from(golden["resamples"].as_u64().unwrap()).unwrap(),
        confidence: golden["confidence"].as_f64().unwrap(),
    }
}

fn assert_close(found: f64, expected: &Value, what: &str) {
    let expected = expected.as_f64().unwrap();
    assert!(
        (found - expected).abs() < TOLERANCE,
        "{what}: {found} is not {expected}"
    );
}

fn assert_interval(found: Interval, expected: &Value, what: &str) {
    assert_close(found.estimate, &expected["estimate"], what);
    assert_close(found.low, &expected["low"], what);
    assert_close(found.high, &expected["high"], what);
}

#[test]
fn draws_are_those_of_the_golden_file() {
    let golden = golden();
    let mut expected = golden["uniform"].as_array().unwrap().iter();
    for resample in [0, 3] {
        let key = EpisodeKey::new(golden["seed"].as_u64().unwrap(), Stream::Other, resample);
        for stratum in [0, 2] {
            for place in [0, 5] {
                let found = key.uniform(stratum, Draw::Setup(place));
                assert_close(found, expected.next().unwrap(), "a draw");
            }
        }
    }
}

#[test]
fn averages_and_quantiles_are_those_of_the_golden_file() {
    let golden = golden();
    let runs = &scores(&golden, "first")[0];
    assert_close(
        mean_and_standard_error(runs).1,
        &golden["standard_error"],
        "standard error",
    );
    for pair in golden["quantiles"].as_array().unwrap() {
        assert_close(
            quantile(runs, pair[0].as_f64().unwrap()),
            &pair[1],
            "quantile",
        );
    }
}

#[test]
fn intervals_are_those_of_the_golden_file() {
    let golden = golden();
    let (first, second) = (scores(&golden, "first"), scores(&golden, "second"));
    let bootstrap = bootstrap(&golden);
    for (name, aggregate) in [
        ("mean", Aggregate::Mean),
        ("median", Aggregate::Median),
        ("interquartile-mean", Aggregate::InterquartileMean),
    ] {
        let found = bootstrap.interval(&first, |tasks| aggregate.of(tasks));
        assert_interval(found, &golden["aggregates"][name], name);
    }
    let both = [first.clone(), second].concat();
    let found = bootstrap.interval(&both, |strata| {
        probability_of_improvement(&strata[..first.len()], &strata[first.len()..])
    });
    assert_interval(found, &golden["improvement"], "improvement");
}

#[test]
fn averages_of_small_samples_are_those_of_the_textbook() {
    assert_eq!(mean_and_standard_error(&[7.0]), (7.0, 0.0));
    let (mean, error) = mean_and_standard_error(&[1.0, 2.0, 6.0]);
    assert!(
        (mean - 3.0).abs() < TOLERANCE && (error - (14.0_f64 / 2.0 / 3.0).sqrt()).abs() < TOLERANCE
    );
    assert_eq!(median(&[5.0, 1.0, 2.0]), 2.0);
    assert_eq!(median(&[5.0, 1.0, 2.0, 4.0]), 3.0);
    assert_eq!(quantile(&[0.0, 10.0, 20.0], 0.25), 5.0);
    assert_eq!(interquartile_mean(&[3.0, 1.0, 2.0]), 2.0);
    assert_eq!(interquartile_mean(&[9.0, 2.0, 4.0, -7.0]), 3.0);
    assert_eq!(
        interquartile_mean(&[9.0, 8.0, 2.0, 3.0, 4.0, 5.0, 0.0, 1.0]),
        3.5
    );
}

#[test]
fn what_does_not_exist_is_not_a_number() {
    for found in [mean(&[]), median(&[]), interquartile_mean(&[])] {
        assert!(found.is_nan(), "{found}");
    }
}

#[test]
fn the_median_of_one_task_is_of_its_runs_and_of_several_of_their_means() {
    let tasks = [vec![0.0, 0.1, 0.8], vec![1.0, 1.0], vec![0.2, 0.4]];
    assert_eq!(Aggregate::Median.of(&tasks[..1]), 0.1);
    assert!((Aggregate::Median.of(&tasks) - 0.3).abs() < TOLERANCE);
}

#[test]
fn runs_that_agree_have_no_uncertainty() {
    let found = Bootstrap::default().interval(&[vec![0.5; 3]], |tasks| Aggregate::Mean.of(tasks));
    assert_eq!((found.estimate, found.low, found.high), (0.5, 0.5, 0.5));
}

/// Strata are drawn from on their own: a task whose runs agree is never mixed with another.
#[test]
fn every_resample_has_every_task() {
    let strata = [vec![0.0; 3], vec![1.0; 5]];
    let found = Bootstrap::default().interval(&strata, |tasks| Aggregate::Mean.of(tasks));
    assert_eq!((found.low, found.high), (0.5, 0.5));
}

/// Of two runs, a resample's mean is 0, ½ or 1 with probabilities ¼, ½, ¼.
#[test]
fn resamples_are_drawn_with_replacement_and_evenly() {
    let bootstrap = Bootstrap {
        confidence: 0.48,
        ..Bootstrap::default()
    };
    let mean = |tasks: &[Vec<f64>]| Aggregate::Mean.of(tasks);
    let inner = bootstrap.interval(&[vec![0.0, 1.0]], mean);
    assert_eq!((inner.low, inner.high), (0.5, 0.5));
    let outer = Bootstrap {
        confidence: 0.52,
        ..bootstrap
    };
    let outer = outer.interval(&[vec![0.0, 1.0]], mean);
    assert_eq!((outer.low, outer.high), (0.0, 1.0));
}

#[test]
fn improvement_counts_draws_half_and_tasks_alike() {
    let first = [vec![1.0, 2.0], vec![0.0]];
    let second = [vec![1.0], vec![1.0, 1.0, 1.0]];
    assert_eq!(
        probability_of_improvement(&first, &second),
        f64::midpoint(0.75, 0.0)
    );
    assert_eq!(
        probability_of_improvement(&second, &first),
        f64::midpoint(0.25, 1.0)
    );
}

#[test]
fn a_level_is_crossed_between_two_points_or_at_the_first() {
    let curve = [[0.0, 0.25], [10.0, 0.75], [30.0, 0.5], [40.0, 1.0]];
    assert_eq!(first_crossing(&curve, 0.5), Some(5.0));
    assert_eq!(first_crossing(&curve, 0.2), Some(0.0));
    assert_eq!(first_crossing(&curve, 0.875), Some(37.5));
    assert_eq!(first_crossing(&curve, 1.1), None);
    assert_eq!(first_crossing(&[], 0.5), None);
}

#[test]
fn runs_that_never_cross_are_counted_as_the_latest() {
    let at = |x: f64| vec![[0.0, 0.0], [2.0 * x, 1.0]];
    let never = vec![[0.0, 0.0], [100.0, 0.1]];
    let most = Crossings::of(&[at(10.0), never.clone(), at(30.0)], 0.5);
    assert_eq!((most.reached, most.runs, most.median), (2, 3, Some(30.0)));
    let half = Crossings::of(&[at(10.0), never.clone()], 0.5);
    assert_eq!((half.reached, half.runs, half.median), (1, 2, None));
    assert_eq!(Crossings::of(&[never], 0.5).median, None);
}

#[test]
fn curves_are_read_between_their_points_and_not_outside() {
    let curve = [[10.0, 1.0], [20.0, 3.0]];
    let read = |x| interpolate(&curve, x);
    assert_eq!(
        [read(10.0), read(15.0), read(20.0)],
        [Some(1.0), Some(2.0), Some(3.0)]
    );
    assert_eq!([read(9.0), read(21.0)], [None, None]);
}
