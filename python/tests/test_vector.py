"""B worlds in arrays: what is written, what is refused, and what survives."""

from __future__ import annotations

import copy
import multiprocessing
import pickle
import signal
import subprocess
import sys
import threading
import time

import numpy as np
import pytest

import mackrl
from mackrl import Buffers, VectorEnv


def played(env: VectorEnv, steps: int) -> list[np.ndarray]:
    """Everything that random play shows in so many steps."""
    seen = []
    for _ in range(steps):
        step = env.step(env.random_actions())
        seen += [array.copy() for array in (*step, step.rewards, step.terminated, step.truncated, step.statistics)]
    return seen


def same(one: list[np.ndarray], other: list[np.ndarray]) -> bool:
    return len(one) == len(other) and all(np.array_equal(a, b) for a, b in zip(one, other, strict=True))


def test_shapes_and_types_are_those_of_the_spec() -> None:
    env = VectorEnv("2s3z", 3)
    spec, shown = env.spec, env.reset(seed=5)
    assert shown is env.buffers
    n, m = spec.n_agents, spec.n_entities
    assert [array.shape for array in shown] == [
        (3, n, spec.obs_size),
        (3, spec.state_size),
        (3, n, spec.n_actions),
        (3, n, m),
        (3, m, spec.entity_features),
    ]
    assert shown.avail_actions.any(axis=-1).all()
    assert shown.visible[:, np.arange(n), np.arange(n)].all()
    step = env.step(env.random_actions())
    assert step.rewards.shape == (3,) and step.battle_won.dtype == bool and step.dead_enemies.dtype == np.int32
    with pytest.raises(ValueError, match="no statistic is called 'won', 2s3z has battle_won, dead_allies"):
        step.statistic("won")


def test_an_episode_is_a_function_of_seed_and_number_for_any_number_of_worlds_and_threads() -> None:
    many, threaded = VectorEnv("3m", 6), VectorEnv("3m", 6, threads=4)
    many.reset(seed=3)
    threaded.reset(seed=3)
    assert same(played(many, 80), played(threaded, 80))
    one, third = VectorEnv("3m", 1), VectorEnv("3m", 5)
    one.reset(seed=9, episode=3)
    third.reset(seed=9)
    assert one.episodes() == [(9, 3, 0)] and third.episodes()[3] == (9, 3, 0)
    for _ in range(15):
        alone, beside = one.step(one.random_actions()), third.step(third.random_actions())
        assert np.array_equal(alone.observations[0], beside.observations[3])
        assert alone.rewards[0] == beside.rewards[3]
    each = VectorEnv("3m", 2)
    each.reset(seed=[4, 7])
    assert each.episodes() == [(4, 0, 0), (7, 0, 0)]
    each.reset()
    assert each.episodes() == [(4, 1, 0), (7, 1, 0)]


def test_a_rollout_is_written_without_a_copy() -> None:
    env = VectorEnv("3m", 4)
    rollout = Buffers.allocate(env.spec, 11, 4)
    env.reset(seed=1, out=rollout[0])
    for t in range(10):
        step = env.step(env.random_actions(), out=rollout[t + 1])
        assert np.shares_memory(step.observations, rollout.observations)
    other = VectorEnv("3m", 4)
    shown = other.reset(seed=1)
    for t in range(11):
        assert same(list(rollout[t]), list(shown))
        shown = other.step(other.random_actions())


def test_what_becomes_of_an_episode_that_ends() -> None:
    envs = {mode: VectorEnv("3m", 3, autoreset=mode) for mode in ("same-step", "next-step", "disabled")}
    for env in envs.values():
        env.reset(seed=2)
    same_step, next_step, disabled = envs.values()
    while True:
        actions = same_step.random_actions()
        steps = [env.step(actions) for env in envs.values()]
        assert all(np.array_equal(step.rewards, steps[0].rewards) for step in steps)
        assert all(np.array_equal(step.ended, steps[0].ended) for step in steps)
        if steps[0].ended.any():
            break
    world = int(steps[0].ended.argmax())
    last = steps[0].final
    assert last is not None and steps[1].final is None
    assert np.array_equal(last.observations[world], steps[2].observations[world])
    assert same_step.episodes()[world] == (2, world + 3, 0)
    first = steps[0].observations[world].copy()
    steps = [env.step(env.random_actions()) for env in (next_step, disabled)]
    # Next step: the episode begins, its first moment is shown, nothing is paid.
    assert np.array_equal(steps[0].observations[world], first)
    assert steps[0].rewards[world] == 0 and not steps[0].ended[world]
    # Disabled: it stays as it was.
    assert np.array_equal(steps[1].observations[world], last.observations[world])
    assert steps[1].rewards[world] == 0 and steps[1].ended[world]
    mask = np.arange(3) == world
    shown = disabled.reset(mask=mask)
    assert np.array_equal(shown.observations[world], first)


