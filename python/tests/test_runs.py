"""Training from Python: the program's own folder, to the byte; metrics, replays, interruptions."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

import mackrl
from conftest import SHORT

ROOT = Path(__file__).parents[2]
PROGRAM = os.environ.get("MACKRL_PROGRAM") or shutil.which("mackrl") or str(ROOT / "target/debug/mackrl")


def timeless(path: Path) -> list[dict[str, object]]:
    rows = [json.loads(line) for line in path.read_text().splitlines()]
    return [{name: value for name, value in row.items() if not name.startswith("sys/")} for row in rows]


@pytest.mark.skipif(not Path(PROGRAM).exists(), reason="the program is not built: `cargo build`, or set MACKRL_PROGRAM")
def test_a_run_is_that_of_the_program_byte_for_byte(runs: dict[str, mackrl.Run], tmp_path: Path) -> None:
    out = tmp_path / "program"
    settings = [f"--set={key}={value}" for key, value in SHORT["settings"].items()]  # type: ignore[attr-defined]
    command = [PROGRAM, "train", "--map=3m", f"--preset={SHORT['preset']}", f"--algorithm={SHORT['algorithm']}"]
    subprocess.run([*command, f"--steps={SHORT['steps']}", *settings, f"--out={out}"], check=True, capture_output=True)
    ours = runs["3m"].folder
    files = {str(path.relative_to(out)) for path in out.rglob("*") if path.is_file()}
    assert files == {str(path.relative_to(ours)) for path in ours.rglob("*") if path.is_file()}
    # The clock stands in run.json and under sys/, and by its hash in the manifest of a checkpoint.
    clocked = {name for name in files if name.endswith(("run.json", "metrics.jsonl", "manifest.json", ".lock"))}
    assert "weights.safetensors" in files - clocked and "config.toml" in files - clocked
    for name in files - clocked:
        assert (out / name).read_bytes() == (ours / name).read_bytes(), name
    assert timeless(out / "metrics.jsonl") == timeless(ours / "metrics.jsonl")
    shown = subprocess.run(
        [PROGRAM, "evaluate", str(ours), "--episodes=20", "--json"], check=True, capture_output=True, text=True
    )
    theirs, own = json.loads(shown.stdout), runs["3m"].evaluate(20)
    assert own["episodes"] == 20
    assert all(theirs[name] == value for name, value in own.items())


def test_metrics_are_arrays_of_one_length(runs: dict[str, mackrl.Run]) -> None:
    metrics = runs["3m"].metrics()
    assert {len(column) for column in metrics.values()} == {len(metrics["t_env"])}
    assert metrics["t_env"][-1] >= SHORT["steps"]
    assert np.isfinite(metrics["test_return_mean"]).sum() >= 1
    assert runs["3m"].status == "finished" and "finished" in repr(runs["3m"])
    assert runs["3m"].config()["run"]["steps_env"] == SHORT["steps"]


@pytest.mark.skipif(not Path(PROGRAM).exists(), reason="the program is not built: `cargo build`, or set MACKRL_PROGRAM")
def test_a_default_run_is_that_of_the_program(default_runs: dict[str, mackrl.Run], tmp_path: Path) -> None:
    out, ours = tmp_path / "program", default_runs["2s3z"].folder
    command = [PROGRAM, "train", "--map=2s3z", "--steps=1500", "--set=test.episodes=4", f"--out={out}"]
    subprocess.run(command, check=True, capture_output=True)
    for name in ("config.toml", "weights.safetensors"):
        assert (out / name).read_bytes() == (ours / name).read_bytes(), name
    assert timeless(out / "metrics.jsonl") == timeless(ours / "metrics.jsonl")


def test_a_run_that_is_not_what_it_was_is_refused(runs: dict[str, mackrl.Run], tmp_path: Path) -> None:
    def exchanged(name: str, content: bytes) -> Path:
        folder = tmp_path / name
        shutil.copytree(runs["3m"].folder, folder)
        (folder / name).write_bytes(content)
        return folder

    other = mackrl.train("3m", out=tmp_path / "other", seed=2, **SHORT)  # type: ignore[arg-type]
    weights = exchanged("weights.safetensors", (other.folder / "weights.safetensors").read_bytes())
    run = mackrl.Run(weights)
    for use in (run.team, lambda: mackrl.policy.load(weights), lambda: run.evaluate(1), run.replay):
        with pytest.raises(ValueError, match="weights.safetensors is not what run.json says"):
            use()
    metrics = (runs["3m"].folder / "metrics.jsonl").read_bytes()
    with pytest.raises(ValueError, match="metrics.jsonl is not what run.json says"):
        mackrl.Run(exchanged("metrics.jsonl", metrics[: metrics.index(b"\n") + 1])).metrics()
    config = (runs["3m"].folder / "config.toml").read_bytes()
    with pytest.raises(ValueError, match="config.toml is not what run.json says"):
        mackrl.Run(exchanged("config.toml", config.replace(b"seed = 1", b"seed = 2")))
    assert runs["3m"].metrics() and runs["3m"].team()


def test_progress_is_told_and_a_listener_may_end_the_run(tmp_path: Path) -> None:
    told: list[mackrl.Progress] = []
    kept = {name: value for name, value in SHORT.items() if name != "progress"}
    mackrl.train("3m", out=tmp_path / "whole", **kept, progress=told.append)  # type: ignore[arg-type]
    assert told[-1].steps >= told[-1].steps_total == SHORT["steps"]
    assert all(a.steps <= b.steps for a, b in zip(told, told[1:], strict=False))

    class Enough(Exception):
        pass

    def stop(progress: mackrl.Progress) -> None:
        if progress.steps > 0:
            raise Enough

    long = {**kept, "steps": 10**9}
    with pytest.raises(Enough):
        mackrl.train("3m", out=tmp_path / "part", **long, progress=stop)  # type: ignore[arg-type]
    assert mackrl.Run(tmp_path / "part").status == "interrupted"


def test_ctrl_c_leaves_a_run_that_goes_on_as_if_never_stopped(tmp_path: Path) -> None:
    script = f"""
