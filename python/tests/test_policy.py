"""Trained teams: one agent alone does what the team does, and NumPy computes the same probabilities."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
import pytest

import mackrl
from mackrl.policy import load

sys.path.insert(0, str(Path(__file__).parents[1] / "examples"))
import numpy_team  # noqa: E402


# Of the paper's learner and of the default one.
TEAMS = [("runs", "3m"), ("runs", "2s3z"), ("default_runs", "3m"), ("default_runs", "2s3z"), ("default_runs", "held")]


@pytest.mark.parametrize("exploration", [None, 0.3])
@pytest.mark.parametrize(("trained", "name"), TEAMS)
def test_agents_alone_act_as_the_team_bit_for_bit(
    request: pytest.FixtureRequest, trained: str, name: str, exploration: float | None
) -> None:
    team = load(request.getfixturevalue(trained)[name])
    env = mackrl.VectorEnv(team.spec.name, 1, autoreset="disabled", **numpy_team.settings(team.config["env"]))
    for episode in range(10):
        shown = env.reset(seed=3, episode=episode)
        central = team.play(seed=3, episode=episode, exploration=exploration)
        agents = [
            team.agent(index, seed=3, episode=episode, exploration=exploration) for index in range(team.spec.n_agents)
        ]
        over, steps = False, 0
        while not over:
            actions = central.act(shown)
            entities = shown.entities[0]
            alone = []
            for index, agent in enumerate(agents):
                visible = shown.visible[0, index]
                # Features of what is not seen must not matter.
                own = np.where(visible[:, None], entities, np.float32(np.nan))
                view = (shown.observations[0, index], shown.avail_actions[0, index], visible, own)
                alone.append(agent.act(*view))
            assert alone == actions[0].tolist()
            step = env.step(actions)
            shown, over = step, bool(step.ended[0])


def test_many_worlds_are_played_as_each_alone(runs: dict[str, mackrl.Run]) -> None:
    team = load(runs["3m"])
    settings = numpy_team.settings(team.config["env"])
    env = mackrl.VectorEnv("3m", 7, autoreset="disabled", **settings)
    shown, central = env.reset(seed=4), team.play(7, seed=4)
    totals, playing = np.zeros(7, np.float32), np.ones(7, np.bool_)
    while playing.any():
        step = env.step(central.act(shown, playing))
        totals += np.where(playing, step.rewards, 0)
        playing = ~step.ended
        shown = step
    for world in range(7):
        alone = mackrl.VectorEnv("3m", 1, autoreset="disabled", **settings)
        shown, one = alone.reset(seed=4, episode=world), team.play(seed=4, episode=world)
        total, over = np.float32(0), False
        while not over:
            step = alone.step(one.act(shown))
            total, over, shown = total + step.rewards[0], bool(step.ended[0]), step
        assert total == totals[world]


def test_a_played_episode_is_that_of_evaluate_and_replay(runs: dict[str, mackrl.Run]) -> None:
    run = runs["2s3z"]
    team, replay = run.team(), run.replay(5, seed=8)
    env = mackrl.VectorEnv("2s3z", 1, autoreset="disabled", **numpy_team.settings(team.config["env"]))
    shown = env.reset(seed=8, episode=5, stream="evaluation")
    central = team.play(seed=8, episode=5, stream="evaluation")
    for recorded, thought in zip(replay.actions, replay.thoughts, strict=True):
        assert np.array_equal(central.act(shown)[0], recorded)
        assert thought is not None
        tables = central.tables()
        for pair in thought.get("pairs", ()):
            assert np.isclose(tables.levels["pair_controller"].of(*pair["members"])[0], pair["delegate"], atol=1e-7)
        for partition, probability in zip(thought["partitions"], tables.levels["pair_selector"].probabilities[0], strict=True):
            assert np.isclose(partition["probability"], probability, atol=1e-7)
        shown = env.step(recorded[None])


def test_the_best_team_and_those_kept_on_the_way_are_loaded_by_name(tmp_path: Path) -> None:
    settings = {"test.episodes": 2, "test.interval_steps_env": 300, "run.weights_interval_steps_env": 400}
    run = mackrl.train("3m", steps=900, out=tmp_path / "run", settings=settings, progress=False)
    assert run.teams is not None
    for checkpoint in ("last", "best"):
        score = run.teams[checkpoint]
        team = run.team(checkpoint)
        assert team.metadata["trained_steps_env"] == str(score["steps_env"])
        played = run.evaluate(score["episodes"], checkpoint=checkpoint)
        assert played[f"test_{run.teams['measure']}_mean"] == score["mean"]
    kept = mackrl.policy.load(run, 400)
    assert 400 <= int(kept.metadata["trained_steps_env"]) < 800
    assert run.replay(checkpoint=400).summary["ep_length"] > 0
    with pytest.raises(ValueError, match="keeps no weights `500`, the nearest are 400; there are: last, best, 400, 800"):
        run.team(500)
    with pytest.raises(ValueError, match="checkpoint is `bets`, expected last, best or a number of steps"):
        run.team("bets")  # type: ignore[arg-type]


@pytest.mark.parametrize(("trained", "name"), TEAMS)
def test_numpy_computes_the_same_probabilities(request: pytest.FixtureRequest, trained: str, name: str) -> None:
    run = request.getfixturevalue(trained)[name]
    assert numpy_team.largest_difference(str(run.folder)) < 1e-6


def test_a_pair_of_the_default_team_has_a_row_while_it_is_formed(default_runs: dict[str, mackrl.Run]) -> None:
    team = load(default_runs["held"])
    env = mackrl.VectorEnv("3m", autoreset="disabled", **numpy_team.settings(team.config["env"]))
    shown, central = env.reset(seed=1), team.play(seed=1)
    formed = []
    for _ in range(6):
        shown = env.step(central.act(shown))
        tables = central.tables()
        (partition,) = tables.partitions
        pairs = tables.levels["pair_controller"]
        known = [not np.isnan(row).any() for row in pairs.probabilities]
        assert known == [pair in partition for pair in pairs.groups] and sum(known) == 1
        formed.append(partition)
    assert formed[0] == formed[1] == formed[2] != formed[3] == formed[4] == formed[5]


def test_numpy_refuses_what_it_does_not_compute(runs: dict[str, mackrl.Run]) -> None:
    file = (runs["3m"].folder / "weights.safetensors").read_bytes()
    with pytest.raises(ValueError, match="has the format mackrl/2, expected mackrl/3"):
        numpy_team.NumpyTeam(file.replace(b"mackrl/3", b"mackrl/2"), mackrl.VectorEnv("3m"))
    with pytest.raises(ValueError, match="pair_selector reads thin_enemies, which this example does not compute"):
        numpy_team.Controllers({"name": "pair_selector", "inputs": [["thin_enemies", 18]]}, {})


def test_tables_are_distributions(runs: dict[str, mackrl.Run]) -> None:
    team = load(runs["2s3z"])
    env = mackrl.VectorEnv("2s3z", 1, **numpy_team.settings(team.config["env"]))
    central = team.play(seed=1, exploration=0.2)
    with pytest.raises(ValueError, match="world 0 has no table"):
        central.tables()
    central.act(env.reset(seed=1))
    tables = central.tables()
    assert len(tables.partitions) == tables.levels["pair_selector"].probabilities.shape[1]
    for level in tables.levels.values():
        assert np.allclose(level.probabilities.sum(axis=1), 1, atol=1e-5)
    with pytest.raises(ValueError, match="exploration is 2, expected a number in"):
        team.play(seed=1, exploration=2)
    with pytest.raises(ValueError, match="agent is 5, expected an integer in"):
        team.agent(5, seed=1)
    with pytest.raises(TypeError, match="observation is float64 of shape"):
        team.agent(0, seed=1).act(*(np.zeros(3) for _ in range(4)))  # type: ignore[arg-type]


def test_a_file_of_weights_describes_itself(runs: dict[str, mackrl.Run]) -> None:
    team = load(runs["3m"])
    described = team.metadata
    assert described["format"] == "mackrl/3" and described["algorithm"] == "mackrl" and described["map"] == "3m"
    assert len(described["map_sha256"]) == len(described["config_sha256"]) == 64
    assert json.loads(described["spec"])["agents"] == 3
    assert float(described["trained_steps_env"]) >= 600 and 0 <= float(described["exploration"]) <= 1
    partitions = json.loads(described["partitions"])
    assert sorted(sorted(groups) for groups in partitions) == [[[0], [1, 2]], [[0, 1], [2]], [[0, 2], [1]]]
    central = team.play(seed=1)
    central.act(mackrl.VectorEnv("3m").reset(seed=1))
    assert central.tables().partitions == partitions
    for level in json.loads(described["controllers"]):
        assert level["memory"] == "episode" and level["normalised"] is False
        name, hidden = level["name"], level["hidden"]
        assert team.weights[f"{name}.input.weight"].shape == (hidden, sum(size for _, size in level["inputs"]))
        outputs = level["divisions"] + level["joint_actions"]
        assert team.weights[f"{name}.output.weight"].shape == (outputs, hidden)


def test_a_file_of_a_default_team_describes_itself(default_runs: dict[str, mackrl.Run]) -> None:
    controllers = json.loads(load(default_runs["2s3z"]).metadata["controllers"])
    described = [(level["name"], level["memory"], level["normalised"], level["acts"]) for level in controllers]
    assert described == [
        ("pair_controller", "while-formed", True, "learned"),
        ("agent_controller", "episode", True, "never"),
    ]
