"""What the documents say is run: worked examples, scene files, links, ids."""

import json
import re
import subprocess
import sys
from pathlib import Path

import pytest

from rayproof.cases.scene_json import scene_from_json

CHECKOUT = Path(__file__).parents[1]
PAGES = sorted([*CHECKOUT.glob("*.md"), *(CHECKOUT / "docs").glob("*.md")])


def blocks(page: str, language: str) -> list[str]:
    """Return the fenced blocks of a page in one language."""
    return re.findall(rf"^```{language}\n(.*?)^```", (CHECKOUT / page).read_text(), re.MULTILINE | re.DOTALL)


def test_the_example_scenes_are_valid() -> None:
    scenes = blocks("docs/scene.md", "json")

    assert scenes
    for text in scenes:
        scene_from_json(json.loads(text), None, "docs/scene.md")


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_links_lead_somewhere(page: Path) -> None:
    targets = re.findall(r"\]\((?!https?:)([^)#]+)", page.read_text())

    assert [target for target in targets if not (page.parent / target).exists()] == []


@pytest.mark.parametrize("page", [page for page in PAGES if page.parent.name == "docs"], ids=lambda page: page.name)
def test_a_page_begins_with_its_title(page: Path) -> None:
    title, empty = page.read_text().split("\n")[:2]

    assert title.startswith("# ")
    assert not empty


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_every_row_of_a_table_belongs_to_a_table(page: Path) -> None:
    # A blank line ends a table, and a row after it is shown as words between bars. No other test reads tables.
    lines = re.sub(r"^```.*?^```", "", page.read_text(), flags=re.MULTILINE | re.DOTALL).split("\n")
    heads = [
        row
        for above, row, below in zip(lines, lines[1:], lines[2:], strict=False)
        if row[:1] == "|" and not above and "---" not in below
    ]

    assert heads == []
    assert "\n\n\n" not in re.sub(r"^```.*?^```", "code", page.read_text(), flags=re.MULTILINE | re.DOTALL)


def test_the_page_on_the_architecture_names_every_folder() -> None:
    section = (CHECKOUT / "docs" / "architecture.md").read_text().split("## Folders", 1)[1].split("\n## ", 1)[0]
    packages = ("cases", "tracer", "reference", "reports")
    folders = {file.parent.name for package in packages for file in (CHECKOUT / package).rglob("__init__.py")}

    assert sorted(folder for folder in folders if f"{folder}/" not in section) == []


@pytest.mark.process
def test_the_renderer_in_one_line_passes() -> None:
    (code,) = re.findall(r'^    \.venv/bin/python -c "(.*)"$', (CHECKOUT / "docs/python.md").read_text(), re.MULTILINE)

    said = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True).stdout

    assert said.splitlines()[-1] == "1 case planned, 1 measured, 0 unsupported: pass"
