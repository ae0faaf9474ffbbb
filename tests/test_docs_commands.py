"""The commands that the documents show exist, with the options that are shown; the tutorial's are run."""

import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest
from cyclopts import CycloptsError

from rayproof.reports.cli import application, main

CHECKOUT = Path(__file__).parents[1]
PAGES = [CHECKOUT / "README.md", CHECKOUT / "CONTRIBUTING.md", *sorted((CHECKOUT / "docs").glob("*.md"))]
LINE = re.compile(r"^    (?:\./)?rayproof ([a-z].*)$|^\./rayproof ([a-z].*)$", re.MULTILINE)
# What stands for a value in a line that shows how a command is written.
VALUES = {"N": "3", "S": "3", "W": "3", "H": "3", "X": "3", "Y": "3", "P": "float32", "x0,y0,x1,y1": "0,0,2,2"}
WRITTEN = re.compile(r"[\[\]|…]|\.\.\.(?=\s|$)")  # of a line that says how commands are written: options in brackets


def commands(page: Path) -> list[str]:
    """Return the commands on a page, without comments; lines that only say how a command is written are left out."""
    found = [one or other for one, other in LINE.findall(page.read_text().replace("\\\n", " "))]
    found = [re.sub(r"\s+#.*| \|\| true$|\s{3,}[^-\s].*", "", line) for line in found]
    return [line for line in found if not WRITTEN.search(line) and not line.startswith("test")]


SHOWN = [(page.name, line) for page in PAGES for line in commands(page)]


@pytest.mark.parametrize(("page", "line"), SHOWN, ids=[f"{page}: {line[:60]}" for page, line in SHOWN])
def test_a_command_that_is_shown_exists_with_its_options(page: str, line: str) -> None:
    words = [VALUES.get(word, word) for word in shlex.split(line)]

    try:
        application().parse_args(words, exit_on_error=False, print_error=False)
    except CycloptsError as error:
        pytest.fail(f"{page}: {line}: {error}")


