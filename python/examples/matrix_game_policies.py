"""Trains a team in the matrix game, and draws what it does: the tables of its pair and of its agents, by what they observe.

    python matrix_game_policies.py OUT.svg
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

import numpy as np

import mackrl

KNOWN = ["A, the light is on", "B, the light is on", "nothing", "A, alone", "B, alone"]
PAYOFFS = np.array(
    [
        [[5, 0, 0, 2, 0], [0, 1, 2, 4, 2], [0, 0, 0, 2, 0], [0, 0, 0, 1, 0], [0, 0, 0, 0, 0]],
        [[0, 0, 1, 0, 5], [0, 0, 2, 0, 0], [1, 2, 4, 2, 1], [0, 0, 2, 0, 0], [0, 0, 1, 0, 0]],
    ]
) / 5
"""Of the matrices A and B."""
MATRIX = [0, 1, None, 0, 1]
"""The matrix behind each observation."""
CELL, LEFT, GAP = 26, 20, 36
INK, QUIET, TEAL = "#222", "#777", (0, 121, 107)


def trained(folder: Path) -> mackrl.Run:
    """The team of docs/hierarchy.md."""
    return mackrl.train(
        "matrix-game",
        preset="paper",
        algorithm="mackrl",
        steps=20_000,
        out=folder,
        world={"common_knowledge": 0.7},
        settings={
            "algorithm.environments": 32,
            "algorithm.learning_rate": 0.002,
            "algorithm.critic_learning_rate": 0.005,
            "algorithm.exploration_start": 0.9,
            "test.episodes": 1000,
        },
        progress=False,
    )


def tables(run: mackrl.Run) -> list[tuple[np.ndarray, np.ndarray]]:
    """For each observation, shared by both agents: the pair's row [26] and the agents' rows [2, 5], without exploration."""
    env = mackrl.VectorEnv("matrix-game", num_envs=400, common_knowledge=0.7, autoreset="disabled")
    shown = env.reset(seed=1)
    play = run.team().play(400, seed=1)
    play.act(shown)
    observed = shown.observations.argmax(axis=2)
    found = []
    for observation in range(len(KNOWN)):
        world = int(np.flatnonzero((observed == observation).all(axis=1))[0])
        levels = play.tables(world).levels
        found.append((levels["pair_controller"].of(0, 1), levels["agent_controller"].probabilities))
    return found


def colour(probability: float) -> str:
    """White for 0, teal for 1."""
    return "#" + "".join(f"{round(255 + (full - 255) * float(probability)):02x}" for full in TEAL)


def text(x: float, y: float, words: str, size: int = 12, ink: str = INK, anchor: str = "start") -> str:
    return f'<text x="{x:g}" y="{y:g}" font-size="{size}" fill="{ink}" text-anchor="{anchor}">{words}</text>'


def cell(x: float, y: float, probability: float, payoff: float = 0.0) -> str:
    edge = 'stroke="#d35400" stroke-width="2.5"' if payoff == 1 else 'stroke="#ccc"'
    drawn = f'<rect x="{x:g}" y="{y:g}" width="{CELL}" height="{CELL}" fill="{colour(probability)}" {edge}/>'
    if probability >= 0.005:
        ink = "#fff" if probability > 0.5 else INK
        drawn += text(x + CELL / 2, y + CELL / 2 + 4, f"{probability:.2f}", 10, ink, "middle")
    elif payoff:
        drawn += text(x + CELL / 2, y + CELL / 2 + 4, f"{payoff:.1f}", 10, "#aaa", "middle")
    return drawn


def picture(run: mackrl.Run) -> str:
    """An SVG picture: a column for each observation, the pair above, the agents below."""
    width = LEFT + len(KNOWN) * (5 * CELL + GAP)
    parts = [text(LEFT, 24, "What the team does, by what both agents observe", 15)]
    for column, (known, (pair, agents)) in enumerate(zip(KNOWN, tables(run), strict=True)):
        x = LEFT + column * (5 * CELL + GAP)
        parts.append(text(x, 56, known, 13))
        parts.append(text(x, 80, "the pair's joint actions", 11, QUIET))
        for first in range(5):
            for second in range(5):
                payoff = 0.0 if MATRIX[column] is None else PAYOFFS[MATRIX[column], first, second]
                parts.append(cell(x + second * CELL, 88 + first * CELL, pair[1 + 5 * first + second], payoff))
        parts.append(cell(x, 230, pair[0]) + text(x + CELL + 6, 247, "delegate"))
        for agent in range(2):
            y = 290 + agent * 52
            ink = INK if pair[0] > 0.5 else QUIET
            parts.append(text(x, y, f"agent {agent + 1} alone" + ("" if pair[0] > 0.5 else ", not asked"), 11, ink))
            parts.extend(cell(x + action * CELL, y + 8, agents[agent, action]) for action in range(5))
    parts.append(text(LEFT, 408, "Joint actions: agent 1 down, agent 2 across. White numbers are probabilities; grey ones are payoffs, with the best in orange.", 11, QUIET))
    body = "\n".join(parts)
    return (
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} 424" font-family="Roboto, Helvetica, Arial, sans-serif">\n'
        f'<rect width="{width}" height="424" fill="#fff"/>\n{body}\n</svg>\n'
    )


if __name__ == "__main__":
    with tempfile.TemporaryDirectory() as folder:
        Path(sys.argv[1]).write_text(picture(trained(Path(folder) / "run")))
