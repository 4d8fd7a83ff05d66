//! A whole battle as an animated GIF.
//!
//! All frames share one palette of the colours that fill most of them, so that nothing flickers and a frame of flat colours
//! packs well.

use anyhow::Context;
use gif::{Encoder, Frame, Repeat};
use mackrl_env::AgentId;

use super::{Opened, picture};
use crate::{plot::Pixels, reproduce::Meter};

/// Hundredths of a second that a frame stays; a step of the game takes half a second.
const FRAME_HUNDREDTHS: u16 = 16;
/// Hundredths of a second that the last frame stays.
const LAST_HUNDREDTHS: u16 = 200;
/// Most frames; longer battles are shown in larger strides.
const FRAMES_MOST: usize = 240;
/// Colours of a palette.
const COLOURS: usize = 256;
/// Bits of each channel that colours are told apart by.
const BITS: u32 = 5;
/// Frames that the palette is made from.
const FRAMES_SAMPLED: usize = 8;

/// The battle as the content of a GIF file, with what `group` knows, if it has members.
///
/// # Errors
/// If a picture has no area or cannot be encoded.
pub(crate) fn film(opened: &Opened, group: &[AgentId]) -> anyhow::Result<Vec<u8>> {
    let steps = opened.playback.steps();
    let stride = (steps / FRAMES_MOST) + 1;
    let mut shown: Vec<usize> = (0..=steps).step_by(stride).collect();
    if shown.last() != Some(&steps) {
        shown.push(steps);
    }
    let ground = ground(opened);
    let frame = |step: usize| {
        let mut picture = picture(opened, step, group);
        picture.show_too(&ground);
        picture.to_pixels()
    };
    let sampled = shown.iter().step_by(shown.len().div_ceil(FRAMES_SAMPLED));
    let sampled: Vec<Pixels> = sampled.map(|step| frame(*step)).collect::<Result<_, _>>()?;
    let palette = Palette::of(&sampled);
    // Legends and so heights may differ from frame to frame.
    let width = sampled.iter().map(|pixels| pixels.width).max();
    let height = sampled.iter().map(|pixels| pixels.height).max();
    let (width, height) = width.zip(height).context("the film has no frames")?;
    let mut file = Vec::new();
    let mut encoder = Encoder::new(&mut file, width, height, &palette.rgb)?;
    encoder.set_repeat(Repeat::Infinite)?;
    let meter = Meter::new("frames");
    for (number, &step) in shown.iter().enumerate() {
        let pixels = frame(step)?;
        let mut frame = palette.frame(&pixels, [width, height]);
        frame.delay = if step == steps {
            LAST_HUNDREDTHS
        } else {
            FRAME_HUNDREDTHS
        };
        encoder.write_frame(&frame)?;
        meter.report(number + 1, shown.len());
    }
    drop(encoder);
    Ok(file)
}

/// Everywhere that somebody is at some time.
fn ground(opened: &Opened) -> Vec<[f64; 2]> {
    let moments = opened.playback.moments.iter();
    moments
        .flat_map(|moment| {
            let places = moment.state.x.iter().zip(&moment.state.y);
            places.map(|(x, y)| [*x, *y].map(f64::from))
        })
        .collect()
}

/// The colours of a film.
struct Palette {
    /// Three bytes a colour.
    rgb: Vec<u8>,
    /// The colour of each cell of the colour space.
    nearest: Vec<u8>,
}

impl Palette {
    fn of(frames: &[Pixels]) -> Self {
        let mut cells = vec![Cell::default(); 1 << (3 * BITS)];
        for pixel in frames.iter().flat_map(|frame| frame.rgb.chunks_exact(3)) {
            cells[cell(pixel)].add(pixel);
        }
        let mut order: Vec<&Cell> = cells.iter().filter(|cell| cell.count > 0).collect();
        order.sort_by_key(|cell| std::cmp::Reverse(cell.count));
        let colours: Vec<[u8; 3]> = order
            .into_iter()
            .take(COLOURS)
            .map(|cell| cell.mean())
            .collect();
        let nearest = (0..cells.len()).map(|cell| nearest(&colours, centre(cell)));
        Self {
            nearest: nearest.collect(),
            rgb: colours.concat(),
        }
    }

    /// A picture in these colours, with white below it if it is too low.
    fn frame(&self, pixels: &Pixels, [width, height]: [u16; 2]) -> Frame<'static> {
        let white = self.nearest[cell(&[u8::MAX; 3])];
        let mut indices = vec![white; usize::from(width) * usize::from(height)];
        let [from, to] = [pixels.width, width].map(usize::from);
        let rows = pixels
            .rgb
            .chunks_exact(3 * from)
            .zip(indices.chunks_exact_mut(to));
        for (pixels, indices) in rows {
            for (pixel, index) in pixels.chunks_exact(3).zip(indices) {
                *index = self.nearest[cell(pixel)];
            }
        }
        Frame {
            width,
            height,
            buffer: indices.into(),
            ..Frame::default()
        }
    }
}

/// The pixels of one cell of the colour space.
#[derive(Debug, Clone, Default)]
struct Cell {
    count: u64,
    sums: [u64; 3],
}

impl Cell {
    fn add(&mut self, pixel: &[u8]) {
        self.count += 1;
        for (sum, value) in self.sums.iter_mut().zip(pixel) {
            *sum += u64::from(*value);
        }
    }

    fn mean(&self) -> [u8; 3] {
        self.sums
            .map(|sum| u8::try_from(sum / self.count.max(1)).unwrap_or(u8::MAX))
    }
}

/// The cell that a pixel lies in.
fn cell(pixel: &[u8]) -> usize {
    pixel.iter().fold(0, |cell, value| {
        cell << BITS | usize::from(*value) >> (u8::BITS - BITS)
    })
}

/// The middle of a cell.
fn centre(cell: usize) -> [i32; 3] {
    let mask = (1 << BITS) - 1;
    [2 * BITS, BITS, 0].map(|shift| {
        let value = i32::try_from(cell >> shift & mask).unwrap_or_default();
        (value << (u8::BITS - BITS)) + (1 << (u8::BITS - BITS - 1))
    })
}

/// Index of the colour that differs least.
fn nearest(colours: &[[u8; 3]], centre: [i32; 3]) -> u8 {
    let distance = |colour: &[u8; 3]| -> i32 {
        let parts = colour.iter().zip(centre);
        parts
            .map(|(own, other)| (i32::from(*own) - other).pow(2))
            .sum()
    };
    let indices = 0..=u8::MAX;
    let closest = indices
        .zip(colours)
        .min_by_key(|(_, colour)| distance(colour));
    closest.map_or(0, |(index, _)| index)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_frame_keeps_the_colours_of_its_picture() {
        let colours = [[255, 255, 255], [0, 114, 178], [213, 94, 0]];
        let pixels = Pixels {
            width: 3,
            height: 1,
            rgb: colours.concat(),
        };
        let palette = Palette::of(std::slice::from_ref(&pixels));
        let frame = palette.frame(&pixels, [3, 2]);
        let shown: Vec<&[u8]> = (frame.buffer.iter())
            .map(|index| &palette.rgb[3 * usize::from(*index)..][..3])
            .collect();
        assert_eq!(shown[..3], colours.each_ref().map(|colour| &colour[..]));
        assert_eq!(
            shown[3..],
            [[255; 3]; 3].each_ref().map(|colour| &colour[..])
        );
    }
}