import mackrl, os, signal, sys, threading
signal.signal(signal.SIGINT, signal.default_int_handler)  # A shell starts what is in its background without.
begun = threading.Event()
threading.Thread(target=lambda: begun.wait() and os.kill(os.getpid(), signal.SIGINT)).start()
try:
    mackrl.train("3m", preset="paper-code", algorithm="mackrl", steps=12000, out=sys.argv[1],
                 progress=lambda progress: progress.steps > 0 and begun.set())
except KeyboardInterrupt:
    print("interrupted")
"""
    stopped = tmp_path / "stopped"
    done = subprocess.run([sys.executable, "-c", script, str(stopped)], capture_output=True, text=True, timeout=100)
    assert done.stdout == "interrupted\n", done.stderr
    run = mackrl.Run(stopped)
    assert run.status == "interrupted"
    with pytest.raises(FileExistsError, match="unfinished run"):
        mackrl.train("3m", out=stopped, progress=False)
    run.resume(progress=False)
    whole = mackrl.train("3m", preset="paper-code", algorithm="mackrl", steps=12000, out=tmp_path / "whole", progress=False)
    weights = [(one.folder / "weights.safetensors").read_bytes() for one in (run, whole)]
    assert weights[0] == weights[1]


def test_wrong_settings_are_refused_before_a_folder_is_made(tmp_path: Path) -> None:
    for arguments, message in (
        ({"settings": {"algorithm.gama": 0.9}}, "unknown key `algorithm.gama`, did you mean `algorithm.gamma`"),
        ({"settings": {"run.seed": -1}}, "`run.seed` is -1"),
        ({"preset": "papr"}, "papr"),
        ({"algorithm": "macrl"}, "macrl"),
        ({"world": {"sight_rang": 1}}, "did you mean `env.sight_range`"),
    ):
        with pytest.raises(ValueError, match="(?s).*") as caught:
            mackrl.train("3m", out=tmp_path / "no", **arguments, progress=False)  # type: ignore[arg-type]
        assert message in str(caught.value), caught.value
    assert not (tmp_path / "no").exists()
    with pytest.raises(FileNotFoundError, match="is not a run folder"):
        mackrl.Run(tmp_path)


def test_a_replay_is_checked_kept_and_shown(runs: dict[str, mackrl.Run], tmp_path: Path) -> None:
    replay = runs["2s3z"].replay(2)
    assert replay.actions.shape == (replay.summary["ep_length"], 5) and len(replay.rewards) == len(replay.actions)
    assert replay.thoughts[0] is not None and replay.thoughts[0]["pairs"]
    replay.save(tmp_path / "a.replay.gz")
    assert mackrl.Replay.load(tmp_path / "a.replay.gz").summary == replay.summary
    html = replay._repr_html_()
    assert html.startswith('<iframe sandbox="allow-scripts"') and html.count("srcdoc=") == 1
    assert "<!doctype html>" in replay.page().lower()
    with pytest.raises(ValueError, match="replay"):
        mackrl.Replay(replay.content[:-9])
    scripted = mackrl.play("3m", policy="kite", seed=2)
    assert scripted.thoughts == [None] * len(scripted.rewards)
    assert mackrl.play("3m", policy="kite", seed=2).content == scripted.content
    with pytest.raises(ValueError, match="expected one of `random`"):
        mackrl.play("3m", policy="run")
