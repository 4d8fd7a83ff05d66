"""Gymnasium's own checks, and its three ways to reset."""

from __future__ import annotations

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.vector import AutoresetMode

import mackrl
import mackrl.gymnasium


@pytest.mark.filterwarnings("ignore")
def test_gymnasium_accepts_it() -> None:
    env = gymnasium.make("mackrl/3m-v0")
    assert not hasattr(env.unwrapped, "state_size")
    check_env(env.unwrapped)


def test_every_map_is_registered() -> None:
    ids = {name for name in gymnasium.registry if name.startswith("mackrl/")}
    assert ids == {f"mackrl/{name}-v0" for name in mackrl.maps()}


def test_a_team_is_a_tuple_with_one_reward() -> None:
    env = gymnasium.make("mackrl/2s3z-v0")
    observed, info = env.reset(seed=3)
    assert len(observed) == 5 and env.observation_space.contains(observed)
    total, over = 0.0, False
    while not over:
        actions = tuple(int(row.argmax()) if row[1] == 0 else 1 for row in info["avail_actions"])
        observed, reward, terminated, truncated, info = env.step(actions)
        total, over = total + reward, terminated or truncated
        assert info["illegal"] == 0
    assert total >= 0 and set(info) == {
        "avail_actions", "state", "battle_won", "timed_out", "dead_allies", "dead_enemies", "illegal",
    }  # fmt: skip


@pytest.mark.parametrize("mode", list(AutoresetMode))
def test_worlds_in_arrays_are_those_of_the_vector_env(mode: AutoresetMode) -> None:
    env = gymnasium.make_vec("mackrl/3m-v0", 4, vectorization_mode="vector_entry_point", autoreset_mode=mode)
    assert env.metadata["autoreset_mode"] == mode
    own = mackrl.VectorEnv("3m", 4, autoreset=mackrl.gymnasium._MODES[mode])
    observed, infos = env.reset(seed=2)
    own.reset(seed=2)
    assert np.array_equal(observed, own.buffers.observations)
    ended = False
    for _ in range(70):
        actions = own.random_actions()
        step = own.step(actions)
        observed, rewards, terminated, truncated, infos = env.step(actions)
        assert np.array_equal(observed, step.observations) and np.array_equal(rewards, step.rewards)
        assert np.array_equal(terminated, step.terminated) and np.array_equal(truncated, step.truncated)
        assert np.array_equal(infos["avail_actions"], step.avail_actions)
        if mode is AutoresetMode.SAME_STEP and step.ended.any():
            assert step.final is not None
            assert np.array_equal(infos["_final_obs"], step.ended)
            assert np.array_equal(infos["final_obs"][step.ended], step.final.observations[step.ended])
        if mode is AutoresetMode.DISABLED and step.ended.any():
            env.reset(options={"reset_mask": step.ended})
            own.reset(mask=step.ended.copy())
        ended |= bool((terminated | truncated).any())
    assert ended
    env.close()


def test_random_samples_are_replaced_and_counted() -> None:
    env = gymnasium.make_vec("mackrl/3m-v0", 4, vectorization_mode="vector_entry_point")
    env.reset(seed=1)
    env.action_space.seed(1)
    illegal = 0
    for _ in range(30):
        *_, infos = env.step(env.action_space.sample())
        illegal += infos["illegal"].sum()
    assert illegal > 0
    env.close()
