"""Planted faults of the judge."""

from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from dataclasses import replace
from typing import Any

import numpy as np
from msgspec import structs

from rayproof.cases.rounding import gamma
from rayproof.cases.scene import Mesh, Motion
from rayproof.cases.stages import Stage
from rayproof.reference.analytic import Analytic
from rayproof.reference.mitsuba3 import _Mitsuba
from rayproof.reports.judge import (
    answers,
    camera_check,
    case,
    checks,
    closed_forms,
    copies,
    known_defects,
    measurement,
    oracle,
    panel,
    promises,
)
from rayproof.reports.judge.conventions import Tested
from rayproof.reports.judge.forward import limits
from rayproof.reports.judge.forward.limits import Coarseness, Roundoff
from rayproof.reports.judge.measurement import Explained
from rayproof.reports.judge.nearby import clouds
from rayproof.reports.judge.nearby.continued import Continuing
from rayproof.reports.judge.nearby.explaining import Asking
from rayproof.reports.judge.panel import AgreementMatrix
from rayproof.reports.results.outcomes import Outcome
from tests.harness.audit.faults import FAULTS, altered, replaced


@FAULTS.register(
    "judge/analytic_is_a_copy",
    where="judge",
    stage=Stage.RAY,
    who=("analytic",),
    cases=(
        "primitives/*",
        "several_lights/*",
        "shadows/*",
    ),
)
@contextmanager
def analytic_is_a_copy() -> Iterator[None]:
    """Let analytic answer with the tracer's own answers.

    Analytic's images are replaced by copies of the tracer's.
    """

    def wrong(self: Any, scene: Any, stages: Any, *, samples: int = 1) -> Any:
        from rayproof.tracer.configuration import Configuration
        from rayproof.tracer.render import render

        return render(scene, stages, Configuration(precision="float32"), samples=samples)

    with altered(Analytic, "render", wrong):
        yield


@FAULTS.register("judge/baseline_misnamed", where="judge", stage=None)
@contextmanager
def baseline_misnamed() -> Iterator[None]:
    """Name a renderer that is no oracle.

    The record names the wrong renderer as the one whose edges and limits it goes by.
    """
    with altered(case, "ORACLE", "mitsuba_scalar"):
        yield


@FAULTS.register("judge/broadcast", where="judge", stage=None)
@contextmanager
def broadcast() -> Iterator[None]:
    """Stretch an image of one row over all.

    Images of different size are broadcast.
    """
    right, misshapen = measurement.measure, answers.misshapen

    def measure(stage: Any, ours: Any, theirs: Any, *rest: Any, **options: Any) -> Any:
        return right(stage, np.broadcast_to(ours, theirs.shape), theirs, *rest, **options)

    def none(*arguments: Any) -> dict[Any, str]:
        return {}

    with replaced(right, measure), replaced(misshapen, none):
        yield


@FAULTS.register("judge/camera_limit_times_1000", where="judge", stage=None)
@contextmanager
def camera_limit_times_1000() -> Iterator[None]:
    """Scale the camera's limits by 1000.

    The camera's limits multiplied by 1000.
    """
    right = camera_check.scales

    def wrong(*arguments: Any) -> dict[str, np.ndarray | float]:
        return {part: 1000 * size for part, size in right(*arguments).items()}

    with replaced(right, wrong):
        yield


# Red, green, or the visibility of every light but the first is not compared.
LIGHT = (Stage.IRRADIANCE, Stage.EXITANCE, Stage.RADIANCE)


@contextmanager
def _not_compared(stages: tuple[Stage, ...], channels: slice) -> Iterator[None]:
    """Copy the reference's `channels` at some stages."""
    right = measurement.ratios

    def wrong(stage: Stage, ours: Any, theirs: Any, limit: Any) -> Any:
        if stage in stages and ours.shape == theirs.shape:
            ours = np.array(ours)
            ours[..., channels] = theirs[..., channels]
        return right(stage, ours, theirs, limit)

    with replaced(right, wrong):
        yield


@FAULTS.register("judge/red_ignored", where="judge", stage=None)
def red_ignored() -> AbstractContextManager[None]:
    """Leave red out."""
    return _not_compared(LIGHT, slice(0, 1))


@FAULTS.register("judge/first_light_only", where="judge", stage=None)
def first_light_only() -> AbstractContextManager[None]:
    """Compare the visibility of the first light alone."""
    return _not_compared((Stage.VISIBILITY,), slice(1, None))


