"""Every example and every Python block of the documentation runs."""

from __future__ import annotations

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

pytest.importorskip("mujoco")
pytest.importorskip("evo")
pytest.importorskip("matplotlib")

ROOT = Path(__file__).resolve().parents[2]
EXAMPLES = sorted((ROOT / "examples" / "python").glob("*.py"))
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
BLOCK = re.compile(r"^```python\n(.*?)^```$", re.MULTILINE | re.DOTALL)
LINK = re.compile(r"(?:\]\(|src=\")([^)\s\"]+)")
OUTPUT = re.compile(r"^# -> (.*)$", re.MULTILINE)


def code_of(page: Path) -> str:
    """The Python blocks of a page, one after the other, as one program with the lines of the page.

    Blocks go on where the last one ended: a page is read from top to bottom.
    """
    text = page.read_text(encoding="utf-8")
    program = ["" for _ in text.splitlines()]
    for block in BLOCK.finditer(text):
        first = text.count("\n", 0, block.start(1))
        lines = block.group(1).splitlines()
        program[first : first + len(lines)] = lines
    return "\n".join(program) + "\n"


PAGES_WITH_CODE = [page for page in PAGES if code_of(page).strip()]


def run(code: Path, directory: Path) -> str:
    """What a program prints; it runs in ``directory`` and draws on no screen."""
    finished = subprocess.run(
        [sys.executable, "-W", "error::DeprecationWarning:__main__", code],
        cwd=directory,
        env=os.environ | {"MPLBACKEND": "agg"},
        capture_output=True,
        text=True,
        timeout=600,
    )
    assert finished.returncode == 0, finished.stderr
    return finished.stdout


def test_there_are_examples() -> None:
    assert EXAMPLES
    assert ROOT / "README.md" in PAGES_WITH_CODE
    assert ROOT / "docs" / "python.md" in PAGES_WITH_CODE


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.stem)
def test_example(example: Path, tmp_path: Path) -> None:
    assert run(example, tmp_path).strip()


@pytest.mark.parametrize("page", PAGES_WITH_CODE, ids=lambda path: path.stem)
def test_page(page: Path, tmp_path: Path) -> None:
    """The blocks run, and print what their lines ``# -> ...`` say."""
    code = code_of(page)
    program = tmp_path / f"{page.stem}.py"
    program.write_text(code, encoding="utf-8")
    printed = run(program, tmp_path).splitlines()
    assert printed == OUTPUT.findall(code)


@pytest.mark.parametrize("page", PAGES, ids=lambda path: path.stem)
def test_links(page: Path) -> None:
    """Every relative link of a page leads to a file, or to a heading of one."""
    for target in LINK.findall(page.read_text(encoding="utf-8")):
        if "://" in target:
            continue
        path, _, heading = target.partition("#")
        linked = page.parent / path if path else page
        assert linked.exists(), f"{page.name} links to {target}"
        if heading:
            assert heading in anchors(linked), f"{page.name} links to {target}"


def anchors(page: Path) -> set[str]:
    """The headings of a page as GitHub names them in links."""
    headings = re.findall(r"^#+ (.*)$", page.read_text(encoding="utf-8"), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}
