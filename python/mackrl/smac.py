"""SMAC's class on this simulator, so that programs written for SMAC run unchanged.

``python -m mackrl.smac script.py arguments…`` runs a script as Python would, with ``smac.env`` being this module. In a program of
one's own, ``install()`` does the same, or ``from mackrl.smac import StarCraft2Env``.
"""

from __future__ import annotations

import importlib.util
import os
import runpy
import sys
import types
from abc import ABC
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from . import _native
from ._settings import environment
from .vector import VectorEnv

__all__ = ["MultiAgentEnv", "StarCraft2Env", "install"]


class MultiAgentEnv(ABC):
    """What SMAC calls its interface; the name that programs import beside ``StarCraft2Env``."""


class StarCraft2Env(MultiAgentEnv):
    """A battle on one of SMAC's maps, or in a scenario file.

    Arguments are SMAC's, with its names and defaults. Those of the game's own client (``difficulty``, ``game_version``, ``window_size_*``,
    ``replay_*``, ``heuristic_*``, ``debug``) mean nothing here and are accepted at SMAC's default alone. ``sight_range``, ``shoot_range``
    and other settings of the simulator, which SMAC has not, can be given by name.

    Raises:
        ValueError: if there is no such map, or an argument has a value that means nothing here.
        TypeError: if there is no such argument.
    """

    def __init__(
        self,
        map_name: str = "8m",
        step_mul: int = 8,
        move_amount: float = 2,
        difficulty: str = "7",
        game_version: str | None = None,
        seed: int | None = None,
        continuing_episode: bool = False,
        obs_all_health: bool = True,
        obs_own_health: bool = True,
        obs_last_action: bool = False,
        obs_pathing_grid: bool = False,
        obs_terrain_height: bool = False,
        obs_instead_of_state: bool = False,
        obs_timestep_number: bool = False,
        state_last_action: bool = True,
        state_timestep_number: bool = False,
        reward_sparse: bool = False,
        reward_only_positive: bool = True,
        reward_death_value: float = 10,
        reward_win: float = 200,
        reward_defeat: float = 0,
        reward_negative_scale: float = 0.5,
        reward_scale: bool = True,
        reward_scale_rate: float = 20,
        replay_dir: str = "",
        replay_prefix: str = "",
        window_size_x: int = 1920,
        window_size_y: int = 1200,
        heuristic_ai: bool = False,
        heuristic_rest: bool = False,
        debug: bool = False,
        **simulator: Any,
    ) -> None:
        of_the_client = {
            "difficulty": (difficulty, "7", "enemies have no difficulty: they follow the map's order"),
            "game_version": (game_version, None, "no game is started"),
            "replay_dir": (replay_dir, "", "no game is started: mackrl.Run.replay() keeps battles"),
            "replay_prefix": (replay_prefix, "", "no game is started: mackrl.Run.replay() keeps battles"),
            "window_size_x": (window_size_x, 1920, "there is no window"),
            "window_size_y": (window_size_y, 1200, "there is no window"),
            "heuristic_ai": (heuristic_ai, False, "scripts are played by mackrl.play()"),
            "heuristic_rest": (heuristic_rest, False, "scripts are played by mackrl.play()"),
            "debug": (debug, False, "there is nothing to print"),
        }
        for name, (found, default, why) in of_the_client.items():
            if found != default:
                raise ValueError(f"{name} is {found!r}, expected {default!r}: {why}")
        settings: dict[str, Any] = {
            "step_mul": step_mul,
            "move_amount": move_amount,
            "obs_all_health": obs_all_health,
            "obs_own_health": obs_own_health,
            "obs_last_action": obs_last_action,
            "obs_pathing_grid": obs_pathing_grid,
            "obs_terrain_height": obs_terrain_height,
            "obs_instead_of_state": obs_instead_of_state,
            "obs_timestep_number": obs_timestep_number,
            "state_last_action": state_last_action,
            "state_timestep_number": state_timestep_number,
            "reward_sparse": reward_sparse,
            "reward_only_positive": reward_only_positive,
            "reward_death_value": reward_death_value,
            "reward_win": reward_win,
            "reward_defeat": reward_defeat,
            "reward_negative_scale": reward_negative_scale,
            "reward_scale": reward_scale,
            "reward_scale_rate": reward_scale_rate,
            **simulator,
        }
        self._env = VectorEnv(map_name, autoreset="disabled", **settings)
        spec = self._env.spec
        self.map_name = map_name
        self.n_agents = spec.n_agents
        self.n_enemies = spec.n_entities - spec.n_agents
        self.n_actions = spec.n_actions
        self.episode_limit = spec.episode_limit
        self.continuing_episode = continuing_episode
        shields, enemy_shields, type_bits, self.max_reward = _native.skirmish_layout(environment(map_name, settings))
        types_of = [f"type_{bit}" for bit in range(type_bits)]
        self.ally_state_attr_names = ["health", "energy/cooldown", "rel_x", "rel_y", *["shield"] * shields, *types_of]
        self.enemy_state_attr_names = ["health", "rel_x", "rel_y", *["shield"] * enemy_shields, *types_of]
        self._seed = int.from_bytes(os.urandom(7), "little") if seed is None else int(seed)
        self._is_begun = False
        self._episode_steps = 0
        self.battles_won = self.battles_game = self.timeouts = self.force_restarts = 0

    def reset(self) -> tuple[list[NDArray[np.float32]], NDArray[np.float32]]:
        """Begins the next episode; gives observations and state."""
        if self._is_begun:
            self._env.reset()
        else:
            self._env.reset(seed=self._seed)
            self._is_begun = True
        self._episode_steps = 0
        return self.get_obs(), self.get_state()

    def step(self, actions: Sequence[int] | NDArray[np.integer[Any]] | Any) -> tuple[float, bool, dict[str, Any]]:
        """Plays one action for each agent; gives reward, whether the episode is over, and what happened.

        Raises:
            IllegalAction: if an action is not available to its agent; nothing has moved then.
        """
        chosen = np.array([int(action) for action in actions], np.int64)[None]
        step = self._env.step(chosen)
        self._episode_steps += 1
        terminated, truncated = bool(step.terminated[0]), bool(step.truncated[0])
        info: dict[str, Any] = {
            "battle_won": bool(step.battle_won[0]),
            "dead_allies": int(step.dead_allies[0]),
            "dead_enemies": int(step.dead_enemies[0]),
        }
        if truncated and self.continuing_episode:
            info["episode_limit"] = True
        self.battles_game += terminated or truncated
        self.battles_won += terminated and info["battle_won"]
        self.timeouts += truncated
        return float(step.rewards[0]), terminated or truncated, info

    def get_obs(self) -> list[NDArray[np.float32]]:
        """What all agents observe; copies."""
        return list(self._env.buffers.observations[0].copy())

    def get_obs_agent(self, agent_id: int) -> NDArray[np.float32]:
        """What one agent observes; a copy."""
        observation: NDArray[np.float32] = self._env.buffers.observations[0, agent_id].copy()
        return observation

    def get_obs_size(self) -> int:
        """Numbers of an observation."""
        return self._env.spec.obs_size

    def get_state(self) -> NDArray[np.float32]:
        """The state; a copy."""
        state: NDArray[np.float32] = self._env.buffers.state[0].copy()
        return state

    def get_state_size(self) -> int:
        """Numbers of the state."""
        return self._env.spec.state_size

    def get_avail_actions(self) -> list[list[int]]:
        """For every agent, 1 for each action that is available and 0 for others."""
        rows: list[list[int]] = self._env.buffers.avail_actions[0].astype(int).tolist()
        return rows

    def get_avail_agent_actions(self, agent_id: int) -> list[int]:
        """The same of one agent."""
        row: list[int] = self._env.buffers.avail_actions[0, agent_id].astype(int).tolist()
        return row

    def get_total_actions(self) -> int:
        """How many actions an agent has."""
        return self.n_actions

    def get_env_info(self) -> dict[str, Any]:
        """Sizes, as SMAC names them."""
        return {
            "state_shape": self.get_state_size(),
            "obs_shape": self.get_obs_size(),
            "n_actions": self.n_actions,
            "n_agents": self.n_agents,
            "episode_limit": self.episode_limit,
            "agent_features": self.ally_state_attr_names,
            "enemy_features": self.enemy_state_attr_names,
        }

    def get_stats(self) -> dict[str, float]:
        """Battles so far, as SMAC counts them."""
        return {
            "battles_won": self.battles_won,
            "battles_game": self.battles_game,
            "battles_draw": self.timeouts,
            "win_rate": self.battles_won / self.battles_game if self.battles_game else 0.0,
            "timeouts": self.timeouts,
            "restarts": self.force_restarts,
        }

    def get_visibility_matrix(self) -> NDArray[np.bool_]:
        """Who sees whom [N, N + enemies]; as in SMAC, an agent does not see itself."""
        visible: NDArray[np.bool_] = self._env.buffers.visible[0].copy()
        visible[np.arange(self.n_agents), np.arange(self.n_agents)] = False
        return visible

    def seed(self, seed: int | None = None) -> int:
        """The seed; SMAC's takes no argument. With one, the next episode is the first of that seed."""
        if seed is not None:
            self._seed, self._is_begun = int(seed), False
        return self._seed

    def render(self, mode: str = "human") -> None:
        """Nothing, as in SMAC without a screen; ``mackrl.Run.replay()`` shows battles."""

    def save_replay(self) -> None:
        """Refused: no game is running.

        Raises:
            NotImplementedError: always.
        """
        raise NotImplementedError("no game is running: mackrl.play() and mackrl.Run.replay() keep battles")

    def full_restart(self) -> None:
        """The same as a new episode: nothing can hang."""
        self.force_restarts += 1

    def close(self) -> None:
        """Gives the world's memory back."""
        self._env.close()


