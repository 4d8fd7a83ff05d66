"""A trained team in NumPy alone: all that a step of it needs, from ``weights.safetensors`` and what the world shows.

    python numpy_team.py RUN

plays an episode with the team of the run folder, computes the tables of all levels here, and says how far they are from those of the
library (less than a millionth). Which partition is in force follows from the shared seed, and is asked of the library.
"""

from __future__ import annotations

import json
import sys
from typing import Any

import numpy as np

import mackrl
from mackrl.policy import load, read_weights


def sigmoid(x: np.ndarray) -> np.ndarray:
    return 1 / (1 + np.exp(-x))


def normalised(rows: np.ndarray) -> np.ndarray:
    """Rows of mean 0 and variance 1."""
    centred = rows - rows.mean(axis=1, keepdims=True)
    return centred / np.sqrt((centred**2).mean(axis=1, keepdims=True) + 1e-5)


class Controllers:
    """The controllers of one level: Linear and ReLU, a gated recurrent unit, Linear, softmax over what is available."""

    def __init__(self, described: dict[str, Any], weights: dict[str, np.ndarray]) -> None:
        thin = [name for name, _ in described["inputs"] if name.startswith("thin_")]
        if thin:
            raise ValueError(f"the {described['name']} reads {thin[0]}, which this example does not compute")
        self.__dict__.update(described)
        self.weights = {
            name.removeprefix(f"{self.name}."): tensor.astype(np.float64)
            for name, tensor in weights.items()
            if name.startswith(f"{self.name}.")
        }
        self.remembered = np.zeros((len(self.groups), self.hidden))

    def forget(self, formed: list[list[int]]) -> None:
        """What is remembered of groups that are not formed, after a step, where that is all that counts."""
        if self.memory == "while-formed":
            self.remembered[[group not in formed for group in self.groups]] = 0

    def step(self, inputs: np.ndarray, masks: np.ndarray, exploration: float) -> np.ndarray:
        """Probabilities [G, C] from inputs [G, I]; 0 where a mask [G, C] is false."""
        w = self.weights
        scaled = normalised if self.normalised else lambda rows: rows
        x = scaled(np.maximum(scaled(inputs) @ w["input.weight"].T + w["input.bias"], 0))
        i_r, i_z, i_n = np.split(x @ w["gru.weight_ih"].T + w["gru.bias_ih"], 3, axis=1)
        h_r, h_z, h_n = np.split(self.remembered @ w["gru.weight_hh"].T + w["gru.bias_hh"], 3, axis=1)
        update = sigmoid(i_z + h_z)
        new = np.tanh(i_n + sigmoid(i_r + h_r) * h_n)
        self.remembered = (1 - update) * new + update * self.remembered
        logits = scaled(self.remembered) @ w["output.weight"].T + w["output.bias"]
        logits = np.where(masks, logits, -np.inf)
        softmax = np.exp(logits - logits.max(axis=1, keepdims=True))
        softmax /= softmax.sum(axis=1, keepdims=True)
        epsilon = exploration if self.explores else 0
        return (1 - epsilon) * softmax + epsilon * masks / masks.sum(axis=1, keepdims=True)


