"""B worlds at once, in arrays that belong to the caller."""

from __future__ import annotations

import os
from collections.abc import Sequence
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from . import _native
from ._settings import MapName, Setting, environment
from .arrays import Buffers, Spec, Step

__all__ = ["Autoreset", "Stream", "VectorEnv"]

Autoreset = Literal["same-step", "next-step", "disabled"]
Stream = Literal["training", "test", "evaluation", "other"]


class VectorEnv:
    """B worlds that are played together.

    An episode is a function of its name, (seed, stream, number), and of the actions. ``reset(seed=s)`` starts episode ``b`` of seed ``s``
    in world ``b``, and the next one there is number ``b + B``: no two worlds ever play the same. With one seed for each world,
    world ``b`` plays episodes 0, 1, 2, … of its own.

    Args:
        map_name: a map (``mackrl.maps()``), a kind of world that has none (``"matrix-game"``), a scenario file ending in
            ``.toml``, or a class derived from ``mackrl.World``.
        num_envs: B, at least 1.
        autoreset: what becomes of a world whose episode is over, as Gymnasium names it. ``"same-step"``: the next one begins within the
            step that ended it; ``"next-step"``: the next step begins it, and its actions are ignored; ``"disabled"``: the world is left
            alone, with reward 0, until it is reset.
        threads: on how many the worlds are shared out. It changes no result.
        scenario: a scenario file, in place of a map.
        settings: the world's own, such as ``sight_range=8``: ``mackrl config --explain env`` lists them.

    Raises:
        ValueError: if there is no such map or setting, with the nearest name.
    """

    def __init__(
        self,
        map_name: MapName = "3m",
        num_envs: int = 1,
        *,
        autoreset: Autoreset = "same-step",
        threads: int = 1,
        scenario: str | os.PathLike[str] | None = None,
        **settings: Setting,
    ) -> None:
        if num_envs < 1:
            raise ValueError(f"num_envs is {num_envs}, expected at least 1")
        self._made_with = (map_name if scenario is None else scenario, num_envs, autoreset, threads, settings)
        self._worlds: _native.Worlds | None = _native.Worlds(
            environment(self._made_with[0], settings), num_envs, threads, autoreset
        )
        self.num_envs = num_envs
        self.autoreset = autoreset
        self.spec = Spec._of(self._worlds.spec())
        self.buffers = Buffers.allocate(self.spec, num_envs)
        self._rewards = np.zeros(num_envs, np.float32)
        self._terminated = np.zeros(num_envs, np.bool_)
        self._truncated = np.zeros(num_envs, np.bool_)
        self._statistics = np.zeros((num_envs, len(self.spec.statistics)), np.float64)
        self._outcome = (self._rewards, self._terminated, self._truncated, self._statistics)
        same_step = autoreset == "same-step"
        self._final = Buffers.allocate(self.spec, num_envs) if same_step else None
        self._last = None if self._final is None else tuple(self._final)
        self._is_begun = False

    @property
    def _native_worlds(self) -> _native.Worlds:
        if self._worlds is None:
            raise ValueError("the worlds are closed")
        return self._worlds

    def reset(
        self,
        seed: int | Sequence[int] | None = None,
        *,
        stream: Stream = "other",
        episode: int = 0,
        mask: NDArray[np.bool_] | None = None,
        out: Buffers | None = None,
    ) -> Buffers:
        """Begins an episode in every world, or where ``mask`` is true: episode ``episode`` of ``seed``, as the class says, or the
        next one if there is no seed (of seed 0 at first).

        Gives ``out``, or ``self.buffers``, with the first observations.
        """
        out = self.buffers if out is None else out
        worlds = self._native_worlds
        b = self.num_envs
        if seed is None and not self._is_begun:
            seed = 0
        for one in [seed] if isinstance(seed, (int, np.integer)) else seed or []:
            if not 0 <= one < 2**64:
                raise ValueError(f"seed is {one}, expected an integer in [0, 2**64)")
        keys: list[tuple[int, int]] | None = None
        stride = 1
        if isinstance(seed, (int, np.integer)):
            keys, stride = [(int(seed), episode + world) for world in range(b)], b
        elif seed is not None:
            if len(seed) != b:
                raise ValueError(f"seed has {len(seed)} entries, expected one for each of {b} worlds")
            keys = [(int(one), episode) for one in seed]
        if mask is not None and np.shape(mask) != (b,):
            raise ValueError(f"mask is of shape {np.shape(mask)}, expected {(b,)}")
        where = None if mask is None else np.asarray(mask, np.bool_).tolist()
        worlds.reset(keys, stride, stream, where, tuple(out))
        self._is_begun = True
        return out

    def step(self, actions: NDArray[np.int64], out: Buffers | None = None) -> Step:
        """Plays ``actions`` [B, N] and writes what follows into ``out``, or into ``self.buffers``.

        Raises:
            IllegalAction: if an action is not available; no world has moved then.
            TypeError, ValueError: if an array is of another type or shape, with what was found and expected.
        """
        if not self._is_begun:
            raise ValueError("no episode has begun: call reset() before step()")
        out = self.buffers if out is None else out
        self._native_worlds.step(actions, tuple(out), self._outcome, self._last)
        return Step(
            out.observations,
            out.state,
            out.avail_actions,
            out.visible,
            out.entities,
            self._rewards,
            self._terminated,
            self._truncated,
            self._statistics,
            self._final,
            self.spec,
        )

    def random_actions(self, out: NDArray[np.int64] | None = None) -> NDArray[np.int64]:
        """A random available action [B, N] for every agent: a function of the episode and the step."""
        if out is None:
            out = np.zeros((self.num_envs, self.spec.n_agents), np.int64)
        self._native_worlds.random_actions(out)
        return out

    def episodes(self) -> list[tuple[int, int, int]]:
        """Which episode each world plays: seed, number, steps so far."""
        return self._native_worlds.episodes()

    def available(self, entities: NDArray[np.float32], known: NDArray[np.bool_], agent: int) -> NDArray[np.bool_]:
        """Which actions [A] of ``agent`` are surely available to somebody who knows only the entities ``known`` [M] of ``entities`` [M, F].

        With what a group commonly knows it gives the mask of the group's joint actions.
        """
        return np.array(self._native_worlds.available(entities, known, agent), np.bool_)

    def sees(
        self,
        observer: int,
        observer_features: NDArray[np.float32],
        entity: int,
        entity_features: NDArray[np.float32],
    ) -> bool:
        """Whether the agent ``observer`` sees ``entity``, both given by their features [F]: what all agents know before the game."""
        return self._native_worlds.sees(observer, observer_features, entity, entity_features)

    def save(self) -> bytes:
        """Where all worlds stand: names of episodes and what was played, not states. It grows with the length of episodes."""
        return self._native_worlds.save()

    def load(self, state: bytes, out: Buffers | None = None) -> Buffers:
        """Brings all worlds to where ``state`` says, by playing it again, and writes what they show.

        Raises:
            ValueError: if the state is that of other worlds or damaged. The worlds have to be reset then.
        """
        out = self.buffers if out is None else out
        self._native_worlds.load(state, tuple(out))
        self._is_begun = True
        return out

    def close(self) -> None:
        """Gives the worlds' memory back; they cannot be played in any more."""
        self._worlds = None

    def __enter__(self) -> VectorEnv:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def __reduce__(self) -> tuple[object, ...]:
        state = self.save() if self._is_begun and self._worlds is not None else None
        return _restored, (*self._made_with, state)

    def __repr__(self) -> str:
        return f"VectorEnv({self.spec.name!r}, num_envs={self.num_envs}, autoreset={self.autoreset!r})"


def _restored(
    map_name: MapName,
    num_envs: int,
    autoreset: Autoreset,
    threads: int,
    settings: dict[str, Any],
    state: bytes | None,
) -> VectorEnv:
    """The worlds that were pickled."""
    env = VectorEnv(map_name, num_envs, autoreset=autoreset, threads=threads, **settings)
    if state is not None:
        env.load(state)
    return env
