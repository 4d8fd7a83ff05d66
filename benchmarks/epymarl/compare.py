#!/usr/bin/env python3
"""QMIX on 2s3z: environment steps a second of `mackrl train` beside EPyMARL's, learning included, and their ratio.

    cargo build --release
    python3 benchmarks/epymarl/compare.py --epymarl CHECKOUT [--json FILE]

CHECKOUT is a clone of https://github.com/uoe-agents/epymarl at the commit below; no line of it is part of this repository, and
none is changed. What it needs (requirements.txt, and our Python package) is installed into target/epymarl/venv at the first call.

EPyMARL's own program, runner and learner play our simulator through the Python package (adapter.py). On both sides: PyMARL's
QMIX, one environment, an update of 32 whole episodes after every episode, Adam, no tests. The program stops if settings of the
game or of the learner, the shapes of the networks, or the optimiser differ.

Short windows of both alternate, on one thread and on two. EPyMARL's processes live on and wait while others are measured; a
window of theirs is whole episodes after the first updates. With several threads it is measured twice, with threads that wait for
each other actively, as is the default, and passively: other load slows the first, and the faster one counts. Of ours two runs
of the same seed are timed, a short one that ends after the first updates and a long one: their difference leaves out the start
and the end. Steps a second of processor time stand beside, which other load on the machine changes less.
"""

import argparse
import json
import math
import os
import platform
import shutil
import statistics
import subprocess
import sys
import tempfile
import time
import tomllib
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
FOLDER = ROOT / "target/epymarl"
PYTHON = FOLDER / "venv/bin/python"
COMMIT = "cbc38c09588064eab978501d0f12c2cf58fa7fc2"
MAP = "2s3z"
NEVER = 1_000_000_000
WAITS = ["active", "passive"]

# Where EPyMARL's QMIX is not PyMARL's: no recurrence, no last action in observations and state, standardised rewards.
THEIRS = {
    "use_rnn": True,
    "obs_last_action": True,
    "env_args.state_last_action": True,
    "standardise_rewards": False,
    "env_args.map_name": MAP,
    "use_cuda": False,
    "seed": 1,
    "t_max": NEVER,
    "test_interval": NEVER,
    "test_nepisode": 1,
}
# EPyMARL's learner has Adam alone, and with `continuing_episode` off the limit of steps ends the game.
OURS = {
    "algorithm.optimiser": '"adam"',
    "algorithm.optimiser_epsilon": "1e-8",
    "algorithm.bootstrap_at_time_limit": "false",
    "test.interval_steps_env": NEVER,
    "test.episodes": 1,
}
NAMES = {
    "batch_size": "minibatch_episodes",
    "batch_size_run": "environments",
    "buffer_size": "memory_episodes",
    "double_q": "double_q",
    "epsilon_anneal_time": "exploration_steps_env",
    "epsilon_finish": "exploration_finish",
    "epsilon_start": "exploration_start",
    "gamma": "gamma",
    "grad_norm_clip": "gradient_norm_max",
    "hidden_dim": "hidden",
    "hypernet_embed": "hypernetwork_hidden",
    "hypernet_layers": "hypernetwork_layers",
    "lr": "learning_rate",
    "mixing_embed_dim": "mixing_hidden",
    "target_update_interval_or_tau": "target_interval_episodes",
}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--epymarl", metavar="CHECKOUT", type=Path, required=True, help=f"EPyMARL, commit {COMMIT[:7]}")
    parser.add_argument("--mackrl", type=Path, default=ROOT / "target/release/mackrl", help="the program to compare with")
    parser.add_argument("--wheel", type=Path, help="a wheel of our package, instead of building python/")
    parser.add_argument("--threads", type=int, nargs="+", default=[1, 2])
    parser.add_argument("--rounds", type=int, default=5, help="windows of each")
    parser.add_argument("--seconds", type=float, default=8, help="length of EPyMARL's windows")
    parser.add_argument("--steps", type=int, default=10_000, help="environment steps of our windows")
    parser.add_argument("--before", type=int, default=2_000, help="environment steps of ours before a window")
    parser.add_argument("--json", metavar="FILE", type=Path, help="write the numbers to FILE")
    arguments = parser.parse_args()
    if not shutil.which(arguments.mackrl):
        sys.exit(f"{arguments.mackrl} is no program; `cargo build --release` makes one, --mackrl names another")
    commit = found_commit(arguments.epymarl)
    install(arguments.wheel)
    with tempfile.TemporaryDirectory(dir=FOLDER) as scratch:
        compare(arguments, commit, Path(scratch))


def found_commit(checkout):
    """The commit of EPyMARL's checkout, which has to be the one that this was written for, unchanged."""
    if not (checkout / "src/main.py").exists():
        sys.exit(f"{checkout} has no src/main.py, expected a clone of https://github.com/uoe-agents/epymarl")
    git = ["git", "-C", checkout]
    commit = subprocess.run([*git, "rev-parse", "HEAD"], check=True, capture_output=True, text=True).stdout.strip()
    changed = subprocess.run([*git, "diff", "--quiet", "HEAD"]).returncode != 0
    if commit != COMMIT or changed:
        sys.exit(f"{checkout} is at {commit}{', changed' if changed else ''}, expected {COMMIT}")
    return commit