@FAULTS.register("judge/closed_forms_ignored", where="judge", stage=None)
@contextmanager
def closed_forms_ignored() -> Iterator[None]:
    """Judge no expectation.

    Closed forms are not looked at.
    """
    right = closed_forms.closed_forms

    def wrong(*arguments: Any) -> list[Any]:
        return []

    with replaced(right, wrong):
        yield


@FAULTS.register("judge/conventions_explain_all", where="judge", stage=None)
@contextmanager
def conventions_explain_all() -> Iterator[None]:
    """Say of every convention that it explains.

    Whatever stands alone is explained by some convention, untested.
    """
    with altered(Tested, "explains", property(lambda self: True)):
        yield


@FAULTS.register("judge/copies_believed", where="judge", stage=None)
@contextmanager
def copies_believed() -> Iterator[None]:
    """Never notice a copy.

    A reference that repeats the tracer's output is believed.
    """

    def wrong(*_: Any, **__: Any) -> tuple[Stage, ...]:
        return ()

    with replaced(copies.copied, wrong):
        yield


@contextmanager
def _excusing(right: Any, which: Any) -> Iterator[None]:
    """Let pixels that are over their limits be explained: of all pixels of a stage, those that `which` says."""

    def wrong(self: Asking) -> dict[Stage, Explained]:
        found = dict(right(self))
        for stage, mask in self.over.items():
            found[stage] = replace(found[stage], rounding=found[stage].rounding | (mask & which(self)))
        return found

    with altered(Asking, "explain", wrong):
        yield


@FAULTS.register("judge/edges_excused", where="judge", stage=None)
def edges_excused() -> AbstractContextManager[None]:
    """Explain every pixel that is over its limit end to end by rounding.

    A nearby problem is said to have any value whatever.
    """
    return _excusing(Asking.explain, lambda asking: True)


@FAULTS.register("judge/first_shape_excused", where="judge", stage=None)
def first_shape_excused() -> AbstractContextManager[None]:
    """Explain every pixel of the first shape by rounding.

    What rounding explains swallows a whole object.
    """
    return _excusing(
        Asking.explain,
        lambda asking: asking.oracle.render(asking.scene, (Stage.OBJECT,))[Stage.OBJECT][..., 0] == 0,
    )


@FAULTS.register("judge/continued_excused", where="judge", stage=None)
@contextmanager
def continued_excused() -> Iterator[None]:
    """Explain every pixel that is over its limit given the stages before.

    Stages that are continued from a renderer's own may have any value.
    """

    def wrong(self: Continuing, over: np.ndarray) -> Explained:
        return Explained(rounding=over, epsilon=np.zeros_like(over), unexamined=np.zeros_like(over))

    with altered(Continuing, "explain", wrong):
        yield


@FAULTS.register("judge/holes_excused", where="judge", stage=None)
@contextmanager
def holes_excused() -> Iterator[None]:
    """Move the faces of a mesh apart.

    Nearby meshes have cracks between their faces, so that a hole passes.
    """
    right = Mesh.moved

    def wrong(self: Mesh, motion: Motion) -> Mesh:
        apart = np.arange(3 * len(self.faces), dtype=np.int32).reshape(-1, 3)
        moved = right(replace(self, vertices=self.vertices[self.faces].reshape(-1, 3), faces=apart), motion)
        return replace(moved, vertices=moved.vertices + 1e-3 * motion.draw.uniform(-1, 1, moved.vertices.shape))

    with altered(Mesh, "moved", wrong):
        yield


@FAULTS.register("judge/everything_known", where="judge", stage=None)
@contextmanager
def everything_known() -> Iterator[None]:
    """Know a finding for everything.

    Every suspect reference is explained by a finding that does not exist.
    """
    right = known_defects.explained

    def wrong(reference: str, version: str, stage: Any, *_: Any) -> Any:
        return known_defects.KnownFinding(
            name="nothing",
            reference=reference,
            version=version,
            stage=stage,
            where="",
            at_least=0.0,
            smallest_scene="none.json",
            command="none",
            third_witness="nobody",
            what="nothing",
        )

    with replaced(right, wrong):
        yield


