"""Progress of a run in a notebook, in a terminal, or to a function."""

from __future__ import annotations

import sys
import time
import warnings
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from typing import Any

_SECONDS_BETWEEN = 0.2


@contextmanager
def shown(progress: Any, make: Callable[..., Any]) -> Iterator[Callable[..., object]]:
    """Gives what the native part reports to: (steps, steps in all, share of battles won), or a warning's text."""
    listen: Callable[[Any], object] | None = None
    bar: _Bar | None = None
    if callable(progress):
        listen = progress
    elif progress is not False:
        bar = _notebook() or (_Terminal() if progress or sys.stderr.isatty() else None)
        listen = bar

    def report(*news: Any) -> None:
        if len(news) == 1:
            warnings.warn(news[0], RuntimeWarning, stacklevel=4)
        elif listen is not None:
            listen(make(*news))

    try:
        yield report
    finally:
        if bar is not None:
            bar.end()


class _Bar:
    """A bar that is drawn a few times a second."""

    def __init__(self) -> None:
        self._start = time.monotonic()
        self._drawn = 0.0
        self._latest: Any = None

    def __call__(self, progress: Any) -> None:
        self._latest = progress
        now = time.monotonic()
        if now - self._drawn >= _SECONDS_BETWEEN:
            self._drawn = now
            self.draw(*self._told())

    def end(self) -> None:
        if self._latest is not None:
            self.draw(*self._told())

    def _told(self) -> tuple[float, str]:
        """The share that is done, and a line about it."""
        now, seconds = self._latest, time.monotonic() - self._start
        share = min(1.0, now.steps / max(1, now.steps_total))
        won = "" if now.battle_won is None else f", {100 * now.battle_won:.0f} % of the test's battles won"
        return share, f"{now.steps:,} of {now.steps_total:,} steps in {seconds:.0f} s{won}"

    def draw(self, share: float, line: str) -> None:
        raise NotImplementedError


class _Terminal(_Bar):
    def draw(self, share: float, line: str) -> None:
        print(f"\r\033[K[{'#' * round(20 * share):20}] {line}", end="", file=sys.stderr, flush=True)

    def end(self) -> None:
        super().end()
        print(file=sys.stderr)


def _notebook() -> _Bar | None:
    """A bar in the running cell, if this is a notebook."""
    shell = getattr(sys.modules.get("IPython"), "get_ipython", lambda: None)()
    if type(shell).__name__ != "ZMQInteractiveShell":
        return None
    from IPython.display import HTML, display

    class Cell(_Bar):
        handle: Any = None

        def draw(self, share: float, line: str) -> None:
            html = HTML(f'<progress value="{share:.3f}" style="width:20em"></progress> {line}')
            if self.handle is None:
                self.handle = display(html, display_id=True)
            else:
                self.handle.update(html)

    return Cell()
