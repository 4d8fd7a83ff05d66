"""Gymnasium's interfaces. Needs ``pip install 'mackrl[gymnasium]'``.

``import mackrl.gymnasium`` registers every map as ``mackrl/<map>-v0``: ``gymnasium.make`` gives one team as a tuple of agents,
``gymnasium.make_vec`` B worlds in arrays.
"""

from __future__ import annotations

import os
from typing import Any, Literal

import gymnasium
import numpy as np
from gymnasium import spaces
from gymnasium.vector import AutoresetMode
from numpy.typing import NDArray

from . import _native, arrays, vector

__all__ = ["TeamEnv", "TeamVectorEnv", "register"]

Illegal = Literal["replace", "error"]


def _legal(
    actions: NDArray[np.int64], avail_actions: NDArray[np.bool_], illegal: Illegal
) -> tuple[NDArray[np.int64], NDArray[np.bool_]]:
    """The actions, with the lowest available one in place of each that is not available, and where that was."""
    if illegal == "error":
        return np.ascontiguousarray(actions), np.zeros(actions.shape, np.bool_)
    count = avail_actions.shape[-1]
    inside = (actions >= 0) & (actions < count)
    taken = np.take_along_axis(avail_actions, np.where(inside, actions, 0)[..., None], axis=-1)[..., 0]
    replaced = ~(inside & taken)
    return np.where(replaced, avail_actions.argmax(axis=-1), actions).astype(np.int64), replaced


class TeamEnv(gymnasium.Env[Any, Any]):
    """One battle: observations and actions are tuples with an entry for each agent, the reward is one number.

    ``info`` holds ``avail_actions`` [N, A] (int8), ``state`` [G], the world's statistics and ``illegal``: how many actions of the step were
    not available and were replaced by the lowest available one (``illegal="error"`` refuses them instead).
    """

    metadata = {"render_modes": []}

    def __init__(
        self,
        map_name: str | os.PathLike[str] = "3m",
        *,
        illegal: Illegal = "replace",
        render_mode: None = None,
        **settings: Any,
    ) -> None:
        self._env = vector.VectorEnv(map_name, autoreset="disabled", **settings)
        self._illegal: Illegal = illegal
        self.render_mode = render_mode
        spec = self._env.spec
        self.n_agents = spec.n_agents
        one = spaces.Box(-np.inf, np.inf, (spec.obs_size,), np.float32)
        self.observation_space = spaces.Tuple([one] * spec.n_agents)
        self.action_space = spaces.Tuple([spaces.Discrete(spec.n_actions)] * spec.n_agents)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[tuple[NDArray[np.float32], ...], dict[str, Any]]:
        """Begins episode 0 of ``seed``, or the next one."""
        super().reset(seed=seed)
        shown = self._env.reset(seed=seed)
        return self._observed(shown), self._info(shown, np.zeros(len(self._env.spec.statistics)), 0)

    def step(self, action: Any) -> tuple[tuple[NDArray[np.float32], ...], float, bool, bool, dict[str, Any]]:
        """Plays one action for each agent."""
        chosen = np.array([int(one) for one in action], np.int64)[None]
        chosen, replaced = _legal(chosen, self._env.buffers.avail_actions, self._illegal)
        step = self._env.step(chosen)
        info = self._info(step, step.statistics[0], int(replaced.sum()))
        return self._observed(step), float(step.rewards[0]), bool(step.terminated[0]), bool(step.truncated[0]), info

    def close(self) -> None:
        """Gives the world's memory back."""
        self._env.close()

    def _observed(self, shown: arrays.Buffers) -> tuple[NDArray[np.float32], ...]:
        return tuple(shown.observations[0].copy())

    def _info(self, shown: arrays.Buffers, statistics: NDArray[np.float64], illegal: int) -> dict[str, Any]:
        return {
            "avail_actions": shown.avail_actions[0].astype(np.int8),
            "state": shown.state[0].copy(),
            **dict(zip(self._env.spec.statistics, map(float, statistics), strict=True)),
            "illegal": illegal,
        }


_MODES: dict[AutoresetMode, vector.Autoreset] = {
    AutoresetMode.SAME_STEP: "same-step",
    AutoresetMode.NEXT_STEP: "next-step",
    AutoresetMode.DISABLED: "disabled",
}


