"""Plays the pods of an Indexed Job on this machine: each is the manifest's own command as the first process of a namespace of its own, with
folders where it mounts its volumes. Pods are made again as `podFailurePolicy` says. One of them is evicted (SIGTERM).

    python tests/kubernetes/pods.py MANIFEST FOLDER        FOLDER holds bin/mackrl, and plan, runs and scratch, which are empty
"""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import yaml

PLAN = """\
maps = ["3m"]
algorithms = ["central-v"]
preset = "paper"
seeds = 4
[settings]
run.steps_env = 20000
run.checkpoint_interval_steps_env = 1000
run.metrics_interval_steps_env = 1000
test.interval_steps_env = 10000
test.episodes = 8
"""


class Pod:
    """A pod with the completion index ``index``."""

    def __init__(self, container: dict[str, Any], folder: Path, index: int) -> None:
        mounts = [mount["mountPath"] for mount in container["volumeMounts"]]
        root = folder / f"root{index}"
        script = [f"mount -t tmpfs tmpfs {root}"]
        # A root of its own over the machine's, in which the volumes' mount points can be made.
        script.append(f"mkdir -p {root}/upper {root}/work {root}/all")
        script.append(f"mount -t overlay overlay -o lowerdir=/,upperdir={root}/upper,workdir={root}/work {root}/all")
        for path in mounts:
            script.append(f"mkdir -p {root}/all{path} && mount --bind {folder}{path} {root}/all{path}")
        script.append(f"mount -t proc proc {root}/all/proc && mount --rbind /dev {root}/all/dev && hostname pod{index}")
        script.append(f'exec chroot {root}/all "$@"')
        root.mkdir(exist_ok=True)
        inside = ["bash", "-ec", "\n".join(script), "pod", *container["command"]]
        self.process = subprocess.Popen(
            ["unshare", "--pid", "--fork", "--mount", "--uts", "--kill-child", *inside],
            env={"PATH": f"{folder}/bin:{os.environ['PATH']}", "JOB_COMPLETION_INDEX": str(index)},
            stderr=subprocess.PIPE,
            text=True,
        )

    def evict(self) -> None:
        """SIGTERM for its first process."""
        children = Path(f"/proc/{self.process.pid}/task/{self.process.pid}/children").read_text().split()
        os.kill(int(children[0]), signal.SIGTERM)

    def code(self) -> tuple[int, str]:
        """Its exit code, and what it said last."""
        said = self.process.communicate(timeout=600)[1]
        return self.process.returncode, (said.strip().splitlines() or [""])[0]


def action(rules: list[dict[str, Any]], code: int) -> str | None:
    """What becomes of a pod that ended with this code."""
    for rule in rules:
        if code in rule.get("onExitCodes", {}).get("values", []):
            return str(rule["action"])
    return None


def main(manifest: Path, folder: Path) -> None:
    spec = yaml.safe_load(manifest.read_text())["spec"]
    container = spec["template"]["spec"]["containers"][0]
    rules = spec["podFailurePolicy"]["rules"]
    command = " ".join(container["command"])
    # Four runs suffice: two pods of two.
    container["command"][-1] = container["command"][-1].replace("--block 8 --jobs 8", "--block 2 --jobs 1")
    print("each pod:", command, "\nhere with --block 2 --jobs 1, for a plan of 4 runs")
    (folder / "plan/plan.toml").write_text(PLAN)

    def listed() -> list[dict[str, Any]]:
        listing = [folder / "bin/mackrl", "sweep", folder / "plan/plan.toml", "--out", folder / "runs", "--list", "--json"]
        return list(json.loads(subprocess.check_output(listing)))

    pods = {index: Pod(container, folder, index) for index in (0, 1)}
    deadline = time.monotonic() + 300
    while not any(run["checkpoint"] and run["where"] and run["where"]["host"] == "pod1" for run in listed()):
        assert time.monotonic() < deadline, "the pod makes no checkpoint"
        assert pods[1].process.poll() is None, pods[1].code()
        time.sleep(0.1)
    print("pod 1 is evicted:", ", ".join(f"{run['name']} {run['state']}" for run in listed()))
    pods[1].evict()
    while pods:
        for index, pod in list(pods.items()):
            code, said = pod.code()
            what = "Complete" if code == 0 else action(rules, code)
            print(f"pod {index} ended with exit code {code}: {what}", f"({said})" if said else "")
            del pods[index]
            if what == "Ignore":
                pods[index] = Pod(container, folder, index)
            else:
                assert what == "Complete", said
    assert all(run["state"] == "finished" for run in listed())
    local = [folder / "bin/mackrl", "sweep", folder / "plan/plan.toml", "--out", folder / "local", "--jobs", "2"]
    subprocess.run(local, check=True, capture_output=True)
    for run in listed():
        weights = [folder / place / run["name"] / "weights.safetensors" for place in ("runs", "local")]
        assert weights[0].read_bytes() == weights[1].read_bytes(), run["name"]
    print("all 4 runs are finished, with the weights of a sweep on one machine")


main(Path(sys.argv[1]), Path(sys.argv[2]))
