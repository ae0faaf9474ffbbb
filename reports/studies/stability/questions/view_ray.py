"""In which direction does the camera look through a point of its image? The angle to the exact direction.

Every ray has a camera of its own, so that no orientation is a special one. Inputs: eye, target, up, sx, sy, fovy
[degrees], aspect, near, far. K = 1 + 1 / sin(F, up), what the basis multiplies its roundings by; the eye's
coordinates do not enter, because target - eye is all that a direction needs.
"""

from types import SimpleNamespace
from typing import Any

import numpy as np
from flint import arb, ctx

from rayproof.cases.ladders import Inputs, Ladder
from rayproof.cases.rounding import UNIT_ROUNDOFF
from rayproof.reports.studies.stability.device import downloaded, number, uploaded
from rayproof.reports.studies.stability.exactly import Columns, evaluated, sample, witnessed
from rayproof.reports.studies.stability.mathematics import cross, minus, normalized, plus, times
from rayproof.reports.studies.stability.questions import QUESTIONS, Answer, Grades, Truth, Witness, nothing
from rayproof.reports.studies.stability.questions.placed import angles
from rayproof.tracer.configuration import Configuration
from rayproof.tracer.formulas import Formula
from rayproof.tracer.kernel.arrays import array_types
from rayproof.tracer.light_path.camera_stage import camera_frame

TANGENT_BITS = 300


def tangents(fovy: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return tan(fovy / 2) as two float64 arrays, fovy in degrees and exact."""
    old, ctx.prec = ctx.prec, TANGENT_BITS
    try:
        table = {}
        for angle in np.unique(fovy):
            tangent = (arb(float(angle)) / 360).sin_pi() / (arb(float(angle)) / 360).cos_pi()
            high = float(tangent.mid())
            table[angle] = (high, float((tangent - high).mid()))
    finally:
        ctx.prec = old
    return np.array([table[angle][0] for angle in fovy]), np.array([table[angle][1] for angle in fovy])


def looking(x: Columns) -> Columns:
    """Return the unit direction from the camera's own numbers; the tangent is the sum of two."""
    forward = normalized(minus(x["target"], x["eye"]))
    right = normalized(cross(forward, x["up"]))
    up = cross(right, forward)
    tangent = x["tangent"] + x["tangent_rest"]
    across, upwards = x["sx"] * tangent * x["aspect"], x["sy"] * tangent
    direction = normalized(plus(plus(forward, times(right, across)), times(up, upwards)))
    return {f"n{i}": value for i, value in enumerate(direction)}


@QUESTIONS.register("view_ray")
class ViewRay:
    """The unit direction of `ray`, by the slot's variant, everything else of the camera by default."""

    def truth(self, ladder: Ladder, inputs: Inputs, rungs: np.ndarray) -> Truth:
        """Return the exact direction and K."""
        high, low = tangents(inputs["fovy"])
        given = {name: inputs[name] for name in ("eye", "target", "up", "sx", "sy", "aspect")}
        given |= {"tangent": high, "tangent_rest": low}
        found = evaluated(looking, given)
        witness = Witness(*witnessed(looking, given, found, sample(rungs)))
        forward = inputs["target"] - inputs["eye"]
        sine = np.linalg.norm(np.cross(forward, inputs["up"]), axis=1)
        sine = sine / np.linalg.norm(forward, axis=1) / np.linalg.norm(inputs["up"], axis=1)
        finite = np.isfinite(found["n0"].high)
        return Truth(counted=finite, facts={"n": found, "K": 1 + 1 / sine}, witness=witness)

    def answer(self, ladder: Ladder, formula: Formula, inputs: Inputs, precision: str) -> Answer:
        """Return directions, one camera per ray and all in one kernel."""
        types = array_types(precision)
        configuration = Configuration(precision=precision, formulas={formula.slot: formula.variant})
        columns = uploaded(inputs, types)
        cameras: Any = SimpleNamespace(**{name: columns[name] for name in ("eye", "target", "up", "near", "far")})
        # The half-sizes of the image come from the formula, one angle at a time.
        half_extent = self._half_sizes(configuration, inputs, types)
        frame = camera_frame(cameras, configuration, types, half_extent=half_extent)
        return downloaded({"d": configuration["ray"](frame, columns["sx"], columns["sy"])}, len(inputs["sx"]))

    @staticmethod
    def _half_sizes(configuration: Configuration, inputs: Inputs, types: Any) -> tuple[Any, Any]:
        given = np.stack([inputs["fovy"], inputs["aspect"]])
        # Runs first: to sort pairs takes long, and the rays of a run have one.
        starts = np.concatenate([[True], np.any(given[:, 1:] != given[:, :-1], axis=0)])
        pairs, where = np.unique(given[:, starts], axis=1, return_inverse=True)
        sizes = np.array(
            [
                [float(size[0]) for size in configuration["half_extent"](types.Float, float(fovy), float(aspect))]
                for fovy, aspect in pairs.T
            ]
        )[where[np.cumsum(starts) - 1]]
        return number(sizes[:, 0], types), number(sizes[:, 1], types)

    def grade(self, ladder: Ladder, inputs: Inputs, truth: Truth, answer: Answer, precision: str) -> Grades:
        """Return angles in degrees, or in pixels of 1080 lines; a direction that is no number is invalid."""
        angle = angles(answer["d"], truth.facts["n"])
        bad = ~np.isfinite(angle)
        error = np.degrees(angle)
        if ladder.options.get("natural") == "pixels":
            error = error / (inputs["fovy"] / 1080)
        return Grades(
            counted=truth.counted,
            false_hit=nothing(len(bad)),
            false_miss=nothing(len(bad)),
            invalid=bad & truth.counted,
            error=np.where(truth.counted, error, np.nan),
            index=np.where(truth.counted, angle / (truth.facts["K"] * UNIT_ROUNDOFF[precision]), np.nan),
        )
