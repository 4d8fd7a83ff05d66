//! A whole battle as an animated GIF.
//!
//! All frames share one palette of the colours that fill most of them, so that nothing flickers. A frame holds only what differs
//! from the one before, which makes the file a few times smaller.

use anyhow::Context as _;
use gif::{DisposalMethod, Encoder, Frame, Repeat};
use mackrl_env::AgentId;
use tiny_skia::Pixmap;

use super::{Opened, picture};
use crate::plot::{self, BattlePicture};

/// Hundredths of a second that a film takes, if its steps are neither too short nor too long for it.
const FILM: u16 = 800;
/// Hundredths of a second that the end stays.
const END: u16 = 150;
/// Least and most hundredths of a second of a step.
const STEP: [u16; 2] = [8, 40];
/// Hundredths of a second of a frame: units move on between two steps.
const FRAME: u16 = 8;
/// Colours of the palette; one more index stands for "as before".
const COLOURS: usize = 255;
/// The index that leaves a pixel as it was.
const AS_BEFORE: u8 = 255;
/// Bits of each channel that colours are told apart by.
const BITS: u32 = 5;

/// The battle as the content of a GIF file, with what `group` knows, if it has members.
///
/// # Errors
/// If a picture has no area or cannot be encoded.
pub(crate) fn film(opened: &Opened, group: &[AgentId]) -> anyhow::Result<Vec<u8>> {
    let steps = u16::try_from(opened.playback.steps()).context("the episode is too long")?;
    let step = ((FILM - END) / steps.max(1)).clamp(STEP[0], STEP[1]);
    let parts = (step / FRAME).max(1);
    let pictures: Vec<BattlePicture> = (0..opened.playback.steps())
        .map(|step| picture(opened, step, group))
        .flat_map(|picture| (0..parts).map(move |part| between(&picture, part, parts)))
        .chain([picture(opened, opened.playback.steps(), group)])
        .collect();
    let images: Vec<Pixmap> = plot::film(&pictures).collect::<Result<_, _>>()?;
    let palette = Palette::of(&images);
    let first = images.first().context("the film has no frames")?;
    let [width, height] = [first.width(), first.height()];
    let [columns, rows] = [u16::try_from(width)?, u16::try_from(height)?];
    let mut file = Vec::new();
    let mut encoder = Encoder::new(&mut file, columns, rows, &palette.rgb)?;
    encoder.set_repeat(Repeat::Infinite)?;
    let mut before = Vec::new();
    for (number, image) in images.iter().enumerate() {
        let indices = palette.indices(image);
        let mut frame = changes(&before, &indices, usize::from(columns));
        frame.delay = if number + 1 == images.len() {
            END
        } else {
            step / parts
        };
        encoder.write_frame(&frame)?;
        before = indices;
    }
    drop(encoder);
    Ok(file)
}

/// The picture with its units so many parts of the way to where the step takes them.
fn between(picture: &BattlePicture, part: u16, parts: u16) -> BattlePicture {
    let mut picture = picture.clone();
    let share = f64::from(part) / f64::from(parts);
    for figure in &mut picture.figures {
        figure.at = [0, 1].map(|axis| {
            let [from, to] = [figure.at[axis], figure.to[axis]];
            from + share * (to - from)
        });
    }
    picture
}

/// The smallest rectangle in which a frame, `width` pixels wide, differs from the one before, and what differs in it.
fn changes(before: &[u8], now: &[u8], width: usize) -> Frame<'static> {
    let differs = |index: usize| before.get(index) != Some(&now[index]);
    let places = || (0..now.len()).filter(|index| differs(*index));
    let (rows, columns) = (
        || places().map(|i| i / width),
        || places().map(|i| i % width),
    );
    let ends = |least: Option<usize>, most: Option<usize>| least.zip(most).unwrap_or((0, 0));
    let (top, bottom) = ends(rows().min(), rows().max());
    let (left, right) = ends(columns().min(), columns().max());
    let inside = (top..=bottom).flat_map(|y| (left..=right).map(move |x| y * width + x));
    let buffer: Vec<u8> = inside
        .map(|index| {
            if differs(index) {
                now[index]
            } else {
                AS_BEFORE
            }
        })
        .collect();
    let short = |length: usize| u16::try_from(length).unwrap_or(u16::MAX);
    Frame {
        left: short(left),
        top: short(top),
        width: short(right + 1 - left),
        height: short(bottom + 1 - top),
        transparent: Some(AS_BEFORE),
        dispose: DisposalMethod::Keep,
        buffer: buffer.into(),
        ..Frame::default()
    }
}

