//! A replay memory among the files of a checkpoint.
//!
//! ```text
//! checkpoints/000000000042/
//!     memory-000000000007.episodes       episodes 7·128 to 8·128 − 1 of those that were ever remembered
//!     memory-000000000008.episodes       ...
//!     memory.episodes                    how many there are, and those before and after the whole blocks
//! ```
//!
//! Remembered episodes never change, so neither do whole blocks of them: a checkpoint links those that the one before it has, and
//! writes the others alone. What is written is then what was played since, and two checkpoints side by side take little more room
//! than one. Each is complete all the same, and equal to the byte however often the run was interrupted.
//!
//! An episode stands behind its length, 4 bytes; numbers are little-endian.

use std::{ops::Range, sync::Arc};

use mackrl::experience::MemoryState;

/// The file that every checkpoint with a memory has.
pub(super) const MEMORY: &str = "memory.episodes";
/// Episodes of a block.
const BLOCK: u64 = 128;

/// The name of a block.
pub(super) fn block_name(block: u64) -> String {
    format!("memory-{block:012}.episodes")
}

/// The blocks whose episodes are all there, if those with the numbers in `episodes` are.
pub(super) fn whole_blocks(episodes: &Range<u64>) -> Range<u64> {
    let first = episodes.start.div_ceil(BLOCK);
    first..(episodes.end / BLOCK).max(first)
}

/// Numbers of the episodes of a memory.
pub(super) fn numbers(memory: &MemoryState) -> Range<u64> {
    memory.first..memory.first + memory.episodes.len() as u64
}

/// The content of a whole block.
pub(super) fn block(memory: &MemoryState, block: u64) -> Vec<u8> {
    let mut content = Vec::new();
    append(memory, block * BLOCK..(block + 1) * BLOCK, &mut content);
    content
}

/// The content of [`MEMORY`].
pub(super) fn rest(memory: &MemoryState) -> Vec<u8> {
    let numbers = numbers(memory);
    let mut content = Vec::new();
    for number in [numbers.start, numbers.end] {
        content.extend(number.to_le_bytes());
    }
    for part in outside(&numbers) {
        append(memory, part, &mut content);
    }
    content
}

/// Puts a memory together from its files, which `read` gives by their names.
///
/// # Errors
/// What `read` gives, or what is wrong with which file.
pub(super) fn assemble<E>(
    mut read: impl FnMut(&str) -> Result<Vec<u8>, E>,
    broken: impl Fn(&str) -> E,
) -> Result<MemoryState, E> {
    let content = read(MEMORY)?;
    let mut unread = content.as_slice();
    let mut number = || {
        let (bytes, after) = unread.split_first_chunk()?;
        unread = after;
        Some(u64::from_le_bytes(*bytes))
    };
    let (Some(start), Some(end)) = (number(), number()) else {
        return Err(broken(MEMORY));
    };
    if start > end {
        return Err(broken(MEMORY));
    }
    let numbers = start..end;
    let mut episodes = Vec::new();
    let [before, after] = outside(&numbers);
    take(&mut unread, before, &mut episodes).ok_or_else(|| broken(MEMORY))?;
    for block in whole_blocks(&numbers) {
        let name = block_name(block);
        let content = read(&name)?;
        let mut unread = content.as_slice();
        let numbers = block * BLOCK..(block + 1) * BLOCK;
        take(&mut unread, numbers, &mut episodes)
            .filter(|()| unread.is_empty())
            .ok_or_else(|| broken(&name))?;
    }
    take(&mut unread, after, &mut episodes)
        .filter(|()| unread.is_empty())
        .ok_or_else(|| broken(MEMORY))?;
    Ok(MemoryState {
        first: start,
        episodes,
    })
}

/// The episodes before and after the whole blocks.
fn outside(numbers: &Range<u64>) -> [Range<u64>; 2] {
    let blocks = whole_blocks(numbers);
    if blocks.is_empty() {
        return [numbers.clone(), numbers.end..numbers.end];
    }
    [
        numbers.start..blocks.start * BLOCK,
        blocks.end * BLOCK..numbers.end,
    ]
}

fn append(memory: &MemoryState, numbers: Range<u64>, content: &mut Vec<u8>) {
    let before = usize::try_from(numbers.start - memory.first).expect("numbers of held episodes");
    let count = usize::try_from(numbers.end - numbers.start).expect("numbers of held episodes");
    for episode in &memory.episodes[before..before + count] {
        let length = u32::try_from(episode.len()).expect("an episode is below 4 GiB");
        content.extend(length.to_le_bytes());
        content.extend_from_slice(episode);
    }
}

fn take(unread: &mut &[u8], numbers: Range<u64>, episodes: &mut Vec<Arc<[u8]>>) -> Option<()> {
    for _ in numbers {
        let (length, after) = unread.split_first_chunk()?;
        let length = u32::from_le_bytes(*length) as usize;
        let (episode, after) = after.split_at_checked(length)?;
        episodes.push(episode.into());
        *unread = after;
    }
    Some(())
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::*;

    fn memory(numbers: Range<u64>) -> MemoryState {
        let episode = |number: u64| {
            let copies = usize::try_from(number).unwrap() % 3 + 1;
            number.to_le_bytes().repeat(copies).into()
        };
        MemoryState {
            first: numbers.start,
            episodes: numbers.map(episode).collect(),
        }
    }

    fn files(memory: &MemoryState) -> BTreeMap<String, Vec<u8>> {
        let blocks = whole_blocks(&numbers(memory));
        let blocks = blocks.map(|number| (block_name(number), block(memory, number)));
        blocks.chain([(MEMORY.to_owned(), rest(memory))]).collect()
    }

    fn assembled(files: &BTreeMap<String, Vec<u8>>) -> Result<MemoryState, String> {
        assemble(
            |name| files.get(name).cloned().ok_or_else(|| name.to_owned()),
            |name| format!("{name} is broken"),
        )
    }

    #[test]
    fn a_memory_comes_back_whichever_blocks_it_has() {
        for numbers in [0..0, 0..5, 100..129, 0..128, 100..400, 128..384, 127..257] {
            let memory = memory(numbers);
            assert_eq!(assembled(&files(&memory)), Ok(memory));
        }
    }

    #[test]
    fn blocks_are_the_same_whenever_they_are_written() {
        let (early, late) = (files(&memory(0..300)), files(&memory(120..500)));
        assert_eq!(early[&block_name(1)], late[&block_name(1)]);
        assert_eq!(late.len(), 3, "blocks 1 and 2, and the rest");
    }

    #[test]
    fn files_that_are_cut_or_too_long_are_refused_by_name() {
        let sound = files(&memory(100..400));
        for (name, content) in &sound {
            let with = |content: Vec<u8>| {
                let mut damaged = sound.clone();
                damaged.insert(name.clone(), content);
                assembled(&damaged).unwrap_err()
            };
            for cut in [0, 1, 17, content.len() / 2, content.len() - 1] {
                assert_eq!(with(content[..cut].to_vec()), format!("{name} is broken"));
            }
            let longer = [content.as_slice(), &[0]].concat();
            assert_eq!(with(longer), format!("{name} is broken"));
        }
    }
}