@FAULTS.register("judge/float64_by_float32", where="judge", stage=None)
@contextmanager
def float64_by_float32() -> Iterator[None]:
    """Take every party's rounding for that of float32.

    Float64 is judged by the limits of float32.
    """
    right = limits.roundoff_of

    def wrong(name: str, precision: str, **options: Any) -> Roundoff:
        return right(name, "float32", **options)

    with replaced(right, wrong):
        yield


@FAULTS.register("judge/infinity_passes", where="judge", stage=None)
@contextmanager
def infinity_passes() -> Iterator[None]:
    """Let an infinite value count as no error, and count no infinity.

    An infinity where the reference is finite counts as no error.
    """
    right, counted = measurement.ratios, measurement.measure

    def ratios(stage: Any, ours: Any, theirs: Any, limit: Any) -> Any:
        ratio, wrong = right(stage, ours, theirs, limit)
        return np.where(np.isinf(ours).any(axis=-1), 0.0, ratio), wrong

    def measure(*arguments: Any, **options: Any) -> Any:
        return structs.replace(counted(*arguments, **options), inf=0)

    with replaced(right, ratios), replaced(counted, measure):
        yield


@FAULTS.register("judge/interior_not_demanded", where="judge", stage=None)
@contextmanager
def interior_not_demanded() -> Iterator[None]:
    """Hold no case to its promise.

    A case with too few pixels to judge passes.
    """
    right = promises.held_to_promise

    def wrong(case: Any, check: Any, *arguments: Any, **options: Any) -> Any:
        return check

    with replaced(right, wrong):
        yield


@FAULTS.register("judge/last_channel_ignored", where="judge", stage=None)
@contextmanager
def last_channel_ignored() -> Iterator[None]:
    """Copy the reference's other channels.

    Only the first channel of an image is compared.
    """
    right = measurement.ratios

    def wrong(stage: Any, ours: Any, theirs: Any, limit: Any) -> Any:
        if ours.shape == theirs.shape:
            ours = np.concatenate([ours[..., :1], theirs[..., 1:]], axis=-1)
        return right(stage, ours, theirs, limit)

    with replaced(right, wrong):
        yield


@FAULTS.register("judge/light_at_edges_excused", where="judge", stage=None)
@contextmanager
def light_at_edges_excused() -> Iterator[None]:
    """Take any light for a sum of what a piece receives.

    Where nearby problems differ light may have any value.
    """

    def wrong(stage: Any, values: Any, *rest: Any) -> Any:
        return np.ones(len(values), dtype=bool), np.zeros(len(values), dtype=bool)

    with replaced(clouds.is_of_lights, wrong):
        yield


# All limits, one stage's limit or the references' constants are a little too wide.
STAGES = (Stage.RAY, Stage.DISTANCE, Stage.POSITION, Stage.NORMAL, Stage.IRRADIANCE, Stage.EXITANCE, Stage.RADIANCE)


@FAULTS.register("judge/limit_times_10", where="judge", stage=None)
@contextmanager
def limit_times_10() -> Iterator[None]:
    """Scale the unit roundoff by 10."""

    def wrong(roundoff: Any, count: float) -> float:
        return 10 * roundoff.scale * gamma(count, precision=roundoff.precision)

    with altered(limits.Roundoff, "__call__", wrong):
        yield


@contextmanager
def _of_one_stage(stage: Stage) -> Iterator[None]:
    """Scale both of a stage's limits by 100, as they leave `limits`."""
    right = limits.limits

    def wrong(*arguments: Any, **options: Any) -> Any:
        found = right(*arguments, **options)
        wide = {
            name: {s: (100 if s is stage else 1) * limit for s, limit in getattr(found, name).items()}
            for name in ("continued", "end_to_end")
        }
        return replace(found, **wide)

    with replaced(right, wrong):
        yield


def _register(stage: Stage) -> None:
    def planted() -> AbstractContextManager[None]:
        """Scale the stage's limits."""
        return _of_one_stage(stage)

    FAULTS.register(f"judge/{stage}_limit_times_100", where="judge", stage=None)(planted)


for each in STAGES:
    _register(each)


@FAULTS.register("judge/calibration_times_100", where="judge", stage=None)
@contextmanager
def calibration_times_100() -> Iterator[None]:
    """Give every reference that has a constant one of 100."""
    wide = {name: replace(constant, scale=100.0) for name, constant in limits.CALIBRATED.items()}
    with altered(limits, "CALIBRATED", wide):
        yield


