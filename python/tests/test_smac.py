"""SMAC's class: sizes as SMAC gives them, one and the same battle through every interface, and programs that import `smac`."""

from __future__ import annotations

import inspect
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import mackrl
import mackrl.smac
from mackrl.smac import StarCraft2Env

GOLDEN = Path(__file__).parents[2] / "crates/mackrl-skirmish/tests/golden/smac_maps.md"

# SMAC d6aab33, smac/env/starcraft2/starcraft2.py: `StarCraft2Env.__init__`.
ARGUMENTS = {
    "map_name": "8m", "step_mul": 8, "move_amount": 2, "difficulty": "7", "game_version": None, "seed": None,
    "continuing_episode": False, "obs_all_health": True, "obs_own_health": True, "obs_last_action": False,
    "obs_pathing_grid": False, "obs_terrain_height": False, "obs_instead_of_state": False, "obs_timestep_number": False,
    "state_last_action": True, "state_timestep_number": False, "reward_sparse": False, "reward_only_positive": True,
    "reward_death_value": 10, "reward_win": 200, "reward_defeat": 0, "reward_negative_scale": 0.5, "reward_scale": True,
    "reward_scale_rate": 20, "replay_dir": "", "replay_prefix": "", "window_size_x": 1920, "window_size_y": 1200,
    "heuristic_ai": False, "heuristic_rest": False, "debug": False,
}  # fmt: skip


def maps() -> list[list[str]]:
    rows = [line.strip("| ").split(" | ") for line in GOLDEN.read_text().splitlines() if line.startswith("| ")]
    return [row for row in rows if row[0] in mackrl.maps()]


def test_arguments_are_those_of_smac() -> None:
    parameters = inspect.signature(StarCraft2Env).parameters
    own = {name: parameter.default for name, parameter in parameters.items() if name != "simulator"}
    assert own == ARGUMENTS
    assert list(own) == list(ARGUMENTS)


def test_there_are_all_maps_of_smac() -> None:
    assert len(maps()) == len(mackrl.maps()) == 23


@pytest.mark.parametrize("row", maps(), ids=lambda row: row[0])
def test_sizes_are_those_that_smac_gives(row: list[str]) -> None:
    env = StarCraft2Env(row[0])
    bold = [int(re.search(r"\*\*(\d+)\*\*", cell).group(1)) for cell in (row[9], row[10])]  # type: ignore[union-attr]
    info = env.get_env_info()
    found = [info[name] for name in ("n_agents", "episode_limit", "n_actions", "obs_shape", "state_shape")]
    assert found == [int(row[1]), int(row[4]), int(row[8]), *bold]
    assert env.n_enemies == int(row[2]) and env.max_reward == float(row[12])
    shields = [int(shield) for shield in row[5].split("/")]
    assert len(info["agent_features"]) == 4 + shields[0] + int(row[6])
    assert len(info["enemy_features"]) == 3 + shields[1] + int(row[6])
    observations, state = env.reset()
    assert len(observations) == info["n_agents"] and observations[0].shape == (info["obs_shape"],)
    assert state.shape == (info["state_shape"],)


def test_an_episode_runs_as_pymarl_runs_it() -> None:
    env = StarCraft2Env("3m", seed=3)
    rng = np.random.default_rng(0)
    won = 0
    for _ in range(5):
        env.reset()
        terminated, total = False, 0.0
        while not terminated:
            actions = [rng.choice(np.flatnonzero(row)) for row in env.get_avail_actions()]
            reward, terminated, info = env.step(actions)
            total += reward
        won += info["battle_won"]
        assert set(info) == {"battle_won", "dead_allies", "dead_enemies"}
        assert 0 <= total <= 20 + 1e-4
    stats = env.get_stats()
    assert (stats["battles_game"], stats["battles_won"]) == (5, won)
    visible = env.get_visibility_matrix()
    assert visible.shape == (3, 6) and not visible[np.arange(3), np.arange(3)].any()
    assert env.get_avail_agent_actions(1) == env.get_avail_actions()[1]
    env.close()


