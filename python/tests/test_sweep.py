"""Runs of a plan, made by the program for Python."""

from __future__ import annotations

import os
import shutil
from pathlib import Path

import pytest

import mackrl.sweep

ROOT = Path(__file__).parents[2]
PROGRAM = os.environ.get("MACKRL_PROGRAM") or shutil.which("mackrl") or str(ROOT / "target/debug/mackrl")
pytestmark = pytest.mark.skipif(
    not Path(PROGRAM).exists(), reason="the program is not built: `cargo build`, or set MACKRL_PROGRAM"
)
SETTINGS = """
[settings]
run.steps_env = 1500
run.metrics_interval_steps_env = 200
run.checkpoint_interval_steps_env = 500
algorithm.hidden = 8
test.episodes = 2
"""


@pytest.fixture
def plan(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> str:
    monkeypatch.chdir(tmp_path)
    Path("plan.toml").write_text('maps = ["3m"]\nalgorithms = ["central-v"]\nseeds = 2\n' + SETTINGS)
    return "plan.toml"


def test_a_run_is_made_and_each_row_is_reported_once(plan: str) -> None:
    told: list[mackrl.sweep.Row] = []
    last = mackrl.sweep.make(plan, 1, program=PROGRAM, report=told.append, pause_s=0.05)
    steps = [row["t_env"] for row in told]
    assert steps == sorted(set(steps)) and steps[-1] >= 1500
    assert told[-1] == last
    first, second = mackrl.sweep.entries(plan, program=PROGRAM)
    assert (first["state"], second["state"]) == ("waiting", "finished")
    assert mackrl.Run(second["folder"]).metrics()["t_env"].tolist() == steps
    assert mackrl.sweep.make(plan, 1, program=PROGRAM, pause_s=0.05) == last, "a finished run says the same"


def test_whoever_stops_listening_stops_the_run_which_goes_on_later(plan: str) -> None:
    class Enough(Exception):
        pass

    def stop(row: mackrl.sweep.Row) -> None:
        raise Enough

    Path(plan).write_text(Path(plan).read_text().replace("1500", "1000000000"))
    with pytest.raises(Enough):
        mackrl.sweep.make(plan, 0, program=PROGRAM, report=stop, pause_s=0.05)
    run = mackrl.sweep.entries(plan, program=PROGRAM)[0]
    assert run["state"] == "stopped" and run["checkpoint"] and run["where"] is None


def test_what_goes_wrong_is_told_as_the_program_tells_it(plan: str) -> None:
    with pytest.raises(mackrl.sweep.RunFailed, match="the plan has 2 runs"):
        mackrl.sweep.make(plan, 2, program=PROGRAM)
    with pytest.raises(mackrl.sweep.RunFailed, match="cannot read"):
        mackrl.sweep.entries("none.toml", program=PROGRAM)
    mackrl.sweep.make(plan, 0, program=PROGRAM, pause_s=0.05)
    folder = Path(mackrl.sweep.entries(plan, program=PROGRAM)[0]["folder"])
    (folder / "metrics.jsonl").write_text("")
    with pytest.raises(mackrl.sweep.RunFailed, match="metrics.jsonl is not what run.json says"):
        mackrl.sweep.make(plan, 0, program=PROGRAM, pause_s=0.05)
