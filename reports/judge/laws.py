"""Laws judged on a renderer: the limit of a relation's two sides, whether they differ more, and the record.

Rounding makes a value differ by some u of its own size. It also turns the camera's ray by some u and moves the hit by
some u of the coordinates: that slides the value over the image by u x pixels per radian pixels, and over one pixel it
changes by no more than the range of the 3 x 3 neighbours. `condition` is how much the scene itself magnifies both.
Source: Higham, Accuracy and Stability of Numerical Algorithms, 2nd ed. (2002), chapters 1 and 3.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from rayproof.cases.case import ITEMS
from rayproof.cases.laws import LAWS
from rayproof.cases.laws.relations import Relation
from rayproof.cases.placement import world_triangles
from rayproof.cases.rounding import UNIT_ROUNDOFF
from rayproof.cases.scene import Camera, Mesh, Scene, Triangle
from rayproof.cases.stages import Resolution, Stage
from rayproof.reports.judge.conditioning import ABSOLUTE, basis_condition, image_reach
from rayproof.reports.judge.measurement import jsonable
from rayproof.reports.results.case_records import (
    BY_LAWS,
    CaseRecord,
    Check,
    Examined,
    LawRecord,
    Measurement,
    shortened,
)
from rayproof.reports.results.outcomes import Outcome, worst

# Roundings from pixel to radiance, each side of a relation: ray 16, hit 16, position 4, normal 16, light 12
# (`reports.judge.limits`). The sum is what one side may be off; two random sides come near to it together.
K = 64
# A relation whose limit is a larger share of the values themselves than this tells nothing.
TELLING = 0.01
UNITS = (Stage.RAY, Stage.NORMAL)
WHOLE = (Stage.OBJECT, Stage.VISIBILITY)  # integers: equal or not
STEPS = [(row, column) for row in (-1, 0, 1) for column in (-1, 0, 1) if (row, column) != (0, 0)]


def pixels_per_radian(camera: Camera) -> float:
    """Return how many rows a radian has at the image's centre, where it has the fewest."""
    return camera.height / (2 * math.tan(camera.alpha))


def condition(scene: Scene) -> float:
    """Return how much a scene magnifies rounding: its camera's axes, and the worst of its model matrices."""
    numbers = [1.0]
    for shape in scene.shapes:
        if not isinstance(shape, Triangle | Mesh):  # these are baked, and their matrix is not met again
            singular = np.linalg.svd(np.asarray(shape.to_world)[:3, :3], compute_uv=False)
            numbers.append(float(singular[0] / singular[2]))
    return basis_condition(scene.camera) * max(numbers)


def baking_condition(scene: Scene) -> float:
    """Return how much a triangle turns when its corners are rounded: coordinates over the least height, the worst."""
    worst = 1.0
    for shape in scene.shapes:
        if isinstance(shape, Triangle | Mesh):
            corners = world_triangles(shape).astype(np.float64)
            edges = np.roll(corners, -1, axis=1) - corners
            twice_area = np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=-1)
            longest = np.linalg.norm(edges, axis=-1).max(axis=-1)
            size = np.abs(corners).max(axis=(1, 2))
            whole = twice_area > 0
            if np.any(whole):
                worst = max(worst, float((size * longest / np.where(whole, twice_area, 1.0))[whole].max()))
    return worst


def roundoff(relation: Relation, precision: str) -> float:
    """Return K u condition of a relation [1]."""
    u = UNIT_ROUNDOFF[precision] * max(condition(relation.scene), condition(relation.changed))
    if relation.conditions.rebaked:
        u += UNIT_ROUNDOFF["float32"] * max(baking_condition(relation.scene), baking_condition(relation.changed))
    return K * u * relation.conditions.factor


def neighbours(image: np.ndarray) -> np.ndarray:
    """Return the eight neighbours (8, height, width, channels) of an image; beyond its border the border's own."""
    padded = np.pad(image, ((1, 1), (1, 1), (0, 0)), mode="edge")
    height, width = image.shape[:2]
    return np.stack([padded[1 + row : 1 + row + height, 1 + column : 1 + column + width] for row, column in STEPS])


