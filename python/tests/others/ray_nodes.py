"""Ray with two nodes on this machine, of which one is killed: the runs of a plan as tasks, then as trials of Tune.

Nothing but the loopback device is needed: `run` starts this in a network namespace without any other. `MACKRL_PROGRAM` is the program.
"""

from __future__ import annotations

import os
import subprocess
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

os.environ |= {"RAY_USAGE_STATS_ENABLED": "0", "RAY_DEDUP_LOGS": "0", "RAY_CHDIR_TO_TRIAL_DIR": "0"}

import ray  # noqa: E402
from ray import tune  # noqa: E402
from ray.cluster_utils import Cluster  # noqa: E402

import mackrl.sweep  # noqa: E402

PROGRAM = os.environ.get("MACKRL_PROGRAM", "mackrl")
LOCAL = {"node_ip_address": "127.0.0.1"}
PLAN = """\
maps = ["3m"]
algorithms = ["central-v"]
preset = "paper"
seeds = {seeds}
[settings]
run.steps_env = {steps}
run.checkpoint_interval_steps_env = 2000
run.metrics_interval_steps_env = 2000
test.interval_steps_env = 10000
test.episodes = 8
"""
START = time.monotonic()


def say(text: str) -> None:
    print(f"{time.monotonic() - START:4.0f} s  {text}", flush=True)


def wait_for(what: str, condition: Callable[[], bool]) -> None:
    deadline = time.monotonic() + 600
    while not condition():
        assert time.monotonic() < deadline, f"waited in vain for {what}"
        time.sleep(0.2)


def runs(plan: str) -> list[dict[str, Any]]:
    return mackrl.sweep.entries(plan, program=PROGRAM)


def states(plan: str) -> str:
    return ", ".join(f"{run['name']} {run['state']}" for run in runs(plan))


def expect_the_weights_of_a_local_sweep(plan: str) -> None:
    subprocess.run([PROGRAM, "sweep", plan, "--out", f"{plan}-local", "--jobs", "2"], check=True, capture_output=True)
    for run in runs(plan):
        assert run["state"] == "finished", run
        weights = [Path(folder) / "weights.safetensors" for folder in (run["folder"], f"{plan}-local/{run['name']}")]
        assert weights[0].read_bytes() == weights[1].read_bytes(), run["name"]
    say(f"all {len(runs(plan))} runs are finished, with the weights of a sweep on one machine")


def main() -> None:
    say(f"Ray {ray.__version__}: a head without processors, and two nodes of one")
    cluster = Cluster(initialize_head=True, head_node_args={"num_cpus": 0, "include_dashboard": False, **LOCAL})
    nodes = [cluster.add_node(num_cpus=1, **LOCAL) for _ in range(2)]
    ray.init(address=cluster.address, logging_level="error", log_to_driver=False)

    plan = "tasks.toml"
    Path(plan).write_text(PLAN.format(seeds=4, steps=40_000))
    tasks = [mackrl.sweep.remote(plan, index, program=PROGRAM) for index in range(4)]
    wait_for("two runs with checkpoints", lambda: sum(bool(run["checkpoint"] and run["where"]) for run in runs(plan)) == 2)
    say(f"four tasks, two at work: {states(plan)}")
    cluster.remove_node(nodes[1], allow_graceful=False)
    say("one node is killed")
    wait_for("its run to be free", lambda: sum(run["state"] == "running" for run in runs(plan)) == 1)
    say(f"its run wrote a checkpoint and stopped: {states(plan)}")
    rows = ray.get(tasks)
    say(f"the tasks gave their last rows, at {sorted(row['t_env'] for row in rows)} environment steps")
    expect_the_weights_of_a_local_sweep(plan)

    plan = "trials.toml"
    Path(plan).write_text(PLAN.format(seeds=2, steps=20_000))
    cluster.add_node(num_cpus=1, **LOCAL)
    tuner = tune.Tuner(
        mackrl.sweep.trainable(plan, program=PROGRAM),
        param_space={"index": tune.grid_search([0, 1])},
        # A metric of tests alone, which not every row has.
        tune_config=tune.TuneConfig(metric="test_battle_won_mean", mode="max"),
        run_config=tune.RunConfig(
            storage_path=str(Path("tune").absolute()), failure_config=tune.FailureConfig(max_failures=-1), verbose=0
        ),
    )
    results = tuner.fit()
    assert not results.errors, results.errors
    for result in results:
        assert result.metrics is not None and result.metrics_dataframe is not None
        steps = result.metrics_dataframe["t_env"].tolist()
        say(f"trial {result.metrics['config']['index']} reported {len(steps)} rows to Tune, the last at {steps[-1]} environment steps")
        assert steps == sorted(set(steps)) and steps[-1] >= 20_000
    expect_the_weights_of_a_local_sweep(plan)
    ray.shutdown()
    cluster.shutdown()
    say("passed")


with tempfile.TemporaryDirectory() as folder:
    os.chdir(folder)
    main()
