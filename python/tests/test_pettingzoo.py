"""PettingZoo's own tests, and what they leave out."""

from __future__ import annotations

import itertools
import pickle
import warnings
from typing import Any

import numpy as np
import pytest
from pettingzoo.test import api_test, parallel_api_test, parallel_seed_test, render_test
from pettingzoo.utils.conversions import parallel_to_aec

from mackrl import IllegalAction
from mackrl.pettingzoo import parallel_env

COMBINATIONS = list(itertools.product(("observation", "info", "rllib"), ("replace",), ("stay", "leave")))


@pytest.mark.parametrize(("masks", "illegal", "dead"), COMBINATIONS)
@pytest.mark.filterwarnings("ignore")
def test_pettingzoo_accepts_it(masks: Any, illegal: Any, dead: Any) -> None:
    def make() -> parallel_env:
        return parallel_env("3m", masks=masks, illegal=illegal, dead=dead)

    parallel_api_test(make(), num_cycles=150)
    parallel_seed_test(make, num_cycles=20)
    api_test(parallel_to_aec(make()), num_cycles=150)


@pytest.mark.filterwarnings("ignore")
def test_it_renders_as_pettingzoo_asks() -> None:
    render_test(lambda render_mode=None: parallel_to_aec(parallel_env("3m", render_mode=render_mode)))


@pytest.mark.parametrize("illegal", ["replace", "error"])
def test_whole_episodes_repeat_from_their_seed(illegal: Any) -> None:
    def episode(env: parallel_env, seed: int) -> list[Any]:
        rng = np.random.default_rng(3)
        observed, infos = env.reset(seed=seed)
        told: list[Any] = []
        while env.agents:
            actions = {name: rng.choice(np.flatnonzero(observed[name]["action_mask"])) for name in env.agents}
            observed, rewards, ends, cut, infos = env.step(actions)
            told += [rewards, ends, cut, infos, env.state().tobytes()]
            told += [observed[name]["observation"].tobytes() for name in observed]
        assert all(info["illegal"] == 0 for info in infos.values())
        return told

    env, other = parallel_env("2s3z", illegal=illegal), parallel_env("2s3z", illegal=illegal)
    assert episode(env, 4) == episode(other, 4) == episode(env, 4)
    assert episode(env, 4) != episode(env, 5)


def test_an_illegal_action_is_replaced_and_counted_or_refused() -> None:
    env = parallel_env("3m")
    env.reset(seed=1)
    *_, infos = env.step({name: 0 for name in env.agents})
    assert [infos[name]["illegal"] for name in env.agents] == [1, 1, 1]
    strict = parallel_env("3m", illegal="error")
    strict.reset(seed=1)
    with pytest.raises(IllegalAction):
        strict.step({name: 0 for name in strict.agents})


@pytest.mark.parametrize("dead", ["stay", "leave"])
def test_the_dead_stay_or_leave(dead: Any) -> None:
    env = parallel_env("3m", dead=dead)
    observed, _ = env.reset(seed=1)
    fewer = False
    while env.agents:
        observed, _, ends, cut, _ = env.step({name: 1 for name in env.agents})
        if 0 < len(env.agents) < 3:
            fewer = True
        if dead == "stay":
            assert len(observed) == 3 and len(set(ends.values())) == 1
    assert fewer == (dead == "leave")


def test_infos_have_the_same_keys_from_reset_on_and_hold_numbers_alone() -> None:
    env = parallel_env("3m")
    _, infos = env.reset(seed=1)
    keys = set(infos["agent_0"])
    assert keys == {"battle_won", "timed_out", "dead_allies", "dead_enemies", "illegal"}
    *_, infos = env.step({name: 1 for name in env.agents})
    assert all(set(info) == keys for info in infos.values())
    assert all(isinstance(value, (int, float)) for value in infos["agent_0"].values())


def test_it_is_copied_from_its_arguments_and_refuses_others() -> None:
    env = parallel_env("3m", masks="info", dead="leave", sight_range=8)
    copied = pickle.loads(pickle.dumps(env))
    assert (copied._masks, copied._dead) == ("info", "leave")
    assert copied._env.spec.distance_scale == 8
    with pytest.raises(ValueError, match="masks is 'both', expected one of"):
        parallel_env("3m", masks="both")  # type: ignore[arg-type]
    assert warnings is not None