class NumpyTeam:
    """A team that is described by its file of weights; ``env`` answers what is known before the game."""

    def __init__(self, file: bytes, env: mackrl.VectorEnv) -> None:
        weights, metadata = read_weights(file)
        if metadata.get("format") != "mackrl/3":
            raise ValueError(f"the file of weights has the format {metadata.get('format')}, expected mackrl/3")
        self.spec, self.env = json.loads(metadata["spec"]), env
        self.levels = [Controllers(level, weights) for level in json.loads(metadata["controllers"])]
        self.last_actions = np.zeros((self.spec["agents"], self.spec["actions"]))

    def tables(
        self, shown: mackrl.Buffers, partitions: list[list[list[int]]], exploration: float = 0.0
    ) -> dict[str, np.ndarray]:
        """The probabilities of every learned level at the next step of world 0, where ``partitions`` are in force. Of levels that
        remember while a group is formed, the rows of other groups mean nothing."""
        tables, formed = {}, [group for partition in partitions for group in partition]
        for level in self.levels:
            rows = [self.row(level, members, shown) for members in level.groups]
            inputs, masks = (np.array(part) for part in zip(*rows, strict=True))
            tables[level.name] = level.step(inputs, masks, exploration)
            level.forget(formed)
        return tables

    def row(self, level: Controllers, members: list[int], shown: mackrl.Buffers) -> tuple[np.ndarray, np.ndarray]:
        """What a group reads, and which of its choices are available."""
        spec = self.spec
        visible, entities = shown.visible[0], shown.entities[0]
        # Lemma 1: what all see, if they all see each other.
        common = visible[members].all(axis=0) & visible[np.ix_(members, members)].all()
        if level.inputs[0][0] == "observation":
            available = shown.avail_actions[0, members]
        else:
            available = np.array([self.env.available(entities, common, member) for member in members])
        read = {"observation": shown.observations[0, members[0]], "last_action": self.last_actions[members[0]]}
        read["members"] = np.eye(spec["agents"])[members].ravel()
        read["available_actions"] = available.ravel()
        axes = spec["position_features"]
        read["attributes"] = np.where(common[:, None], entities[:, axes:], 0).ravel()
        delta = (entities[None, :, :axes] - entities[members, None, :axes]) / np.float32(spec["distance_scale"])
        distance = np.sqrt((delta**2).sum(axis=2, keepdims=True))
        ones = np.ones((len(members), spec["entities"], 1))
        places = np.concatenate([ones, distance, delta] if axes else [ones], axis=2)
        knows = common[members][:, None, None] & common[None, :, None]
        read["places"] = np.where(knows, places, 0).ravel()
        inputs = np.concatenate([read[name] for name, _ in level.inputs])
        assert len(inputs) == sum(size for _, size in level.inputs)
        joint = available[0] if len(members) == 1 else np.outer(*available).ravel() if level.joint_actions else np.zeros(0)
        divide = np.ones(level.divisions)
        if level.acts == "never":
            divide *= not joint.any()
        elif level.acts == "always":
            joint = np.zeros_like(joint)
        return inputs, np.concatenate([divide, joint]).astype(bool)

    def acted(self, actions: np.ndarray) -> None:
        """Notes what everybody did."""
        self.last_actions = np.eye(self.spec["actions"])[actions]


def largest_difference(run: str, seed: int = 1) -> float:
    """Plays a greedy episode with the library, and computes every table again."""
    team = load(run)
    env = mackrl.VectorEnv(team.config["env"]["map"], autoreset="disabled", **settings(team.config["env"]))
    shown = env.reset(seed=seed, stream="evaluation")
    player = team.play(seed=seed, stream="evaluation")
    own = NumpyTeam((mackrl.Run(run).folder / "weights.safetensors").read_bytes(), env)
    worst, over = 0.0, False
    while not over:
        actions = player.act(shown)
        tables = player.tables()
        for name, mine in own.tables(shown, tables.partitions).items():
            theirs = tables.levels[name]
            lives = [shown.visible[0, members].any(axis=1).all() for members in theirs.groups]
            # The choice of the dead is forced; no network decides it. Groups that nothing in force leads to have no numbers.
            asked = ~np.isnan(theirs.probabilities).any(axis=1)
            rows = [row for row, alive in enumerate(lives) if asked[row] and (alive or len(theirs.groups) == 1)]
            worst = max(worst, float(np.abs(mine[rows] - theirs.probabilities[rows]).max(initial=0)))
        own.acted(actions[0])
        step = env.step(actions)
        shown, over = step, bool(step.ended[0])
    return worst


def settings(env: dict[str, Any]) -> dict[str, Any]:
    """The world's settings, without its name."""
    return {name: value for name, value in env.items() if name not in ("name", "map", "scenario")}


if __name__ == "__main__":
    difference = largest_difference(sys.argv[1])
    print(f"largest difference to the library's probabilities: {difference:.1e}")
    assert difference < 1e-6
