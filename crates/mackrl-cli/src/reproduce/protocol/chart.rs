//! The protocol's charts.

use super::{
    ProtocolReport, Study,
    claims::differences,
    delegation::{Delegation, Moment},
    study::{CHOICE, Cell, LEARNED, LEARNERS, Quantity, interquartile},
};
use crate::{
    plot::{Axis, Colour, LineChart, Mark, Multiple, Point, Series, SmallMultiples},
    reproduce::{
        Chart, figure6, interval,
        learning::{Curve, Curves, Panel, Published, line, published_rates, win_rates},
    },
};

/// Figure 6 of each map and configuration of which both learners have two runs, Figure 7, and the ablations of each configuration of
/// which all have two runs; each with the name of its files.
pub(super) fn charts(study: &Study, report: &ProtocolReport) -> Vec<(String, Chart)> {
    let Curves::Maps(published) = figure6::FIGURE.curves else {
        return Vec::new();
    };
    let mut charts = Vec::new();
    for (map, published) in figure6::FIGURE.maps.iter().zip(published) {
        for configuration in study.configurations() {
            let cells = LEARNERS.map(|learner| study.cell(map, [learner, &configuration, ""]));
            if let [Some(mackrl), Some(central_v)] = cells
                && [mackrl, central_v].iter().all(|cell| cell.runs.len() > 1)
            {
                let name = format!("figure6-{map}-{configuration}");
                charts.push((name, win_rates_of([mackrl, central_v], published)));
            }
        }
    }
    if let Some(delegation) = &report.delegation {
        charts.push(("figure7".to_owned(), delegation_of(delegation)));
    }
    for configuration in study.configurations() {
        if let Some(chart) = ablations_of(study, &configuration) {
            charts.push((format!("ablations-{CHOICE}-{configuration}"), chart));
        }
    }
    charts
}

/// A panel for each ablation, with MACKRL in all of them.
fn ablations_of(study: &Study, configuration: &str) -> Option<Chart> {
    let mackrl = study.cell(CHOICE, [LEARNED[0], configuration, LEARNED[1]])?;
    let cells = (study.cells.iter()).filter(|cell| cell.configuration == configuration);
    let others: Vec<&Cell> = cells.filter(|cell| cell.name() != mackrl.name()).collect();
    let drawn = |cell: &&Cell| cell.runs.len() > 1;
    (others.iter().chain([&mackrl]).all(drawn)).then_some(())?;
    let series = |cell: &Cell, name: &str, colour| {
        let points = curve(cell).points(&cell.places());
        line(name.to_owned(), colour, points)
    };
    let panel = |cell: &&Cell| {
        let paired = differences(cell, mackrl, |cell| cell.of_runs(Quantity::All));
        Multiple {
            title: format!("{} {}", cell.learner, cell.variant),
            note: interval(interquartile(&paired)).replace('-', "−"),
            series: vec![
                series(mackrl, "MACKRL", Colour::BLUE),
                series(cell, "what the panel names", Colour::VERMILLION),
            ],
        }
    };
    Some(Chart::Multiples(SmallMultiples {
        title: format!("What MACKRL's parts are worth on {CHOICE}, {configuration}"),
        subtitle: format!(
            "Greedy tests; mean of {} seeds ± one standard error. The number: over training less MACKRL, paired, with its 95 % interval",
            mackrl.runs.len()
        ),
        x_axis: axis(figure6::FIGURE.axes[0], None),
        y_axis: axis(figure6::FIGURE.axes[1], Some([-0.02, 1.02])),
        columns: 4,
        panels: others.iter().map(panel).collect(),
    }))
}

fn axis(label: &str, range: Option<[f64; 2]>) -> Axis {
    Axis {
        label: label.to_owned(),
        range,
    }
}

fn curve(cell: &Cell) -> Curve {
    let runs: Vec<&[f64]> = cell.runs.values().map(|run| &*run.battle_won).collect();
    Curve::of(&runs)
}

fn win_rates_of(cells: [&Cell; 2], published: &'static Published) -> Chart {
    let [mackrl, central_v] = cells;
    let panel = Panel {
        map: mackrl.map.clone(),
        mackrl: curve(mackrl),
        central_v: curve(central_v),
        published,
    };
    Chart::Lines(LineChart {
        title: format!("Battles won on {}, {}", panel.map, mackrl.configuration),
        subtitle: figure6::FIGURE.subtitle.to_owned(),
        x_axis: axis(figure6::FIGURE.axes[0], None),
        y_axis: axis(figure6::FIGURE.axes[1], Some([-0.02, 1.02])),
        series: win_rates(&panel, &mackrl.places()),
    })
}

fn delegation_of(delegation: &Delegation) -> Chart {
    let sources = [
        ("training", &delegation.training),
        ("greedy tests", &delegation.tests),
    ];
    let panels = sources.into_iter().flat_map(|(source, moments)| {
        moments.iter().map(move |moment| Multiple {
            title: match moment.steps {
                0 => format!("{source}, at first"),
                steps => format!("{source}, {} k steps", steps / 1000),
            },
            note: String::new(),
            series: series(moment),
        })
    });
    Chart::Multiples(SmallMultiples {
        title: "When pairs delegate, 2s3z".to_owned(),
        subtitle: "Chosen pairs with common knowledge".to_owned(),
        x_axis: axis("Enemies in the pair's common knowledge", Some([-0.1, 5.1])),
        y_axis: axis("Share of pairs that delegate", Some([-0.02, 1.02])),
        columns: 4,
        panels: panels.collect(),
    })
}

fn series(moment: &Moment) -> Vec<Series> {
    let points = |rates: &[Option<f64>]| -> Vec<Point> {
        let rates = rates.iter().enumerate();
        rates
            .filter_map(|(enemies, rate)| Some(Point::exact(enemies as f64, (*rate)?)))
            .collect()
    };
    let of = |name: Option<&str>, colour, points| Series {
        name: name.map(str::to_owned),
        colour,
        mark: Mark::Line,
        points,
    };
    let runs = moment.runs.iter().enumerate().map(|(number, (_, rates))| {
        let name = (number == 0).then_some("each run");
        of(name, Colour::GREY, points(rates))
    });
    let ours = [
        ("share of the cases", Colour::GREEN, &moment.cases),
        ("mean of the runs", Colour::BLUE, &moment.mean),
    ];
    let ours = ours.map(|(name, colour, rates)| of(Some(name), colour, points(rates)));
    (runs.chain(ours))
        .chain(published_rates(moment.published))
        .collect()
}