/// The colours of a film.
struct Palette {
    /// Three bytes a colour.
    rgb: Vec<u8>,
    /// The colour of each cell of the colour space.
    nearest: Vec<u8>,
}

impl Palette {
    fn of(images: &[Pixmap]) -> Self {
        let mut cells = vec![Cell::default(); 1 << (3 * BITS)];
        for pixel in images.iter().flat_map(|image| image.pixels()) {
            cells[cell(rgb(*pixel))].add(rgb(*pixel));
        }
        let mut order: Vec<&Cell> = cells.iter().filter(|cell| cell.count > 0).collect();
        order.sort_by_key(|cell| std::cmp::Reverse(cell.count));
        let colours: Vec<[u8; 3]> = order.into_iter().take(COLOURS).map(Cell::mean).collect();
        let nearest = (0..cells.len()).map(|cell| nearest(&colours, centre(cell)));
        let nearest = nearest.collect();
        let mut rgb = colours.concat();
        rgb.resize(3 * (COLOURS + 1), 0);
        Self { rgb, nearest }
    }

    /// The index of each pixel's colour.
    fn indices(&self, image: &Pixmap) -> Vec<u8> {
        let pixels = image.pixels().iter();
        pixels
            .map(|pixel| self.nearest[cell(rgb(*pixel))])
            .collect()
    }
}

/// The channels of a pixel; pictures are opaque.
const fn rgb(pixel: tiny_skia::PremultipliedColorU8) -> [u8; 3] {
    [pixel.red(), pixel.green(), pixel.blue()]
}

/// The pixels of one cell of the colour space.
#[derive(Debug, Clone, Default)]
struct Cell {
    count: u64,
    sums: [u64; 3],
}

impl Cell {
    fn add(&mut self, pixel: [u8; 3]) {
        self.count += 1;
        for (sum, value) in self.sums.iter_mut().zip(pixel) {
            *sum += u64::from(value);
        }
    }

    fn mean(&self) -> [u8; 3] {
        self.sums
            .map(|sum| u8::try_from(sum / self.count.max(1)).unwrap_or(u8::MAX))
    }
}

/// The cell that a pixel lies in.
fn cell(pixel: [u8; 3]) -> usize {
    pixel.into_iter().fold(0, |cell, value| {
        cell << BITS | usize::from(value) >> (u8::BITS - BITS)
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
    fn a_frame_holds_the_rectangle_that_changed_and_leaves_the_rest_as_it_was() {
        let before = [1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1, 1];
        let now = [1, 1, 1, 1, 1, 2, 1, 1, 1, 1, 3, 1];
        let frame = changes(&before, &now, 4);
        assert_eq!(
            [frame.left, frame.top, frame.width, frame.height],
            [1, 1, 2, 2]
        );
        assert_eq!(frame.buffer[..], [2, AS_BEFORE, AS_BEFORE, 3]);
        assert_eq!(changes(&[], &now, 4).buffer.len(), 12, "the first is whole");
        assert_eq!(changes(&now, &now, 4).buffer[..], [AS_BEFORE]);
    }

    #[test]
    fn colours_that_fill_a_picture_are_kept() {
        let mut image = Pixmap::new(3, 1).unwrap();
        let colours = [[255, 255, 255], [0, 114, 178], [213, 94, 0]];
        for (pixel, [red, green, blue]) in image.pixels_mut().iter_mut().zip(colours) {
            *pixel = tiny_skia::PremultipliedColorU8::from_rgba(red, green, blue, 255).unwrap();
        }
        let palette = Palette::of(std::slice::from_ref(&image));
        let shown: Vec<&[u8]> = (palette.indices(&image).iter())
            .map(|index| &palette.rgb[3 * usize::from(*index)..][..3])
            .collect();
        assert_eq!(shown, colours.each_ref().map(|colour| &colour[..]));
    }
}