class TeamVectorEnv(gymnasium.vector.VectorEnv[Any, Any, Any]):
    """``mackrl.VectorEnv`` as Gymnasium's vector environment: observations [B, N, O], actions [B, N], rewards [B].

    ``infos`` hold ``avail_actions`` [B, N, A], ``state`` [B, G] and the world's statistics [B]; with ``AutoresetMode.SAME_STEP`` also
    ``final_obs`` [B, N, O] and ``final_info``, where ``_final_obs`` [B] is true. Arrays are the worlds' own and are written again by
    the next step, unless ``copy``.
    """

    def __init__(
        self,
        map_name: str | os.PathLike[str] = "3m",
        num_envs: int = 1,
        *,
        autoreset_mode: AutoresetMode | str = AutoresetMode.NEXT_STEP,
        illegal: Illegal = "replace",
        threads: int = 1,
        copy: bool = True,
        render_mode: None = None,
        **settings: Any,
    ) -> None:
        mode = AutoresetMode(autoreset_mode)
        self._env = vector.VectorEnv(map_name, num_envs, autoreset=_MODES[mode], threads=threads, **settings)
        self._illegal: Illegal = illegal
        self._copies = copy
        self.metadata = {"render_modes": [], "autoreset_mode": mode}
        self.render_mode = render_mode
        self.num_envs = num_envs
        spec = self._env.spec
        shape = (spec.n_agents, spec.obs_size)
        self.single_observation_space = spaces.Box(-np.inf, np.inf, shape, np.float32)
        self.single_action_space = spaces.MultiDiscrete([spec.n_actions] * spec.n_agents)
        self.observation_space = gymnasium.vector.utils.batch_space(self.single_observation_space, num_envs)
        self.action_space = gymnasium.vector.utils.batch_space(self.single_action_space, num_envs)

    def reset(
        self, *, seed: int | list[int | None] | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[np.float32], dict[str, Any]]:
        """Begins an episode in every world, or where ``options["reset_mask"]`` [B] is true."""
        if isinstance(seed, list):
            seed = [0 if one is None else one for one in seed]
        mask = (options or {}).get("reset_mask")
        shown = self._env.reset(seed=seed, mask=mask)  # type: ignore[arg-type]
        return self._kept(shown.observations), self._infos(shown)

    def step(
        self, actions: Any
    ) -> tuple[NDArray[np.float32], NDArray[np.float32], NDArray[np.bool_], NDArray[np.bool_], dict[str, Any]]:
        """Plays actions [B, N]."""
        chosen, replaced = _legal(np.asarray(actions, np.int64), self._env.buffers.avail_actions, self._illegal)
        step = self._env.step(chosen)
        infos = self._infos(step)
        for name in self._env.spec.statistics:
            infos[name] = step.statistic(name).copy()
            infos[f"_{name}"] = np.ones(self.num_envs, np.bool_)
        infos["illegal"] = replaced.sum(axis=1)
        if step.final is not None and step.ended.any():
            ended = step.ended
            infos["final_obs"], infos["_final_obs"] = self._kept(step.final.observations), ended
            last = {**self._infos(step.final), **{name: infos[name] for name in self._env.spec.statistics}}
            infos["final_info"], infos["_final_info"] = last, ended
        ends = self._kept(step.terminated), self._kept(step.truncated)
        return self._kept(step.observations), self._kept(step.rewards), *ends, infos

    def close_extras(self, **kwargs: Any) -> None:
        """Gives the worlds' memory back."""
        self._env.close()

    def _kept(self, array: NDArray[Any]) -> NDArray[Any]:
        return array.copy() if self._copies else array

    def _infos(self, shown: arrays.Buffers) -> dict[str, Any]:
        every = np.ones(self.num_envs, np.bool_)
        infos = {"avail_actions": self._kept(shown.avail_actions), "state": self._kept(shown.state)}
        return {**infos, **{f"_{name}": every for name in infos}}


def register() -> None:
    """Registers every map as ``mackrl/<map>-v0``; done when this module is imported, and again without harm."""
    for name in _native.maps():
        env_id = f"mackrl/{name}-v0"
        if env_id not in gymnasium.registry:
            gymnasium.register(
                env_id,
                entry_point="mackrl.gymnasium:TeamEnv",
                vector_entry_point="mackrl.gymnasium:TeamVectorEnv",
                kwargs={"map_name": name},
            )


register()
