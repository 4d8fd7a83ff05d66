"""Worlds in Python: checked by the contract's own test, trained in, and played in as any other."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest

import mackrl

sys.path.insert(0, str(Path(__file__).parents[1] / "examples"))
from own_world import Lamp  # noqa: E402

TRAINED = {"preset": "paper-code", "algorithm": "mackrl", "steps": 400, "progress": False, "settings": {"test.episodes": 8}}


def test_the_example_keeps_the_contract() -> None:
    mackrl.check_world(Lamp)
    mackrl.check_world(Lamp, 3, looks=0.3)


class Changed(Lamp):
    """A lamp with a fault."""

    def __init__(self, fault: str) -> None:
        super().__init__()
        self.fault = fault

    def draw(self, out: mackrl.Buffers) -> None:
        super().draw(out)
        if self.fault == "sight":
            out.visible[:, 2] = True
        if self.fault == "chance":
            out.state[0] = np.random.default_rng().random()
        if self.fault == "self":
            out.visible[0, 0] = False
        if self.fault == "error":
            raise ZeroDivisionError("planted")


@pytest.mark.parametrize(
    ("fault", "message"),
    [
        ("sight", "lamp"),
        ("chance", "differs when repeated"),
        ("self", "lamp"),
        ("error", "lamp"),
    ],
)
def test_a_broken_promise_is_told_in_words(fault: str, message: str) -> None:
    with pytest.raises(AssertionError) as caught:
        mackrl.check_world(Changed, 5, fault=fault)
    assert message in str(caught.value), caught.value


def test_worlds_are_played_in_arrays_and_failures_are_told() -> None:
    env = mackrl.VectorEnv(Lamp, 5, safe=0.25)
    env.reset(seed=1)
    actions = np.full((5, 2), 2)
    step = env.step(actions)
    assert (step.rewards == 0.25).all() and not step.ended.any()
    for _ in range(3):
        step = env.step(actions)
    assert step.truncated.all() and (step.statistic("pressed") == 0).all()
    again = mackrl.VectorEnv(Lamp, 5, safe=0.25, threads=3)
    again.reset(seed=1)
    env.reset(seed=1)
    for _ in range(9):
        chosen = env.random_actions()
        one, other = env.step(chosen), again.step(chosen)
        assert np.array_equal(one.state, other.state) and np.array_equal(one.rewards, other.rewards)
    broken = mackrl.VectorEnv(Changed, fault="error")
    broken.reset(seed=1)
    with pytest.raises(mackrl.WorldFailed, match="world 0: .*ZeroDivisionError: planted.*test_own_world.py"):
        broken.step(np.full((1, 2), 2))
    with pytest.raises(ValueError, match="unexpected keyword argument 'saf'"):
        mackrl.VectorEnv(Lamp, saf=1)
    with pytest.raises(TypeError, match="is no subclass of mackrl.World"):
        mackrl.VectorEnv(int)  # type: ignore[arg-type]


def test_a_team_is_trained_and_its_run_opened_again(tmp_path: Path) -> None:
    run = mackrl.train(Lamp, out=tmp_path / "lamp", world={"safe": 0.3}, **TRAINED)  # type: ignore[arg-type]
    threaded = mackrl.train(Lamp, out=tmp_path / "two", world={"safe": 0.3}, threads=2, **TRAINED)  # type: ignore[arg-type]
    weights = [(one.folder / "weights.safetensors").read_bytes() for one in (run, threaded)]
    assert weights[0] == weights[1]
    assert run.config()["env"] == {"name": "python", "map": "own_world:Lamp", "arguments": '{"safe": 0.3}'}
    assert 0 <= run.evaluate(20)["test_pressed_mean"] <= 1
    assert "test_pressed_mean" in run.metrics()
    team, env = run.team(), mackrl.VectorEnv(Lamp, 3, safe=0.3)
    shown, central = env.reset(seed=1), run.team().play(3, seed=1)
    assert central.act(shown).shape == (3, 2) and team.spec.name == "lamp"


class Forgetful(Lamp):
    """A lamp whose common knowledge fails."""

    def available(self, known: mackrl.worlds.Known, agent: int) -> np.ndarray:
        raise KeyError("planted")


def test_a_world_that_fails_in_training_is_told(tmp_path: Path) -> None:
    with pytest.raises(mackrl.WorldFailed, match="available\\(\\) of the world failed: KeyError: 'planted'"):
        mackrl.train(Forgetful, out=tmp_path / "lamp", threads=1, **TRAINED)  # type: ignore[arg-type]


def test_a_class_that_cannot_be_found_is_named() -> None:
    from mackrl._native import Layers, Worlds

    for name in ("nowhere:Lamp", "own_world:Lump", "Lamp"):
        settings = [("", 'env.name="python"'), ("", f'env.map="{name}"')]
        with pytest.raises(ValueError, match=name):
            Worlds(Layers(settings=settings), 1, 1, "disabled")
