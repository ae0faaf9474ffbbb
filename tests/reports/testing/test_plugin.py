"""The pytest plug-in, from a stranger's test suite: one item a case; right answers pass, wrong ones say why not."""

from pathlib import Path

import pytest

pytest_plugins = ["pytester"]

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


@pytest.fixture
def suite(pytester: pytest.Pytester, monkeypatch: pytest.MonkeyPatch) -> pytest.Pytester:
    """Return an empty test suite that sees rayproof and its plug-in as any installed one would."""
    root = Path(__file__).resolve().parents[3] / "python"
    monkeypatch.setenv("PYTHONPATH", str(root))
    return pytester


def outcomes(suite: pytest.Pytester, *arguments: str) -> tuple[dict[str, int], str]:
    result = suite.runpytest_subprocess("-p", "no:cacheprovider", *arguments)
    return result.parseoutcomes(), result.stdout.str() + result.stderr.str()


@pytest.mark.process
def test_a_formula_in_four_lines_passes(suite: pytest.Pytester) -> None:
    suite.makepyfile(mine=MINE, test_mine=FOUR_LINES.format("nearest_hit"))

    found, text = outcomes(suite, "-v")

    assert found == {"passed": 1}, text
    assert "test_mine[primitives/sphere]" in text


def test_a_file_s_formula_runs_in_the_configuration_that_is_asked_for(tmp_path: Path) -> None:
    from rayproof.cases.families import select
    from rayproof.reports.testing.conformance import Conformance

    (tmp_path / "mine.py").write_text(MINE)
    (case,) = select(["primitives/sphere"])
    named = {"formula": "sphere=mine.py:nearest_hit", "configuration": "float64/triangle=woop/sphere=textbook"}

    judged = Conformance(case=case, folder=tmp_path, **named).check()

    (name,) = {check.configuration for check in judged.checks}
    assert name == f"float64/sphere={tmp_path}/mine.py:nearest_hit/triangle=woop"


@pytest.mark.process
def test_a_wrong_formula_fails_and_names_the_stage(suite: pytest.Pytester) -> None:
    suite.makepyfile(mine=MINE, test_mine=FOUR_LINES.format("swollen"))

    found, text = outcomes(suite)

    assert found == {"failed": 1}
    assert "primitives/sphere: fail at" in text
    assert "HIT-1" in text


@pytest.mark.process
def test_a_renderer_s_own_suite_runs_the_cases(suite: pytest.Pytester) -> None:
    suite.makepyfile(test_renderer=RENDERER.format(change=ROUNDED))

    found, text = outcomes(suite)

    assert set(found) == {"passed"}, text
    assert found["passed"] >= 2


@pytest.mark.process
def test_a_renderer_that_is_wrong_fails(suite: pytest.Pytester) -> None:
    suite.makepyfile(test_renderer=RENDERER.format(change="-image if stage == 'normal' else " + ROUNDED))

    found, text = outcomes(suite)

    assert set(found) == {"failed"}, text
    assert "fail at normal" in text


def averaging(check: str, *, change: str = ROUNDED) -> str:
    """Return a suite that takes a case of 8 x 8 samples a pixel."""
    return (
        RENDERER.format(change=change)
        .replace('"primitives/s*", stages=("distance", "normal")', '"antialiased/sphere", stages=("radiance",)')
        .replace("conformance.check(render)", check)
    )


@pytest.mark.process
def test_a_renderer_is_asked_for_the_finer_image_where_a_case_averages(suite: pytest.Pytester) -> None:
    suite.makepyfile(test_renderer=averaging("conformance.check(render)"))

    found, text = outcomes(suite)

    assert found == {"passed": 1}, text


@pytest.mark.process
def test_a_wrong_finer_image_fails(suite: pytest.Pytester) -> None:
    wrong = f"image * 1.01 if stage == 'radiance' and scene.camera.width > 24 else {ROUNDED}"
    suite.makepyfile(test_renderer=averaging("conformance.check(render)", change=wrong))

    found, text = outcomes(suite)

    assert found == {"failed": 1}, text
    assert "fail at radiance" in text


@pytest.mark.process
def test_images_alone_do_not_do_where_a_case_averages(suite: pytest.Pytester) -> None:
    suite.makepyfile(test_renderer=averaging("conformance.check(render(conformance.scene, conformance.stages))"))

    found, text = outcomes(suite)

    assert found == {"failed": 1}, text
    assert "give a function" in text


@pytest.mark.process
def test_a_stage_that_was_promised_and_is_missing_fails(suite: pytest.Pytester) -> None:
    suite.makepyfile(
        test_renderer=RENDERER.format(change=ROUNDED).replace(
            "in answers.items()}", "in answers.items() if stage == 'normal'}"
        )
    )

    found, text = outcomes(suite)

    assert set(found) == {"failed"}, text
    assert "gave no distance" in text


@pytest.mark.process
def test_what_cannot_be_measured_is_skipped_and_not_passed(suite: pytest.Pytester) -> None:
    body = (
        RENDERER.format(change=ROUNDED)
        .replace('"primitives/s*"', '"behind/sphere"')
        .replace('"distance", "normal"', '"radiance",')
    )
    suite.makepyfile(test_renderer=body)

    found, text = outcomes(suite)

    assert found == {"skipped": 1}, text


@pytest.mark.process
@pytest.mark.parametrize(
    ("marker", "message"),
    [
        ('@pytest.mark.rayproof("no/such")', "no case matches"),
        ('@pytest.mark.rayproof("primitives", color=1)', "no option is called 'color'"),
        ('@pytest.mark.rayproof("primitives", formula="sphere/none")', "sphere/none"),
        ("", "needs @pytest.mark.rayproof"),
    ],
)
def test_a_wrong_marker_is_told(suite: pytest.Pytester, marker: str, message: str) -> None:
    suite.makepyfile(f"import pytest\n{marker}\ndef test_it(conformance):\n    conformance.check()\n")

    found, text = outcomes(suite)

    assert "passed" not in found
    assert message in text


@pytest.mark.process
def test_a_suite_that_does_not_use_it_imports_nothing_of_it(suite: pytest.Pytester) -> None:
    suite.makepyfile(
        "import sys\ndef test_it():\n    assert not {'drjit', 'mitsuba', 'numpy', 'trimesh'} & set(sys.modules)\n"
    )

    found, text = outcomes(suite)

    assert found == {"passed": 1}, text