def sizes(relation: Relation) -> np.ndarray:
    """Return the size of the numbers that a value was made from, in its unit, in the image's shape."""
    image = np.abs(np.nan_to_num(relation.expected, posinf=0.0))
    if relation.stage in UNITS:
        return np.ones_like(image)
    if relation.stage is Stage.POSITION:
        eyes = max(float(np.linalg.norm(one.camera.eye)) for one in (relation.scene, relation.changed))
        return np.full_like(image, eyes) + np.linalg.norm(image, axis=-1, keepdims=True)
    return image if relation.terms is None else np.maximum(image, relation.terms)


def limit(relation: Relation, precision: str, coarse: Resolution | None = None) -> np.ndarray:
    """Return the largest allowed error of a relation's values, in their unit and shape.

    A coarse output's step is allowed to either side.
    """
    image = relation.expected
    if relation.stage in WHOLE:
        return np.zeros(image.shape)
    size = sizes(relation)
    step = 2 * (coarse.relative * size + coarse.absolute) if coarse is not None else np.zeros(image.shape)
    if relation.conditions.exact:
        return step
    factor = roundoff(relation, precision)
    if relation.stage is Stage.CAMERA:
        return factor * size
    finite = np.where(np.isfinite(image), image, np.nan)
    around = np.concatenate([neighbours(finite), finite[np.newaxis]])
    with np.errstate(invalid="ignore"):
        high = np.where(np.isnan(around), -np.inf, around).max(axis=0)
        low = np.where(np.isnan(around), np.inf, around).min(axis=0)
    spread = np.where(high >= low, high - low, 0.0)
    # The pixel's own coordinates are off by roundings of 1, which a wide image magnifies (`ray_condition`).
    wide = max(1.0, ABSOLUTE / K * image_reach(relation.scene.camera))
    slide = pixels_per_radian(relation.scene.camera) * wide * spread
    return factor * (size + slide) + relation.conditions.truncation * size + step


# One relation judged: how many of its values lie within the limit, at an edge, or outside.
BEND = 0.5  # of a step from pixel to pixel: where an image bends by more, an edge runs between the two
MOST_EXCUSED = 0.02  # share of the pixels examined that rounding may move over an edge
ALWAYS = 8  # pixels that it may in any image: an edge that runs along a short row


@dataclass(frozen=True, kw_only=True)
class Judged:
    """The result of a relation."""

    stage: Stage
    what: str
    examined: int  # pixels
    excused: int  # of these, at an edge, with the value of a neighbour
    outside: int  # of these, with a value that nothing explains
    worst: float  # largest error over K u (size + pixels per radian x range), edges left out
    pixel: tuple[int, int] | None  # column and row of the worst pixel outside
    expected: tuple[float, ...] = ()  # there
    measured: tuple[float, ...] = ()
    ill_conditioned: bool = False  # the limit is too wide to tell anything

    @property
    def alarm(self) -> bool:
        """Say whether the law is broken."""
        return self.outside > 0 or self.excused > max(ALWAYS, MOST_EXCUSED * self.examined)


def judge(relation: Relation, precision: str, coarse: Resolution | None = None) -> Judged:
    """Return what becomes of a relation of images that `precision` computed and an output may have made coarse."""
    expected, measured = relation.expected, relation.measured
    if expected.shape != measured.shape:
        return _misshapen(relation)
    wide = not relation.conditions.exact and roundoff(relation, precision) > TELLING
    if wide and relation.stage not in WHOLE:
        return Judged(
            stage=relation.stage, what=relation.what, examined=0, excused=0, outside=0, worst=0.0, pixel=None,
            ill_conditioned=True,
        )  # fmt: skip
    allowed = limit(relation, precision, coarse)
    error = difference(expected, measured)
    pixels = np.ones(expected.shape[:2], dtype=bool) if relation.examined is None else relation.examined
    beyond = np.any(~(error <= allowed), axis=-1) & pixels
    smooth = relation.stage in (Stage.CAMERA, Stage.RAY)
    excused = np.zeros_like(beyond) if smooth or not beyond.any() else beyond & _at_an_edge(relation, allowed)
    outside = beyond & ~excused
    ratio = ratios(relation, precision, coarse)
    ratio = np.where((pixels & ~excused)[..., np.newaxis], ratio, 0.0)
    row, column = np.unravel_index(int(np.argmax(np.where(outside, ratio.max(axis=-1), -1.0))), outside.shape)
    bad = bool(outside.any())
    return Judged(
        stage=relation.stage,
        what=relation.what,
        examined=int(pixels.sum()),
        excused=int(excused.sum()),
        outside=int(outside.sum()),
        worst=float(ratio.max(initial=0.0)),
        pixel=(int(column), int(row)) if bad else None,
        expected=tuple(map(float, expected[row, column])) if bad else (),
        measured=tuple(map(float, measured[row, column])) if bad else (),
    )


