//! Spoiling files: bytes, numbers, words, lines, and parts of other files.

use fastrand::Rng;

/// Numbers at which programs go wrong.
const NUMBERS: &[&str] = &[
    "0",
    "-1",
    "1",
    "255",
    "256",
    "65536",
    "2147483648",
    "4294967295",
    "4294967296",
    "9007199254740993",
    "9223372036854775807",
    "-9223372036854775808",
    "18446744073709551615",
    "99999999999999999999999",
    "1e308",
    "1e-320",
    "1e999",
    "nan",
    "-inf",
    "0.1",
    "1e15",
];
/// Longest input, so that a thousand mutations do not grow without end.
const LENGTH_MAX: usize = 300_000;

/// A seed with one to four changes.
pub(crate) fn mutated(seeds: &[Vec<u8>], words: &[String], rng: &mut Rng) -> Vec<u8> {
    let mut input = pick(seeds, rng).cloned().unwrap_or_default();
    for _ in 0..rng.usize(1..=4) {
        mutate(&mut input, seeds, words, rng);
    }
    input.truncate(LENGTH_MAX);
    input
}

/// One of these, if there is one.
pub(crate) fn pick<'a, T>(from: &'a [T], rng: &mut Rng) -> Option<&'a T> {
    (!from.is_empty()).then(|| &from[rng.usize(..from.len())])
}

fn mutate(input: &mut Vec<u8>, seeds: &[Vec<u8>], words: &[String], rng: &mut Rng) {
    let place = rng.usize(..=input.len());
    let part = place..(place + rng.usize(..=40)).min(input.len());
    match rng.u8(..10) {
        0 if !input.is_empty() => {
            let place = place.min(input.len() - 1);
            input[place] ^= 1 << rng.u8(..8);
        }
        1 => input.insert(place, rng.u8(..)),
        2 => drop(input.drain(part)),
        3 => input.truncate(place),
        4 => {
            let copy = input[part].to_vec();
            let copies = copy.repeat(1 << rng.u8(..10));
            splice(input, place, &copies);
        }
        5 => {
            let other = pick(seeds, rng).map_or(&[][..], Vec::as_slice);
            let from = rng.usize(..=other.len());
            let length = rng.usize(..=200).min(other.len() - from);
            splice(input, place, &other[from..from + length]);
        }
        6 => {
            let word = pick(words, rng).map_or("", String::as_str);
            splice(input, place, word.as_bytes());
        }
        7 => {
            let bracket = *pick(b"[{(\"'", rng).unwrap_or(&b'[');
            splice(input, place, &[bracket].repeat(1 << rng.u8(..14)));
        }
        8 => swap_lines(input, rng),
        _ => replace_number(input, place, rng),
    }
}

fn splice(input: &mut Vec<u8>, place: usize, part: &[u8]) {
    input.splice(place..place, part.iter().copied());
}

fn swap_lines(input: &mut Vec<u8>, rng: &mut Rng) {
    let mut lines: Vec<Vec<u8>> = input
        .split(|byte| *byte == b'\n')
        .map(<[u8]>::to_vec)
        .collect();
    let (one, other) = (rng.usize(..lines.len()), rng.usize(..lines.len()));
    if rng.bool() {
        lines.swap(one, other);
    } else {
        lines.insert(one, lines[other].clone());
    }
    *input = lines.join(&b'\n');
}

/// Puts an unusual number in place of the first one behind `place`.
fn replace_number(input: &mut Vec<u8>, place: usize, rng: &mut Rng) {
    let numeric = |byte: &u8| byte.is_ascii_digit() || b".-+".contains(byte);
    let Some(start) = input[place..].iter().position(u8::is_ascii_digit) else {
        return;
    };
    let start = place + start;
    let length = input[start..]
        .iter()
        .take_while(|byte| numeric(byte))
        .count();
    let number = pick(NUMBERS, rng).map_or("0", |number| number);
    input.splice(start..start + length, number.bytes());
}
