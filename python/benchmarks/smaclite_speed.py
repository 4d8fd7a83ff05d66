"""Steps a CPU second of SMAClite, one world, with random available actions: `python smaclite_speed.py 3m 1`."""

from __future__ import annotations

import sys
import time

import gymnasium as gym
import numpy as np
import smaclite  # noqa: F401

env = gym.make(f"smaclite/{sys.argv[1]}-v0").unwrapped
rng = np.random.default_rng(0)
env.reset()
played, start = 0, time.process_time()
while (spent := time.process_time() - start) < 4:
    actions = [int(rng.choice(np.flatnonzero(row))) for row in env.get_avail_actions()]
    _, _, terminated, truncated, _ = env.step(actions)
    env.get_state()
    played += 1
    if terminated or truncated:
        env.reset()
print(played / spent)
