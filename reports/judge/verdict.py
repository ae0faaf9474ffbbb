"""The verdict of a case: its outcome, the stage to blame and the items to blame, from checks and closed forms."""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace

from rayproof.cases.case import ITEMS, ITEMS_OF_OTHERS, Case
from rayproof.cases.scene import Cube, Mesh, Plane, Shape, Sphere, Square, Triangle
from rayproof.cases.stages import Stage
from rayproof.reports.judge.against_oracle import AgainstOracle
from rayproof.reports.judge.answers import Answers
from rayproof.reports.judge.checks import accounted
from rayproof.reports.judge.panel import AgreementMatrix
from rayproof.reports.judge.scene_truth import SceneTruth
from rayproof.reports.results.case_records import Check, ExpectationRecord
from rayproof.reports.results.outcomes import Outcome, worst


@dataclass(frozen=True, kw_only=True)
class Judged:
    """A case's checks and its verdict."""

    case: Case
    checks: list[Check]
    expectations: list[ExpectationRecord]
    outcome: Outcome
    stage: Stage | None = None
    blamed: tuple[str, ...] = ()  # the specification's items between which the checks cannot decide
    reason: str = ""
    planned: int
    panel: Mapping[Stage, AgreementMatrix] = field(default_factory=dict)  # all pairs of renderers
    base: SceneTruth | None = None  # the truth of the case; None without an answer of the oracle
    against: Mapping[str, AgainstOracle] = field(default_factory=dict)  # by the renderer's name

    def worsened(self, outcome: Outcome, reason: str) -> "Judged":
        """Return it with a worse outcome and its reason; unchanged if the verdict is at least as bad."""
        if outcome is self.outcome or worst([self.outcome, outcome]) is not outcome:
            return self
        return replace(self, outcome=outcome, reason=reason, stage=None, blamed=())


def sum_up(
    case: Case,
    checks: Sequence[Check],
    expectations: list[ExpectationRecord],
    planned: int,
    subjects: Mapping[str, Answers] | None,
    panel: Mapping[Stage, AgreementMatrix],
) -> Judged:
    """Return the case's verdict: the worst of its checks and expectations, and the first stage to blame.

    Without `subjects` no items are blamed.
    """
    checks = accounted(checks, case.scene)
    outcome = case_outcome(checks, expectations)
    judged = Judged(case=case, checks=checks, expectations=expectations, outcome=outcome, planned=planned, panel=panel)
    if outcome is Outcome.PASS:
        return judged
    order = list(Stage)
    # A stage that is wrong by itself precedes a stage with only propagated errors.
    failure = min(
        (check for check in checks if check.outcome is outcome),
        key=lambda check: (not check.alone, order.index(check.stage), -check.ratio),
        default=None,
    )
    if failure is None:
        broken = next(check for check in expectations if check["verdict"] == outcome.value)
        reason = f"{broken['configuration']}: {broken['measured']} instead of {broken['expected']}: {broken['because']}"
        return replace(judged, stage=Stage(broken["stage"]), reason=reason)
    blamed: tuple[str, ...] = ()
    if subjects is not None and outcome is Outcome.FAIL:
        named = next(
            check.configuration for check in checks if check.outcome is outcome and check.stage is failure.stage
        )
        verdicts = [(check.stage.value, check.outcome.value) for check in checks if check.configuration == named]
        own = subjects[named].items if named in subjects else ITEMS_OF_OTHERS
        shapes = [type(shape).__name__ for shape in case.scene.shapes]
        blamed = items_to_blame(failure.stage, verdicts, shapes, () if own == ITEMS_OF_OTHERS else own)
    reason = f"{failure.configuration} against {failure.reference}, {failure.stage}: {failure.reason}"
    return replace(judged, stage=failure.stage, blamed=blamed, reason=reason)


def case_outcome(checks: Sequence[Check], expectations: Sequence[ExpectationRecord]) -> Outcome:
    """Return the worst outcome of checks and closed forms; undecided checks count only if there are no others.

    Camera and rays are decided in every scene: if only they are, the case is undecided.
    """
    outcomes = [check.outcome for check in checks] + [Outcome(expectation["verdict"]) for expectation in expectations]
    outcome = worst(outcomes)
    scene_outcomes = [check.outcome for check in checks if check.stage not in (Stage.CAMERA, Stage.RAY)]
    answered = {Outcome.PASS, Outcome.WARN}
    if outcome in answered and Outcome.UNDECIDED in scene_outcomes and not answered & {*scene_outcomes}:
        return Outcome.UNDECIDED
    return outcome


