//! An episode as few bytes that give it back to the bit.
//!
//! | part | bytes |
//! |---|---|
//! | T, the number of steps | 4 |
//! | 1 if time ran out, else 0 | 1 |
//! | actions \[T, N\] | 2 each |
//! | rewards \[T\] | 4 each |
//! | available actions \[T + 1, N, A\] | a bit each, the lowest of a byte first |
//! | of each of the T + 1 steps: which numbers differ from the step before | a bit each |
//! | ... and those that do (before the first step, all are 0) | 4 each |
//!
//! All numbers are little-endian. Between two steps of a battle most numbers stay: health of units that are not shot at, kinds,
//! everything out of sight. A general compressor would find more and cost a crate and milliseconds at every draw.

use mackrl_env::EpisodeEnd;

use super::{EpisodeShape, RememberedEpisode};
use crate::{Error, experience::Episode};

/// Encodes an episode.
pub(super) fn encode(shape: EpisodeShape, episode: &Episode) -> Result<Vec<u8>, Error> {
    let steps = episode.steps();
    let (agents, own) = (shape.agents, shape.agents * shape.observation);
    let found = [
        episode.observation_tno.len(),
        episode.available_tna.len(),
        episode.state_tg.len(),
        episode.action_tn.len(),
    ];
    let expected = [
        (steps + 1) * own,
        (steps + 1) * agents * shape.actions,
        (steps + 1) * shape.state,
        steps * agents,
    ];
    if steps == 0 || found != expected {
        return Err(Error::Data(format!(
            "an episode of {steps} steps holds {found:?} numbers of observations, available actions, states and actions, expected {expected:?}"
        )));
    }
    let mut bytes = Vec::new();
    let steps = u32::try_from(steps).map_err(|_| Error::Data("an episode is too long".into()))?;
    bytes.extend(steps.to_le_bytes());
    bytes.push(u8::from(episode.end == Some(EpisodeEnd::Truncated)));
    for action in &episode.action_tn {
        let action = u16::try_from(action.index()).expect("actions have 16 bits");
        bytes.extend(action.to_le_bytes());
    }
    for reward in &episode.reward_t {
        bytes.extend(reward.to_le_bytes());
    }
    push_bits(&mut bytes, episode.available_tna.iter().copied());
    let mut before = vec![0; shape.numbers()];
    for t in 0..=episode.steps() {
        let observations = &episode.observation_tno[t * own..(t + 1) * own];
        let numbers = observations.iter().chain(episode.state(t));
        let bits: Vec<u32> = numbers.map(|number| number.to_bits()).collect();
        let changes = || bits.iter().zip(&before).map(|(now, before)| now != before);
        push_bits(&mut bytes, changes());
        for (number, _) in bits.iter().zip(changes()).filter(|(_, changed)| *changed) {
            bytes.extend(number.to_le_bytes());
        }
        before = bits;
    }
    Ok(bytes)
}

/// Reads an episode of this shape; says what is wrong if there is none.
pub(super) fn decode(
    shape: EpisodeShape,
    bytes: &[u8],
    to: &mut RememberedEpisode,
) -> Result<(), &'static str> {
    let mut rest = bytes;
    let steps = u32::from_le_bytes(take(&mut rest)?) as usize;
    // Every step has an action of every agent, at least: a length that nothing stands behind makes no room.
    if steps == 0 || steps > bytes.len() {
        return Err("its length is not that of its content");
    }
    let [end] = take(&mut rest)?;
    if end > 1 {
        return Err("its end is none");
    }
    to.ends_by_time_limit = end == 1;
    to.action_tn.clear();
    for _ in 0..steps * shape.agents {
        let action = u16::from_le_bytes(take(&mut rest)?);
        if usize::from(action) >= shape.actions {
            return Err("it holds an action that there is not");
        }
        to.action_tn.push(action);
    }
    to.reward_t.clear();
    for _ in 0..steps {
        to.reward_t.push(finite(take(&mut rest)?)?);
    }
    let available = (steps + 1) * shape.agents * shape.actions;
    to.available_tna.clear();
    let bits = take_bits(&mut rest, available)?;
    to.available_tna
        .extend((0..available).map(|i| bits[i / 8] >> (i % 8) & 1 == 1));
    to.number_tw.clear();
    for t in 0..=steps {
        let numbers = shape.numbers();
        if t == 0 {
            to.number_tw.resize(numbers, 0.0);
        } else {
            to.number_tw.extend_from_within((t - 1) * numbers..);
        }
        let row = &mut to.number_tw[t * numbers..];
        let changes = take_bits(&mut rest, numbers)?;
        for (byte, &changed) in changes.iter().enumerate() {
            let mut changed = changed;
            while changed != 0 {
                let index = 8 * byte + changed.trailing_zeros() as usize;
                let place = row.get_mut(index).ok_or("it has too many numbers")?;
                *place = finite(take(&mut rest)?)?;
                changed &= changed - 1;
            }
        }
    }
    if rest.is_empty() {
        Ok(())
    } else {
        Err("its length is not that of its content")
    }
}

/// Appends bits, the lowest of a byte first, and fills up the last byte.
fn push_bits(bytes: &mut Vec<u8>, bits: impl Iterator<Item = bool>) {
    let mut byte = 0;
    let mut count = 0;
    for bit in bits {
        byte |= u8::from(bit) << (count % 8);
        count += 1;
        if count % 8 == 0 {
            bytes.push(byte);
            byte = 0;
        }
    }
    if count % 8 != 0 {
        bytes.push(byte);
    }
}

/// The bytes of the next `count` bits.
fn take_bits<'a>(rest: &mut &'a [u8], count: usize) -> Result<&'a [u8], &'static str> {
    let (bits, after) = rest
        .split_at_checked(count.div_ceil(8))
        .ok_or("it is cut off")?;
    *rest = after;
    Ok(bits)
}

/// The next bytes.
fn take<const LENGTH: usize>(rest: &mut &[u8]) -> Result<[u8; LENGTH], &'static str> {
    let (bytes, after) = rest.split_first_chunk().ok_or("it is cut off")?;
    *rest = after;
    Ok(*bytes)
}

fn finite(bytes: [u8; 4]) -> Result<f32, &'static str> {
    let number = f32::from_le_bytes(bytes);
    if number.is_finite() {
        Ok(number)
    } else {
        Err("it holds a number that is not finite")
    }
}