def _misshapen(relation: Relation) -> Judged:
    count = int(np.prod(relation.expected.shape[:2]))
    return Judged(
        stage=relation.stage, what=relation.what, examined=count, excused=0, outside=count, worst=np.inf, pixel=None
    )  # fmt: skip


def ratios(relation: Relation, precision: str, coarse: Resolution | None = None) -> np.ndarray:
    """Return error over limit, in the shape of a relation's images; 0 where there is no error, whatever the limit."""
    allowed = limit(relation, precision, coarse)
    error = difference(relation.expected, relation.measured)
    return np.divide(error, allowed, out=np.where(error > 0, np.inf, 0.0), where=allowed > 0)


def difference(expected: np.ndarray, measured: np.ndarray) -> np.ndarray:
    """Return |expected - measured|: 0 where both are the same infinity, infinite where either is NaN."""
    with np.errstate(invalid="ignore"):
        apart = np.abs(expected - measured)
    return np.where(expected == measured, 0.0, np.where(np.isnan(apart), np.inf, apart))


def _at_an_edge(relation: Relation, allowed: np.ndarray) -> np.ndarray:
    """Return where (height, width) an edge runs close by and the measured value is one from beyond it.

    At an edge the expected image bends: what it gains in one direction it does not lose in the other. The value beyond
    is a neighbour's, less at most what separates that one from the next pixel on the same line.
    """
    image, value = (np.where(np.isfinite(one), one, np.nan) for one in (relation.expected, relation.measured))
    # A distance is infinite where nothing is hit; nothing else ever is, and NaN is nobody's value.
    broken = np.isnan(relation.expected) | np.isnan(relation.measured)
    if relation.stage is not Stage.DISTANCE:
        broken |= np.isinf(relation.expected) | np.isinf(relation.measured)
    around = neighbours(image)
    further = np.stack([neighbours(one)[index] for index, one in enumerate(around)])
    with np.errstate(invalid="ignore"):
        steps = np.linalg.norm(around - image, axis=-1).max(axis=0)
        bends = np.linalg.norm(around + around[::-1] - 2 * image, axis=-1).max(axis=0)
        beyond = np.all(np.abs(value - around) <= np.abs(around - further) + 2 * allowed, axis=-1).any(axis=0)
    empty = np.isnan(around).any(axis=-1).any(axis=0)  # a miss is next to it
    missed, gone = np.isnan(image).any(axis=-1), np.isnan(value).any(axis=-1)
    return np.where(gone, empty, ((bends > BEND * steps) | empty | missed) & beyond) & ~broken.any(axis=-1)


# What the laws of a case say, as checks of its record beside those of the references.
SHOWN = 3  # broken laws of a stage that a reason tells one by one
BECAUSE = f"{K} u times the scene's condition times (the value's size + pixels per radian x the neighbours' range)"


@dataclass(frozen=True, kw_only=True)
class LawReport:
    """What one law says of one configuration on a case: its relations, or the sentence that says why there are none."""

    law: str
    configuration: str
    judged: tuple[Judged, ...] = ()
    unsupported: str | None = None  # the subject's reason
    error: str | None = None

    @property
    def alarms(self) -> tuple[Judged, ...]:
        """Return the relations that are broken."""
        return tuple(one for one in self.judged if one.alarm)

    @property
    def outcome(self) -> Outcome:
        """Return the law's verdict; it is undecided where no relation could be examined."""
        if self.error is not None:
            return Outcome.ERROR
        if self.unsupported is not None:
            return Outcome.UNSUPPORTED
        if self.alarms:
            return Outcome.FAIL
        return Outcome.PASS if any(one.examined for one in self.judged) else Outcome.UNDECIDED

    def as_json(self) -> LawRecord:
        """Return plain JSON data."""
        return {
            "law": self.law,
            "configuration": self.configuration,
            "verdict": self.outcome.value,
            "relations": sum(one.examined > 0 for one in self.judged),
            "ill_conditioned": sum(one.ill_conditioned for one in self.judged),
            "excused": sum(one.excused for one in self.judged),
            "worst_ratio": jsonable(shortened(max((one.worst for one in self.judged), default=0.0))),
            "reason": self.error or self.unsupported or "; ".join(_sentence(self.law, one) for one in self.alarms[:1]),
        }


