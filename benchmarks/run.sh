#!/usr/bin/env bash
# Measures environments, training, the update, its peers and the criterion benches, and writes the numbers into a folder:
#
#     benchmarks/run.sh benchmarks/DATE-MACHINE [REPETITIONS]
#
# Other work on the machine can only slow a measurement down, so each is repeated and the best repetition is kept, with what
# all the others gave beside it. PyTorch and JAX are compared if `benchmarks/peers/compare.py --install` has been run.
set -euo pipefail
cd "$(dirname "$0")/.."
folder=${1:?name the folder to write, such as benchmarks/2026-11-22-laptop}
repetitions=${2:-5}
mkdir -p "$folder"

cargo build --release
mackrl=target/release/mackrl

# best FILE FIELD min|max COMMAND...: keeps the repetition in which FIELD of the command's JSON is best.
best() {
    local file=$1 field=$2 order=$3
    shift 3
    echo "$file: $*"
    for _ in $(seq "$repetitions"); do "$@" --json | tr -d '\n'; echo; done |
        python3 -c '
import json, sys
field, order, command = sys.argv[1], {"min": min, "max": max}[sys.argv[2]], sys.argv[3:]
runs = [json.loads(line) for line in sys.stdin]
best = order(runs, key=lambda run: run[field])
print(json.dumps({"command": " ".join(command), "best": best, "all": [run[field] for run in runs]}, indent=2))
' "$field" "$order" "$@" >"$folder/$file"
}

{
    grep -m1 "model name" /proc/cpuinfo || true
    echo "cores: $(nproc)"
    uname -sr
    rustc --version
    echo "commit: $(git rev-parse --short HEAD)"
    uptime
} >"$folder/machine.txt"

benchmarks/simulator.sh "$folder" "$repetitions"
best update.json min_ms min $mackrl bench update
for map in 3m 2s3z; do
    for threads in 1 2; do
        best "train-$map-$threads-threads.json" env_steps_per_s max \
            $mackrl bench train --map "$map" --preset paper --steps 50000 --threads "$threads"
    done
done
if [ -e benchmarks/peers/.venv ]; then
    python3 benchmarks/peers/compare.py --repetitions "$repetitions" --json "$folder/peers.json" | tee "$folder/peers.txt"
fi
{
    cargo bench -p mackrl-skirmish --bench step -- --quiet
    cargo bench -p mackrl-core --bench hierarchy -- --quiet
    cargo bench -p mackrl-core --bench update -- --quiet
} 2>/dev/null | grep -v '^$' >"$folder/criterion.txt"
uptime >>"$folder/machine.txt"
