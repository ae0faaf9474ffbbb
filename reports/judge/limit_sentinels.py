"""`Sentinel`, a self-test, and the self-tests of limits: scenes with limits derived by hand at the middle pixel."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from rayproof.cases.case import Case
from rayproof.cases.rounding import UNIT_ROUNDOFF
from rayproof.cases.scene import Camera, Cube, Plane, PointLight, Scene, Shape, Sphere
from rayproof.cases.stages import Resolution, Stage, StageImages
from rayproof.reference import REFERENCES
from rayproof.reference.analytic import Analytic
from rayproof.reports.judge import case
from rayproof.reports.judge.answers import Answers
from rayproof.reports.judge.oracle import ORACLE, stages_of
from rayproof.reports.results.case_records import Check
from rayproof.reports.results.outcomes import Outcome

SCENE = Scene(
    camera=Camera(
        eye=(3.1, -4.2, 2.6),
        target=(0.1, 0.2, 0.0),
        up=(0.1, 0.2, 1.0),
        fovy=34.0,
        width=24,
        height=18,
        near=0.1,
        far=60.0,
    ),
    shapes=(
        Sphere(albedo=(0.7, 0.5, 0.3), center=(0.3, -0.2, 0.3), radius=0.9),
        Plane(albedo=(0.4, 0.6, 0.8), to_world=((1, 0, 0, 0.3), (0, 1, 0, 0.1), (0, 0, 1, -0.8), (0, 0, 0, 1))),
        Cube(albedo=(0.9, 0.2, 0.4), to_world=((0.8, -0.6, 0, 1.6), (0.6, 0.8, 0, 0.9), (0, 0, 1, -0.3), (0, 0, 0, 1))),
    ),
    lights=(PointLight(position=(1.7, -1.1, 4.2), flux=(90.0, 70.0, 50.0)),),
)
CASE = Case(
    name="sentinel/judge",
    scene=SCENE,
    stresses="Nothing: its answers are spoiled on purpose.",
    covers=("HIT-1",),
    least_interior=200,
    most_explained=0.05,
)


class BrokenJudgeError(RuntimeError):
    """The judge's verdict on a self-test is wrong, so that no verdict can be trusted."""


@dataclass(frozen=True, kw_only=True)
class Sentinel:
    """A self-test of the judge: answers with a known verdict."""

    name: str
    ours: StageImages | None
    theirs: StageImages
    outcome: Outcome
    stage: Stage | None  # the stage to blame; None: any
    case: Case = CASE
    others: tuple[Answers, ...] = ()  # references in addition to the oracle
    steps: Mapping[Stage, Resolution] = field(default_factory=dict)  # of the subject's output
    oracle: Analytic | None = None  # that is wrong on purpose; None: the right one


def rounded(answers: StageImages) -> StageImages:
    """Return the answers of a perfect float32 renderer."""
    return {
        stage: image if stage is Stage.CAMERA else np.asarray(image).astype(np.float32).astype(np.float64)
        for stage, image in answers.items()
    }


def spoilt_at(image: np.ndarray, pixel: tuple[int, int], value: float) -> np.ndarray:
    """Return a copy of an image with the first channel of one pixel replaced."""
    changed = image.copy()
    changed[(*pixel, 0)] = value
    return changed


# Self-tests of the limits: each limit at a pixel at which it can be derived by hand, within 5 %.
#
# The camera is 4 m above the origin, looks down and has a field of view of 90 degrees; the middle one of its 9 x 9
# pixels looks straight down, n.d = 1. There every limit is a multiple of the unit roundoff u, derived below, first for
# a floor (the plane z = 0), then for a unit sphere around the origin, hit at (0, 0, 1). docs/judging.md explains the
# parts of a limit; here it is derived a second time, in numbers, so that no limit changes unintentionally.
#
#     ray        axes 1, at the image's border times (1 + tan 45 deg), tan's condition pi / 2, and twice the coordinates
#                (4 + 0) / 4, times the same factor: 16 (1 + 1 + 1 + pi / 2) + 2 (1 + 1) = 52 + 8 pi
#     distance   floor: 16 (eye and hit 4, the plane's own 1/2, t 4); sphere: 16 (4 + 1, radius 1, hit 1, t 3)
#     position   4 (4 + t) and, end to end, the distance's and t times the ray's
#     normal     16, doubled on the sphere, whose point has as large an error as its radius; end to end the sphere's
#                curvature 1 times the position's
#     irradiance of each light at distance r: 12 + 2 * 3 (|light| + r) / r; end to end 3 / r times the position's and
#                the normal's
#     exitance   3; end to end the irradiance's and 3
#     radiance   4; end to end the irradiance's and 3 + 4