@pytest.mark.parametrize(
    ("actions", "error", "message"),
    [
        (np.zeros((4, 3), np.int32), TypeError, "actions is int32 of shape (4, 3), expected int64 of shape (4, 3)"),
        (np.zeros((4, 2), np.int64), ValueError, "actions is int64 of shape (4, 2), expected int64 of shape (4, 3)"),
        ([[1, 1, 1]] * 4, TypeError, "actions is a <class 'list'>, expected int64 of shape (4, 3)"),
        (np.ones((3, 4), np.int64).T, ValueError, "actions is not contiguous, expected int64 of shape (4, 3) in C order"),
        (np.full((4, 3), 9), ValueError, "actions[0, 0] is 9, expected an integer in [0, 8]"),
        (np.full((4, 3), -1), ValueError, "actions[0, 0] is -1, expected an integer in [0, 8]"),
    ],
)
def test_wrong_actions_are_refused_by_name_type_and_shape(actions: object, error: type, message: str) -> None:
    env = VectorEnv("3m", 4)
    env.reset(seed=1)
    with pytest.raises(error) as caught:
        env.step(actions)  # type: ignore[arg-type]
    assert str(caught.value) == message


def test_wrong_arrays_are_refused_by_name_type_and_shape() -> None:
    env = VectorEnv("3m", 2)
    spec = env.spec

    def refused(change: str, array: np.ndarray, error: type, message: str) -> None:
        out = Buffers.allocate(spec, 2)
        setattr(out, change, array)
        with pytest.raises(error) as caught:
            env.reset(seed=1, out=out)
        assert message in str(caught.value)

    wide = np.zeros((2, 3, spec.obs_size), np.float64)
    refused("observations", wide, TypeError, "observations is float64 of shape (2, 3, 30), expected float32 of shape (2, 3, 30)")
    refused("state", np.zeros((2, 1), np.float32), ValueError, "state is float32 of shape (2, 1), expected float32 of shape (2, 48)")
    frozen = np.zeros((2, 3, 6), np.bool_)
    frozen.flags.writeable = False
    refused("visible", frozen, ValueError, "visible cannot be written")
    out = Buffers.allocate(spec, 2)
    shared = np.zeros((2, 6, 3), np.float32)
    out.entities = shared
    out.state = shared
    with pytest.raises(ValueError, match="state is float32"):
        env.reset(seed=1, out=out)
    with VectorEnv("3m", 2) as closed:
        pass
    with pytest.raises(ValueError, match="the worlds are closed"):
        closed.reset()
    with pytest.raises(ValueError, match="no episode has begun"):
        VectorEnv("3m").step(np.ones((1, 3), np.int64))
    with pytest.raises(ValueError, match="seed is -1, expected an integer in"):
        VectorEnv("3m").reset(seed=-1)
    with pytest.raises(ValueError, match="did you mean `3m`"):
        VectorEnv("3n")
    with pytest.raises(ValueError, match="`env.sight_range` is -3.0, expected a number in"):
        VectorEnv("3m", sight_range=-3)


def test_an_array_that_is_passed_twice_is_refused() -> None:
    env = VectorEnv("matrix-game", 2)
    out = Buffers.allocate(env.spec, 2)
    if out.observations.shape == out.entities.shape:
        out.entities = out.observations
        with pytest.raises(ValueError, match="entities cannot be written"):
            env.reset(seed=1, out=out)
    twice = VectorEnv("3m", 2)
    twice.reset(seed=1)
    final = twice._last
    assert final is not None
    with pytest.raises(ValueError, match="observations cannot be written"):
        twice.step(twice.random_actions(), out=Buffers(*final))


def test_an_illegal_action_moves_no_world() -> None:
    env = VectorEnv("3m", 2)
    env.reset(seed=1)
    actions = env.random_actions()
    actions[1, 2] = 0
    before = [array.copy() for array in env.buffers]
    with pytest.raises(mackrl.IllegalAction) as caught:
        env.step(actions)
    assert (caught.value.env, caught.value.agent, caught.value.action) == (1, 2, 0)
    again = pickle.loads(pickle.dumps(caught.value))
    assert str(again) == str(caught.value)
    assert same(before, list(env.buffers)) and [steps for *_, steps in env.episodes()] == [0, 0]