# The specification's items whose formulas are to blame for a failed stage.


HITS: dict[type[Shape], tuple[str, ...]] = {
    Sphere: ("HIT-1",),
    Cube: ("HIT-3",),
    Plane: ("HIT-4",),
    Triangle: ("HIT-5", "HIT-6"),
    Mesh: ("HIT-5", "HIT-6"),
    Square: ("HIT-7", "HIT-8"),
}
NORMALS: dict[type[Shape], str] = {Sphere: "NRM-1", Cube: "NRM-2"}
MATRICES = ("XF-1", "XF-2")
_HITS = ("HIT-1", "HIT-2", "HIT-3", "HIT-4", "HIT-5", "HIT-6", "HIT-7", "HIT-8", "HIT-9")
# Items whose formula can make a stage wrong although the stages before it are right. A shadow ray hits shapes as well,
# behind the eye and from inside, which no camera ray shows; a light may be missing in visibility or in the sum.
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
GOOD = frozenset({Outcome.PASS.value, Outcome.WARN.value})
# Item -> kinds of shapes that use the item.
OF_SHAPES: dict[str, tuple[type[Shape], ...]] = {
    **{name: tuple(kind for kind, names in HITS.items() if name in names) for names in HITS.values() for name in names},
    **{name: (kind,) for kind, name in NORMALS.items()},
}


def possible_items(stage: Stage, passing: Collection[Stage], shapes: Collection[str]) -> tuple[str, ...]:
    """Return the items that may be to blame if `stage` is the first wrong stage.

    They belong to the stage itself and to each stage before it without a passing check. `passing` are the stages that
    pass in the case, `shapes` the names of the scene's kinds of shapes.
    """
    order = list(Stage)
    suspects = [stage, *(before for before in order[: order.index(stage)] if before not in passing)]
    if Stage.RAY in passing and stage is not Stage.CAMERA:
        # Images depend on the camera only through its rays.
        suspects = [suspect for suspect in suspects if suspect is not Stage.CAMERA]
    named = {name for suspect in suspects for name in COMPUTED[suspect]}
    kinds = {name: {kind.__name__ for kind in kinds} for name, kinds in OF_SHAPES.items()}
    return tuple(name for name in ITEMS if name in named and (name not in kinds or kinds[name] & set(shapes)))


def passing(checks: Iterable[tuple[str, str]]) -> frozenset[Stage]:
    """Return the stages at which every check passes, from (stage, verdict) of one configuration's checks."""
    verdicts: dict[str, set[str]] = {}
    for stage, verdict in checks:
        verdicts.setdefault(stage, set()).add(verdict)
    quiet = {*GOOD, Outcome.UNDECIDED.value}
    return frozenset(
        stage for stage in Stage if (present := verdicts.get(stage.value, set())) & GOOD and present <= quiet
    )


def items_to_blame(
    stage: Stage, checks: Iterable[tuple[str, str]], shapes: Collection[str], own: Collection[str]
) -> tuple[str, ...]:
    """Return the items that may be to blame if the first failure of a configuration's `checks` is at `stage`.

    `own` are the items that its formulas cover, if known.
    """
    possible = possible_items(stage, passing(checks), shapes)
    return tuple(item for item in possible if item in own) or possible


# A subject that supports only some stages is judged on these; a stage that it declares unsupported neither passes nor
# fails.
#
# Checks of such stages remain `unsupported`; a case without any other measurement is `unsupported` as well.


def of_what_is_supported(judged: Judged, subjects: Sequence[Answers]) -> Judged:
    """Return the verdict on the measured stages, if all other stages are declared unsupported by a subject."""
    if judged.outcome is not Outcome.UNSUPPORTED:
        return judged
    declared = {(subject.name, stage) for subject in subjects for stage in subject.unsupported}
    left = [check for check in judged.checks if (check.configuration, check.stage) not in declared]
    lost = next((check for check in left if check.outcome is Outcome.UNSUPPORTED), None)
    if lost is not None:  # a stage that was neither rendered nor declared unsupported
        why = f"{lost.configuration} against {lost.reference}, {lost.stage}: {lost.reason}"
        return replace(judged, outcome=Outcome.MISSING, stage=lost.stage, blamed=(), reason=why)
    if left or judged.expectations:
        outcome = case_outcome(left, judged.expectations)
        why = next((check.reason for check in left if check.outcome is outcome), "")
        return replace(judged, outcome=outcome, stage=None, blamed=(), reason=why)
    return judged