def install(wheel):
    """Installs everything once; a change of the requirements or of the wheel's name does it again."""
    ours = str(wheel.resolve()) if wheel else str(ROOT / "python")
    wanted = (HERE / "requirements.txt").read_text() + ours + "\n"
    stamp = FOLDER / "installed.txt"
    if stamp.exists() and stamp.read_text() == wanted:
        return
    print(f"installing into {FOLDER / 'venv'}; this takes minutes", flush=True)
    subprocess.run([sys.executable, "-m", "venv", "--clear", FOLDER / "venv"], check=True)
    pip = [PYTHON, "-m", "pip", "install", "--quiet"]
    subprocess.run([*pip, "-r", HERE / "requirements.txt"], check=True)
    subprocess.run([*pip, ours], check=True)
    stamp.write_text(wanted)


class Peer:
    """EPyMARL in a process of its own, which waits between windows."""

    def __init__(self, checkout, threads, waits, scratch):
        self.waits = waits
        # EPyMARL writes its records beside the folder of its program, which is therefore named through a link.
        home = scratch / f"epymarl-{threads}-{waits}"
        home.mkdir()
        (home / "src").symlink_to((checkout / "src").resolve())
        reports, writes = os.pipe()
        settings = [f"{name}={value}" for name, value in THEIRS.items()]
        command = [PYTHON, HERE / "adapter.py", home / "src/main.py", str(threads), str(writes)]
        command += ["--config=qmix", "--env-config=sc2", "with", *settings]
        self.log = home / "log.txt"
        environment = {**os.environ, "OMP_NUM_THREADS": str(threads), "PYTHONDONTWRITEBYTECODE": "1"}
        if waits == "passive":
            environment["OMP_WAIT_POLICY"] = "PASSIVE"
        with self.log.open("w") as log:
            self.process = subprocess.Popen(
                command,
                cwd=home,
                env=environment,
                stdin=subprocess.PIPE,
                stdout=log,
                stderr=subprocess.STDOUT,
                pass_fds=[writes],
                text=True,
            )
        os.close(writes)
        self.reports = os.fdopen(reports)
        self.facts = self.report()

    def report(self):
        line = self.reports.readline()
        if not line:
            sys.exit(f"EPyMARL ended with {self.process.wait()}:\n{self.log.read_text()[-4000:]}")
        return json.loads(line)

    def window(self, seconds):
        print(seconds, file=self.process.stdin, flush=True)
        return {**self.report(), "waits": self.waits}

    def end(self):
        self.process.kill()
        self.process.wait()


def trained(program, threads, steps, seed, folder):
    """Trains; gives steps, episodes, seconds and seconds of processor time."""
    shutil.rmtree(folder, ignore_errors=True)
    command = [program, "train", "--preset", "pymarl-qmix", "--map", MAP, "--threads", str(threads)]
    command += ["--steps", str(steps), "--seed", str(seed), "--out", folder]
    for name, value in OURS.items():
        command += ["--set", f"{name}={value}"]
    began = time.perf_counter()
    with subprocess.Popen(command, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE) as process:
        complaint = process.stderr.read()
        _, status, usage = os.wait4(process.pid, 0)
        wall = time.perf_counter() - began
        process.returncode = os.waitstatus_to_exitcode(status)
    if process.returncode != 0:
        sys.exit(f"{program} failed: {complaint.decode()}")
    last = json.loads((folder / "metrics.jsonl").read_text().splitlines()[-1])
    return {
        "wall_s": wall,
        "cpu_s": usage.ru_utime + usage.ru_stime,
        "steps": last["t_env"],
        "episodes": last["episode"],
        "updates": last["update"],
    }


def our_window(arguments, threads, seed, scratch):
    short = trained(arguments.mackrl, threads, arguments.before, seed, scratch / "short")
    long = trained(arguments.mackrl, threads, arguments.before + arguments.steps, seed, scratch / "long")
    return {name: long[name] - short[name] for name in long}


def tensors(path):
    """Header of a file of safetensors."""
    with path.open("rb") as file:
        return json.loads(file.read(int.from_bytes(file.read(8), "little")))