@FAULTS.register("judge/majority_alone", where="judge", stage=None)
@contextmanager
def majority_alone() -> Iterator[None]:
    """Exchange the two.

    The majority is said to stand alone, and the one that does is its judge.
    """
    right = panel.standing

    def wrong(matrix: Any, voice: Any) -> Any:
        found = right(matrix, voice)
        return replace(found, alone=found.majority, majority=found.alone) if found.alone else found

    with replaced(right, wrong):
        yield


@FAULTS.register("judge/mean_for_maximum", where="judge", stage=None)
@contextmanager
def mean_for_maximum() -> Iterator[None]:
    """Spread the errors evenly over the image.

    The mean of an image's errors in place of the largest.
    """
    right = measurement.ratios

    def wrong(stage: Any, ours: Any, theirs: Any, limit: Any) -> Any:
        ratio, error = right(stage, ours, theirs, limit)
        finite = ratio[np.isfinite(ratio)]
        return np.full_like(ratio, finite.mean() if finite.size else np.inf), error

    with replaced(right, wrong):
        yield


@FAULTS.register(
    "judge/mitsuba_copies_light",
    where="judge",
    stage=Stage.IRRADIANCE,
    who=(
        "mitsuba_llvm",
        "mitsuba_scalar",
    ),
    cases=(
        "primitives/*",
        "several_lights/*",
        "shadows/*",
    ),
)
@contextmanager
def mitsuba_copies_light() -> Iterator[None]:
    """Let Mitsuba answer irradiance with the tracer's own image.

    Mitsuba's irradiance alone is replaced by a copy of the tracer's.
    """
    right = vars(_Mitsuba)["render"]

    def wrong(self: Any, scene: Any, stages: Any, *, samples: int = 1) -> Any:
        from rayproof.tracer.configuration import Configuration
        from rayproof.tracer.render import render

        found = right(self, scene, stages, samples=samples)
        if Stage.IRRADIANCE in found:
            found |= render(scene, (Stage.IRRADIANCE,), Configuration(precision="float32"))
        return found

    with altered(_Mitsuba, "render", wrong):
        yield


@FAULTS.register(
    "judge/mitsuba_is_a_copy",
    where="judge",
    stage=Stage.RAY,
    who=(
        "mitsuba_llvm",
        "mitsuba_scalar",
    ),
    cases=(
        "primitives/*",
        "several_lights/*",
        "shadows/*",
    ),
)
@contextmanager
def mitsuba_is_a_copy() -> Iterator[None]:
    """Let Mitsuba answer with the tracer's own answers.

    Mitsuba's images are replaced by copies of the tracer's.
    """

    def wrong(self: Any, scene: Any, stages: Any, *, samples: int = 1) -> Any:
        from rayproof.tracer.configuration import Configuration
        from rayproof.tracer.render import render

        return render(scene, stages, Configuration(precision="float32"), samples=samples)

    with altered(_Mitsuba, "render", wrong):
        yield


@FAULTS.register("judge/nan_passes", where="judge", stage=None)
@contextmanager
def nan_passes() -> Iterator[None]:
    """Let a NaN ratio count as no error, and count no NaN.

    NaN compared with `>`, which is never true.
    """
    right, counted = measurement.ratios, measurement.measure

    def ratios(stage: Any, ours: Any, theirs: Any, limit: Any) -> Any:
        ratio, wrong = right(stage, ours, theirs, limit)
        return np.where(np.isnan(ours).any(axis=-1), 0.0, ratio), wrong

    def measure(*arguments: Any, **options: Any) -> Any:
        return structs.replace(counted(*arguments, **options), nan=0)

    with replaced(right, ratios), replaced(counted, measure):
        yield


@FAULTS.register("judge/one_sided_error", where="judge", stage=None)
@contextmanager
def one_sided_error() -> Iterator[None]:
    """Count no error where the value is below the reference's.

    Only a value above the reference's counts as an error.
    """
    right = measurement.error

    def wrong(stage: Any, ours: Any, theirs: Any) -> Any:
        found = right(stage, ours, theirs)
        below = (ours <= theirs) if found.ndim == ours.ndim else np.all(ours <= theirs, axis=-1)
        return np.where(below, 0.0, found)

    with replaced(right, wrong):
        yield


