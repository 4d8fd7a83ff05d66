"""The arrays that worlds write."""

from __future__ import annotations

import dataclasses
import json
from collections.abc import Iterator
from typing import Any

import numpy as np
from numpy.typing import NDArray

__all__ = ["Buffers", "Spec", "Step"]


@dataclasses.dataclass(frozen=True)
class Spec:
    """Sizes of a world's arrays and its time limit.

    Axes: B worlds, N agents, M entities (the agents first), F features of an entity, A actions, O numbers of an observation,
    G numbers of the state.
    """

    name: str
    """Which world, such as ``3m``."""
    n_agents: int
    """N."""
    n_entities: int
    """M, at most 128."""
    n_actions: int
    """A."""
    obs_size: int
    """O."""
    state_size: int
    """G."""
    entity_features: int
    """F."""
    position_features: int
    """How many of the F, from the first on, are a position in map units."""
    episode_limit: int
    """Steps after which an episode is truncated."""
    distance_scale: float
    """Map units by which relative positions are divided to become network inputs."""
    statistics: tuple[str, ...]
    """Names of what an episode is reported by, such as ``battle_won``."""
    success: str | None
    """The statistic that says how far an episode succeeded, in [0, 1], if one does."""

    @staticmethod
    def _of(text: str) -> Spec:
        spec = json.loads(text)
        names = tuple(statistic["name"] for statistic in spec["statistics"])
        return Spec(
            name=spec["name"],
            n_agents=spec["agents"],
            n_entities=spec["entities"],
            n_actions=spec["actions"],
            obs_size=spec["observation_size"],
            state_size=spec["state_size"],
            entity_features=spec["entity_features"],
            position_features=spec["position_features"],
            episode_limit=spec["episode_limit"],
            distance_scale=spec["distance_scale"],
            statistics=names,
            success=None if spec["success"] is None else names[spec["success"]],
        )


@dataclasses.dataclass(eq=False)
class Buffers:
    """What worlds show, as arrays that belong to the caller and that worlds write into.

    ``buffers[t]`` gives views of part ``t`` of the first axis, so one allocation of ``[T, B, …]`` holds a whole rollout.
    """

    observations: NDArray[np.float32]
    """``[…, N, O]``: what each agent observes; zeros for the dead."""
    state: NDArray[np.float32]
    """``[…, G]``: what only a critic may see."""
    avail_actions: NDArray[np.bool_]
    """``[…, N, A]``: which actions are available; at least one in each row."""
    visible: NDArray[np.bool_]
    """``[…, N, M]``: which entities each agent sees; the living see themselves, the dead nothing."""
    entities: NDArray[np.float32]
    """``[…, M, F]``: features of every entity in absolute coordinates."""

    @staticmethod
    def allocate(spec: Spec, *lead: int) -> Buffers:
        """Zeroed arrays whose first axes are ``lead``, such as ``(T, B)``."""
        n, m = spec.n_agents, spec.n_entities
        return Buffers(
            observations=np.zeros((*lead, n, spec.obs_size), np.float32),
            state=np.zeros((*lead, spec.state_size), np.float32),
            avail_actions=np.zeros((*lead, n, spec.n_actions), np.bool_),
            visible=np.zeros((*lead, n, m), np.bool_),
            entities=np.zeros((*lead, m, spec.entity_features), np.float32),
        )

    def __getitem__(self, index: Any) -> Buffers:
        """Views of the same part of every array, by an index of the first axes."""
        return Buffers(*(array[index] for array in self))

    def __iter__(self) -> Iterator[NDArray[Any]]:
        """The five arrays, in the order of their declaration."""
        return iter((self.observations, self.state, self.avail_actions, self.visible, self.entities))

    def __len__(self) -> int:
        """Length of the first axis."""
        return len(self.observations)

    def copy(self) -> Buffers:
        """The same numbers in arrays of their own."""
        return Buffers(*(array.copy() for array in self))


@dataclasses.dataclass(eq=False)
class Step(Buffers):
    """What one step of B worlds gave. The arrays are the worlds' own and are written again by the next step: copy what is kept.

    In worlds whose episode ended in this step, rewards, ends and statistics are those of the episode that ended; what is
    observed is already the next episode's first moment with ``autoreset="same-step"``, and the last moment lies in ``final``.
    """

    rewards: NDArray[np.float32]
    """``[B]``: shared by the team."""
    terminated: NDArray[np.bool_]
    """``[B]``: the game was decided."""
    truncated: NDArray[np.bool_]
    """``[B]``: time ran out."""
    statistics: NDArray[np.float64]
    """``[B, S]``: how each episode stands, in the order of ``spec.statistics``."""
    final: Buffers | None
    """The last moment of episodes that ended, in their rows; other rows are left as they were. Only with
    ``autoreset="same-step"``."""
    spec: Spec = dataclasses.field(repr=False)

    @property
    def ended(self) -> NDArray[np.bool_]:
        """``[B]``: the episode is over, for either reason."""
        ended: NDArray[np.bool_] = self.terminated | self.truncated
        return ended

    def statistic(self, name: str) -> NDArray[np.float64]:
        """``[B]``: the statistic called ``name``.

        Raises:
            ValueError: if the world declares none of that name.
        """
        if name not in self.spec.statistics:
            declared = ", ".join(self.spec.statistics) or "none"
            raise ValueError(f"no statistic is called {name!r}, {self.spec.name} has {declared}")
        values: NDArray[np.float64] = self.statistics[:, self.spec.statistics.index(name)]
        return values

    @property
    def battle_won(self) -> NDArray[np.bool_]:
        """``[B]``: whether the team has won."""
        won: NDArray[np.bool_] = self.statistic("battle_won") != 0
        return won

    @property
    def dead_allies(self) -> NDArray[np.int32]:
        """``[B]``: agents lost."""
        return self.statistic("dead_allies").astype(np.int32)

    @property
    def dead_enemies(self) -> NDArray[np.int32]:
        """``[B]``: enemies defeated."""
        return self.statistic("dead_enemies").astype(np.int32)
