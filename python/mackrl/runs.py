"""Runs: trained, kept in a folder, looked into."""

from __future__ import annotations

import dataclasses
import html
import json
import math
import os
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import NDArray

from . import _native
from ._progress import shown
from ._settings import MapName, Setting, assignment, environment, threads as count_of, world_layers

if TYPE_CHECKING:
    from .policy import Team

__all__ = ["Progress", "Replay", "Run", "play", "train"]


@dataclasses.dataclass(frozen=True)
class Progress:
    """How a run stands."""

    steps: int
    """Environment steps played."""
    steps_total: int
    """Environment steps to play."""
    battle_won: float | None
    """Share of battles won in the latest greedy test, if the world says."""


Listener = Callable[[Progress], object]

Checkpoint = Literal["last", "best"] | int
"""Which weights of a run: the last, those that did best in a test, or those that were kept at a number of steps."""


def train(
    map_name: MapName = "3m",
    *,
    preset: str = "default",
    algorithm: str | None = None,
    steps: int | None = None,
    seed: int | None = None,
    out: str | os.PathLike[str] | None = None,
    config: str | os.PathLike[str] | None = None,
    settings: Mapping[str, Setting] | None = None,
    world: Mapping[str, Setting] | None = None,
    threads: int | None = None,
    progress: bool | Listener | None = None,
) -> Run:
    """Trains a team, as ``mackrl train`` does, and gives its run: the same folder to the byte, but for what the clock says.

    Args:
        map_name: a map, a scenario file, a kind of world that has no maps, or a class derived from ``mackrl.World``.
        preset: the shipped configuration to start from.
        algorithm: what learns.
        steps: environment steps, summed over parallel worlds.
        seed: from which all randomness follows.
        out: the folder, which must not hold a run; ``runs/MAP-ALGORITHM-seedS`` otherwise.
        config: a TOML file laid over the preset.
        settings: single settings laid over everything else, such as ``{"algorithm.gamma": 0.95}``.
        world: settings of the world, such as ``{"sight_range": 8}``; for a class, the arguments that it is made with.
        threads: how many work; they change no result. All processors otherwise.
        progress: ``True`` or ``False``, or a function that is called with a ``Progress`` after every update. It is shown in
            notebooks and terminals otherwise.

    Raises:
        ValueError: if a setting is unknown or out of its range, with what was expected.
        FileExistsError: if the folder holds something; an unfinished run is continued by ``Run(folder).resume()``.
        KeyboardInterrupt: after an interruption; the run has written a checkpoint and can be resumed.
    """
    typed: list[tuple[str, str]] = []
    short = {"algorithm": ("algorithm.name", algorithm), "steps": ("run.steps_env", steps), "seed": ("run.seed", seed)}
    for name, (key, value) in short.items():
        if value is not None:
            typed.append((f"{name}={value!r}", assignment("", key, value)[1]))
    chosen, assignments = world_layers(map_name, world or {})
    typed.extend(assignments)
    typed.extend(assignment("", key, value) for key, value in (settings or {}).items())
    layers = _native.Layers(preset=preset, file=config, map=chosen, settings=typed)
    folder = Path(layers.folder() if out is None else out)
    with shown(progress, Progress) as report:
        _native.train(folder, layers, count_of(threads), report)
    return Run(folder)


