//! Two runs: what they were to do, what they recorded, and, played again, where they part.

use mackrl_run::{
    config::Config,
    provenance::Provenance,
    run_folder::{Recorded, Row},
};
use serde::Serialize;
use serde_json::Value;

use super::{
    Comparison, Differing,
    files::same,
    replay::{Replay, RowDifference, replay},
};
use crate::args::DiffArgs;

/// Two runs.
#[derive(Debug, Serialize)]
pub(super) struct Runs {
    equal: bool,
    /// The versions of simulator and learning, if they differ.
    versions: Option<Differing>,
    /// The hashes of the map data, if they differ.
    map_data: Option<Differing>,
    /// All settings that differ.
    configuration: Vec<Differing>,
    /// The first row of metrics that differs.
    metrics: Option<RowDifference>,
    /// Whether both have final weights, and they differ.
    weights_differ: bool,
    /// What playing both again showed, if that was done.
    replay: Option<Replay>,
}

/// Compares the runs that `args` name.
pub(super) fn compare(args: &DiffArgs) -> anyhow::Result<Runs> {
    let (a, b) = (Recorded::open(&args.a)?, Recorded::open(&args.b)?);
    let metrics = first_in_rows(&a.rows, &b.rows);
    let weights_differ = a.weights.is_some() && b.weights.is_some() && a.weights != b.weights;
    let replay = if args.no_replay || metrics.is_none() && !weights_differ {
        None
    } else {
        // Weights come after all rows.
        let last_row = metrics.as_ref().map_or(usize::MAX, |found| found.row - 1);
        Some(replay([&a, &b], last_row, args.threads.count())?)
    };
    let mut runs = Runs {
        equal: false,
        versions: of_provenance("versions", &a, &b, |one| one.versions.to_string()),
        map_data: of_provenance("map data", &a, &b, |one| one.map_sha256.clone()),
        configuration: settings(&a.config, &b.config),
        metrics,
        weights_differ,
        replay,
    };
    runs.equal = runs.first().is_none();
    Ok(runs)
}

/// The first row that differs, and its first value that does.
pub(super) fn first_in_rows(a: &[Row], b: &[Row]) -> Option<RowDifference> {
    (0..a.len().max(b.len())).find_map(|index| {
        let (own, other) = (a.get(index), b.get(index));
        let value = match (own, other) {
            (Some(own), Some(other)) => in_row(own, other)?,
            _ => Differing::new("number of rows", a.len(), b.len()),
        };
        let row = own.or(other).and_then(|row| row.get("t_env"));
        Some(RowDifference {
            row: index + 1,
            t_env: row.cloned().unwrap_or_default(),
            value,
        })
    })
}

fn in_row(own: &Row, other: &Row) -> Option<Differing> {
    let names = own
        .keys()
        .chain(other.keys().filter(|name| !own.contains_key(*name)));
    let value = |row: &Row, name: &String| row.get(name).cloned().unwrap_or(Value::Null);
    names
        .map(|name| Differing::new(name.clone(), value(own, name), value(other, name)))
        .find(|differing| differing.a != differing.b)
}

fn of_provenance(
    name: &str,
    a: &Recorded,
    b: &Recorded,
    of: impl Fn(&Provenance) -> String,
) -> Option<Differing> {
    let value = |run: &Recorded| run.provenance.as_ref().map(&of);
    let (a, b) = (value(a), value(b));
    (a != b).then(|| Differing::new(name, a, b))
}

/// Every setting that differs.
fn settings(a: &Config, b: &Config) -> Vec<Differing> {
    let value = |config: &Config, key: &str| {
        let value = config.get(key);
        value.map_or(Value::Null, |value| {
            serde_json::to_value(value).unwrap_or_default()
        })
    };
    let of_a: Vec<String> = a.keys().collect();
    let of_b = b.keys().filter(|key| !of_a.contains(key));
    let keys = of_a.iter().cloned().chain(of_b);
    keys.map(|key| {
        let (a, b) = (value(a, &key), value(b, &key));
        Differing::new(key, a, b)
    })
    .filter(|setting| setting.a != setting.b)
    .collect()
}

impl Comparison for Runs {
    fn first(&self) -> Option<String> {
        let of = |found: &Option<Differing>| found.as_ref().map(Differing::words);
        let configuration = || self.configuration.first().map(Differing::words);
        let metrics = || self.metrics.as_ref().map(RowDifference::words);
        let weights = || self.weights_differ.then(|| "final weights".to_owned());
        of(&self.versions)
            .or_else(|| of(&self.map_data))
            .or_else(configuration)
            .or_else(metrics)
            .or_else(weights)
    }

    fn lines(&self) -> Vec<(&'static str, String)> {
        let of = |found: &Option<Differing>| found.as_ref().map_or_else(same, Differing::words);
        let settings: Vec<String> = self.configuration.iter().map(Differing::words).collect();
        let settings = if settings.is_empty() {
            same()
        } else {
            settings.join("; ")
        };
        let metrics = self.metrics.as_ref();
        let weights = if self.weights_differ {
            "different".to_owned()
        } else {
            same()
        };
        let mut lines = vec![
            ("versions", of(&self.versions)),
            ("map data", of(&self.map_data)),
            ("configuration", settings),
            ("metrics", metrics.map_or_else(same, RowDifference::words)),
            ("final weights", weights),
        ];
        lines.extend(self.replay.iter().flat_map(Replay::lines));
        lines
    }
}

#[cfg(test)]
mod tests {
    use serde_json::json;

    use super::*;

    fn rows(values: &[Value]) -> Vec<Row> {
        let object = |value: &Value| value.as_object().unwrap().clone();
        values.iter().map(object).collect()
    }

    #[test]
    fn the_first_row_and_its_first_value_are_named() {
        let a = rows(&[json!({ "t_env": 0 }), json!({ "t_env": 9, "x": 1.5 })]);
        let b = rows(&[json!({ "t_env": 0 }), json!({ "t_env": 9, "x": 2.5 })]);
        let found = first_in_rows(&a, &b).unwrap();
        assert_eq!(found.words(), "row 2 (9 environment steps), x: 1.5, 2.5");
        assert_eq!(first_in_rows(&a, &a), None);
        let found = first_in_rows(&a, &b[..1]).unwrap();
        assert_eq!(
            found.words(),
            "row 2 (9 environment steps), number of rows: 2, 1"
        );
    }

    #[test]
    fn settings_are_compared_key_by_key() {
        let mut other = Config::default();
        other.run.seed = 7;
        other.env.set("move_amount", 5.0).unwrap();
        let found = settings(&Config::default(), &other);
        let names: Vec<&str> = found.iter().map(|setting| setting.name.as_str()).collect();
        assert_eq!(names, ["env.move_amount", "run.seed"]);
        assert_eq!(found[1].words(), "run.seed: 1, 7");
    }
}
