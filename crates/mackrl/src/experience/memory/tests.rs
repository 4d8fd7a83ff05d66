//! What goes into a memory comes out of it to the bit, and nothing else is taken for it.

use mackrl_env::{Action, EpisodeEnd, Stream};

use super::*;

const SHAPE: EpisodeShape = EpisodeShape {
    agents: 3,
    actions: 5,
    observation: 7,
    state: 11,
};

/// An episode of `steps` steps; most of its numbers stay as they are.
fn episode(number: u64, steps: usize, end: EpisodeEnd) -> Episode {
    let key = EpisodeKey::new(3, Stream::Other, number);
    let real = |t: usize, i: usize| -> f32 {
        let latest = if i.is_multiple_of(4) { t } else { t / 5 };
        crate::Real::from_f64(key.normal(latest, Draw::World(i)))
    };
    let row = |t: usize, first: usize, count: usize| (first..first + count).map(move |i| (t, i));
    let moments = 0..=steps;
    Episode {
        observation_tno: (moments.clone().flat_map(|t| row(t, 0, 21)))
            .map(|(t, i)| real(t, i))
            .collect(),
        state_tg: (moments.clone().flat_map(|t| row(t, 100, 11)))
            .map(|(t, i)| real(t, i))
            .collect(),
        available_tna: (moments.flat_map(|t| row(t, 0, 15)))
            .map(|(t, i)| key.uniform(t, Draw::Agent(i)) < 0.5)
            .collect(),
        action_tn: (0..3 * steps).map(|i| Action::new(i % 5)).collect(),
        reward_t: (0..steps).map(|t| real(t, 0)).collect(),
        end: Some(end),
        ..Episode::default()
    }
}

fn check(remembered: &RememberedEpisode, episode: &Episode) {
    assert_eq!(remembered.steps(), episode.steps());
    for t in 0..=episode.steps() {
        let own = &episode.observation_tno[21 * t..21 * (t + 1)];
        assert_eq!(remembered.observations(SHAPE, t), own);
        assert_eq!(remembered.state(SHAPE, t), episode.state(t));
    }
    assert_eq!(remembered.available_tna, episode.available_tna);
    assert_eq!(remembered.reward_t, episode.reward_t);
    let actions = remembered.action_tn.iter().map(|&a| usize::from(a));
    assert!(actions.eq(episode.action_tn.iter().map(|a| a.index())));
    assert_eq!(remembered.ends_by_time_limit, episode.ends_by_time_limit());
}

#[test]
fn the_latest_episodes_come_back_and_older_ones_are_forgotten() {
    let mut memory = ReplayMemory::new(SHAPE, 3);
    let episodes: Vec<Episode> = [(2, EpisodeEnd::Terminated), (13, EpisodeEnd::Truncated)]
        .into_iter()
        .cycle()
        .take(5)
        .zip(0..)
        .map(|((steps, end), number)| episode(number, steps, end))
        .collect();
    for episode in &episodes {
        memory.add(episode).unwrap();
    }
    assert_eq!((memory.len(), memory.added()), (3, 5));
    let mut remembered = RememberedEpisode::default();
    for (index, episode) in episodes[2..].iter().enumerate() {
        memory.read(index, &mut remembered);
        check(&remembered, episode);
    }
    let restored = ReplayMemory::new(SHAPE, 3).restored(memory.state());
    assert_eq!(restored.unwrap(), memory);
    assert!(
        ReplayMemory::new(SHAPE, 2)
            .restored(memory.state())
            .is_err()
    );
}

#[test]
fn an_episode_without_observations_is_refused() {
    let mut memory = ReplayMemory::new(SHAPE, 3);
    let mut blind = episode(0, 4, EpisodeEnd::Terminated);
    blind.observation_tno.clear();
    assert!(memory.add(&blind).is_err());
    assert!(memory.is_empty());
}

#[test]
fn bytes_that_are_no_episode_are_refused_and_never_panic() {
    let mut memory = ReplayMemory::new(SHAPE, 1);
    memory.add(&episode(1, 6, EpisodeEnd::Terminated)).unwrap();
    let sound = memory.state().episodes[0].to_vec();
    let restored = |bytes: Vec<u8>| {
        memory.restored(MemoryState {
            first: 0,
            episodes: vec![bytes.into()],
        })
    };
    for cut in 0..sound.len() {
        assert!(restored(sound[..cut].to_vec()).is_err(), "cut at {cut}");
    }
    assert!(restored([&sound[..], &[0]].concat()).is_err());
    for place in 0..sound.len() {
        for bit in 0..8 {
            let mut damaged = sound.clone();
            damaged[place] ^= 1 << bit;
            // Whether it is still an episode or not: it is read to the end without a panic.
            let _ = restored(damaged);
        }
    }
    let mut wrong = sound;
    wrong[5] = 5;
    let error = restored(wrong).unwrap_err().to_string();
    assert!(error.contains("episode 0 of the replay memory: it holds an action"));
}

#[test]
fn every_episode_is_drawn_as_often_as_every_other_and_none_twice() {
    let mut memory = ReplayMemory::new(SHAPE, 7);
    for number in 0..7 {
        memory
            .add(&episode(number, 1, EpisodeEnd::Terminated))
            .unwrap();
    }
    let key = EpisodeKey::new(5, Stream::Other, 2);
    let mut counts = [0; 7];
    for step in 0..7_000 {
        let drawn = memory.draw(3, &key, step);
        assert_eq!(drawn.len(), 3);
        assert!(drawn.is_sorted_by(|a, b| a < b));
        drawn.iter().for_each(|&index| counts[index] += 1);
    }
    // Five standard deviations: 5·√(7000·3/7·4/7) = 207.
    for count in counts {
        assert!((2_793..=3_207).contains(&count), "{counts:?}");
    }
    assert_eq!(memory.draw(9, &key, 0), [0, 1, 2, 3, 4, 5, 6]);
}