def test_what_is_handed_out_is_not_written_again() -> None:
    env = StarCraft2Env("3m", seed=3)
    env.reset()
    kept = [env.get_obs(), env.get_state(), env.get_obs_agent(1), env.get_visibility_matrix()]
    before = [np.array(one) for one in kept]
    for _ in range(10):
        env.step([1, 1, 1] if all(row[1] for row in env.get_avail_actions()) else [row.index(1) for row in env.get_avail_actions()])
    assert all(np.array_equal(one, other) for one, other in zip(kept, before, strict=True))


@pytest.mark.parametrize("map_name", ["3m", "2s3z"])
def test_one_battle_through_every_interface(map_name: str) -> None:
    from mackrl.pettingzoo import parallel_env

    replay = mackrl.play(map_name, policy="focus-fire", seed=5, episode=0)
    vector = mackrl.VectorEnv(map_name, autoreset="disabled")
    vector.reset(seed=5)
    smac = StarCraft2Env(map_name, seed=5)
    smac.reset()
    zoo = parallel_env(map_name, illegal="error")
    zoo.reset(seed=5)
    for actions, reward in zip(replay.actions, replay.rewards, strict=True):
        step = vector.step(actions[None])
        smac_reward, smac_over, info = smac.step(list(actions))
        _, rewards, ends, cut, infos = zoo.step(dict(zip(zoo.possible_agents, actions, strict=True)))
        assert step.rewards[0] == reward == np.float32(smac_reward) == np.float32(rewards["agent_0"])
        assert np.array_equal(step.state[0], smac.get_state()) and np.array_equal(step.state[0], zoo.state())
        assert bool(step.ended[0]) == smac_over == (ends["agent_1"] or cut["agent_1"])
    assert smac_over and info["battle_won"] == replay.summary["battle_won"] == bool(infos["agent_0"]["battle_won"])


def test_arguments_of_the_client_are_refused_with_a_reason() -> None:
    with pytest.raises(ValueError, match="difficulty is '9', expected '7': enemies have no difficulty"):
        StarCraft2Env("3m", difficulty="9")
    with pytest.raises(ValueError, match="heuristic_ai is True, expected False"):
        StarCraft2Env("3m", heuristic_ai=True)
    with pytest.raises(ValueError, match="unknown map `3n`, did you mean `3m`"):
        StarCraft2Env("3n")
    with pytest.raises(mackrl.IllegalAction):
        env = StarCraft2Env("3m", seed=1)
        env.reset()
        env.step([0, 1, 1])


def test_seeds_repeat_and_options_reach_the_simulator() -> None:
    def states(seed: int) -> list[np.ndarray]:
        env = StarCraft2Env("3m", seed=seed)
        return [env.reset()[1] for _ in range(3)]

    assert all(np.array_equal(a, b) for a, b in zip(states(4), states(4), strict=True))
    assert not np.array_equal(states(4)[0], states(5)[0])
    env = StarCraft2Env("3m", obs_last_action=True, state_last_action=False, obs_timestep_number=True)
    plain = StarCraft2Env("3m")
    assert env.get_obs_size() == plain.get_obs_size() + 2 * 9 + 1
    assert env.get_state_size() == plain.get_state_size() - 27
    assert env.seed(7) == 7 == env.seed()


def test_a_script_that_imports_smac_runs_unchanged(tmp_path: Path) -> None:
    (tmp_path / "beside.py").write_text("from smac.env import MultiAgentEnv, StarCraft2Env\n")
    script = tmp_path / "script.py"
    script.write_text(
        "import sys\nfrom beside import MultiAgentEnv, StarCraft2Env\nfrom smac.env.multiagentenv import MultiAgentEnv as same\n"
        "env = StarCraft2Env(map_name=sys.argv[1])\n"
        "assert isinstance(env, MultiAgentEnv) and MultiAgentEnv is same\n"
        "env.reset()\nprint(__name__, env.get_env_info()['n_agents'])\n"
    )
    command = [sys.executable, "-m", "mackrl.smac", str(script), "2s3z"]
    done = subprocess.run(command, capture_output=True, text=True, timeout=60)
    assert done.stdout == "__main__ 5\n", done.stderr
