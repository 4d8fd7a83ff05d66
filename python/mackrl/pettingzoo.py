"""PettingZoo's parallel interface. Needs ``pip install 'mackrl[pettingzoo]'``.

A dictionary for each agent costs six to ten times what the simulator does: ``mackrl.VectorEnv`` is the fast way.
"""

from __future__ import annotations

import os
from typing import Any, Literal

import numpy as np
from gymnasium import spaces
from numpy.typing import NDArray
from pettingzoo import ParallelEnv

from .vector import VectorEnv

__all__ = ["parallel_env"]

Masks = Literal["observation", "info", "rllib"]


class parallel_env(ParallelEnv):  # type: ignore[misc]  # noqa: N801
    """A battle among dictionaries by agent.

    Args:
        map_name: a map or a scenario file.
        masks: where each agent finds which actions are available: in its observation, a dictionary of ``observation`` and
            ``action_mask``; the same for RLlib, whose examples say ``observations``; or in ``infos[agent]["action_mask"]``. One place,
            because TorchRL refuses two.
        illegal: what becomes of an action that is not available: the lowest available one takes its place and is counted in
            ``infos[agent]["illegal"]``, or it is an error. PettingZoo's own seed test samples without masks.
        dead: whether the dead stay, with no-op as their only action, as in SMAC, or leave. To TorchRL and BenchMARL the first
            agent that leaves ends the game.
        render_mode: ``"human"`` prints a line on every unit, ``"ansi"`` gives it.
        settings: the world's own, such as ``sight_range=8``.
    """

    metadata = {"name": "mackrl_v0", "render_modes": ["human", "ansi"], "is_parallelizable": True}

    def __init__(
        self,
        map_name: str | os.PathLike[str] = "3m",
        *,
        masks: Masks = "observation",
        illegal: Literal["replace", "error"] = "replace",
        dead: Literal["stay", "leave"] = "stay",
        render_mode: Literal["human", "ansi"] | None = None,
        **settings: Any,
    ) -> None:
        for name, found, expected in (
            ("masks", masks, ("observation", "info", "rllib")),
            ("illegal", illegal, ("replace", "error")),
            ("dead", dead, ("stay", "leave")),
            ("render_mode", render_mode, ("human", "ansi", None)),
        ):
            if found not in expected:
                raise ValueError(f"{name} is {found!r}, expected one of {expected}")
        self._env = VectorEnv(map_name, autoreset="disabled", **settings)
        self._masks, self._illegal, self._dead = masks, illegal, dead
        self.render_mode = render_mode
        spec = self._env.spec
        self.possible_agents = [f"agent_{agent}" for agent in range(spec.n_agents)]
        self.agents: list[str] = []
        self._index = {name: agent for agent, name in enumerate(self.possible_agents)}
        self._illegal_actions = np.zeros(spec.n_agents, np.int64)
        low, high = np.float32(-np.inf), np.float32(np.inf)
        box = spaces.Box(low, high, (spec.obs_size,), np.float32)
        mask = spaces.Box(0, 1, (spec.n_actions,), np.int8)
        self.state_space = spaces.Box(low, high, (spec.state_size,), np.float32)
        self.observation_spaces = {}
        self.action_spaces = {}
        for name in self.possible_agents:
            space: spaces.Space[Any] = box
            if masks != "info":
                space = spaces.Dict({self._called: box, "action_mask": mask})
            self.observation_spaces[name] = space
            self.action_spaces[name] = spaces.Discrete(spec.n_actions)

    @property
    def _called(self) -> str:
        return "observations" if self._masks == "rllib" else "observation"

    def observation_space(self, agent: str) -> spaces.Space[Any]:
        """The space of what an agent observes: the same object at every call."""
        return self.observation_spaces[agent]

    def action_space(self, agent: str) -> spaces.Space[Any]:
        """The space of an agent's actions: the same object at every call."""
        return self.action_spaces[agent]

    def reset(
        self, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[dict[str, Any], dict[str, dict[str, Any]]]:
        """Begins episode 0 of ``seed``, or the next one."""
        self._env.reset(seed=seed)
        self.agents = self.possible_agents[:]
        self._illegal_actions[:] = 0
        return self._observed(self.agents), self._infos(self.agents, np.zeros(len(self._env.spec.statistics)))

    def step(
        self, actions: dict[str, int]
    ) -> tuple[dict[str, Any], dict[str, float], dict[str, bool], dict[str, bool], dict[str, dict[str, Any]]]:
        """Plays one action for each agent that is left; agents without one do what is lowest among the available."""
        acting = self.agents
        available = self._env.buffers.avail_actions[0]
        chosen = available.argmax(axis=1)
        for name, action in actions.items():
            agent = self._index[name]
            found = int(action)
            is_action = 0 <= found < available.shape[1]
            if self._illegal == "error" or (is_action and available[agent, found]):
                chosen[agent] = found
            else:
                self._illegal_actions[agent] += 1
        step = self._env.step(chosen.astype(np.int64)[None])
        reward, terminated, truncated = float(step.rewards[0]), bool(step.terminated[0]), bool(step.truncated[0])
        ends = {name: terminated for name in acting}
        if self._dead == "leave":
            lives = step.visible[0].any(axis=1)
            ends = {name: terminated or not bool(lives[self._index[name]]) for name in acting}
        cut = {name: truncated for name in acting}
        self.agents = [name for name in acting if not (ends[name] or cut[name])]
        rewards = {name: reward for name in acting}
        return self._observed(acting), rewards, ends, cut, self._infos(acting, step.statistics[0])

    def state(self) -> NDArray[np.float32]:
        """What only a critic may see; a copy."""
        state: NDArray[np.float32] = self._env.buffers.state[0].copy()
        return state

    def render(self) -> str | None:
        """A line on every unit, printed or given as ``render_mode`` says."""
        if self.render_mode is None:
            return None
        spec, entities = self._env.spec, self._env.buffers.entities[0]
        names = [*self.possible_agents, *(f"enemy_{enemy}" for enemy in range(spec.n_entities - spec.n_agents))]
        rows = zip(names, entities, strict=True)
        text = "\n".join(f"{name}: x {row[0]:.2f}, y {row[1]:.2f}, life {row[2]:.2f}" for name, row in rows)
        if self.render_mode == "ansi":
            return text
        print(text)
        return None

    def close(self) -> None:
        """Gives the world's memory back."""
        self._env.close()

    def _observed(self, names: list[str]) -> dict[str, Any]:
        observations = self._env.buffers.observations[0].copy()
        if self._masks == "info":
            return {name: observations[self._index[name]] for name in names}
        masks = self._env.buffers.avail_actions[0].astype(np.int8)
        return {
            name: {self._called: observations[self._index[name]], "action_mask": masks[self._index[name]]} for name in names
        }

    def _infos(self, names: list[str], statistics: NDArray[np.float64]) -> dict[str, dict[str, Any]]:
        if self._masks == "info":
            masks = self._env.buffers.avail_actions[0].astype(np.int8)
            return {name: {"action_mask": masks[self._index[name]]} for name in names}
        reported = dict(zip(self._env.spec.statistics, map(float, statistics), strict=True))
        return {name: {**reported, "illegal": int(self._illegal_actions[self._index[name]])} for name in names}

    def __reduce__(self) -> tuple[object, ...]:
        map_name, _, _, _, settings = self._env._made_with
        arguments = {
            "masks": self._masks,
            "illegal": self._illegal,
            "dead": self._dead,
            "render_mode": self.render_mode,
            **settings,
        }
        return _made, (map_name, arguments)


def _made(map_name: str, arguments: dict[str, Any]) -> parallel_env:
    """The world that was copied, made anew from its arguments: it has played nothing."""
    return parallel_env(map_name, **arguments)
