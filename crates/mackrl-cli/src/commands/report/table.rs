//! A report as text.

use mackrl::statistics::Crossings;

use super::findings::{Averages, Comparison, Findings, MapFindings, RUNS_LEAST};
use crate::{output, reproduce::interval};

/// The report as it reads.
pub(super) fn text(findings: &Findings) -> String {
    let mut text = format!(
        "{}: {}\n[a, b]: {:.0} % stratified-bootstrap interval, {} resamples\n",
        findings.metric,
        findings.score,
        100.0 * findings.confidence,
        findings.resamples
    );
    let learners = findings.maps.iter().flat_map(|map| &map.algorithms);
    if learners
        .map(|learner| learner.runs)
        .any(|runs| (2..RUNS_LEAST).contains(&runs))
    {
        text += "of fewer than 5 runs, bootstrap intervals are too narrow: Student's t gives wider ones\n";
    }
    for map in &findings.maps {
        text += &format!("\n{}\n", map.map);
        text += &indented(&averages_of(map));
        text.push('\n');
        text += &indented(&steps_of(map));
        if !map.comparisons.is_empty() {
            text.push('\n');
            text += &indented(&comparisons(&map.comparisons));
        }
    }
    if !findings.overall.is_empty() {
        text += "\nover all maps\n";
        let rows = findings.overall.iter().map(|overall| {
            let mut row = vec![overall.algorithm.clone()];
            row.extend(averages(&overall.averages));
            row
        });
        let heading = words(&["", "interquartile mean", "median of maps", "mean"]);
        text += &indented(&[vec![heading], rows.collect()].concat());
        let all: Vec<Comparison> = (findings.overall.iter())
            .flat_map(|overall| overall.comparisons.clone())
            .collect();
        if !all.is_empty() {
            text.push('\n');
            text += &indented(&comparisons(&all));
        }
    }
    text
}

fn averages_of(map: &MapFindings) -> Vec<Vec<String>> {
    let heading = words(&[
        "",
        "runs",
        "interquartile mean",
        "median",
        "mean",
        "mean by Student's t",
    ]);
    let rows = map.algorithms.iter().map(|algorithm| {
        let mut row = vec![algorithm.algorithm.clone(), algorithm.runs.to_string()];
        if algorithm.runs == 1 {
            // One run says nothing of the spread of runs.
            let estimate = algorithm.averages.mean.estimate;
            row.extend(["", "", &format!("{estimate:.3}"), ""].map(str::to_owned));
            return row;
        }
        row.extend(averages(&algorithm.averages));
        let student = algorithm.student_interval;
        row.extend(student.map(|[low, high]| format!("[{low:.3}, {high:.3}]")));
        row
    });
    [vec![heading], rows.collect()].concat()
}

fn steps_of(map: &MapFindings) -> Vec<Vec<String>> {
    let mut heading = words(&["steps to"]);
    let levels = map.algorithms.first();
    let levels = levels.map_or(&[][..], |algorithm| &algorithm.steps_to[..]);
    heading.extend(
        levels
            .iter()
            .map(|steps| format!("{:.0} % (runs)", 100.0 * steps.level)),
    );
    let rows = map.algorithms.iter().map(|algorithm| {
        let mut row = vec![algorithm.algorithm.clone()];
        row.extend(algorithm.steps_to.iter().map(steps));
        row
    });
    [vec![heading], rows.collect()].concat()
}

fn comparisons(comparisons: &[Comparison]) -> Vec<Vec<String>> {
    let heading = words(&["probability of improvement", ""]);
    let rows = comparisons.iter().map(|comparison| {
        let found = if comparison.tested {
            interval(comparison.probability_of_improvement)
        } else {
            format!("not tested: needs {RUNS_LEAST} runs of each")
        };
        vec![
            format!("{} over {}", comparison.first, comparison.second),
            found,
        ]
    });
    [vec![heading], rows.collect()].concat()
}

fn averages(averages: &Averages) -> [String; 3] {
    [averages.interquartile_mean, averages.median, averages.mean].map(interval)
}

fn steps(crossings: &Crossings) -> String {
    let Crossings { reached, runs, .. } = crossings;
    let median = crossings
        .median
        .map_or_else(|| "–".to_owned(), |steps| format!("{steps:.0}"));
    format!("{median} ({reached}/{runs})")
}

fn words(words: &[&str]) -> Vec<String> {
    words.iter().map(|&word| word.to_owned()).collect()
}

fn indented(rows: &[Vec<String>]) -> String {
    let table = output::table(rows);
    table.lines().flat_map(|line| ["  ", line, "\n"]).collect()
}
