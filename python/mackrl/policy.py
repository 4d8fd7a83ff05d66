"""Trained teams: the whole team, one agent alone, and the probabilities of all levels."""

from __future__ import annotations

import dataclasses
import json
import os
from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import _native
from .arrays import Buffers, Spec
from .runs import Checkpoint
from .vector import Stream

__all__ = ["Agent", "Level", "Play", "Tables", "Team", "load", "read_weights"]


def load(run: str | os.PathLike[str], checkpoint: Checkpoint = "last") -> Team:
    """The team of a run folder with its weights: the ``"last"`` ones (at the end, or those of the latest checkpoint), those that did
    ``"best"`` in a test, or those that were kept at a number of steps."""
    return Team(run, checkpoint)


def read_weights(content: bytes) -> tuple[dict[str, NDArray[np.float32]], dict[str, str]]:
    """The tensors of a file of weights by their names, and what the file says of itself."""
    length = int.from_bytes(content[:8], "little")
    header = json.loads(content[8 : 8 + length])
    metadata: dict[str, str] = header.pop("__metadata__", {})
    tensors = {}
    for name, entry in header.items():
        begin, end = (8 + length + offset for offset in entry["data_offsets"])
        tensors[name] = np.frombuffer(content[begin:end], "<f4").reshape(entry["shape"])
    return tensors, metadata


@dataclasses.dataclass(frozen=True, eq=False)
class Level:
    """The table of one level: what each of its groups chooses with which probability."""

    groups: list[list[int]]
    """Members of each group."""
    probabilities: NDArray[np.float32]
    """``[G, C]``: first the ways to divide, then the joint actions; of members (i, j), column ``divisions + i·A + j``. NaN for groups
    that nothing in force leads to."""

    def of(self, *members: int) -> NDArray[np.float32]:
        """The row of the group with these members."""
        row: NDArray[np.float32] = self.probabilities[self.groups.index(sorted(members))]
        return row


@dataclasses.dataclass(frozen=True, eq=False)
class Tables:
    """The probabilities of all levels at one step of one world: what is sampled from, and what learning differentiates."""

    partitions: list[list[list[int]]]
    """The partitions in force: groups by their members, in the order of the first level's columns."""
    levels: dict[str, Level]
    """By name, the whole team's first and that of single agents last."""


class Team:
    """A team that was trained. ``load`` makes it."""

    def __init__(self, run: str | os.PathLike[str], checkpoint: Checkpoint = "last") -> None:
        self._team = _native.Team(os.fspath(run), str(checkpoint))
        self.spec = Spec._of(self._team.spec())
        self.config: dict[str, Any] = json.loads(self._team.config())
        self.weights: Mapping[str, NDArray[np.float32]]
        self.metadata: Mapping[str, str]
        self.weights, self.metadata = read_weights(self._team.weights())

    def agent(
        self, index: int, *, seed: int, episode: int = 0, stream: Stream = "other", exploration: float | None = None
    ) -> Agent:
        """Agent ``index`` alone: with the weights, the shared seed and its own views, it computes its own actions, bit for bit those of
        the whole team in the episode (seed, stream, episode). Greedy, or sampled with ``exploration`` in [0, 1]."""
        return Agent(self._team.agent(index, (seed, episode), stream, exploration))

    def play(
        self,
        num_envs: int = 1,
        *,
        seed: int | Sequence[int],
        episode: int = 0,
        stream: Stream = "other",
        exploration: float | None = None,
    ) -> Play:
        """The whole team in B worlds that begin an episode together, named as ``VectorEnv.reset`` names them."""
        if isinstance(seed, (int, np.integer)):
            keys = [(int(seed), episode + world) for world in range(num_envs)]
        elif len(seed) != num_envs:
            raise ValueError(f"seed has {len(seed)} entries, expected one for each of {num_envs} worlds")
        else:
            keys = [(int(one), episode) for one in seed]
        return Play(self._team.play(keys, stream, exploration))

    def __repr__(self) -> str:
        return f"Team({self.config['algorithm']['name']} on {self.spec.name})"


class Agent:
    """One agent alone in one episode."""

    def __init__(self, agent: _native.Agent) -> None:
        self._agent = agent

    def act(
        self,
        observation: NDArray[np.float32],
        avail_actions: NDArray[np.bool_],
        visible: NDArray[np.bool_],
        entities: NDArray[np.float32],
    ) -> int:
        """Its action at the next step: from what it observes [O], what is available to it [A], and the entities [M, F] where
        ``visible`` [M] is true. Features of others are not read."""
        return self._agent.act(observation, avail_actions, visible, entities)

    def inputs(self) -> list[tuple[str, list[int], NDArray[np.float32]]]:
        """What its controllers read at the latest step: name of the level, members of the group, numbers."""
        return self._agent.inputs()


class Play:
    """The whole team at work in B worlds."""

    def __init__(self, play: _native.Play) -> None:
        self._play = play

    def act(self, shown: Buffers, playing: NDArray[np.bool_] | None = None) -> NDArray[np.int64]:
        """Everybody's actions [B, N] at the next step. Worlds where ``playing`` [B] is false have left and do not come back; their
        rows keep what they last did."""
        mask = None if playing is None else np.asarray(playing, np.bool_).tolist()
        return self._play.act(tuple(shown), mask)

    def tables(self, b: int = 0) -> Tables:
        """The probabilities of all levels in world ``b`` at the step that ``act`` has just decided."""
        partitions, levels = self._play.tables(b)
        return Tables(partitions, {name: Level(groups, rows) for name, groups, rows in levels})