@pytest.mark.process
@pytest.mark.timeout(600)  # 25 s of one idle processor
def test_the_readme_s_commands_run_in_order_as_they_stand(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    # What follows the two commands at the top, in a folder that has of a checkout what the lines name.
    (tmp_path / "examples").symlink_to(CHECKOUT / "examples")
    (tmp_path / ".venv").symlink_to(sys.prefix)
    monkeypatch.chdir(tmp_path)
    lines = re.findall(r"^    \./rayproof (.*)$", (CHECKOUT / "README.md").read_text(), re.MULTILINE)

    codes = {line: main(shlex.split(line.removesuffix(" || true"))) for line in lines}

    assert len(lines) >= 6
    assert {code for line, code in codes.items() if not line.endswith(" || true")} == {0}
    assert {code for line, code in codes.items() if line.endswith(" || true")} == {1}  # there is something to accept
    assert '"reason": "Mitsuba draws sheared spheres wrong."' in (tmp_path / "known.json").read_text()


@pytest.mark.process
@pytest.mark.timeout(1200)  # 30 s of one idle processor
def test_the_tutorial_about_a_renderer_leads_from_a_pass_to_a_failure_and_its_repair(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    # Nothing else notices if the starter changes so that the page's code no longer fits into it.
    (tmp_path / ".venv").symlink_to(sys.prefix)
    monkeypatch.chdir(tmp_path)
    page = (CHECKOUT / "docs" / "first_renderer.md").read_text()
    trace, repair = re.findall(r"^```python\n(.*?)^```", page, re.MULTILINE | re.DOTALL)
    new, first, stretched, *_ = commands(CHECKOUT / "docs" / "first_renderer.md")
    renderer = Path("renderer.py")
    patient = ["--timeout", "500"]  # s, where many tests share a processor

    assert main(shlex.split(new)) == 0
    assert main([*shlex.split(first), *patient]) == 0
    starter = renderer.read_text()
    start = re.sub(r"^def trace\(.*?(?=^def render\()", lambda _: f"{trace}\n\n", starter, flags=re.M | re.S)
    start = start.replace("import json\n", "import json\n\nimport numpy\n", 1)
    wrong = start.replace('"affine": False,', '"affine": True,')
    (line,) = [line for line in wrong.splitlines(keepends=True) if line.strip().startswith("normal = matrix")]
    renderer.write_text(wrong)
    assert main([*shlex.split(stretched), *patient]) == 1
    assert "turns normals by the model matrix instead of its inverse transpose" in capsys.readouterr().out
    renderer.write_text(wrong.replace(line, repair))
    assert main([*shlex.split(stretched), *patient]) == 0


RIGHT = """
from rayproof.cases.scene_json import load_scene
from rayproof.cases.stages import Stage
from rayproof.reference.analytic import Analytic

image = Analytic().render(load_scene(Path(sys.argv[1])), (Stage.RADIANCE,))[Stage.RADIANCE].astype("<f4")
header"""


@pytest.mark.process
@pytest.mark.timeout(600)  # 30 s of one idle processor
def test_the_way_from_the_readme_to_a_green_a_red_and_a_repaired_gate(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    (tmp_path / "examples").symlink_to(CHECKOUT / "examples")
    (tmp_path / ".venv").symlink_to(sys.prefix)
    monkeypatch.chdir(tmp_path)
    place = "examples/findings/plain_mitsuba.py"
    first, accept, gated = re.findall(
        r"^    \./rayproof (.*gated.*)$", (CHECKOUT / "README.md").read_text(), re.MULTILINE
    )
    renderer, wrong = tmp_path / "mine.py", (CHECKOUT / place).read_text()

    def run(line: str, program: str) -> tuple[int, str, str]:
        """Run a line of the README with a program of one's own; return exit code, last line and the badge's words."""
        renderer.write_text(program)
        code = main(shlex.split(line.removesuffix(" || true").replace(place, "mine.py")))
        (badge,) = re.findall("<title>rayproof: (.*)</title>", (tmp_path / "gated" / "badge.svg").read_text())
        line, words = re.subn(
            r"; \d+ of \d+ checks of images answered \(radiance only\)", "", capsys.readouterr().out.splitlines()[-1]
        )
        badge, more = re.subn(r", \d+ % answered", "", badge)  # how many depends on the references that are installed
        assert words == more == 1
        return code, line, badge

    assert run(first, wrong) == (1, "fail: gated/index.html", "fail: 0 of 1 pass")
    assert main(shlex.split(accept)) == 0
    green = run(gated, wrong)
    assert green == (0, "gate green; cases: fail: gated/index.html", "gate green: 0 of 1 pass, 1 known to fail")
    worse = wrong.replace("flux / (4 * np.pi)", "flux / (2 * np.pi)")
    assert run(gated, worse) == (1, "gate red; cases: fail: gated/index.html", "gate red: 0 of 1 pass")
    head = "The gate known.json is red: 1 new (the renderer leaves out the model matrix "
    assert (tmp_path / "gated" / "summary.md").read_text().replace("\\", "").startswith(f"# rayproof: {head}")
    page = (tmp_path / "gated" / "index.html").read_text()
    assert "<title>rayproof: gate red</title>" in page
    assert head in page
    assert f"::error title=rayproof::{head}" in (tmp_path / "gated" / "annotations.txt").read_text()
    assert run(gated, wrong) == green
    # What is repaired is taken out of the file, and stays repaired.
    right = re.sub(r"\nimage = .*\nheader", RIGHT, wrong)
    assert run(gated, right) == (1, "gate red; cases: pass: gated/index.html", "gate red: 1 of 1 pass")
    assert main(["gate", "prune", "gated", "--file", "known.json"]) == 0
    assert run(gated, right) == (0, "gate green; cases: pass: gated/index.html", "gate green: 1 of 1 pass")
    assert run(gated, wrong)[0] == 1


@pytest.mark.process
def test_the_site_builds_in_strict_mode_and_fails_on_a_lost_page(tmp_path: Path) -> None:
    pytest.importorskip("mkdocs", reason="mkdocs is not installed; ./rayproof test installs it")

    def built(*options: str) -> subprocess.CompletedProcess[str]:
        words = [
            sys.executable,
            "-m",
            "mkdocs",
            "build",
            "--strict",
            "--site-dir",
            str(tmp_path / "site"),
            *options,
        ]
        return subprocess.run(words, cwd=CHECKOUT, capture_output=True, text=True, check=False)

    done = built()

    assert done.returncode == 0, done.stdout + done.stderr
    assert "a scene, the reason for asking it" in (tmp_path / "site" / "terms" / "index.html").read_text()
    lost = (CHECKOUT / "mkdocs.yml").read_text().replace("compare.md", "lost.md")
    for name, value in (("docs_dir: docs", f"docs_dir: {CHECKOUT / 'docs'}"), ("docs/site", f"{CHECKOUT}/docs/site")):
        lost = lost.replace(name, value)
    (tmp_path / "lost.yml").write_text(lost)
    assert "lost.md" in built("-f", str(tmp_path / "lost.yml")).stderr