def with_laws(record: CaseRecord, reports: Sequence[LawReport]) -> CaseRecord:
    """Return a case's record with the checks of its laws: a broken one fails the case, as a reference's does."""
    checks: list[Check] = []
    for configuration in dict.fromkeys(report.configuration for report in reports):
        own = [report for report in reports if report.configuration == configuration]
        checks += [check for stage in Stage if (check := _check(own, stage)) is not None]
    record["laws"] = [report.as_json() for report in reports]
    record["checks"] = [*record["checks"], *checks]
    record["planned"] += len(checks)
    bad = [check for check in checks if check.outcome != Outcome.PASS]
    outcome = worst([Outcome(record["verdict"]), *(check.outcome for check in bad)])
    if outcome != record["verdict"]:
        first = next(check for check in bad if check.outcome == outcome)
        record.update({"verdict": outcome.value, "stage": first.stage, "item": None, "reason": first.reason})
        if outcome is Outcome.FAIL:
            record["blamed_items"] = items = implicated([report.law for report in reports if report.alarms])
            record["item"] = items[0] if len(items) == 1 else None
    return record


def implicated(broken: Sequence[str]) -> list[str]:
    """Return the items that every broken law speaks of; where there is none, those that any of them speaks of."""
    each = [set(LAWS.about(law)["implicates"]) for law in broken]
    named = set.intersection(*each) or set.union(*each)
    return [item for item in ITEMS if item in named]


def _check(reports: Sequence[LawReport], stage: Stage) -> Check | None:
    """Return what the laws of one configuration say of a stage, by the worst of their relations; None: nothing."""
    judged = [(report.law, one) for report in reports for one in report.judged if one.stage is stage and one.examined]
    lost = [report for report in reports if report.error is not None and LAWS.about(report.law)["stage"] is stage]
    if not judged and not lost:
        return None
    broken = {law: one for law, one in sorted(judged, key=lambda each: each[1].worst) if one.alarm}
    reasons = [_sentence(law, one) for law, one in reversed(broken.items())]
    reasons = reasons or [f"law {report.law}: {report.error}" for report in lost]
    more = f"; {len(reasons) - SHOWN} more" if len(reasons) > SHOWN else ""
    outcome = Outcome.FAIL if broken else Outcome.ERROR if lost else Outcome.PASS
    chosen = max((one for _, one in judged), key=lambda one: (one.alarm, one.worst), default=None)
    ratio = 0.0 if chosen is None else shortened(chosen.worst)
    measured = None
    if chosen is not None:  # its pixel is one of a changed scene, and stands in the reason alone
        measured = Measurement(
            worst_ratio=ratio,
            worst_inside=ratio,
            worst_error=None,
            limit=None,
            pixel=None,
            interior=chosen.examined - chosen.excused,
            over_inside=chosen.outside,
            edge=chosen.excused,
        )
    return Check(
        configuration=reports[0].configuration,
        reference=BY_LAWS,
        stage=stage,
        outcome=outcome,
        reason="; ".join(reasons[:SHOWN]) + more,
        ratio=ratio,
        end_to_end=measured,
        examined=_examined([relation for _, relation in judged]),
        because=BECAUSE,
    )


def _examined(judged: Sequence[Judged]) -> Examined:
    """Return what became of the pixels of relations: within the limit, a neighbour's value at an edge, or wrong."""
    pixels, side, wrong = (sum(getattr(each, name) for each in judged) for name in ("examined", "excused", "outside"))
    return Examined(pixels=pixels, side=side, wrong=wrong)


def _sentence(law: str, one: Judged) -> str:
    """Return what is broken in words, with the two values at the worst pixel of the changed scene."""
    items = ", ".join(LAWS.about(law)["implicates"])
    if one.pixel is None:
        values = f"{one.outside or one.excused} of {one.examined} pixels are wrong or have a neighbour's value"
    else:
        expected, measured = (", ".join(f"{value:.9g}" for value in values) for values in (one.expected, one.measured))
        values = f"at pixel {one.pixel} it expects ({expected}), and ({measured}) was measured"
    return f"law {law} is broken ({one.what}): {values}; it implicates {items}"
