"""What a step of training costs by the number of agents.

    cargo build --release && python3 benchmarks/team-size.py [--steps N] [--json FILE]

Trains MACKRL for a moment on maps of 3 to 27 marines, 8 environments, one thread, and prints environment steps per second of
CPU time, which other load on the machine hardly changes. Up to 8 agents all partitions are in force; above, one at a time.
"""

import argparse
import json
import resource
import subprocess
from pathlib import Path

PROGRAM = Path(__file__).resolve().parents[1] / "target/release/mackrl"
MAPS = {"3m": 3, "5m_vs_6m": 5, "8m": 8, "10m_vs_11m": 10, "25m": 25, "27m_vs_30m": 27}
KEPT = ["simulate", "common_knowledge", "act", "marginal", "critic", "backward"]


def cpu_seconds():
    usage = resource.getrusage(resource.RUSAGE_CHILDREN)
    return usage.ru_utime + usage.ru_stime


def measure(name, steps):
    before = cpu_seconds()
    command = [str(PROGRAM), "bench", "train", "--map", name, "--steps", str(steps), "--threads", "1", "--json"]
    command += ["--set", "test.episodes=1", "--set", f"test.interval_steps_env={steps}"]
    speed = json.loads(subprocess.run(command, check=True, capture_output=True).stdout)
    seconds = cpu_seconds() - before
    return {
        "map": name,
        "agents": MAPS[name],
        "steps": speed["steps"],
        "cpu_s": round(seconds, 3),
        "steps_per_cpu_s": round(speed["steps"] / seconds),
        "cpu_us_per_step": round(1e6 * seconds / speed["steps"]),
        "shares": {phase: round(speed["shares"][phase], 3) for phase in KEPT},
    }


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--steps", type=int, default=8_000)
    parser.add_argument("--json", type=Path)
    parser.add_argument("--repeat", type=int, default=3)
    arguments = parser.parse_args()
    rows = []
    print(f"{'map':<12} agents  steps/CPU s  us/step   best of {arguments.repeat}")
    for name in MAPS:
        runs = [measure(name, arguments.steps) for _ in range(arguments.repeat)]
        best = max(runs, key=lambda run: run["steps_per_cpu_s"])
        rows.append(best)
        print(f"{name:<12} {best['agents']:>6}  {best['steps_per_cpu_s']:>11}  {best['cpu_us_per_step']:>7}", flush=True)
    if arguments.json:
        arguments.json.write_text(json.dumps({"command": f"python3 benchmarks/team-size.py --steps {arguments.steps}", "rows": rows}, indent=1) + "\n")


if __name__ == "__main__":
    main()
