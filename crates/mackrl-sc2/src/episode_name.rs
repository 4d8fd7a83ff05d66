//! Episodes by a line of chat.
//!
//! A game that goes on for days has no idea of episodes. Before the first step of each, the adapter says its name in the
//! game's chat: who watches the replay sees where he is, and the stand-in takes its dice from the name, so that an episode
//! played through it is the built-in simulator's to the bit. The real game shows the line and does nothing else with it.

use mackrl_env::{EpisodeKey, Stream};

const STREAMS: [(Stream, &str); 4] = [
    (Stream::Training, "training"),
    (Stream::Test, "test"),
    (Stream::Evaluation, "evaluation"),
    (Stream::Other, "other"),
];

/// The line that names the episode `key`.
#[must_use]
pub fn format(key: EpisodeKey) -> String {
    let stream = STREAMS.iter().find(|(stream, _)| *stream == key.stream);
    let name = stream.map_or("other", |(_, name)| *name);
    format!("mackrl {name} episode {} of seed {}", key.episode, key.seed)
}

/// The episode that a line names, if it names one.
#[must_use]
pub fn parse(line: &str) -> Option<EpisodeKey> {
    let words: Vec<&str> = line.split(' ').collect();
    let ["mackrl", name, "episode", episode, "of", "seed", seed] = words[..] else {
        return None;
    };
    let (stream, _) = STREAMS.iter().find(|(_, known)| *known == name)?;
    let episode = episode.parse().ok().filter(|episode| *episode < 1 << 56)?;
    Some(EpisodeKey::new(seed.parse().ok()?, *stream, episode))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_name_is_understood_and_other_chat_is_not() {
        for (stream, _) in STREAMS {
            let key = EpisodeKey::new(u64::MAX, stream, 17);
            assert_eq!(parse(&format(key)), Some(key));
        }
        for line in [
            "gl hf",
            "",
            "mackrl lunch episode 1 of seed 1",
            "mackrl test episode -1 of seed 1",
            "mackrl test episode 99999999999999999 of seed 1",
        ] {
            assert_eq!(parse(line), None, "{line}");
        }
    }
}
