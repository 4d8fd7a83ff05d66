"""A world of one's own, in NumPy: a lamp, and two agents that do not always look at it.

    python own_world.py

checks the contract, trains a team, and says how often it earns what can be earned.
"""

from __future__ import annotations

import numpy as np

import mackrl

RED, BLUE, STAY = range(3)
LAMP = 2
STEPS = 4


class Lamp(mackrl.World):
    """Both press the lamp's colour: 1. Both stay: `safe`. Anything else: 0.

    Who looks at the lamp is drawn anew at every step, and each sees whether the other does. If both look, the colour is
    common knowledge, and a pair can act on it jointly.
    """

    name = "lamp"
    n_agents, n_entities, n_actions = 2, 3, 3
    entity_features = 2  # looks, colour: -1 or 1; an agent has no colour, the lamp does not look
    obs_size, state_size = 2, 3
    episode_limit = STEPS
    statistics = {"pressed": "share of the steps in which both pressed the lamp's colour"}
    success = "pressed"

    def __init__(self, safe: float = 0.4, looks: float = 0.8) -> None:
        self.safe, self.looks = safe, looks

    def reset(self, rng: np.random.Generator, out: mackrl.Buffers) -> None:
        self.rng, self.steps, self.pressed = rng, 0, 0
        self.draw(out)

    def step(self, actions: np.ndarray, out: mackrl.Buffers) -> tuple[float, bool, bool]:
        reward = 0.0
        if actions[0] == actions[1]:
            reward = self.safe if actions[0] == STAY else float(actions[0] == self.colour)
            self.pressed += actions[0] == self.colour
        self.steps += 1
        self.draw(out)
        return reward, False, self.steps == STEPS

    def draw(self, out: mackrl.Buffers) -> None:
        self.colour = int(self.rng.integers(2))
        looks = self.rng.random(2) < self.looks
        sign = 2 * self.colour - 1
        out.entities[:2, 0], out.entities[:2, 1] = looks, 0
        out.entities[LAMP] = 0, sign
        out.visible[:, :2], out.visible[:, LAMP] = True, looks
        out.observations[:] = np.stack([looks, looks * sign], axis=1)
        out.state[:] = sign, *looks
        out.avail_actions[:] = True

    def sees(self, observer: int, observer_features: np.ndarray, entity: int, entity_features: np.ndarray) -> bool:
        return entity != LAMP or observer_features[0] == 1

    def available(self, known: mackrl.worlds.Known, agent: int) -> np.ndarray:
        return np.ones(3, bool)

    def report(self) -> dict[str, float]:
        return {"pressed": self.pressed / STEPS}


if __name__ == "__main__":
    mackrl.check_world(Lamp)
    run = mackrl.train(Lamp, steps=20_000, out="runs/lamp")
    print(f"both press the lamp's colour in {run.evaluate(200)['test_pressed_mean']:.0%} of the steps")
