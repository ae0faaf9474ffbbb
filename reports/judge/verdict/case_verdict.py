"""From a case's checks and closed forms to its verdict, the stage to blame and the specification item behind it."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

from rayproof.cases.case import Case
from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage
from rayproof.reports.judge.comparison.box_filter import configuration_of
from rayproof.reports.judge.comparison.check import Check, account
from rayproof.reports.judge.panel.matrix import Matrix
from rayproof.reports.judge.renderers import Candidate
from rayproof.reports.judge.verdict import blame
from rayproof.reports.results.outcomes import Outcome, worst
from rayproof.reports.results.records import ExpectationRecord


@dataclass(kw_only=True)
class Judged:
    """A case's checks and what they add up to."""

    case: Case
    checks: list[Check]
    expectations: list[ExpectationRecord]
    outcome: Outcome
    stage: Stage | None
    item: str | None
    reason: str
    planned: int
    panel: Mapping[Stage, Matrix] = field(default_factory=dict)  # everybody against everybody

    def worsen(self, outcome: Outcome, reason: str) -> None:
        """Take a worse outcome for a reason of its own, in place of an earlier one's; a verdict that is worse stays."""
        if outcome is not self.outcome and worst([self.outcome, outcome]) is outcome:
            self.outcome, self.reason, self.stage, self.item = outcome, reason, None, None


def sum_up(
    case: Case,
    checks: list[Check],
    expectations: list[ExpectationRecord],
    planned: int,
    candidates: Mapping[str, Candidate] | None,
) -> Judged:
    """Return the case's verdict: the worst of its checks and expectations, and the first stage to blame."""
    account(checks, case.scene, tuned=case.tuned)
    outcome = case_outcome(checks, expectations)
    guilty = [check for check in checks if check.outcome is outcome and outcome is not Outcome.PASS]
    order = list(Stage)
    # A stage that is wrong by itself comes before one that only shows what it was handed.
    guilty.sort(key=lambda check: (not check.alone, order.index(check.stage), -check.ratio))
    judged = Judged(
        case=case,
        checks=checks,
        expectations=expectations,
        outcome=outcome,
        stage=None,
        item=None,
        reason="",
        planned=planned,
    )
    if guilty:
        check = guilty[0]
        judged.stage = check.stage
        judged.reason = f"{check.configuration} against {check.reference}, {check.stage}: {check.reason}"
        if candidates is not None and outcome is Outcome.FAIL:
            same = [one for one in checks if one.configuration == check.configuration and one.alone]
            phantom = any(one.stage is Stage.DISTANCE for one in same)
            judged.item = _item(case, check, candidates[configuration_of(check.configuration)], phantom=phantom)
    elif outcome is not Outcome.PASS:
        broken = next(one for one in expectations if one["verdict"] == outcome.value)
        judged.stage = Stage(broken["stage"])
        judged.reason = (
            f"{broken['configuration']}: {broken['measured']} instead of {broken['expected']}: {broken['because']}"
        )
    return judged


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
        column, row = measured.pixel[0], measured.pixel[1] - case.scene.camera.first_row
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
