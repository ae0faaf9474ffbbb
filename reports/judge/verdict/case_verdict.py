"""From a case's checks and closed forms to its verdict, the stage to blame and the specification item behind it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

from rayproof.cases.case import Case
from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage
from rayproof.reports.judge.comparison.box_filter import configuration_of
from rayproof.reports.judge.comparison.check import Check, accounted
from rayproof.reports.judge.panel.matrix import Matrix
from rayproof.reports.judge.renderers import Candidate
from rayproof.reports.judge.tolerance.scene_context import Ground
from rayproof.reports.judge.verdict import blame
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
        turned = blame.misplaced(case.scene.shapes[ours], measured.ours, measured.theirs)
    return blame.item(
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
