"""What the pages show works: their blocks of Python are run, one page after the other in one place."""

from __future__ import annotations

import re
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PAGES = ["README.md", "python/README.md", "docs/python.md", "docs/python-interfaces.md", "docs/python-teams.md"]


def blocks(page: str) -> str:
    found = re.findall(r"^```python\n(.*?)^```", (ROOT / page).read_text(), re.MULTILINE | re.DOTALL)
    # What takes a while to win is not waited for here.
    return "\n".join(found).replace("200_000", "2_000")


@pytest.mark.parametrize("page", PAGES)
@pytest.mark.filterwarnings("ignore")
def test_the_code_of_a_page_runs(page: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    text = blocks(page)
    assert text.count("\n") > 5
    exec(compile(text, page, "exec"), {"__name__": page})


@pytest.mark.parametrize("page", PAGES)
def test_links_of_a_page_lead_somewhere(page: str) -> None:
    folder = (ROOT / page).parent
    links = re.findall(r"\]\(([^)#]+?)(?:#[^)]*)?\)", (ROOT / page).read_text())
    assert links
    missing = [link for link in links if "://" not in link and not (folder / link).exists()]
    assert not missing
