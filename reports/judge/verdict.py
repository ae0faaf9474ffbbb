"""From a case's checks and closed forms to its verdict, the stage to blame and the specification item behind it."""

from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from rayproof.cases.case import ITEMS, Case
from rayproof.cases.scene import Cube, Mesh, Plane, Scene, Shape, Sphere, Square, Triangle
from rayproof.cases.stages import Stage
from rayproof.reports.judge.answers import Candidate
from rayproof.reports.judge.box_filter import configuration_of
from rayproof.reports.judge.checks import Check, accounted
from rayproof.reports.judge.panel import Matrix
from rayproof.reports.judge.scene_truth import Ground
from rayproof.reports.results.outcomes import Outcome, worst
from rayproof.reports.results.records import ExpectationRecord


@dataclass(frozen=True, kw_only=True)
class Judged:
    """A case's checks and what they add up to."""

    case: Case
    checks: list[Check]
    expectations: list[ExpectationRecord]
    outcome: Outcome
    stage: Stage | None = None
    item: str | None = None
    reason: str = ""
    planned: int
    panel: Mapping[Stage, Matrix] = field(default_factory=dict)  # everybody against everybody
    ground: Ground | None = None  # on which it was judged; None where the oracle had no answer

    def worsened(self, outcome: Outcome, reason: str) -> "Judged":
        """Return it with a worse outcome for a reason of its own; a verdict that is as bad or worse stays."""
        if outcome is self.outcome or worst([self.outcome, outcome]) is not outcome:
            return self
        return replace(self, outcome=outcome, reason=reason, stage=None, item=None)


def sum_up(
    case: Case,
    checks: Sequence[Check],
    expectations: list[ExpectationRecord],
    planned: int,
    candidates: Mapping[str, Candidate] | None,
    panel: Mapping[Stage, Matrix],
) -> Judged:
    """Return the case's verdict: the worst of its checks and expectations, and the first stage to blame.

    Without `candidates` no item is blamed.
    """
    checks = accounted(checks, case.scene, tuned=case.tuned)
    outcome = case_outcome(checks, expectations)
    judged = Judged(case=case, checks=checks, expectations=expectations, outcome=outcome, planned=planned, panel=panel)
    if outcome is Outcome.PASS:
        return judged
    order = list(Stage)
    # A stage that is wrong by itself comes before one that only shows what it was handed.
    guilty = min(
        (check for check in checks if check.outcome is outcome),
        key=lambda check: (not check.alone, order.index(check.stage), -check.ratio),
        default=None,
    )
    if guilty is None:
        broken = next(one for one in expectations if one["verdict"] == outcome.value)
        reason = f"{broken['configuration']}: {broken['measured']} instead of {broken['expected']}: {broken['because']}"
        return replace(judged, stage=Stage(broken["stage"]), reason=reason)
    item = None
    if candidates is not None and outcome is Outcome.FAIL:
        same = [one for one in checks if one.configuration == guilty.configuration and one.alone]
        phantom = any(one.stage is Stage.DISTANCE for one in same)
        item = _item(case, guilty, candidates[configuration_of(guilty.configuration)], phantom=phantom)
    reason = f"{guilty.configuration} against {guilty.reference}, {guilty.stage}: {guilty.reason}"
    return replace(judged, stage=guilty.stage, item=item, reason=reason)


def case_outcome(checks: Sequence[Check], expectations: Sequence[ExpectationRecord]) -> Outcome:
    """Return the worst outcome of checks and closed forms; what is undecided leaves the word to the rest.

    Camera and rays are decided whatever the scene: where they alone are, the scene's question is undecided.
    """
    outcomes = [check.outcome for check in checks] + [Outcome(one["verdict"]) for one in expectations]
    found = worst(outcomes)
    asked = [check.outcome for check in checks if check.stage not in (Stage.CAMERA, Stage.RAY)]
    answered = {Outcome.PASS, Outcome.WARN}
    if found in answered and Outcome.UNDECIDED in asked and not answered & {*asked}:
        return Outcome.UNDECIDED
    return found


