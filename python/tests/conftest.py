"""What tests share: short runs, trained once."""

from __future__ import annotations

from pathlib import Path

import pytest

import mackrl

# Small enough for seconds, and every level of the hierarchy at work.
SHORT = {
    "preset": "paper-code",
    "algorithm": "mackrl",
    "steps": 600,
    "settings": {"test.episodes": 8, "algorithm.common_knowledge": "complete"},
    "progress": False,
}


@pytest.fixture(scope="session")
def runs(tmp_path_factory: pytest.TempPathFactory) -> dict[str, mackrl.Run]:
    """A short run on each of two maps."""
    folder: Path = tmp_path_factory.mktemp("runs")
    return {name: mackrl.train(name, out=folder / name, **SHORT) for name in ("3m", "2s3z")}


@pytest.fixture(scope="session")
def default_runs(tmp_path_factory: pytest.TempPathFactory) -> dict[str, mackrl.Run]:
    """The same of the default preset; in ``held`` a pair is formed for several steps, and its controller remembers."""
    folder: Path = tmp_path_factory.mktemp("default")
    held = {"algorithm.hold_steps_env": 3}
    return {
        name: mackrl.train(
            "3m" if name == "held" else name,
            steps=1500,
            out=folder / name,
            settings={"test.episodes": 4, **(held if name == "held" else {})},
            progress=False,
        )
        for name in ("3m", "2s3z", "held")
    }
