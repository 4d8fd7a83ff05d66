#!/usr/bin/env bash
# The long form of the tests that hold the promises about robustness: kills, fuzzing, an hour of training, failing disks.
#
#   scripts/robustness.sh                 everything, about three and a half hours
#   scripts/robustness.sh kills fuzz      some of it: integrity, kills, disks, fuzz or soak
#
# CASES, CASES_SEED, KILLS, FUZZ_SECONDS, FUZZ_SEED and SOAK_SECONDS change how long. What the tests say is kept in results/robustness/.
set -euo pipefail
cd "$(dirname "$0")/.."
results=results/robustness
mkdir -p "$results"

# Keeps what a test says, without the frame around it.
keep() {
    local name="$1"
    shift
    cargo test --release --quiet "$@" -- --nocapture | grep -E ': [0-9]+ cases|kills|failing operations' | tee "$results/$name.txt"
}

if [ $# -eq 0 ]; then
    set -- disks integrity kills fuzz soak
fi
for step in "$@"; do
    case "$step" in
        disks) keep disks -p mackrl-run --lib faults ;;
        integrity)
            # Another build than the one that is tested, for runs that cross from one to the other.
            cargo build --quiet -p mackrl
            MACKRL_CASES="${CASES:-60}" MACKRL_SEED="${CASES_SEED:-1}" MACKRL_OTHER_BUILD="$PWD/target/debug/mackrl" \
                keep integrity -p mackrl --features slow-tests --test integrity
            ;;
        kills) MACKRL_KILLS="${KILLS:-5000}" keep kills -p mackrl --features slow-tests --test crash ;;
        fuzz) MACKRL_FUZZ_SECONDS="${FUZZ_SECONDS:-7200}" MACKRL_FUZZ_SEED="${FUZZ_SEED:-2}" keep fuzz -p mackrl --features slow-tests --test fuzz ;;
        soak)
            MACKRL_SOAK_SECONDS="${SOAK_SECONDS:-3600}" MACKRL_SOAK_OUT="$results/soak" \
                cargo test --release --quiet -p mackrl --features slow-tests --test soak
            ;;
        *)
            printf 'error: no step is called %s, expected disks, integrity, kills, fuzz or soak\n' "$step" >&2
            exit 2
            ;;
    esac
done