MIDDLE = (4, 4)  # row, column
ALBEDO = (0.5, 0.25, 0.75)
LIGHTS = (
    PointLight(position=(0.0, 0.0, 3.0), flux=(90.0, 70.0, 50.0)),
    PointLight(position=(0.0, 0.0, 6.0), flux=(200.0, 300.0, 100.0)),
)
CAMERA = Camera(
    eye=(0.0, 0.0, 4.0), target=(0.0, 0.0, 0.0), up=(0.0, 1.0, 0.0), fovy=90.0, width=9, height=9, near=0.5, far=99.0
)
CLOSE = 0.05  # relative
MANY = 100  # error of a wrong pixel in limits, so that rounding is negligible
JUST = (0.95, Outcome.PASS), (1.05, Outcome.FAIL)
# The calibrated constants of references whose limits exceed those of their precision; all others have 1.
CONSTANTS: Mapping[str, float] = {}


@dataclass(frozen=True, kw_only=True)
class Pin:
    """One stage's limits at the middle pixel, in units of the sum of both renderers' unit roundoffs."""

    stage: Stage
    continued: tuple[float, ...]  # of each channel
    end_to_end: tuple[float, ...]


@dataclass(frozen=True, kw_only=True)
class KnownLimits:
    """A scene and the limits at its middle pixel."""

    name: str
    scene: Scene
    pins: tuple[Pin, ...]

    @property
    def case(self) -> Case:
        """Return the scene as a case."""
        return Case(
            name=f"sentinel/{self.name}",
            scene=self.scene,
            stresses="Nothing: its limits are known.",
            covers=("HIT-1",),
            least_interior=1,
            most_explained=0.9,
        )


def _known(
    name: str, shape: Shape, *, t: float, height: float, distance: float, normal: float, bend: float
) -> KnownLimits:
    """Return a scene whose middle pixel has a hit at `t` and `height` [m], on a shape of curvature `bend` [1/m].

    `distance` and `normal` are the limits of these stages in unit roundoffs.
    """
    ray = 52 + 8 * math.pi
    position = distance + ray * t + 4 * (4 + t)
    whole_normal = normal + bend * position
    arriving = np.zeros(3)
    own, whole = np.zeros(3), np.zeros(3)
    for light in LIGHTS:
        r = light.position[2] - height
        flux = np.array(light.flux) / (4 * math.pi * r**2)
        relative = 12 + 6 * (light.position[2] + r) / r
        arriving += flux
        own += flux * relative
        whole += flux * (relative + 3 * position / r + whole_normal)
    leaving = arriving * ALBEDO
    pins = (
        Pin(stage=Stage.RAY, continued=(ray,) * 3, end_to_end=(ray,) * 3),
        Pin(stage=Stage.DISTANCE, continued=(distance,), end_to_end=(distance,)),
        Pin(stage=Stage.POSITION, continued=(4 * (4 + t),) * 3, end_to_end=(position,) * 3),
        Pin(stage=Stage.NORMAL, continued=(normal,) * 3, end_to_end=(whole_normal,) * 3),
        Pin(stage=Stage.IRRADIANCE, continued=tuple(own), end_to_end=tuple(whole)),
        Pin(stage=Stage.EXITANCE, continued=tuple(3 * leaving), end_to_end=tuple(whole * ALBEDO + 3 * leaving)),
        Pin(
            stage=Stage.RADIANCE,
            continued=tuple(4 * leaving / math.pi),
            end_to_end=tuple((whole * ALBEDO + 7 * leaving) / math.pi),
        ),
    )
    return KnownLimits(name=name, scene=Scene(camera=CAMERA, shapes=(shape,), lights=LIGHTS), pins=pins)


