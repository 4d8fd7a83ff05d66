"""What the pages show works: their blocks of Python are run, one page after the other in one place, and print what the pages say.

A comment above a block tells what the page leaves out, as `crates/mackrl-cli/tests/documents/main.rs` explains. With `INSTA_UPDATE=always`
outputs and pictures are written anew.
"""

from __future__ import annotations

import contextlib
import io
import os
import re
import shutil
import sys
from pathlib import Path
from typing import Any

import pytest


ROOT = Path(__file__).parents[2]
BLOCK = re.compile(r"^(?:<!-- ([^\n]*) -->\n)?```(\w+)[^\n]*\n(.*?)^```", re.MULTILINE | re.DOTALL)


def has_python(page: Path) -> bool:
    return any(language == "python" for _, language, _ in BLOCK.findall(page.read_text()))


PAGES = sorted(str(page.relative_to(ROOT)) for page in (ROOT / "docs").rglob("*.md"))
PROGRAMS = [page for page in ["README.md", "python/README.md", *PAGES] if has_python(ROOT / page)]


def to_run(directive: str, text: str) -> str:
    """A block with what its page says is to be replaced."""
    if directive.startswith("with: "):
        for pair in directive.removeprefix("with: ").split("; "):
            before, after = pair.split(" = ")
            assert before in text
            text = text.replace(before, after)
    # What takes a while to win is not waited for here.
    return text.replace("200_000", "2_000")


def expect_same(file: Path, before: str, after: str) -> None:
    """Compares a part of a file with what it should be, or writes it anew."""
    if before != after and os.environ.get("INSTA_UPDATE") == "always":
        file.write_text(file.read_text().replace(before, after, 1) if before else after)
    else:
        assert before == after, f"{file}: INSTA_UPDATE=always pytest python/tests/test_documents.py"


@pytest.mark.parametrize("page", PROGRAMS)
@pytest.mark.filterwarnings("ignore")
def test_the_code_of_a_page_runs(page: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    shutil.copytree(ROOT / "zoo", tmp_path / "zoo")
    names: dict[str, Any] = {"__name__": page}
    printed: str | None = None
    for directive, language, text in BLOCK.findall((ROOT / page).read_text()):
        if language == "python" and not directive.startswith("not run: "):
            said = io.StringIO()
            with contextlib.redirect_stdout(said):
                exec(compile(to_run(directive, text), page, "exec"), names)
            printed = said.getvalue()
        elif directive.startswith("output") and printed is not None:
            shown = "".join(f"{line.rstrip()}\n" for line in printed.splitlines())
            expect_same(ROOT / page, f"{directive} -->\n```text\n{text}```", f"{directive} -->\n```text\n{shown}```")
        elif language == "sh":
            printed = None


def test_pages_have_programs() -> None:
    assert len(PROGRAMS) >= 8


@pytest.mark.parametrize("page", [*PROGRAMS, *PAGES])
def test_links_of_a_page_lead_somewhere(page: str) -> None:
    folder = (ROOT / page).parent
    links = re.findall(r"\]\(([^)#]+?)(?:#[^)]*)?\)", (ROOT / page).read_text())
    # Beside the pages of the site stand those of Rust, which are no files of the repository.
    missing = [link for link in links if "://" not in link and "../rust/" not in link and not (folder / link).exists()]
    assert not missing


def test_the_picture_of_the_matrix_game_is_that_of_its_team(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.syspath_prepend(str(ROOT / "python" / "examples"))
    import matrix_game_policies  # type: ignore[import-not-found]

    picture = ROOT / "docs" / "matrix-game-policies.svg"
    drawn = matrix_game_policies.picture(matrix_game_policies.trained(tmp_path / "run"))
    expect_same(picture, picture.read_text(), drawn)
    sys.modules.pop("matrix_game_policies")
