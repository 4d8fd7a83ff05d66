//! The two fonts that the program carries: how wide words are, and their outlines.

use ttf_parser::{Face, GlyphId, OutlineBuilder};

use super::scene::Weight;

const REGULAR: &[u8] = include_bytes!("fonts/Roboto-Regular.ttf");
const MEDIUM: &[u8] = include_bytes!("fonts/Roboto-Medium.ttf");

/// The embedded font of this weight.
pub(super) fn font(weight: Weight) -> Face<'static> {
    let bytes = match weight {
        Weight::Regular => REGULAR,
        Weight::Medium => MEDIUM,
    };
    Face::parse(bytes, 0).expect("the embedded font is valid")
}

/// Width of `text` when an em is `size` high.
pub(super) fn width(text: &str, size: f64, weight: Weight) -> f64 {
    let font = font(weight);
    let units: f64 = glyphs(&font, text).map(|(_, advance)| advance).sum();
    units * size / f64::from(font.units_per_em())
}

/// Hands the outline of `text` to `outline` in font units, y upwards; `move_to_glyph` hears where each glyph starts.
pub(super) fn outline<B: OutlineBuilder>(
    text: &str,
    weight: Weight,
    outline: &mut B,
    mut move_to_glyph: impl FnMut(&mut B, f64),
) {
    let font = font(weight);
    let mut start = 0.0;
    for (glyph, advance) in glyphs(&font, text) {
        move_to_glyph(outline, start);
        // A glyph without an outline is a space.
        let _bounds = font.outline_glyph(glyph, outline);
        start += advance;
    }
}

/// Glyphs and their advances in font units. A character that the font lacks becomes its replacement glyph.
fn glyphs<'a>(font: &'a Face<'_>, text: &'a str) -> impl Iterator<Item = (GlyphId, f64)> + 'a {
    text.chars().map(|character| {
        let glyph = font.glyph_index(character).unwrap_or(GlyphId(0));
        (glyph, f64::from(font.glyph_hor_advance(glyph).unwrap_or(0)))
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_fonts_have_every_character_that_figures_use() {
        for weight in [Weight::Regular, Weight::Medium] {
            for character in "aZ09 .,:;()[]±−–×=%²πλτγμε°".chars() {
                assert!(
                    font(weight).glyph_index(character).is_some(),
                    "{weight:?} {character}"
                );
            }
        }
    }

    #[test]
    fn width_grows_with_text_size_and_length() {
        let short = width("MACKRL", 12.0, Weight::Regular);
        assert!((30.0..60.0).contains(&short), "{short}");
        let twice = width("MACKRLMACKRL", 12.0, Weight::Regular);
        assert!((twice - 2.0 * short).abs() < 1e-9, "{twice}");
        assert!((width("MACKRL", 24.0, Weight::Regular) - 2.0 * short).abs() < 1e-9);
    }
}
