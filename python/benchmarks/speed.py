"""Environment steps a second from Python, beside the Rust program, SMAX and SMAClite, in one run, one after the other and again.

    python speed.py --program ../../target/release/mackrl --smax PYTHON_WITH_JAXMARL --smaclite PYTHON_WITH_SMACLITE --out FILE

Everything runs on one thread with random available actions, and everything is written that agents may ask for: observations, state,
masks. Only ratios between neighbouring measurements count: the machine may have other work.
"""

from __future__ import annotations

import argparse
import json
import os
import platform
import resource
import subprocess
import sys
import time
from pathlib import Path

HERE = Path(__file__).parent
ONE_THREAD = {"OMP_NUM_THREADS": "1", "OPENBLAS_NUM_THREADS": "1", "XLA_FLAGS": "--xla_cpu_multi_thread_eigen=false"}
ONE_THREAD["JAX_PLATFORMS"] = "cpu"


def ours(map_name: str, worlds: int, draws: str, seconds: float) -> float:
    """Steps of `VectorEnv` in a CPU second; actions drawn in Rust, or by NumPy in the caller."""
    import numpy as np

    import mackrl

    env = mackrl.VectorEnv(map_name, worlds)
    env.reset(seed=1)
    actions = env.random_actions()
    rng = np.random.default_rng(1)
    steps, start = 0, time.process_time()
    while (spent := time.process_time() - start) < seconds:
        for _ in range(max(1, 2000 // worlds)):
            if draws == "rust":
                env.random_actions(actions)
            else:
                noise = rng.random(env.buffers.avail_actions.shape, np.float32)
                actions = np.where(env.buffers.avail_actions, noise, -1).argmax(axis=-1)
            env.step(actions)
            steps += worlds
    return steps / spent


def program(binary: str, map_name: str) -> float:
    """Steps of `mackrl bench env` in a CPU second, on one thread; its start is taken off by a shorter run."""
    few, many = 50_000, 550_000
    command = [binary, "bench", "env", "--map", map_name, "--threads", "1", "--json", "--steps"]

    def spent(steps: int) -> float:
        before = resource.getrusage(resource.RUSAGE_CHILDREN)
        subprocess.run([*command, str(steps)], check=True, capture_output=True)
        after = resource.getrusage(resource.RUSAGE_CHILDREN)
        return after.ru_utime + after.ru_stime - before.ru_utime - before.ru_stime

    return (many - few) / (spent(many) - spent(few))


def peer(python: str, script: str, map_name: str, worlds: int) -> float:
    """Steps a CPU second of another simulator, as its script prints them."""
    command = [python, str(HERE / script), map_name, str(worlds)]
    shown = subprocess.run(command, check=True, capture_output=True, text=True, env={**os.environ, **ONE_THREAD})
    return float(shown.stdout.split()[-1])


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--program", required=True)
    parser.add_argument("--smax")
    parser.add_argument("--smaclite")
    parser.add_argument("--maps", nargs="+", default=["3m", "2s3z"])
    parser.add_argument("--worlds", nargs="+", type=int, default=[64, 512, 8, 1])
    parser.add_argument("--seconds", type=float, default=2)
    parser.add_argument("--out", type=Path, required=True)
    typed = parser.parse_args()
    rows = []

    def measure(what: str, map_name: str, worlds: int, rate: float) -> None:
        rows.append({"what": what, "map": map_name, "worlds": worlds, "steps_per_s": round(rate)})
        print(what, map_name, worlds, round(rate), file=sys.stderr, flush=True)
        record = {"python": platform.python_version(), "machine": platform.machine(), "rows": rows}
        typed.out.write_text(json.dumps(record, indent=1) + "\n")

    for worlds in typed.worlds:
        for map_name in typed.maps:
            measure("program", map_name, 1, program(typed.program, map_name))
            for draws in ("rust", "numpy"):
                measure(f"ours, {draws} draws", map_name, worlds, ours(map_name, worlds, draws, typed.seconds))
            if typed.smax:
                measure("smax", map_name, worlds, peer(typed.smax, "smax.py", map_name, worlds))
                measure("ours, rust draws", map_name, worlds, ours(map_name, worlds, "rust", typed.seconds))
            measure("program", map_name, 1, program(typed.program, map_name))
            if typed.smaclite and worlds == typed.worlds[0]:
                measure("smaclite", map_name, 1, peer(typed.smaclite, "smaclite_speed.py", map_name, 1))


if __name__ == "__main__":
    main()