# A reference is not compared or not missed, or all are judged by the first one's answers.
@FAULTS.register("judge/reference_not_compared", where="judge", stage=None)
@contextmanager
def reference_not_compared() -> Iterator[None]:
    """Leave out one of the references, and plan nothing of it."""
    right = case.judge_case

    def wrong(case: Any, candidates: Any, witnesses: Any, *rest: Any, **options: Any) -> Any:
        heard = [witness for witness in witnesses if witness.name != "mitsuba_llvm"]
        return right(case, candidates, heard, *rest, **options)

    with replaced(right, wrong):
        yield


@FAULTS.register("judge/lost_reference_not_missed", where="judge", stage=None)
@contextmanager
def lost_reference_not_missed() -> Iterator[None]:
    """Plan what arrived, whoever was announced."""

    def wrong(*_: Any) -> list[Any]:
        return []

    with replaced(answers.lost, wrong):
        yield


@FAULTS.register("judge/first_candidates_answers", where="judge", stage=None)
@contextmanager
def first_candidates_answers() -> Iterator[None]:
    """Judge every candidate by what the first one answered."""
    right = case.judge_case

    def wrong(case: Any, candidates: Any, *rest: Any, **options: Any) -> Any:
        return right(case, [replace(one, answers=candidates[0].answers) for one in candidates], *rest, **options)

    with replaced(right, wrong):
        yield


@FAULTS.register("judge/reference_never_suspect", where="judge", stage=None)
@contextmanager
def reference_never_suspect() -> Iterator[None]:
    """Adjudicate nothing.

    Whatever differs, the tracer is blamed.
    """
    right = panel.adjudicated

    def wrong(checks: Any, *rest: Any) -> Any:
        return list(checks)

    with replaced(right, wrong):
        yield


@FAULTS.register("judge/renderers_misnamed", where="judge", stage=None)
@contextmanager
def renderers_misnamed() -> Iterator[None]:
    """Shift the names by one.

    The panel's matrix names its rows and columns in another order.
    """
    right = AgreementMatrix.as_json

    def wrong(self: Any) -> Any:
        told = right(self)
        return told | {"renderers": [*told["renderers"][1:], *told["renderers"][:1]]}

    with altered(AgreementMatrix, "as_json", wrong):
        yield


@FAULTS.register("judge/resolution_ignored", where="judge", stage=None)
@contextmanager
def resolution_ignored() -> Iterator[None]:
    """Give every step as 0.

    A coarse output is judged as if it were not.
    """

    def wrong(self: Any, stage: Any, value: Any) -> float:
        return 0.0

    with altered(Coarseness, "step", wrong):
        yield


@FAULTS.register("judge/resolution_twice", where="judge", stage=None)
@contextmanager
def resolution_twice() -> Iterator[None]:
    """Double every step.

    A coarse output's step is allowed twice.
    """
    right = Coarseness.step

    def wrong(self: Any, stage: Any, value: Any) -> Any:
        return 2 * right(self, stage, value)

    with altered(Coarseness, "step", wrong):
        yield


@FAULTS.register("judge/stage_not_planned", where="judge", stage=None)
@contextmanager
def stage_not_planned() -> Iterator[None]:
    """Forget one stage where the plan is made.

    Normal is neither planned nor compared.
    """
    right = oracle.stages_of

    def wrong(scene: Any) -> tuple[Stage, ...]:
        return tuple(stage for stage in right(scene) if stage is not Stage.NORMAL)

    with replaced(right, wrong):
        yield


@FAULTS.register("judge/stage_skipped", where="judge", stage=None)
@contextmanager
def stage_skipped() -> Iterator[None]:
    """Leave one planned stage out.

    Exitance is silently not compared.
    """
    right = checks.pair_checks

    def wrong(pair: Any, stages: Any, *rest: Any) -> Any:
        return right(pair, [stage for stage in stages if stage is not Stage.EXITANCE], *rest)

    with replaced(right, wrong):
        yield


@FAULTS.register("judge/tracer_always_excused", where="judge", stage=None)
@contextmanager
def tracer_always_excused() -> Iterator[None]:
    """Suspect the reference of every failure.

    Whatever differs, the reference is suspected.
    """
    right = panel.adjudicated

    def wrong(checks: Any, *rest: Any) -> Any:
        return [
            structs.replace(check, outcome=Outcome.REFERENCE_SUSPECT) if check.outcome is Outcome.FAIL else check
            for check in right(checks, *rest)
        ]

    with replaced(right, wrong):
        yield
