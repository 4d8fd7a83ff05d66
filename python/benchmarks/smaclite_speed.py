"""Steps a CPU second of SMAClite, one world, with random available actions: `python smaclite_speed.py 3m 1`."""

from __future__ import annotations

import json
import sys
import tempfile
import time

import gymnasium as gym
import numpy as np
import smaclite  # noqa: F401

# SMAClite ships no 3m: as its own maps of marines are written.
THREE_MARINES = {
    "name": "3m",
    "num_allied_units": 3,
    "num_enemy_units": 3,
    "groups": [
        {"x": 9, "y": 16, "faction": "ALLY", "units": {"MARINE": 3}},
        {"x": 23, "y": 16, "faction": "ENEMY", "units": {"MARINE": 3}},
    ],
    "attack_point": [9, 16],
    "terrain_preset": "SIMPLE",
    "num_unit_types": 0,
    "ally_has_shields": False,
    "enemy_has_shields": False,
}

if sys.argv[1] == "3m":
    with tempfile.NamedTemporaryFile("w", suffix=".json") as file:
        json.dump(THREE_MARINES, file)
        file.flush()
        env = gym.make("smaclite/custom-v0", map_file=file.name).unwrapped
else:
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