def install(*, replace: bool = False) -> bool:
    """Makes ``import smac`` and ``from smac.env import StarCraft2Env`` give this module, in this process.

    A SMAC that is installed is left alone unless ``replace``; says whether it was done.
    """
    if not replace and "smac" not in sys.modules and importlib.util.find_spec("smac") is not None:
        return False
    package, env = types.ModuleType("smac"), types.ModuleType("smac.env")
    package.__path__ = []
    for module in (package, env):
        module.__dict__.update(StarCraft2Env=StarCraft2Env, MultiAgentEnv=MultiAgentEnv)
    multi_agent = types.ModuleType("smac.env.multiagentenv")
    multi_agent.__dict__.update(MultiAgentEnv=MultiAgentEnv)
    env.__path__ = []
    package.__dict__["env"] = env
    sys.modules.update({"smac": package, "smac.env": env, "smac.env.multiagentenv": multi_agent})
    return True


def _main(arguments: list[str]) -> None:
    """Runs a script, or with ``-m`` a module, with SMAC in place."""
    if not arguments or arguments == ["-m"]:
        sys.exit("usage: python -m mackrl.smac SCRIPT [ARGUMENTS…], or python -m mackrl.smac -m MODULE [ARGUMENTS…]")
    # `python -m` made a second module of this file; the classes that others import are the first one's.
    from mackrl.smac import install as install_once

    install_once(replace=True)
    if arguments[0] == "-m":
        sys.argv = arguments[1:]
        runpy.run_module(arguments[1], run_name="__main__", alter_sys=True)
    else:
        from pathlib import Path

        sys.argv = arguments
        sys.path.insert(0, str(Path(arguments[0]).resolve().parent))
        runpy.run_path(arguments[0], run_name="__main__")


if __name__ == "__main__":
    _main(sys.argv[1:])
