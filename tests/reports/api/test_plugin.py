"""The pytest plug-in, from a stranger's test suite: one item a case; right answers pass, wrong ones say why not."""

import os
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import NamedTuple
from xml.etree import ElementTree

import pytest

MINE = """
import drjit as dr

def nearest_hit(ray, sphere, interval):
    offset = ray.origin - sphere.center
    a, half_b = dr.squared_norm(ray.direction), dr.dot(offset, ray.direction)
    discriminant = half_b * half_b - a * (dr.squared_norm(offset) - dr.square(sphere.radius))
    root = dr.sqrt(dr.maximum(discriminant, 0))
    return dr.select(discriminant >= 0, interval.smallest((-half_b - root) / a, (-half_b + root) / a), dr.inf)

def swollen(ray, sphere, interval):
    return nearest_hit(ray, sphere, interval) * 1.001
"""

FOUR_LINES = """
import pytest
@pytest.mark.rayproof("primitives/sphere", formula="sphere=mine.py:{}")
def test_mine(conformance):
    conformance.check()
"""

ROUNDED = "image.astype('float32')"  # a copy of the oracle to the last bit would be no witness
RENDERER = """
import pytest
from rayproof.reference.analytic import Analytic

def render(scene, stages):
    answers = Analytic().render(scene, stages)
    return {{stage: {change} for stage, image in answers.items()}}

@pytest.mark.rayproof("primitives/s*", stages=("distance", "normal"), precision="float32")
def test_conforms(conformance):
    conformance.check(render)
"""


def averaging(check: str, *, change: str = ROUNDED) -> str:
    """Return a suite that takes a case of 8 x 8 samples a pixel."""
    return (
        RENDERER.format(change=change)
        .replace('"primitives/s*", stages=("distance", "normal")', '"antialiased/sphere", stages=("radiance",)')
        .replace("conformance.check(render)", check)
    )


WRONG_MARKERS = {
    '@pytest.mark.rayproof("no/such")': "no case matches",
    '@pytest.mark.rayproof("primitives", color=1)': "no option is called 'color'",
    '@pytest.mark.rayproof("primitives", formula="sphere/none")': "sphere/none",
    "": "needs @pytest.mark.rayproof",
}
# The files of a stranger's suite.
SUITE = {
    "right_formula": FOUR_LINES.format("nearest_hit"),
    "wrong_formula": FOUR_LINES.format("swollen"),
    "right": RENDERER.format(change=ROUNDED),
    "wrong_normal": RENDERER.format(change="-image if stage == 'normal' else " + ROUNDED),
    "finer": averaging("conformance.check(render)"),
    "wrong_finer": averaging(
        "conformance.check(render)",
        change=f"image * 1.01 if stage == 'radiance' and scene.camera.width > 24 else {ROUNDED}",
    ),
    "images_alone": averaging("conformance.check(render(conformance.scene, conformance.stages))"),
    "missing": RENDERER.format(change=ROUNDED).replace(
        "in answers.items()}", "in answers.items() if stage == 'normal'}"
    ),
    "unmeasured": RENDERER.format(change=ROUNDED)
    .replace('"primitives/s*"', '"behind/sphere"')
    .replace('"distance", "normal"', '"radiance",'),
    **{
        f"marker{number}": f"import pytest\n{marker}\ndef test_it(conformance):\n    conformance.check()\n"
        for number, marker in enumerate(WRONG_MARKERS)
    },
}


def pytest_on(folder: Path, *arguments: str) -> str:
    """Run pytest on a folder's suite, which sees rayproof and its plug-in as any installed one would."""
    environment = os.environ | {"PYTHONPATH": str(Path(__file__).resolve().parents[3] / "python")}
    command = [sys.executable, "-m", "pytest", "-p", "no:cacheprovider", *arguments]
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)
    return done.stdout + done.stderr


class Said(NamedTuple):
    """What became of the items of a file: their names, their outcomes and what was said of them."""

    names: list[str]
    outcomes: set[str]
    text: str


@pytest.fixture(scope="module")
def said(tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Said]:
    """Run the stranger's suite once; return what was said of a file of it."""
    folder = tmp_path_factory.mktemp("suite")
    (folder / "mine.py").write_text(MINE)
    for name, text in SUITE.items():
        (folder / f"test_{name}.py").write_text(text)
    printed = pytest_on(folder, "--continue-on-collection-errors", "--junit-xml", "found.xml")
    assert (folder / "found.xml").is_file(), printed
    items = list(ElementTree.parse(folder / "found.xml").iter("testcase"))

    def of(name: str) -> Said:
        ours = [one for one in items if f"test_{name}" in (one.get("classname"), one.get("name"))]
        assert ours, printed
        return Said(
            [one.get("name", "") for one in ours],
            {part.tag for one in ours for part in one} or {"passed"},
            "".join(f"{part.get('message')} {part.text}" for one in ours for part in one),
        )

    return of


@pytest.mark.process
def test_a_formula_in_four_lines_passes(said: Callable[[str], Said]) -> None:
    found = said("right_formula")

    assert found.outcomes == {"passed"}, found.text
    assert found.names == ["test_mine[primitives/sphere]"]


def test_a_file_s_formula_runs_in_the_configuration_that_is_asked_for(tmp_path: Path) -> None:
    from rayproof.cases.families import select
    from rayproof.reports.api.conformance import Conformance

    (tmp_path / "mine.py").write_text(MINE)
    (case,) = select(["primitives/sphere"])
    named = {"formula": "sphere=mine.py:nearest_hit", "configuration": "float64/triangle=woop/sphere=textbook"}

    judged = Conformance(case=case, folder=tmp_path, **named).check()

    (name,) = {check.configuration for check in judged.checks}
    assert name == f"float64/sphere={tmp_path}/mine.py:nearest_hit/triangle=woop"


@pytest.mark.process
def test_a_wrong_formula_fails_and_names_the_stage(said: Callable[[str], Said]) -> None:
    found = said("wrong_formula")

    assert found.outcomes == {"failure"}
    assert "primitives/sphere: fail at" in found.text
    assert "HIT-1" in found.text


@pytest.mark.process
@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("wrong_normal", "fail at normal"),
        ("wrong_finer", "fail at radiance"),
        ("images_alone", "give a function"),
        ("missing", "gave no distance"),
    ],
)
def test_a_renderer_that_is_wrong_fails_and_so_does_one_that_answers_too_little(
    said: Callable[[str], Said], name: str, message: str
) -> None:
    found = said(name)

    assert found.outcomes == {"failure"}, found.text
    assert message in found.text


@pytest.mark.process
def test_what_cannot_be_measured_is_skipped_and_not_passed(said: Callable[[str], Said]) -> None:
    assert said("unmeasured").outcomes == {"skipped"}