def _item(case: Case, check: Check, candidate: Candidate, *, phantom: bool) -> str:
    """Return the specification item behind a failed check."""
    ours = theirs = -1
    measured = check.continued if check.alone else check.end_to_end
    known = candidate.answers is not None and Stage.OBJECT in candidate.answers
    if measured is not None and measured.pixel is not None and known:
        assert candidate.answers is not None
        column, row = measured.pixel
        ours = _shape(case.scene, candidate.answers[Stage.OBJECT][row, column, 0])
        theirs = _shape(case.scene, measured.theirs[0]) if check.stage is Stage.OBJECT else ours
    turned = False
    if check.stage is Stage.NORMAL and measured is not None and ours >= 0:
        turned = misplaced(case.scene.shapes[ours], measured.ours, measured.theirs)
    return item(
        check.stage,
        case.scene,
        candidate.items,
        ours=ours,
        theirs=theirs,
        alone=check.alone,
        part=check.part,
        phantom=phantom,
        misplaced=turned,
    )


def _shape(scene: Scene, number: float) -> int:
    """Return the index of the shape that a pixel's object names; -1 where it misses, or names none (NaN, say)."""
    return int(number) if 0 <= number < len(scene.shapes) else -1


# From a stage that failed to the specification item whose formula is to blame.


HITS: dict[type[Shape], tuple[str, ...]] = {
    Sphere: ("HIT-1",),
    Cube: ("HIT-3",),
    Plane: ("HIT-4",),
    Triangle: ("HIT-5", "HIT-6"),
    Mesh: ("HIT-5", "HIT-6"),
    Square: ("HIT-7", "HIT-8"),
}
# rad: a normal that is wrong for another reason comes this near to one of two by chance in one case of a million.
CLOSE = 1e-3
NORMALS: dict[type[Shape], str] = {Sphere: "NRM-1", Cube: "NRM-2"}
MATRICES = ("XF-1", "XF-2")
_HITS = ("HIT-1", "HIT-2", "HIT-3", "HIT-4", "HIT-5", "HIT-6", "HIT-7", "HIT-8", "HIT-9")
# Items whose formula can make a stage wrong though the stages before it are right. A feeler meets shapes as well,
# behind the eye and from inside, where no ray of the camera shows it; a light is left out of visibility or of the sum.
COMPUTED: dict[Stage, tuple[str, ...]] = {
    Stage.CAMERA: ("CAM-1", "CAM-2", "CAM-3", "CAM-5"),
    Stage.RAY: ("CAM-1", "CAM-2", "CAM-3", "CAM-4", "CAM-5"),
    Stage.OBJECT: (*MATRICES, *_HITS),
    Stage.DISTANCE: (*MATRICES, *_HITS),
    Stage.POSITION: MATRICES,
    Stage.NORMAL: ("XF-2", "NRM-1", "NRM-2", "NRM-3"),
    Stage.VISIBILITY: (*MATRICES, *_HITS, "LIT-1", "LIT-2", "LIT-3", "LIT-4", "LIT-5", "RAD-2"),
    Stage.IRRADIANCE: ("LIT-1", "RAD-1", "RAD-2", "RAD-3", "RAD-5"),
    Stage.EXITANCE: ("RAD-4",),
    Stage.RADIANCE: ("NRM-3", "RAD-4"),
}
# Kinds of shapes without which an item is not asked for.
OF_SHAPES: dict[str, tuple[type[Shape], ...]] = {
    **{name: tuple(kind for kind, names in HITS.items() if name in names) for names in HITS.values() for name in names},
    **{name: (kind,) for kind, name in NORMALS.items()},
}


def candidates(stage: Stage, passing: Collection[Stage], shapes: Collection[str]) -> tuple[str, ...]:
    """Return the items that may be to blame where `stage` is the first that is wrong.

    That is those of the stage itself and of each stage before it that nobody has seen pass. `passing` are the stages
    written that pass in the case, `shapes` the names of the scene's kinds of shapes.
    """
    order = list(Stage)
    suspects = [stage, *(before for before in order[: order.index(stage)] if before not in passing)]
    if Stage.RAY in passing and stage is not Stage.CAMERA:
        suspects = [one for one in suspects if one is not Stage.CAMERA]  # of a camera images show nothing but its rays
    named = {name for one in suspects for name in COMPUTED[one]}
    kinds = {name: {kind.__name__ for kind in kinds} for name, kinds in OF_SHAPES.items()}
    return tuple(name for name in ITEMS if name in named and (name not in kinds or kinds[name] & set(shapes)))


