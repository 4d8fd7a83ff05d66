//! `mackrl plot`: learning curves of many runs.

use std::path::Path;

use mackrl::statistics::{Aggregate, Bootstrap, mean_and_standard_error};
use mackrl_run::{
    recorded::{Gridded, Grouping, find, group},
    run_folder,
};
use serde::Serialize;

use super::{headline_or, note_left_out};
use crate::{
    args::{CurveAxis, CurveStatistic, PlotArgs},
    failure::Failure,
    output,
    plot::{Axis, Colour, LineChart, Mark, Point, Series},
};

/// Resamples of each interval along a curve: there are hundreds of them, and a pixel is all that they have to be right to.
const RESAMPLES: usize = 2_000;

/// A curve as data.
#[derive(Debug, Serialize)]
struct Drawn {
    name: String,
    runs: usize,
    x: Vec<f64>,
    y: Vec<f64>,
    low: Vec<f64>,
    high: Vec<f64>,
}

/// Draws the curves into the file that was named.
pub(crate) fn run(args: &PlotArgs) -> anyhow::Result<()> {
    let format = Format::of(&args.out)?;
    let grouping = group(find(&args.runs.paths)?, &args.runs.selection())?;
    note_left_out(&grouping);
    let map = only_map(&grouping)?;
    let metric = headline_or(args.metric.as_ref(), &grouping);
    let series = curves(&grouping, args, &metric)?;
    let chart = chart(args, &metric, map, &series);
    let picture = match format {
        Format::Svg => chart.to_svg().into_bytes(),
        Format::Png => chart.to_png()?,
    };
    run_folder::replace(&args.out, &picture)?;
    let drawn: Vec<Drawn> = series.into_iter().map(Drawn::new).collect();
    if args.json {
        return output::print_json(&drawn);
    }
    let curves: Vec<String> = (drawn.iter())
        .map(|drawn| format!("{} ({})", drawn.name, drawn.runs))
        .collect();
    output::print(&format!("{}: {}\n", args.out.display(), curves.join(", ")))
}

/// The curve of each series: its name, the number of its runs, its points. Learners that do not have the metric, such as the
/// delegation rate, are left out if another has it.
fn curves(
    grouping: &Grouping,
    args: &PlotArgs,
    metric: &str,
) -> anyhow::Result<Vec<(String, usize, Vec<Point>)>> {
    let mut curves = Vec::new();
    let mut missing = None;
    for series in &grouping.series {
        match Gridded::read(series, metric, args.x.recorded()) {
            Ok(gridded) => {
                let points = points(&gridded, args.statistic);
                curves.push((series.name.clone(), series.runs.len(), points));
            }
            Err(error) if error.is_missing_metric() => missing = Some(error),
            Err(error) => return Err(error.into()),
        }
    }
    match missing {
        Some(error) if curves.is_empty() => Err(error.into()),
        _ => Ok(curves),
    }
}

/// How a picture is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Format {
    Svg,
    Png,
}

impl Format {
    fn of(path: &Path) -> anyhow::Result<Self> {
        match path.extension().and_then(|ending| ending.to_str()) {
            Some("svg") => Ok(Self::Svg),
            Some("png") => Ok(Self::Png),
            _ => {
                let message = format!(
                    "{} ends neither in .svg nor in .png, which says how the picture is written",
                    path.display()
                );
                Err(Failure::Usage { message }.into())
            }
        }
    }
}

/// The map of all runs: win rates on different maps are not one curve.
fn only_map(grouping: &Grouping) -> anyhow::Result<&str> {
    match *grouping.maps() {
        [map] => Ok(map),
        ref maps => {
            let message = format!(
                "the runs are on {} maps, expected one: choose it with --map ({})",
                maps.len(),
                maps.join(", ")
            );
            Err(Failure::Usage { message }.into())
        }
    }
}

fn points(gridded: &Gridded, statistic: CurveStatistic) -> Vec<Point> {
    let places = gridded.places.iter().zip(&gridded.heights);
    let point = |(&x, heights): (&f64, &Vec<f64>)| match statistic {
        CurveStatistic::Mean => {
            let (mean, error) = mean_and_standard_error(heights);
            Point::with_error(x, mean, error)
        }
        CurveStatistic::Iqm => {
            let bootstrap = Bootstrap {
                resamples: RESAMPLES,
                ..Bootstrap::default()
            };
            let strata = std::slice::from_ref(heights);
            let iqm = bootstrap.interval(strata, |tasks| Aggregate::InterquartileMean.of(tasks));
            Point {
                x,
                y: iqm.estimate,
                band: [iqm.low, iqm.high],
            }
        }
    };
    places.map(point).collect()
}

fn chart(
    args: &PlotArgs,
    metric: &str,
    map: &str,
    drawn: &[(String, usize, Vec<Point>)],
) -> LineChart {
    let is_share = ["battle_won_mean", "delegation_rate", "knowledge_rate"]
        .iter()
        .any(|share| metric.contains(share));
    let y_range = is_share.then_some([-0.02, 1.02]);
    let label = match metric {
        "test_battle_won_mean" => "Share of battles won in greedy tests".to_owned(),
        metric => metric.to_owned(),
    };
    let series: Vec<Series> = (drawn.iter().zip(Colour::LINES.into_iter().cycle()))
        .map(|((name, runs, points), colour)| Series {
            name: Some(format!("{name} ({runs})")),
            colour,
            mark: Mark::Line,
            points: points.clone(),
        })
        .collect();
    LineChart {
        title: args.title.clone().unwrap_or_else(|| match metric {
            "test_battle_won_mean" => format!("Battles won on {map}"),
            metric => format!("{metric} on {map}"),
        }),
        subtitle: match args.statistic {
            CurveStatistic::Mean => "Mean over runs, band ± one standard error",
            CurveStatistic::Iqm => "Interquartile mean over runs, band 95 % bootstrap interval",
        }
        .into(),
        x_axis: Axis {
            label: match args.x {
                CurveAxis::Steps => "Environment steps",
                CurveAxis::WallClock => "Seconds of training and testing",
            }
            .into(),
            range: None,
        },
        y_axis: Axis {
            label,
            range: y_range,
        },
        series,
    }
}

impl Drawn {
    fn new((name, runs, points): (String, usize, Vec<Point>)) -> Self {
        let column = |of: fn(&Point) -> f64| points.iter().map(of).collect();
        Self {
            name,
            runs,
            x: column(|point| point.x),
            y: column(|point| point.y),
            low: column(|point| point.band[0]),
            high: column(|point| point.band[1]),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_ending_says_how_a_picture_is_written() {
        assert_eq!(Format::of(Path::new("a/b.svg")).unwrap(), Format::Svg);
        assert_eq!(Format::of(Path::new("b.png")).unwrap(), Format::Png);
        for name in ["b.pdf", "svg", "b.SVG.txt"] {
            assert!(Format::of(Path::new(name)).is_err(), "{name}");
        }
    }

    #[test]
    fn bands_are_standard_errors_or_bootstrap_intervals() {
        let gridded = Gridded {
            places: vec![5.0],
            heights: vec![vec![0.0, 1.0]],
        };
        let mean = points(&gridded, CurveStatistic::Mean)[0];
        assert_eq!((mean.x, mean.y, mean.band), (5.0, 0.5, [0.0, 1.0]));
        let iqm = points(&gridded, CurveStatistic::Iqm)[0];
        assert_eq!((iqm.y, iqm.band), (0.5, [0.0, 1.0]));
    }
}
