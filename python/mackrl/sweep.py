"""Runs of a plan as tasks of Ray, or of anything else that starts functions on many machines.

The plan is that of ``mackrl sweep``, whose program does the work: it has to be installed on every machine, and the run folders have to
lie on a disk that all of them share. A run that was interrupted goes on where it was, wherever it is begun again.
"""

from __future__ import annotations

import json
import os
import subprocess
import tempfile
import time
from collections.abc import Callable, Iterator, Mapping
from pathlib import Path
from typing import Any

__all__ = ["Again", "RunFailed", "entries", "make", "remote", "trainable"]

_AGAIN = 75
"""Exit code of a program that did not come to the end of its run, and could if it were started again."""

Row = dict[str, Any]


class Again(RuntimeError):
    """The run is not finished, and goes on when it is begun again."""


class RunFailed(RuntimeError):
    """The run has failed, and would fail again."""


def entries(
    plan: str | os.PathLike[str], *, out: str | os.PathLike[str] | None = None, program: str = "mackrl"
) -> list[dict[str, Any]]:
    """All runs of a plan and how each stands, as ``mackrl sweep PLAN --list --json`` tells it.

    Args:
        plan: the plan's file.
        out: the folder of the run folders, if not the plan's own.
        program: the program ``mackrl``.

    Raises:
        RunFailed: if the plan cannot be read.
    """
    return _list(_command(program, plan, out), Path.cwd())


def make(
    plan: str | os.PathLike[str],
    index: int,
    *,
    out: str | os.PathLike[str] | None = None,
    program: str = "mackrl",
    folder: str | os.PathLike[str] | None = None,
    report: Callable[[Row], object] | None = None,
    pause_s: float = 1.0,
) -> Row:
    """Makes a run to its end, in a process of its own on one thread, and gives its last row of metrics.

    Args:
        plan: the plan's file.
        index: number of the run in the plan, from 0 on.
        out: the folder of the run folders, if not the plan's own.
        program: the program ``mackrl``.
        folder: where relative paths begin; the working folder otherwise.
        report: is called with every row of metrics, from the first of the run on, once each.
        pause_s: seconds between two looks at the metrics.

    Raises:
        Again: if the run was interrupted, or another process makes it.
        RunFailed: if it failed, with what the program said.
    """
    folder = Path.cwd() if folder is None else Path(folder)
    plan = folder / plan
    sweep = _command(program, plan, out)
    runs = _list(sweep, folder)
    if not 0 <= index < len(runs):
        raise RunFailed(f"the plan has {len(runs)} runs, expected an index from 0 to {len(runs) - 1}: {index}")
    rows = _Rows(folder / runs[index]["folder"] / "metrics.jsonl")
    command = [*sweep, "--index", str(index), "--threads", "1", "--leashed"]
    last: Row = {}

    def tell() -> None:
        nonlocal last
        for row in rows:
            last = row
            if report is not None:
                report(row)

    with tempfile.TemporaryFile("w+") as said:
        # When this process ends, however that comes, the pipe breaks, and the program writes a checkpoint and stops.
        with subprocess.Popen(
            command, cwd=folder, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=said
        ) as process:
            try:
                while process.poll() is None:
                    tell()
                    time.sleep(pause_s)
            finally:
                if process.stdin is not None:
                    process.stdin.close()
                process.wait()
        said.seek(0)
        message = _error(said.read())
    if process.returncode == _AGAIN or process.returncode < 0:
        raise Again(message)
    if process.returncode != 0:
        raise RunFailed(message)
    tell()
    return last


def trainable(
    plan: str | os.PathLike[str],
    index: int | None = None,
    *,
    out: str | os.PathLike[str] | None = None,
    program: str = "mackrl",
) -> Callable[[Mapping[str, Any]], None]:
    """A function for Ray Tune that makes a run and reports every row of its metrics. Tune wants every metric in every report: those that a row
    does not have, such as those of tests, keep their latest value.

    Which run that is stands in ``index``, or in Tune's configuration: ``{"index": tune.grid_search([0, 1, 2])}``. With
    ``FailureConfig(max_failures=-1)`` a run whose node dies goes on at its last checkpoint on another.

    Args:
        plan: the plan's file.
        index: number of the run in the plan.
        out: the folder of the run folders, if not the plan's own.
        program: the program ``mackrl``.
    """
    folder = Path.cwd()

    def run(config: Mapping[str, Any]) -> None:
        from ray import tune

        latest: Row = {}

        def report(row: Row) -> None:
            latest.update(row)
            tune.report(dict(latest))

        number = config["index"] if index is None else index
        make(plan, number, out=out, program=program, folder=folder, report=report)

    run.__name__ = Path(plan).stem
    return run


def remote(plan: str | os.PathLike[str], index: int, *, cpus: float = 1, **options: Any) -> Any:
    """Starts ``make`` as a task of Ray, and gives what ``ray.get`` waits for.

    The task is begun again, on any node, as often as the run is interrupted or its node dies.

    Args:
        plan: the plan's file.
        index: number of the run in the plan.
        cpus: processors that the task takes.
        options: further arguments of ``make``.
    """
    import ray

    task = ray.remote(num_cpus=cpus, max_retries=-1, retry_exceptions=[Again])(make)
    return task.remote(plan, index, folder=Path.cwd(), **options)


class _Rows:
    """The rows of metrics that are new since the last look."""

    def __init__(self, file: Path) -> None:
        self._file = file
        self._steps = -1

    def __iter__(self) -> Iterator[Row]:
        try:
            text = self._file.read_text()
        except FileNotFoundError:
            return
        # The last line may still be being written.
        for line in text.splitlines(keepends=True):
            if not line.endswith("\n"):
                return
            row: Row = json.loads(line)
            # After an interruption some rows are written again, the same ones.
            if row["t_env"] > self._steps:
                self._steps = row["t_env"]
                yield row


def _command(program: str, plan: str | os.PathLike[str], out: str | os.PathLike[str] | None) -> list[str]:
    own = [program, "sweep", os.fspath(plan)]
    return own if out is None else [*own, "--out", os.fspath(out)]


def _list(command: list[str], folder: Path) -> list[dict[str, Any]]:
    done = subprocess.run([*command, "--list", "--json"], cwd=folder, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        raise RunFailed(_error(done.stderr))
    found: list[dict[str, Any]] = json.loads(done.stdout)
    return found


def _error(said: str) -> str:
    """The line in which the program says what went wrong."""
    lines = [line.removeprefix("error: ") for line in said.splitlines() if line.startswith("error: ")]
    return lines[-1] if lines else said.strip() or "the program ended without a word"