def check_same(facts, run, threads):
    """Stops unless EPyMARL and our run play the same game with the same networks and settings."""
    theirs, config = facts["settings"], tomllib.loads((run / "config.toml").read_text())
    header = tensors(run / "weights.safetensors")
    about = header.pop("__metadata__")
    pairs = {name: (theirs[name], config["algorithm"][ours]) for name, ours in NAMES.items()}
    for name, value in theirs["env_args"].items():
        if name in config["env"]:
            pairs[f"env_args.{name}"] = (value, config["env"][name])
    pairs["map"] = (theirs["env_args"]["map_name"], config["env"]["map"])
    pairs["episode limit"] = (facts["episode_limit"], json.loads(about["spec"])["episode_limit"])
    pairs["optimiser"] = (facts["optimiser"], config["algorithm"]["optimiser"])
    pairs["threads"] = (facts["threads"], threads)
    pairs["shapes"] = (facts["shapes"], sorted(tensor["shape"] for tensor in header.values()))
    differing = [f"{name}: EPyMARL {one}, ours {other}" for name, (one, other) in pairs.items() if one != other]
    if differing:
        sys.exit("not the same is compared:\n" + "\n".join(differing))
    return len(pairs)


def compare(arguments, commit, scratch):
    peers = {threads: [] for threads in arguments.threads}
    checked = scratch / "checked"
    trained(arguments.mackrl, 1, 100, 1, checked)
    try:
        for threads in peers:
            for waits in WAITS if threads > 1 else WAITS[:1]:
                peer = Peer(arguments.epymarl, threads, waits, scratch)
                peers[threads].append(peer)
                count = check_same(peer.facts, checked, threads)
                peer.window(0)
        about = conditions(commit, peer.facts, checked, count)
        print(f"{'threads':>7} {'round':>5} {'EPyMARL':>9} {'mackrl':>9} {'ratio':>7} {'of CPU s':>9}  EPyMARL waits", flush=True)
        rows = []
        for number in range(1, arguments.rounds + 1):
            for threads in peers:
                row = {"threads": threads, "round": number}
                for name in ["epymarl", "mackrl"] if number % 2 else ["mackrl", "epymarl"]:
                    if name == "mackrl":
                        row[name] = rates(our_window(arguments, threads, number, scratch))
                    else:
                        row["windows"] = [rates(peer.window(arguments.seconds)) for peer in peers[threads]]
                        row[name] = max(row["windows"], key=lambda window: window["steps_per_s"])
                rows.append(row)
                tell(row)
    finally:
        for peer in sum(peers.values(), []):
            peer.end()
    summary = [summed_up(threads, [row for row in rows if row["threads"] == threads]) for threads in peers]
    if arguments.json:
        record = {"about": about, "summary": summary, "rows": rows}
        arguments.json.write_text(json.dumps(record, indent=1) + "\n")


def conditions(commit, facts, run, count):
    provenance = json.loads((run / "run.json").read_text())
    about = {
        "epymarl": commit,
        "torch": facts["torch"],
        "python": platform.python_version(),
        "package": facts["mackrl"],
        "program": provenance["provenance"][0]["code"],
        "simd": provenance["simd"],
        "parameters": sum(math.prod(shape) for shape in facts["shapes"]),
        "load": os.getloadavg()[0],
    }
    print(", ".join(f"{name} {value}" for name, value in about.items()))
    print(f"{count} settings and all {len(facts['shapes'])} shapes are the same on both sides")
    return about


def rates(window):
    """The window with its steps a second, by the clock and by processor time."""
    return {
        **window,
        "steps_per_s": window["steps"] / window["wall_s"],
        "steps_per_cpu_s": window["steps"] / window["cpu_s"],
        "episode_length": window["steps"] / window["episodes"],
    }


def ratio(row, figure):
    return row["mackrl"][figure] / row["epymarl"][figure]


def tell(row):
    speeds = [f"{row[name]['steps_per_s']:9.1f}" for name in ("epymarl", "mackrl")]
    wall, cpu = ratio(row, "steps_per_s"), ratio(row, "steps_per_cpu_s")
    print(f"{row['threads']:7} {row['round']:5} {' '.join(speeds)} {wall:7.2f} {cpu:9.2f}  {row['epymarl']['waits']}", flush=True)


def summed_up(threads, rows):
    summary = {"threads": threads}
    for name, figure in (("ratio", "steps_per_s"), ("ratio_of_cpu_s", "steps_per_cpu_s")):
        ratios = [ratio(row, figure) for row in rows]
        summary[name] = {"median": statistics.median(ratios), "least": min(ratios), "most": max(ratios)}
    for name in ("epymarl", "mackrl"):
        summary[f"{name}_steps_per_s"] = statistics.median(row[name]["steps_per_s"] for row in rows)
        summary[f"{name}_episode_length"] = statistics.mean(row[name]["episode_length"] for row in rows)
    wall, cpu = summary["ratio"], summary["ratio_of_cpu_s"]
    print(
        f"{threads} thread(s): mackrl {summary['mackrl_steps_per_s']:.0f} steps/s, EPyMARL {summary['epymarl_steps_per_s']:.0f};"
        f" ratio {wall['median']:.1f} ({wall['least']:.1f} to {wall['most']:.1f}), of processor time {cpu['median']:.1f}"
        f" ({cpu['least']:.1f} to {cpu['most']:.1f}); steps an episode {summary['mackrl_episode_length']:.0f} and"
        f" {summary['epymarl_episode_length']:.0f}"
    )
    return summary


if __name__ == "__main__":
    main()
