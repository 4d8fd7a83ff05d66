#!/usr/bin/env bash
# Measures the simulator on five maps, on one thread and on two, beside what it has to reach, and writes simulator.json and
# simulator.md into a folder:
#
#     benchmarks/simulator.sh benchmarks/DATE-MACHINE [REPETITIONS]
#
# One and two threads take turns, so that both meet the same load; the best part of the best repetition counts. Two threads are
# judged only where two cores were free: look at the load averages that stand below the table.
set -euo pipefail
cd "$(dirname "$0")/.."
folder=${1:?name the folder to write, such as benchmarks/2026-11-22-laptop}
repetitions=${2:-5}
mkdir -p "$folder"

cargo build --release
for _ in $(seq "$repetitions"); do
    for map in 3m:200000 2s3z:100000 MMM2:50000 27m_vs_30m:10000 2c_vs_64zg:5000; do
        for threads in 1 2; do
            target/release/mackrl bench env --map "${map%:*}" --steps $((${map#*:} * threads)) --threads "$threads" --json |
                tr -d '\n'
            echo
            echo "${map%:*}, $threads threads: done" >&2
        done
    done
done | python3 -c '
import json, os, sys
aims = {"3m": 200_000, "2s3z": 100_000, "MMM2": 40_000, "27m_vs_30m": 8_000, "2c_vs_64zg": 5_000}
folder, runs = sys.argv[1], [json.loads(line) for line in sys.stdin]
speed = lambda run: run["env_steps_per_s_best_part"]
rows = ["| map | aim | 1 thread | 2 threads | ratio |", "|---|---:|---:|---:|---:|"]
for name, aim in aims.items():
    one, two = (max(speed(run) for run in runs if (run["map"], run["threads"]) == (name, n)) for n in (1, 2))
    rows.append(f"| `{name}` | {aim:,} | {one:,.0f} | {two:,.0f} | {two / one:.2f} |".replace(",", " "))
load = "Load averages at the end: {:.1f}, {:.1f}, {:.1f}.".format(*os.getloadavg())
table = "\n".join(rows) + "\n\n" + load + "\n"
open(f"{folder}/simulator.md", "w").write(table)
json.dump(runs, open(f"{folder}/simulator.json", "w"), indent=1)
print(table, end="")
' "$folder"