class Run:
    """A run folder.

    Args:
        folder: where it lies.

    What is read of it is checked: where a finished run is not what it was at its end, such as with the weights of another run, that
    is a ``ValueError``.

    Raises:
        FileNotFoundError: if no run lies there.
    """

    def __init__(self, folder: str | os.PathLike[str]) -> None:
        self.folder = Path(folder)
        _native.run_description(self.folder)

    @property
    def status(self) -> str:
        """``"running"``, ``"finished"``, ``"interrupted"`` or ``"failed"``."""
        status: str = json.loads(_native.run_description(self.folder)[0])
        return status

    def resume(self, *, threads: int | None = None, progress: bool | Listener | None = None) -> Run:
        """Goes on to the end, as if it had never stopped; a finished run stays as it is."""
        with shown(progress, Progress) as report:
            _native.resume(self.folder, count_of(threads), report)
        return self

    def metrics(self) -> dict[str, NDArray[np.float64]]:
        """Every metric as an array of one length, a number for each row; NaN where a row does not have it. ``t_env`` counts
        environment steps."""
        rows: list[dict[str, Any]] = json.loads(_native.run_rows(self.folder))
        names = dict.fromkeys(name for row in rows for name, value in row.items() if not isinstance(value, str))
        return {name: np.array([row.get(name, math.nan) for row in rows], np.float64) for name in names}

    @property
    def teams(self) -> dict[str, Any] | None:
        """Of a finished run, how its ``"last"`` and its ``"best"`` weights play in episodes that neither training nor tests have seen:
        ``"steps_env"``, ``"mean"``, ``"standard_error"`` and ``"episodes"`` of each, and under ``"measure"`` what was measured."""
        teams: dict[str, Any] | None = json.loads(_native.run_description(self.folder)[2])
        return teams

    def config(self) -> dict[str, Any]:
        """The whole configuration."""
        config: dict[str, Any] = json.loads(_native.run_description(self.folder)[1])
        return config

    def team(self, checkpoint: Checkpoint = "last") -> Team:
        """The team with its weights: the ``"last"`` ones, those that did ``"best"`` in a test, or those that were kept at a number of
        steps, as the setting ``run.weights_interval_steps_env`` asks for."""
        from .policy import load

        return load(self, checkpoint)

    def evaluate(
        self,
        episodes: int = 320,
        *,
        seed: int | None = None,
        threads: int | None = None,
        checkpoint: Checkpoint = "last",
    ) -> dict[str, float]:
        """Plays greedy episodes: means and standard errors under the names of ``mackrl evaluate --json``."""
        played = _native.evaluate(self.folder, episodes, seed, count_of(threads), str(checkpoint))
        result: dict[str, float] = json.loads(played)
        return result

    def replay(
        self,
        episode: int = 0,
        *,
        seed: int | None = None,
        exploration: float | None = None,
        checkpoint: Checkpoint = "last",
    ) -> Replay:
        """Plays an episode of ``evaluate`` again and keeps it: greedy, or sampled with ``exploration`` in [0, 1]."""
        return Replay(_native.record_policy(self.folder, seed, episode, exploration, str(checkpoint)))

    def __fspath__(self) -> str:
        return os.fspath(self.folder)

    def __repr__(self) -> str:
        return f"Run({os.fspath(self.folder)!r}, {self.status})"


class Replay:
    """A recorded episode. In a notebook it is shown as a page to step through, with what every group knew.

    Args:
        content: the bytes of a replay file.

    Raises:
        ValueError: if they are damaged, or were recorded by another version of the simulator.
    """

    def __init__(self, content: bytes) -> None:
        self.content = content
        self.summary: dict[str, Any] = json.loads(_native.replay_summary(content))
        name, steps, rewards = _native.replay_steps(content)
        self.env, self.key = json.loads(name)
        self._steps: list[dict[str, Any]] = json.loads(steps)
        self.rewards = np.array(rewards, np.float32)

    @staticmethod
    def load(file: str | os.PathLike[str]) -> Replay:
        """Reads a replay file."""
        return Replay(Path(file).read_bytes())

    def save(self, file: str | os.PathLike[str]) -> None:
        """Writes a replay file, which ``mackrl replay`` and ``mackrl explain`` read."""
        Path(file).write_bytes(self.content)

    @property
    def actions(self) -> NDArray[np.int64]:
        """What everybody did [T, N]."""
        return np.array([step["actions"] for step in self._steps], np.int64)

    @property
    def thoughts(self) -> list[dict[str, Any] | None]:
        """What the controllers computed at every step, as the replay file has it; nothing for scripts."""
        return [step.get("thought") for step in self._steps]

    def page(self, step: int = 0) -> str:
        """A page for the browser that needs no network; it first shows ``step``."""
        return _native.replay_page(self.content, step)

    def _repr_html_(self) -> str:
        page = html.escape(self.page(), quote=True)
        style = "width:100%;height:760px;border:0"
        return f'<iframe sandbox="allow-scripts" style="{style}" srcdoc="{page}"></iframe>'

    def __repr__(self) -> str:
        won = "won" if self.summary["battle_won"] else "not won"
        return f"Replay({self.summary['map']} by {self.summary['policy']}, {won} after {self.summary['ep_length']} steps)"


def play(
    map_name: str = "3m", *, policy: str = "focus-fire", seed: int = 1, episode: int = 0, **settings: Setting
) -> Replay:
    """Plays an episode by a script, ``"random"``, ``"idle"``, ``"nearest"``, ``"focus-fire"`` or ``"kite"``."""
    return Replay(_native.record_script(environment(map_name, settings), policy, seed, episode))


