"""What is kept of a case: one file where it passed or warned, EXR files of everybody otherwise or where asked for."""

import zlib
from base64 import b64decode
from dataclasses import replace

import numpy as np
import pytest

from rayproof.cases.families import select
from rayproof.cases.stages import Stage
from rayproof.reference.analytic import Analytic
from rayproof.reports.judge.answers import Answers
from rayproof.reports.judge.case import judge_case
from rayproof.reports.judge.oracle import stages_of
from rayproof.reports.judge.sentinels import EDGE_CASE, SIDE, edge_scene
from rayproof.reports.results.images import read_answers, read_pixels
from rayproof.reports.results.outcomes import Outcome
from rayproof.reports.run.case_answers import CaseAnswers
from rayproof.reports.run.judge_task import keep_images, masks
from rayproof.reports.run.options import EVERY_CASE, CaseOptions, KeptImages, images_to_keep
from tests.reports.judge.scenes import candidate, rounded, witness


@pytest.fixture(scope="module")
def answered():
    """Return a case and the analytic reference's answers."""
    (case,) = select(["primitives/cube"])
    return case, Analytic().render(case.scene, list(Stage))


@pytest.fixture
def answers(answered):
    """Return the answers of two configurations and of two references, one of which is not independent."""
    _, answers = answered
    candidates = tuple(Answers(name=name, precision="float32", answers=answers) for name in ("float32", "float64"))
    witnesses = tuple(
        Answers(name=name, precision="float64", independent=name == "analytic", answers=answers)
        for name in ("analytic", "mitsuba_llvm")
    )

    return CaseAnswers(subjects=candidates, references=witnesses)


@pytest.fixture
def keep(answered, answers, tmp_path):
    """Return a function that keeps the images of a case."""

    def keep(outcome: Outcome, images: KeptImages = EVERY_CASE, answers: CaseAnswers = answers):
        return keep_images(answered[0], CaseOptions(references=(), images=images), answers, tmp_path, outcome)

    return keep


def test_a_case_that_passed_keeps_ours_and_the_oracle_s_in_one_file(keep, answered, tmp_path):
    images, pixels = keep(Outcome.PASS)

    assert images == {}
    assert pixels == "images/primitives/cube.js"
    kept = read_pixels(tmp_path / pixels)
    assert set(kept) == {"tracer-float32", "analytic"}
    normal = answered[1][Stage.NORMAL].astype(np.float32)
    assert kept["analytic"][Stage.NORMAL].tobytes() == normal.tobytes()


@pytest.mark.parametrize("lost", [{"name": "mitsuba_scalar"}, {"answers": {}}], ids=["not asked", "no answer"])
def test_without_the_oracle_it_keeps_the_independent_references(keep, answers, tmp_path, lost):
    first, second = answers.references
    third = replace(first, name="radiance")

    _, pixels = keep(Outcome.PASS, answers=replace(answers, references=(replace(first, **lost), second, third)))

    independent = {"radiance", *([lost["name"]] if "name" in lost else [])}
    assert set(read_pixels(tmp_path / pixels)) == {"tracer-float32"} | independent


def test_a_case_that_warns_keeps_everybody_in_one_file(keep, tmp_path):
    images, pixels = keep(Outcome.WARN)

    assert images == {}
    assert set(read_pixels(tmp_path / pixels)) == {"tracer-float32", "tracer-float64", "analytic", "mitsuba_llvm"}


@pytest.mark.parametrize(
    ("kept", "outcome"),
    [(KeptImages(full=True), Outcome.PASS), (EVERY_CASE, Outcome.FAIL), (KeptImages(0.0), Outcome.FAIL)],
    ids=["all", "did not pass", "failed alone"],
)
def test_otherwise_everybody_leaves_an_exr(keep, tmp_path, kept, outcome):
    images, pixels = keep(outcome, kept)

    assert pixels is None
    assert set(images) == {"tracer-float32", "tracer-float64", "analytic", "mitsuba_llvm"}
    assert Stage.RAY in read_answers(tmp_path / images["mitsuba_llvm"])


def test_a_sample_is_drawn_by_names_alone():
    tenth, third = KeptImages(0.1), KeptImages(1 / 3)
    names = [f"file/{number}" for number in range(10_000)]
    kept = {name for name in names if tenth.keeps(name, Outcome.PASS)}

    assert abs(len(kept) - 1000) < 5 * np.sqrt(900)  # five standard deviations of as many independent draws
    assert kept <= {name for name in names if third.keeps(name, Outcome.PASS)}
    assert all(KeptImages(0.0).keeps(name, Outcome.WARN) for name in names[:10])


@pytest.mark.parametrize("text", ["none", "sample:0%", "sample:101%", "sample:1", "sample:-1%", ""])
def test_what_can_not_be_kept_is_refused(text):
    with pytest.raises(ValueError, match=f"sample:1% .*got {text}"):
        images_to_keep(text, cases=1)


def test_the_mask_has_what_rounding_explains_and_nothing_else():
    # The border of a square meets the centres of 28 pixels, and each shows what the oracle does not.
    stages = stages_of(EDGE_CASE.scene)
    truth, *shown = (Analytic().render(edge_scene(SIDE * (1 + part)), stages) for part in (0.0, 1e-9, -1e-9))
    other = next(each for each in shown if (each[Stage.OBJECT] != truth[Stage.OBJECT]).any())
    subject, reference = candidate(rounded(other)), witness(truth)
    answers = CaseAnswers(subjects=(subject,), references=(reference,))

    found = masks(answers, judge_case(EDGE_CASE, [subject], [reference], Analytic(), {}))

    assert found is not None
    bits = np.frombuffer(zlib.decompress(b64decode(found["data"])), np.uint8).reshape(found["height"], found["width"])
    np.testing.assert_array_equal(bits > 0, (other[Stage.OBJECT] != truth[Stage.OBJECT]).any(axis=-1))