FLOOR = _known("floor", Plane(albedo=ALBEDO), t=4, height=0, distance=16 * 8.5, normal=16, bend=0)
BALL = _known("ball", Sphere(albedo=ALBEDO), t=3, height=1, distance=16 * 10, normal=32, bend=1)


def guard_limits(oracle: Analytic) -> int:
    """Judge answers that are wrong by known multiples of known limits; return their number.

    Raises:
        BrokenJudgeError: a limit has changed, or a renderer was not judged by its own answers.

    """
    count = 0
    for test, precisions in ((FLOOR, ("float32", "float64")), (BALL, ("float32",))):
        truth = oracle.render(test.scene, stages_of(test.scene))
        for precision in precisions:
            for pin in test.pins:
                count += _guard_pin(test, pin, precision, truth, oracle)
    truth = oracle.render(FLOOR.scene, stages_of(FLOOR.scene))
    _guard_panel(truth, oracle)
    return count + _guard_lights(FLOOR, truth, oracle) + _guard_parties(truth, oracle)


def _guard_pin(test: KnownLimits, pin: Pin, precision: str, truth: StageImages, oracle: Analytic) -> int:
    """Compare one stage's limits of one precision, against the oracle, with their derived values, per channel."""
    u = UNIT_ROUNDOFF[precision] + UNIT_ROUNDOFF["float64"]
    good = _answered(truth, "float64")
    channels = range(len(pin.continued))
    spoilt = {f"channel {c}": _off(good, pin.stage, c, MANY * pin.end_to_end[c] * u) for c in channels}
    # The smaller of the two limits decides.
    least = min(pin.continued[0], pin.end_to_end[0]) * u
    edge = {f"{times} times": (_off(good, pin.stage, 0, times * least), outcome) for times, outcome in JUST}
    # A float64 image has too few digits for an error of so little more or less than its limit.
    edge = edge if precision == "float32" else {}
    subjects = [_candidate(name, precision, answers) for name, answers in spoilt.items()]
    subjects += [_candidate(name, precision, answers) for name, (answers, _) in edge.items()]
    checks = {check.configuration: check for check in _checks(test, oracle, truth, subjects, pin.stage)}
    for name, continued, end_to_end in zip(spoilt, pin.continued, pin.end_to_end, strict=True):
        measurements = checks[name].continued, checks[name].end_to_end
        for how, measured, limit in zip(
            ("by itself", "end to end"), measurements, (continued, end_to_end), strict=True
        ):
            ratio = measured.worst_ratio if measured is not None else math.nan
            what = f"the limit of {pin.stage}, {name}, {how} in {precision} on the {test.name}"
            _expect(ratio, MANY * end_to_end / limit, what)
    for name, (_, outcome) in edge.items():
        if checks[name].outcome is not outcome:
            raise BrokenJudgeError(
                f"the judge is broken: {pin.stage} off by {name} its limit must {outcome}, got {checks[name].outcome}"
            )
    return len(subjects)


def _guard_lights(test: KnownLimits, truth: StageImages, oracle: Analytic) -> int:
    """Judge answers for each light, dark at the middle pixel although nothing hides it there."""
    dark = [_off(_answered(truth, "float32"), Stage.VISIBILITY, light, -1.0) for light in range(len(LIGHTS))]
    subjects = [_candidate(f"light {light}", "float32", answers) for light, answers in enumerate(dark)]
    for check in _checks(test, oracle, truth, subjects, Stage.VISIBILITY):
        if check.outcome is not Outcome.FAIL:
            raise BrokenJudgeError(f"the judge is broken: {check.configuration} is dark and passes")
    return len(subjects)


