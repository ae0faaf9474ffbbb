"""The report's guard: known images of four renderers, kept and published, are handed to the page under their own names.

So are the classes of pixels: those of the configuration that the page says they are of.
"""

import base64
import json
import tempfile
import zlib
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from rayproof.cases.stages import Stage
from rayproof.reference.analytic import Freedom
from rayproof.reports.judge.answers import Answers
from rayproof.reports.judge.case import judge_case
from rayproof.reports.judge.limit_sentinels import CASE
from rayproof.reports.judge.oracle import ORACLE, stages_of
from rayproof.reports.judge.verdict import Judged
from rayproof.reports.publish.page.case_data import write_case_data
from rayproof.reports.results.case_records import CaseRecord
from rayproof.reports.results.images import handed_over, read_pixels
from rayproof.reports.results.outcomes import Outcome
from rayproof.reports.run.case_answers import CaseAnswers
from rayproof.reports.run.judge_task import keep_images, masks
from rayproof.reports.run.options import CaseOptions
from tests.harness.guards import BrokenHarnessError


def guard_report(oracle: Any) -> None:
    """Publish images and masks whose owner is known; raise BrokenHarnessError where they are said to be another's."""
    truth = oracle.render(CASE.scene, stages_of(CASE.scene))
    shape = truth[Stage.RADIANCE].shape
    # Each renderer's radiance is a number of its own.
    shown = {"tracer-float32": 1.0, "tracer-float64": 2.0, ORACLE: 3.0, "third": 4.0}
    given = {name: truth | {Stage.RADIANCE: np.full(shape, number)} for name, number in shown.items()}
    # One of them sees lights from as far above each hit as its epsilon is large, which explains some pixels.
    rows = {stage: image.reshape(-1, image.shape[-1]) for stage, image in truth.items() if stage is not Stage.CAMERA}
    seen = oracle.visibility(CASE.scene, rows, Freedom(lift=0.2)).reshape(truth[Stage.VISIBILITY].shape)
    given["tracer-float64"][Stage.VISIBILITY] = seen
    one, two = (
        Answers(
            name=name.removeprefix("tracer-"),
            precision="float32",
            shadow_epsilon=epsilon,
            answers=given[name],
        )
        for name, epsilon in (("tracer-float32", 0.0), ("tracer-float64", 0.2))
    )
    witnesses = tuple(
        Answers(name=name, precision="float64", independent=True, answers=given[name]) for name in (ORACLE, "third")
    )
    with tempfile.TemporaryDirectory() as name:
        answers, folder = CaseAnswers(subjects=(one, two), references=witnesses), Path(name)
        judged = judge_case(CASE, (one, two), witnesses, oracle, {})
        classes = {each.name: masks(replace(answers, subjects=(each,)), judged) for each in (one, two)}
        if len({json.dumps(found and found["data"]) for found in classes.values()}) < 2:
            raise BrokenHarnessError("the report is broken: an epsilon of 0.2 m leaves every pixel's class as it was")
        for outcome in (Outcome.FAIL, Outcome.PASS):
            kept = set(shown) if outcome is Outcome.FAIL else {"tracer-float32", ORACLE}
            page = _published(answers, folder, judged, outcome, list(shown))
            images = read_pixels(folder / str(page["pixels"]))
            radiance = {name: set(np.unique(images[name][Stage.RADIANCE]).tolist()) for name in images}
            if radiance != {name: {shown[name]} for name in kept}:
                raise BrokenHarnessError("the report is broken: an image is shown as another renderer's, or is lost")
            if page["masks"] is None or page["masks"] != {**(classes["float32"] or {}), "configuration": "float32"}:
                raise BrokenHarnessError("the report is broken: pixels are classed as another configuration's")


def _published(answers: CaseAnswers, folder: Path, judged: Judged, outcome: Outcome, names: list[str]) -> CaseRecord:
    """Return what the page is handed of a case that ended so."""
    images, pixels = keep_images(CASE, CaseOptions(references=()), answers, folder, outcome)
    record: CaseRecord = {
        "name": CASE.name,
        "family": CASE.family,
        "verdict": outcome.value,
        "renders": [{"renderer": name, "image": images.get(name)} for name in names],
        "pixels": pixels,
        "masks": masks(answers, judged),
        "lights": len(CASE.scene.lights),
        "checks": [],
    }
    page = folder / "data" / f"{outcome}.js"
    page.parent.mkdir(exist_ok=True)
    write_case_data(folder, page, record)
    packed = json.loads(handed_over(page.read_text(encoding="utf-8")))
    return json.loads(zlib.decompress(base64.b64decode(packed)))
