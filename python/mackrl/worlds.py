"""Worlds of one's own, written in Python."""

from __future__ import annotations

import importlib
import inspect
import json
from abc import ABC, abstractmethod
from collections.abc import Callable, Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import _native
from .arrays import Buffers

__all__ = ["Known", "World", "check_world"]

Known = Mapping[int, NDArray[np.float32]]
"""Features ``[F]`` of the entities that are known, by their indices."""


class World(ABC):
    """A world with N agents that share one reward. Subclass it, and ``mackrl.train(MyWorld, …)`` learns in it.

    Agents are the first N of M entities. Everything random comes from the generator that ``reset`` is given, so that an episode
    can be repeated from its seed and number. ``mackrl.check_world(MyWorld)`` plays random episodes and tests every promise made here.
    """

    name: str = "world"
    """Which world, for reports."""
    version: str = "1"
    """Raise it whenever the same actions give another episode."""
    n_agents: int
    n_actions: int
    n_entities: int
    """At least ``n_agents``, at most 128."""
    entity_features: int
    """Numbers of an entity: its position, then attributes of about unit size."""
    position_features: int = 0
    """How many of them are the position; 0 in worlds without places."""
    obs_size: int
    state_size: int
    episode_limit: int
    distance_scale: float = 1.0
    """What relative positions are divided by."""
    statistics: Mapping[str, str] = {}
    """Names and meanings of what an episode is reported by; ``report`` gives the numbers."""
    success: str | None = None
    """The statistic in [0, 1] that says how far an episode succeeded, if one does."""

    @abstractmethod
    def reset(self, rng: np.random.Generator, out: Buffers) -> None:
        """Begins an episode and writes its first observations into the arrays of ``out``, which has no axis B here.

        ``out`` holds what was written last: write every number. ``rng`` is a function of the episode's name alone.
        """

    @abstractmethod
    def step(self, actions: NDArray[np.int64], out: Buffers) -> tuple[float, bool, bool]:
        """Plays ``actions`` [N], which are available, and writes what follows; gives reward, terminated, truncated."""

    @abstractmethod
    def sees(
        self,
        observer: int,
        observer_features: NDArray[np.float32],
        entity: int,
        entity_features: NDArray[np.float32],
    ) -> bool:
        """Whether the agent ``observer`` sees ``entity``: everybody's field of view, which all agents know before the game.

        It has to agree with what is written into ``out.visible``, for every pair of the living.
        """

    @abstractmethod
    def available(self, known: Known, agent: int) -> NDArray[np.bool_]:
        """Which actions [A] of ``agent`` are surely available to somebody who knows only ``known``.

        A subset of the truth, and equal to it if ``known`` is all that ``agent`` itself sees. ``agent`` is always in ``known``.
        """

    def action_on(self, entity: int) -> int | None:
        """The action by which an agent acts on ``entity``, if there is one."""
        return None

    def report(self) -> Mapping[str, float]:
        """How the episode stands: a number for every name of ``statistics``."""
        return {}


class _Factory:
    """Makes objects of a class with fixed arguments; ``source`` is the text of the class, as far as it can be found."""

    def __init__(self, world: type[World], arguments: Mapping[str, Any]) -> None:
        self._world, self._arguments = world, arguments
        try:
            self.source = inspect.getsource(world)
        except (OSError, TypeError):
            self.source = ""

    def __call__(self) -> World:
        return self._world(**self._arguments)


_KNOWN_CLASSES: dict[str, type[World]] = {}
"""Classes that were handed over in this process: those of a notebook cannot be imported."""

_Known = dict


def register(world: type[World]) -> str:
    """The name by which configurations call the class."""
    if not issubclass(world, World):
        raise TypeError(f"{world.__qualname__} is no subclass of mackrl.World")
    name = f"{world.__module__}:{world.__qualname__}"
    _KNOWN_CLASSES[name] = world
    return name


def _factory(name: str, arguments: str) -> Callable[[], World]:
    """What makes the world that a configuration names."""
    world = _KNOWN_CLASSES.get(name)
    if world is None:
        module, _, qualified = name.partition(":")
        if not module or not qualified:
            raise ValueError(f"{name!r} is no name of a class, expected package.module:Class")
        found: Any = importlib.import_module(module)
        for part in qualified.split("."):
            found = getattr(found, part)
        world = found
    return _Factory(world, json.loads(arguments))


def _generator(seed: int, stream: str, episode: int) -> np.random.Generator:
    """Randomness that is a function of the episode's name alone."""
    number = ["training", "test", "evaluation", "other"].index(json.loads(stream))
    return np.random.Generator(np.random.Philox(key=seed, counter=[0, 0, number, episode]))


def check_world(world: type[World], episodes: int = 10, /, **arguments: Any) -> int:
    """Plays random episodes and checks every promise of the contract that MACKRL relies on.

    Gives the number of steps at which two states were compared that differ only beyond an agent's sight.

    Raises:
        AssertionError: with a sentence that names the broken promise, the episode and the step.
    """
    from ._settings import environment

    return _native.check_world(environment(world, arguments), episodes)