def item(
    stage: Stage,
    scene: Scene,
    items: Collection[str],
    *,
    ours: int,
    theirs: int,
    alone: bool,
    part: str | None = None,
    phantom: bool = False,
    misplaced: bool = False,
) -> str:
    """Return the item to blame for `stage`, among the `items` that the configuration's formulas cover.

    `ours` and `theirs` are the shape indices at the worst pixel (-1: none). `alone` says that the stage is wrong even
    given the tracer's own previous stages; `part` is the camera stage's worst item; `phantom` says that distances are
    wrong by themselves, so that something was hit where it is not; `misplaced` that a normal was brought into the world
    by the wrong matrix.
    """
    if stage is Stage.CAMERA:
        return part or "CAM-1"
    if stage is Stage.RAY:
        return _first(("CAM-5", "CAM-4"), items)
    if stage in (Stage.OBJECT, Stage.DISTANCE):
        # Two hits of which the farther was taken: choosing is to blame, not the shapes' own tests.
        if stage is Stage.OBJECT and ours >= 0 and theirs >= 0 and ours != theirs and not phantom:
            return "HIT-9"
        index = theirs if theirs >= 0 and not (phantom and ours >= 0) else ours
        if index < 0:
            return "HIT-9"
        if stage is Stage.DISTANCE and not alone:
            return _first(("CAM-5", "CAM-4"), items)
        return _first(tuple(reversed(HITS[type(scene.shapes[index])])), items)
    if stage is Stage.POSITION:
        return "XF-2"
    if stage is Stage.NORMAL:
        index = ours if ours >= 0 else theirs
        local = NORMALS.get(type(scene.shapes[index])) if index >= 0 and not misplaced else None
        return local or "NRM-3"
    if stage is Stage.VISIBILITY:
        return _first(("LIT-2", "LIT-3", "LIT-4"), items, otherwise="LIT-1")
    if stage is Stage.IRRADIANCE:
        return "RAD-3" if scene.shading == "simplified" else "RAD-2"
    return "RAD-4"


def misplaced(shape: Shape, ours: Sequence[float], theirs: Sequence[float]) -> bool:
    """Say whether a wrong normal is the right one of object space, turned by the model matrix itself or not at all."""
    matrix = np.asarray(shape.to_world, dtype=np.float64)[:3, :3]
    wrong, right = np.asarray(ours, dtype=np.float64), np.asarray(theirs, dtype=np.float64)
    usable = all(len(one) == 3 and np.isfinite(one).all() and np.any(one) for one in (wrong, right))
    if not usable or _angle(wrong, right) <= CLOSE:
        return False
    local = matrix.T @ right
    return min(_angle(wrong, matrix @ local), _angle(wrong, local)) <= CLOSE


def _angle(one: np.ndarray, other: np.ndarray) -> float:
    """Return the angle [rad] between two lines: a normal may have been turned towards the viewer."""
    return float(np.arctan2(np.linalg.norm(np.cross(one, other)), abs(np.dot(one, other))))


def _first(wanted: tuple[str, ...], items: Collection[str], otherwise: str | None = None) -> str:
    """Return the first of `wanted` that the configuration covers."""
    return next((name for name in wanted if name in items), otherwise or wanted[-1])


# A subject that supports some stages only is judged on these: what it says it cannot is no pass and no failure.
#
# Checks of such stages stay `unsupported`; a case in which nothing else was measured is `unsupported` as well.


def of_what_is_supported(judged: Judged, candidates: Sequence[Candidate]) -> Judged:
    """Return the verdict by what was measured, if nothing is amiss but stages that a candidate declared."""
    if judged.outcome is not Outcome.UNSUPPORTED:
        return judged
    declared = {(candidate.name, stage) for candidate in candidates for stage in candidate.unsupported}
    left = [one for one in judged.checks if (one.configuration, one.stage) not in declared]
    lost = next((one for one in left if one.outcome is Outcome.UNSUPPORTED), None)
    if lost is not None:  # a stage that was neither given nor declared
        why = f"{lost.configuration} against {lost.reference}, {lost.stage}: {lost.reason}"
        return replace(judged, outcome=Outcome.MISSING, stage=lost.stage, item=None, reason=why)
    if left or judged.expectations:
        outcome = case_outcome(left, judged.expectations)
        why = next((one.reason for one in left if one.outcome is outcome), "")
        return replace(judged, outcome=outcome, stage=None, item=None, reason=why)
    return judged
