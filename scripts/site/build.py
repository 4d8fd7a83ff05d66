"""Builds the documentation site into target/site, and checks it.

    python3 -m venv target/site-venv && target/site-venv/bin/pip install -r scripts/site/requirements.txt
    cargo doc --workspace --no-deps
    target/site-venv/bin/python scripts/site/build.py

Pages are those of docs/, and what they link to in the repository (DEVIATIONS.md, pages of results, …), which is copied beside them.
Then every link of every page has to lead somewhere, and nothing may be loaded from another host.
"""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

ROOT = Path(__file__).resolve().parents[2]
STAGE = ROOT / "target" / "site-stage"
SITE = ROOT / "target" / "site"
RUSTDOC = ROOT / "target" / "doc"
# Pages of docs/ keep their place; other files of the repository stand below this folder.
OUTSIDE = "repository"
# Pages that the navigation names and no page links to.
ALWAYS = ["DEVIATIONS.md", "PAPER.md", "CHANGELOG.md", "CONTRIBUTING.md", "ARCHITECTURE.md", "python/mackrl", "CITATION.cff"]

FENCE = re.compile(r"^(```.*?^```[^\n]*$)", re.MULTILINE | re.DOTALL)
LINK = re.compile(r"(\]\()([^)\s]+)(\))|((?:src|href)=\")([^\"]+)(\")")
DIRECTIVE = re.compile(r"^<!--.*?-->\n", re.MULTILINE | re.DOTALL)
# What a tag loads by itself, so that a reader's browser asks that host without being told to.
LOADS = {("script", "src"), ("img", "src"), ("iframe", "src"), ("source", "src"), ("video", "src"), ("link", "href"), ("use", "href"), ("object", "data")}
IN_STYLES = re.compile(r"url\(\s*['\"]?(?:https?:)?//|@import\s+(?:url\()?['\"]?(?:https?:)?//")


def place(file: Path) -> Path:
    """Where a file of the repository stands among the pages."""
    path = file.relative_to(ROOT)
    return path.relative_to("docs") if path.parts[0] == "docs" else OUTSIDE / path


def stage() -> None:
    """Copies all pages, and what they link to, with links that are right in the new place."""
    shutil.rmtree(STAGE, ignore_errors=True)
    waiting = [file for file in sorted((ROOT / "docs").rglob("*")) if file.is_file()]
    waiting += [ROOT / name for name in ALWAYS if (ROOT / name).is_file()]
    seen = set(waiting)

    def follow(page: Path, target: str) -> str:
        """The link `target` of `page` as it is to be among the pages."""
        parts = urlsplit(target)
        if parts.scheme or parts.netloc or not parts.path or target.startswith("rust/") or "/rust/" in target:
            return target
        file = (page.parent / unquote(parts.path)).resolve()
        if file.is_dir():
            file /= "README.md"
        if not file.is_file() or ROOT not in file.parents:
            sys.exit(f"{page.relative_to(ROOT)}: the link {target} leads nowhere")
        if file not in seen:
            seen.add(file)
            waiting.append(file)
        moved = os.path.relpath(place(file), place(page).parent)
        return moved + (f"#{parts.fragment}" if parts.fragment else "")

    while waiting:
        file = waiting.pop(0)
        there = STAGE / "docs" / place(file)
        there.parent.mkdir(parents=True, exist_ok=True)
        if file.suffix != ".md":
            shutil.copyfile(file, there)
            continue

        def moved(link: re.Match[str], page: Path = file) -> str:
            before, target, after = link.groups()[:3] if link[2] else link.groups()[3:]
            return before + follow(page, target) + after

        # Blocks of code stay as they are.
        parts = FENCE.split(file.read_text())
        text = "".join(part if part.startswith("```") else LINK.sub(moved, DIRECTIVE.sub("", part)) for part in parts)
        there.write_text(text)
    shutil.copyfile(ROOT / "mkdocs.yml", STAGE / "mkdocs.yml")
    (STAGE / "python").symlink_to(ROOT / "python")


class Page(HTMLParser):
    """Links, anchors and loaded things of a page."""

    def __init__(self) -> None:
        super().__init__()
        self.links: list[str] = []
        self.loads: list[str] = []
        self.anchors: set[str] = set()
        self.styles: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        named = {name: value or "" for name, value in attrs}
        self.anchors.update(named[name] for name in ("id", "name") if name in named)
        self.styles.append(named.get("style", ""))
        for name, value in named.items():
            # Where else the page stands is said, and not loaded.
            if (tag, name) in LOADS and named.get("rel") not in ("canonical", "prev", "next"):
                self.loads.append(value)
            elif (tag, name) == ("a", "href"):
                self.links.append(value)

    def handle_data(self, data: str) -> None:
        self.styles.append(data)


def read(file: Path) -> Page:
    page = Page()
    page.feed(file.read_text())
    return page


def check() -> int:
    """Names every fault of the built site; gives their number."""
    pages = {file: read(file) for file in sorted(SITE.rglob("*.html"))}
    faults = []
    for file, page in pages.items():
        name = file.relative_to(SITE)
        of_rust = name.parts[0] == "rust"
        faults += [f"{name}: loads {url} from another host" for url in page.loads if urlsplit(url).netloc]
        faults += [f"{name}: a style loads from another host: {text[:80]}" for text in page.styles if IN_STYLES.search(text)]
        # Cargo has checked the links of rustdoc.
        for url in [] if of_rust or name.name == "404.html" else page.links + page.loads:
            parts = urlsplit(url)
            if parts.scheme or parts.netloc:
                continue
            target = (file.parent / unquote(parts.path)).resolve() if parts.path else file
            if target.is_dir():
                target /= "index.html"
            if not target.is_file():
                faults.append(f"{name}: the link {url} leads nowhere")
            elif parts.fragment and target in pages and unquote(parts.fragment) not in pages[target].anchors:
                faults.append(f"{name}: the link {url} leads to no heading")
    for file in SITE.rglob("*.css"):
        if IN_STYLES.search(file.read_text()):
            faults.append(f"{file.relative_to(SITE)}: loads from another host")
    for fault in faults:
        print(fault, file=sys.stderr)
    print(f"{len(pages)} pages, {len(faults)} faults")
    return len(faults)


def main() -> None:
    stage()
    shutil.rmtree(SITE, ignore_errors=True)
    subprocess.run([Path(sys.executable).parent / "zensical", "build", "--strict", "--clean"], cwd=STAGE, check=True)
    shutil.move(STAGE / "site", SITE)
    shutil.copytree(RUSTDOC, SITE / "rust")
    sys.exit(1 if check() else 0)


if __name__ == "__main__":
    main()
