use tiny_skia::Pixmap;

use super::*;

fn chart(mark: Mark, half_width: f64) -> LineChart {
    let point = |x, y| Point::with_error(x, y, half_width);
    LineChart {
        title: "Losses < gains & more".into(),
        subtitle: String::new(),
        x_axis: Axis {
            label: "steps".into(),
            range: None,
        },
        y_axis: Axis {
            label: "share".into(),
            range: Some([0.0, 1.0]),
        },
        series: vec![Series {
            name: Some("ours".into()),
            colour: Colour::BLUE,
            mark,
            points: vec![point(0.0, 0.25), point(10.0, 0.5), point(20.0, 3.0)],
        }],
    }
}

/// Pixels of the image whose colour is exactly `colour`.
fn count(chart: &LineChart, Colour(red, green, blue): Colour) -> usize {
    let image = Pixmap::decode_png(&chart.to_png().unwrap()).unwrap();
    let same =
        |p: &&tiny_skia::PremultipliedColorU8| [p.red(), p.green(), p.blue()] == [red, green, blue];
    image.pixels().iter().filter(same).count()
}

#[test]
fn every_mark_leaves_its_colour_in_the_image() {
    for mark in [Mark::Line, Mark::Dashes, Mark::Rings] {
        assert!(count(&chart(mark, 0.0), Colour::BLUE) > 50, "{mark:?}");
        assert_eq!(count(&chart(mark, 0.0), Colour::VERMILLION), 0, "{mark:?}");
    }
}

#[test]
fn a_band_covers_what_would_be_paper() {
    let white = Colour(0xFF, 0xFF, 0xFF);
    let (without, with) = (chart(Mark::Line, 0.0), chart(Mark::Line, 0.2));
    assert!(
        count(&with, white) + 10_000 < count(&without, white),
        "no band is seen"
    );
}

#[test]
fn data_beyond_the_axes_is_clipped_in_both_files() {
    let svg = chart(Mark::Line, 0.0).to_svg();
    assert!(svg.contains("<g clip-path=\"url(#panel-0)\">"), "{svg}");
    let image = Pixmap::decode_png(&chart(Mark::Line, 0.0).to_png().unwrap()).unwrap();
    // The line leaves through the top of the plot; nothing blue may stand in the row of the title above it.
    let title_rows = image.pixels().iter().take(image.width() as usize * 70);
    let blue = |p: &&tiny_skia::PremultipliedColorU8| p.blue() > p.red().saturating_add(60);
    assert_eq!(
        title_rows.filter(blue).count(),
        0,
        "data was drawn over the title"
    );
}

#[test]
fn words_in_the_svg_are_escaped() {
    let svg = chart(Mark::Line, 0.0).to_svg();
    assert!(
        svg.contains("<title>Losses &lt; gains &amp; more</title>"),
        "{svg}"
    );
    assert!(!svg.contains("Losses < gains"), "{svg}");
}

#[test]
fn a_chart_without_data_is_still_drawn() {
    let empty = LineChart {
        series: Vec::new(),
        ..chart(Mark::Line, 0.0)
    };
    assert!(empty.to_svg().contains("steps"), "the axes have no words");
    assert!(!empty.to_png().unwrap().is_empty());
}

#[test]
fn small_multiples_have_a_panel_each_and_one_legend() {
    let panel = |title: &str| Multiple {
        title: title.into(),
        note: "+0.10 ± 0.05".into(),
        series: chart(Mark::Line, 0.1).series,
    };
    let multiples = SmallMultiples {
        title: "Parts".into(),
        subtitle: String::new(),
        x_axis: chart(Mark::Line, 0.0).x_axis,
        y_axis: chart(Mark::Line, 0.0).y_axis,
        columns: 2,
        panels: ["first", "second", "third"].map(panel).to_vec(),
    };
    let svg = multiples.to_svg();
    let count = |text: &str| svg.matches(text).count();
    assert_eq!(count("<clipPath"), 3);
    assert_eq!([count(">first<"), count(">third<")], [1, 1]);
    assert_eq!(count("+0.10 ± 0.05"), 3);
    assert_eq!(count(">ours<"), 1, "the legend");
    assert_eq!(
        count(">0.50<"),
        2,
        "labels stand at the first panel of a row"
    );
    assert!(!multiples.to_png().unwrap().is_empty());
}

/// What a scene writes, with its place.
fn words(scene: &scene::Scene) -> Vec<(&str, [f64; 2])> {
    let shapes = scene.panels.iter().flat_map(|panel| &panel.foreground);
    let words = shapes.filter_map(|shape| match shape {
        scene::Shape::Words(words) => Some((&*words.text, words.at)),
        _ => None,
    });
    words.collect()
}

#[test]
fn legends_stand_outside_the_data_in_rows_that_fit() {
    let mut chart = chart(Mark::Line, 0.1);
    let names: Vec<String> = (0..9)
        .map(|number| format!("a learner with number {number}"))
        .collect();
    chart.series = (names.iter())
        .map(|name| Series {
            name: Some(name.clone()),
            ..chart.series[0].clone()
        })
        .collect();
    let scene = layout::lay_out(&chart);
    let area = scene.panels[0].area;
    let mut places: Vec<[f64; 2]> = Vec::new();
    for (text, at) in words(&scene) {
        if names.iter().any(|name| name == text) {
            let end = at[0] + text::width(text, 12.5, scene::Weight::Regular);
            assert!(at[1] < area.top && end <= area.right, "{text} at {at:?}");
            places.push(at);
        }
    }
    assert_eq!(places.len(), names.len());
    let rows: std::collections::BTreeSet<u64> = places.iter().map(|at| at[1].to_bits()).collect();
    assert!(rows.len() > 1, "nine names need more than one row");
}

#[test]
fn published_points_at_the_edge_are_whole() {
    let mut chart = chart(Mark::Rings, 0.0);
    chart.x_axis.range = Some([0.0, 20.0]);
    let points = [
        [0.0, 0.5],
        [10.0, 0.5],
        [20.0, 1.0],
        [15.0, 3.0],
        [25.0, 0.5],
    ];
    chart.series[0].points = points.map(|[x, y]| Point::exact(x, y)).to_vec();
    chart.series[0].name = None;
    let scene = layout::lay_out(&chart);
    let panel = &scene.panels[0];
    let is_ring = |shape: &&scene::Shape| matches!(shape, scene::Shape::Ring { .. });
    assert_eq!(
        panel.data.iter().filter(is_ring).count(),
        0,
        "none is clipped"
    );
    let rings: Vec<[f64; 2]> = (panel.foreground.iter())
        .filter_map(|shape| match shape {
            scene::Shape::Ring { centre, radius, .. } => {
                let [x, y] = *centre;
                let [right, bottom] = [scene.width, scene.height].map(f64::from);
                assert!(x - radius > 0.0 && x + radius < right, "{x}");
                assert!(y - radius > 0.0 && y + radius < bottom, "{y}");
                Some(*centre)
            }
            _ => None,
        })
        .collect();
    assert_eq!(
        rings.len(),
        3,
        "those beyond the axes are left out: {rings:?}"
    );
    let whole = count(&chart, Colour::BLUE);
    chart.series[0].points.truncate(1);
    let one = count(&chart, Colour::BLUE);
    assert!(
        whole.abs_diff(3 * one) < one / 3,
        "{whole} pixels of three, {one} of one"
    );
}
