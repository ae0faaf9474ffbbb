"""From checks and closed forms to a case's outcome, the stage to blame and the items to blame."""

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
    """A case's checks and what they add up to."""

    case: Case
    checks: list[Check]
    expectations: list[ExpectationRecord]
    outcome: Outcome
    stage: Stage | None = None
    blamed: tuple[str, ...] = ()  # the specification's items that the checks cannot tell apart
    reason: str = ""
    planned: int
    panel: Mapping[Stage, AgreementMatrix] = field(default_factory=dict)  # everybody against everybody
    base: SceneTruth | None = None  # on which it was judged; None where the oracle had no answer
    against: Mapping[str, AgainstOracle] = field(default_factory=dict)  # every renderer by name, pixel by pixel

    def worsened(self, outcome: Outcome, reason: str) -> "Judged":
        """Return it with a worse outcome for a reason of its own; a verdict that is as bad or worse stays."""
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
    blamed: tuple[str, ...] = ()
    if subjects is not None and outcome is Outcome.FAIL:
        named = next(one.configuration for one in checks if one.outcome is outcome and one.stage is guilty.stage)
        verdicts = [(one.stage.value, one.outcome.value) for one in checks if one.configuration == named]
        own = subjects[named].items if named in subjects else ITEMS_OF_OTHERS
        shapes = [type(shape).__name__ for shape in case.scene.shapes]
        blamed = items_to_blame(guilty.stage, verdicts, shapes, () if own == ITEMS_OF_OTHERS else own)
    reason = f"{guilty.configuration} against {guilty.reference}, {guilty.stage}: {guilty.reason}"
    return replace(judged, stage=guilty.stage, blamed=blamed, reason=reason)


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


# From a stage that failed to the specification item whose formula is to blame.


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
# Items whose formula can make a stage wrong though the stages before it are right. A shadow ray meets shapes as well,
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
GOOD = frozenset({Outcome.PASS.value, Outcome.WARN.value})
# Kinds of shapes without which an item is not asked for.
OF_SHAPES: dict[str, tuple[type[Shape], ...]] = {
    **{name: tuple(kind for kind, names in HITS.items() if name in names) for names in HITS.values() for name in names},
    **{name: (kind,) for kind, name in NORMALS.items()},
}


def possible_items(stage: Stage, passing: Collection[Stage], shapes: Collection[str]) -> tuple[str, ...]:
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


def passing(checks: Iterable[tuple[str, str]]) -> frozenset[Stage]:
    """Return the stages at which every check passes, of one configuration's stages with their verdicts."""
    verdicts: dict[str, set[str]] = {}
    for stage, verdict in checks:
        verdicts.setdefault(stage, set()).add(verdict)
    quiet = {*GOOD, Outcome.UNDECIDED.value}
    return frozenset(stage for stage in Stage if (seen := verdicts.get(stage.value, set())) & GOOD and seen <= quiet)


def items_to_blame(
    stage: Stage, checks: Iterable[tuple[str, str]], shapes: Collection[str], own: Collection[str]
) -> tuple[str, ...]:
    """Return the items that may be to blame where a configuration's `checks` fail first at `stage`.

    `own` are the items that its formulas cover, as far as they are known.
    """
    found = possible_items(stage, passing(checks), shapes)
    return tuple(item for item in found if item in own) or found


# A subject that supports some stages only is judged on these: what it says it cannot is no pass and no failure.
#
# Checks of such stages stay `unsupported`; a case in which nothing else was measured is `unsupported` as well.


def of_what_is_supported(judged: Judged, subjects: Sequence[Answers]) -> Judged:
    """Return the verdict by what was measured, if nothing is amiss but stages that a subject declared."""
    if judged.outcome is not Outcome.UNSUPPORTED:
        return judged
    declared = {(subject.name, stage) for subject in subjects for stage in subject.unsupported}
    left = [one for one in judged.checks if (one.configuration, one.stage) not in declared]
    lost = next((one for one in left if one.outcome is Outcome.UNSUPPORTED), None)
    if lost is not None:  # a stage that was neither given nor declared
        why = f"{lost.configuration} against {lost.reference}, {lost.stage}: {lost.reason}"
        return replace(judged, outcome=Outcome.MISSING, stage=lost.stage, blamed=(), reason=why)
    if left or judged.expectations:
        outcome = case_outcome(left, judged.expectations)
        why = next((one.reason for one in left if one.outcome is outcome), "")
        return replace(judged, outcome=outcome, stage=None, blamed=(), reason=why)
    return judged
