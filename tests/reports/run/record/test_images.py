"""What is kept of a case: one file where it passed or warned, EXR files of everybody otherwise or where asked for."""

import zlib
from base64 import b64decode

import numpy as np
import pytest

from rayproof.cases.families import select
from rayproof.cases.stages import Stage
from rayproof.reference.analytic import Analytic
from rayproof.reports.judge.judge_case import judge_case
from rayproof.reports.judge.renderers import Candidate, Witness
from rayproof.reports.results.exr import read_answers
from rayproof.reports.results.image_script import read_pixels
from rayproof.reports.results.outcomes import Outcome
from rayproof.reports.run.messages import JudgeTask
from rayproof.reports.run.record.images import keep_images, masks


@pytest.fixture(scope="module")
def answered():
    """Return a case and the analytic reference's answers."""
    (case,) = select(["primitives/cube"])
    return case, Analytic().render(case.scene, list(Stage))


@pytest.fixture
def task(answered, tmp_path):
    """Return a task of two configurations and two witnesses, one of which is not independent."""
    case, answers = answered
    candidates = tuple(
        Candidate(name=name, precision="float32", items=frozenset(), shadow_epsilon=0.0, answers=answers)
        for name in ("float32", "float64")
    )
    witnesses = tuple(
        Witness(name=name, precision="float64", independent=name == "analytic", shadow_epsilon=0.0, answers=answers)
        for name in ("analytic", "mitsuba_llvm")
    )

    def make(*, full: bool = False) -> JudgeTask:
        return JudgeTask(
            case=case, candidates=candidates, witnesses=witnesses, versions={}, folder=tmp_path, require=(), full=full
        )

    return make


def test_a_case_that_passed_keeps_ours_and_the_independent_in_one_file(task, answered, tmp_path):
    images, pixels = keep_images(task(), Outcome.PASS)

    assert images == {}
    assert pixels == "images/primitives/cube.js"
    kept = read_pixels(tmp_path / pixels)
    assert set(kept) == {"tracer-float32", "analytic"}
    normal = answered[1][Stage.NORMAL].astype(np.float32)
    assert kept["analytic"][Stage.NORMAL].tobytes() == normal.tobytes()


def test_a_case_that_warns_keeps_everybody_in_one_file(task, tmp_path):
    images, pixels = keep_images(task(), Outcome.WARN)

    assert images == {}
    assert set(read_pixels(tmp_path / pixels)) == {"tracer-float32", "tracer-float64", "analytic", "mitsuba_llvm"}


@pytest.mark.parametrize(
    ("full", "outcome"), [(True, Outcome.PASS), (False, Outcome.FAIL)], ids=["full", "did not pass"]
)
def test_otherwise_everybody_leaves_an_exr(task, tmp_path, full, outcome):
    images, pixels = keep_images(task(full=full), outcome)

    assert pixels is None
    assert set(images) == {"tracer-float32", "tracer-float64", "analytic", "mitsuba_llvm"}
    assert Stage.RAY in read_answers(tmp_path / images["mitsuba_llvm"])


def test_the_mask_has_an_outline_and_leaves_most_alone(task):
    asked = task()
    found = masks(asked, judge_case(asked.case, asked.candidates, asked.witnesses, Analytic(), {}).ground)

    assert found is not None
    bits = np.frombuffer(zlib.decompress(b64decode(found["data"])), np.uint8)
    assert len(bits) == found["width"] * found["height"]
    assert 0 < np.count_nonzero(bits) < len(bits) / 10
