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