def test_worlds_are_saved_loaded_copied_and_pickled_where_they_stand() -> None:
    env = VectorEnv("2s3z", 3, sight_range=8)
    env.reset(seed=6)
    played(env, 70)
    state, shown = env.save(), [array.copy() for array in env.buffers]
    pickled, copied = pickle.loads(pickle.dumps(env)), copy.deepcopy(env)
    after = played(env, 40)
    for other in (pickled, copied):
        assert same(list(other.buffers), shown)
        assert same(played(other, 40), after)
    assert same(list(env.load(state)), shown)
    assert same(played(env, 40), after)
    for broken in (b"", state[:-2], b"[]", state.replace(b'"played":[', b'"played":[60000,')):
        with pytest.raises(ValueError, match="state of worlds"):
            env.load(broken)


def test_worlds_survive_a_fork() -> None:
    env = VectorEnv("3m", 4, threads=2)
    env.reset(seed=8)
    played(env, 5)
    fork = multiprocessing.get_context("fork")
    results = fork.SimpleQueue()
    child = fork.Process(target=lambda: results.put(played(env, 20)))
    child.start()
    of_child = results.get()
    child.join(20)
    assert child.exitcode == 0
    assert same(played(env, 20), of_child)


def test_other_threads_run_while_worlds_are_played() -> None:
    env = VectorEnv("27m_vs_30m", 256)
    env.reset(seed=1)
    counted, playing = 0, True

    def count() -> None:
        nonlocal counted
        while playing:
            counted += 1
            # Gives the interpreter away: with it held by a step, this thread could count once.
            time.sleep(0)

    thread = threading.Thread(target=count)
    thread.start()
    actions = env.random_actions()
    most, end = 0, time.monotonic() + 30
    while most <= 20 and time.monotonic() < end:
        before = counted
        env.step(env.random_actions(actions))
        most = max(most, counted - before)
    playing = False
    thread.join()
    assert most > 20, most


def test_threads_may_share_worlds() -> None:
    env = VectorEnv("3m", 2)
    env.reset(seed=1)
    errors = []

    def work() -> None:
        out = Buffers.allocate(env.spec, 2)
        try:
            for _ in range(50):
                env.reset(out=out)
        except Exception as error:  # noqa: BLE001
            errors.append(error)

    threads = [threading.Thread(target=work) for _ in range(4)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    assert not errors
    assert env.episodes()[0][1] == 2 * 200


def test_ctrl_c_stops_between_steps_and_worlds_stay_usable() -> None:
    script = """
import mackrl, os, signal, threading
signal.signal(signal.SIGINT, signal.default_int_handler)  # A shell starts what is in its background without.
env = mackrl.VectorEnv("3m", 64)
env.reset(seed=1)
threading.Timer(0.3, lambda: os.kill(os.getpid(), signal.SIGINT)).start()
try:
    while True:
        env.step(env.random_actions())
except KeyboardInterrupt:
    env.step(env.random_actions())
    print("stopped and usable")
"""
    done = subprocess.run([sys.executable, "-c", script], capture_output=True, text=True, timeout=60)
    assert done.stdout == "stopped and usable\n", done.stderr
    assert signal.SIGINT


def test_a_thousand_worlds_are_opened_and_closed_without_a_leak() -> None:
    def resident() -> int:
        with open("/proc/self/statm") as file:
            return int(file.read().split()[1]) * 4096

    for _ in range(100):
        VectorEnv("3m").close()
    before = resident()
    for _ in range(1000):
        env = VectorEnv("3m")
        env.reset(seed=1)
        env.step(env.random_actions())
        env.close()
    assert resident() - before < 8 << 20


def test_what_is_known_before_the_game_can_be_asked() -> None:
    env = VectorEnv("2s3z", 1)
    env.reset(seed=1)
    for _ in range(12):
        step = env.step(env.random_actions())
    entities, visible = step.entities[0], step.visible[0]
    for agent in range(env.spec.n_agents):
        if visible[agent].any():
            # Whoever knows all that an agent sees knows what it can do.
            assert np.array_equal(env.available(entities, visible[agent], agent), step.avail_actions[0, agent])
            seen = [env.sees(agent, entities[agent], other, entities[other]) for other in range(env.spec.n_agents)]
            assert seen[agent]
    with pytest.raises(ValueError, match="agent is 5, expected an integer in"):
        env.available(entities, visible[0], 5)


@pytest.mark.parametrize("kind", ["matrix-game", "sanity-observe", "sanity-remember", "sanity-coordinate"])
def test_every_kind_of_world_can_be_played(kind: str) -> None:
    env = VectorEnv(kind, 5)
    env.reset(seed=1)
    played(env, 20)
