"""A name, a message and a program's output are text at every door: no line of their own, no control, no direction."""

import base64
import json
import re
import zlib
from pathlib import Path
from xml.etree import ElementTree

import pytest

from rayproof.reports.commands.output import say, show_table
from rayproof.reports.publish import publish_all
from rayproof.reports.results.document import save_results
from rayproof.reports.results.files import legible, legible_json
from rayproof.reports.results.images import handed_over
from rayproof.reports.run.progress import CaseProgress, worst_first
from rayproof.reports.run.scenes import cases_of_files
from rayproof.reports.terminal import console
from tests.reports.checks import recorded
from tests.reports.publish.sample import make_folder

NAME = "ok\n::error title=a::b\r\n::add-mask::c\x1b[31m\x9b1m\u202etxt.exe\u2066 [bold]x[/bold] :warning: \u2028."
NONE = "\N{REPLACEMENT CHARACTER}"
OBEYED = re.compile("[\x00-\x09\x0b-\x1f\x7f-\x9f\u061c\u200e\u200f\u2028-\u202e\u2066-\u2069]")


def harmless(text: str) -> bool:
    """Return whether nothing in `text` is obeyed, no line is a command of its own, and markup is still there."""
    commands = [line for line in text.splitlines() if line.lstrip().startswith(("::error title=a", "::add-mask"))]
    return not OBEYED.search(text) and not commands


@pytest.fixture
def record() -> dict[str, object]:
    """Return a case as a run tells of it."""
    return {
        "name": NAME,
        "verdict": "fail",
        "reason": NAME,
        "stage": NAME,
        "item": NAME,
        "seconds": 1.0,
        "checks": [recorded(configuration=NAME, reference="r", stage="ray", ratio=2.0)],
    }


def test_a_text_is_one_line_of_printable_characters() -> None:
    assert legible("ein Würfel, 立方体 ✓") == "ein Würfel, 立方体 ✓"
    assert legible("a\nb\tc\x1b[1m\u202ed\ud800") == f"a b c{NONE}[1m{NONE}d{NONE}"
    texts = ["\x1b", "\\u001b", "\\\u202e", "two\nlines"]
    assert json.loads(legible_json(json.dumps(texts))) == [NONE, "\\u001b", f"\\{NONE}", "two\nlines"]


def test_the_terminal_gets_no_more_than_text(record, capsys: pytest.CaptureFixture[str]) -> None:
    say(NAME)
    show_table("title", ["column"], [[NAME]])
    with CaseProgress(console(), total=1) as progress:
        progress.finished(record, again=False)
    console().print(worst_first([record]))

    said = capsys.readouterr().out
    assert harmless(said)
    assert said.count("[bold]x[/bold]") >= 4
    assert ":warning:" in said


def test_a_scene_file_s_name_is_made_one_where_it_becomes_a_case_s(tmp_path: Path) -> None:
    file = tmp_path / f"{NAME.replace('/', '')}.json"
    camera = {"eye": [0, 0, 4], "target": [0, 0, 0], "up": [0, 1, 0], "fovy": 40, "width": 2, "height": 2}
    file.write_text(json.dumps({"camera": camera | {"near": 1, "far": 9}, "shapes": []}))

    (case,) = cases_of_files([file])

    assert case.name.isprintable()
    assert case.stresses.isprintable()


def test_everything_published_is_harmless(tmp_path: Path) -> None:
    results = make_folder(tmp_path)
    for case in results["cases"]:
        case |= {"name": f"evil/{NAME}", "family": NAME, "verdict": "fail", "reason": NAME, "item": NAME}
    results |= {"subject": NAME, "faults": [NAME], "environment": {"machine": NAME}}
    results["summary"] |= {"fail": len(results["cases"]), "planned": len(results["cases"])}
    save_results(tmp_path, results)

    publish_all(tmp_path)  # as `rayproof report` reads it
    publish_all(tmp_path, results)  # as a run hands it over

    for name in ("annotations.txt", "summary.md", "badge.svg", "index.html", "junit.xml"):
        assert harmless((tmp_path / name).read_text(encoding="utf-8")), name
    suites = ElementTree.parse(tmp_path / "junit.xml").getroot()
    assert all(test.attrib["name"].isprintable() for test in suites.iter("testcase"))
    assert all(failure.attrib["message"].isprintable() for failure in suites.iter("failure"))
    page = (tmp_path / "index.html").read_text(encoding="utf-8")
    (data,) = re.findall('id="results">(.*)</script>', page)
    assert not OBEYED.search(str(json.loads(data)).replace("\\n", ""))
    stored = json.loads(handed_over((tmp_path / "data" / "0001.js").read_text()))
    assert "\\u202e" not in zlib.decompress(base64.b64decode(stored)).decode()