def _guard_parties(truth: StageImages, oracle: Analytic) -> int:
    """Judge several subjects against all references, each with an error of a different multiple.

    Every pair must be compared by its own answers and at its own precisions, or its ratio is wrong.
    """
    pin = next(pin for pin in FLOOR.pins if pin.stage is Stage.RADIANCE)
    step = pin.end_to_end[1] * UNIT_ROUNDOFF["float32"]
    precisions = {"single": "float32", "double": "float64", "another": "float32"}
    off = {name: MANY * (index + 1) * step for index, name in enumerate(precisions)}
    subjects = [
        _candidate(name, precision, _off(_answered(truth, precision), Stage.RADIANCE, 1, off[name]))
        for name, precision in precisions.items()
    ]
    others = [name for name in REFERENCES if name != ORACLE]
    apart = {ORACLE: 0.0} | {name: -MANY * 7 * (index + 1) * step for index, name in enumerate(others)}
    references = [_witness(name, "float32", _off(truth, Stage.RADIANCE, 1, apart[name])) for name in others]
    checks = _checks(FLOOR, oracle, truth, subjects, Stage.RADIANCE, references)
    compared = {(check.configuration, check.reference): check for check in checks}
    for subject, precision in precisions.items():
        for name, away in apart.items():
            check = compared.get((subject, name))
            if check is None or check.end_to_end is None:
                raise BrokenJudgeError(f"the judge is broken: {subject} is not compared with {name}")
            constant = CONSTANTS.get(name, 1.0)
            roundoff = UNIT_ROUNDOFF["float64" if name == ORACLE else "float32"]
            limit = pin.end_to_end[1] * (UNIT_ROUNDOFF[precision] + constant * roundoff)
            _expect(check.end_to_end.worst_ratio, (off[subject] - away) / limit, f"{subject} before {name}")
    return len(compared)


def _guard_panel(truth: StageImages, oracle: Analytic) -> None:
    """Judge a subject with a planned reference without a reply: each of its checks must be missing."""
    subject, reference = _candidate("sentinel", "float32", rounded(truth)), _witness(ORACLE, "float64", truth)
    judged = case.judge_case(FLOOR.case, [subject], [reference], oracle, {}, panel=(ORACLE, "lost"))
    missed = [check for check in judged.checks if check.reference == "lost" and check.outcome is Outcome.MISSING]
    stages = len(stages_of(FLOOR.scene))
    if len(missed) != stages or judged.planned != 2 * stages or judged.outcome is not Outcome.MISSING:
        raise BrokenJudgeError("the judge is broken: nobody misses a reference that was announced and did not come")


def _checks(
    test: KnownLimits,
    oracle: Analytic,
    truth: StageImages,
    subjects: Sequence[Answers],
    stage: Stage,
    others: Sequence[Answers] = (),
) -> list[Check]:
    """Return the checks of one stage; the oracle is the first reference."""
    references = [_witness(ORACLE, "float64", truth), *others]
    judged = case.judge_case(test.case, subjects, references, oracle, {})
    return [check for check in judged.checks if check.stage is stage]


def _candidate(name: str, precision: str, answers: StageImages) -> Answers:
    return Answers(name=name, precision=precision, answers=answers)


def _witness(name: str, precision: str, answers: StageImages) -> Answers:
    return Answers(name=name, precision=precision, independent=True, answers=answers)


def _answered(truth: StageImages, precision: str) -> StageImages:
    """Return the truth as a different renderer computes it: with different last bits, so that it is no copy."""
    if precision == "float32":
        return rounded(truth)
    return {
        stage: image if stage is Stage.CAMERA else np.nextafter(image, np.where(np.isfinite(image), 0.0, image))
        for stage, image in truth.items()
    }


def _off(answers: StageImages, stage: Stage, channel: int, amount: float) -> StageImages:
    """Return answers with one channel of the middle pixel wrong by `amount`."""
    image = np.array(answers[stage])
    image[(*MIDDLE, channel)] += amount
    return answers | {stage: image}


def _expect(ratio: float, wanted: float, what: str) -> None:
    if not abs(ratio - wanted) <= CLOSE * wanted:
        raise BrokenJudgeError(f"the judge is broken: {what} must be used {wanted:.4g} times, got {ratio:.4g}")
