"""The panel of references: matrices of agreement, the outlier of each stage, and the decision of the majority."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import Any, Literal

import numpy as np
from msgspec import structs

from rayproof.cases.stages import Stage, upto
from rayproof.reference import REFERENCES, code_of
from rayproof.reports.judge.against_oracle import AgainstOracle
from rayproof.reports.judge.checks import check_camera
from rayproof.reports.judge.measurement import jsonable, ratios
from rayproof.reports.judge.oracle import ORACLE
from rayproof.reports.judge.pairs import RendererPair
from rayproof.reports.results.case_records import AdjudicationRecord, Check
from rayproof.reports.results.outcomes import Outcome

SUBJECT = "the one under test"


def voice(name: str, tested: Iterable[str]) -> str:
    """Return the name under which a renderer votes: references that share code share a vote, and so do subjects."""
    if name in tested:
        return SUBJECT
    return code_of(name) if name in REFERENCES else name


# For each stage, every renderer judged against every other renderer as the baseline.
#
# Interior and limits are always the oracle's; a row is compared with the renderer of its column. Results of existing
# checks are reused.


SHOWN = 4  # digits of a ratio in a table for readers; checks have all digits


@dataclass(frozen=True, kw_only=True)
class Cell:
    """One renderer judged against another."""

    ratio: float  # worst error over limit, of the pixels that no nearby problem explains
    differing: int  # number of such pixels over the limit; for the camera, which has no pixels, 1 if it is over

    @property
    def agrees(self) -> bool:
        """Return whether the row is within every limit of its column."""
        return self.ratio <= 1


@dataclass(frozen=True, kw_only=True)
class AgreementMatrix:
    """One stage: `cells[row, column]` by names, without pairs that cannot be compared and without the diagonal."""

    stage: Stage
    renderers: tuple[str, ...]
    cells: Mapping[tuple[str, str], Cell]

    def agree(self, first: str, second: str) -> bool | None:
        """Return whether two renderers agree; None if they cannot be compared."""
        cell = self.cells.get((first, second))
        return None if cell is None else cell.agrees

    def answered(self) -> tuple[str, ...]:
        """Return the renderers that can be compared with any other."""
        return tuple(name for name in self.renderers if any(name in pair for pair in self.cells))

    def as_json(self) -> AdjudicationRecord:
        """Return plain JSON data: rows are judged, columns are their baselines."""

        def table(value: Callable[[Cell], float | int]) -> list[list[Any]]:
            return [
                [jsonable(value(self.cells[row, column])) if (row, column) in self.cells else None for column in names]
                for row in names
            ]

        names = self.renderers
        return {
            "renderers": list(names),
            "ratio": table(lambda cell: float(f"{cell.ratio:.{SHOWN}g}")),
            "differing": table(lambda cell: cell.differing),
        }


def matrices(
    renderers: Sequence[AgainstOracle], stages: Sequence[Stage], checks: Sequence[Check]
) -> dict[Stage, AgreementMatrix]:
    """Return each stage's matrix of all renderers; images of the wrong size must have been removed."""
    checks_by_pair = {
        (check.configuration, check.reference, check.stage): check
        for check in checks
        if check.end_to_end is not None or (check.stage is Stage.CAMERA and check.examined is not None)
    }
    names = tuple(against.renderer.name for against in renderers)
    cells: dict[Stage, dict[tuple[str, str], Cell]] = {stage: {} for stage in stages}
    answered_stages = [{stage for stage in stages if _answers(against, stage)} for against in renderers]
    for (first_index, first), (second_index, second) in combinations(enumerate(renderers), 2):
        pair = RendererPair(first, second)
        for stage in (
            stage for stage in stages if stage in answered_stages[first_index] & answered_stages[second_index]
        ):
            cell = _cell(pair, stage, checks_by_pair.get((first.renderer.name, second.renderer.name, stage)))
            cells[stage][first.renderer.name, second.renderer.name] = cell
            cells[stage][second.renderer.name, first.renderer.name] = cell
    return {stage: AgreementMatrix(stage=stage, renderers=names, cells=cells[stage]) for stage in stages}


def _answers(against: AgainstOracle, stage: Stage) -> bool:
    """Return whether a renderer has an answer to a stage, in the scene's size."""
    if stage in against.renderer.unsupported or against.renderer.answers.get(stage) is None:
        return False
    return stage is Stage.CAMERA or against.answers(stage)


def _cell(pair: RendererPair, stage: Stage, check: Check | None) -> Cell:
    """Return the cell of two renderers, from their check if it has measured the stage."""
    if stage is Stage.CAMERA:
        ratio = check_camera(pair).ratio if check is None else check.ratio
        return Cell(ratio=ratio, differing=int(not ratio <= 1))
    if check is not None and check.end_to_end is not None:
        return Cell(ratio=check.end_to_end.worst_ratio, differing=check.end_to_end.wrong)
    ratio, differing = pair.worst(stage)
    return Cell(ratio=ratio, differing=differing)


# The outlier: the only vote that differs, if all others, at least two, agree with each other.


LEAST_MAJORITY = 2  # votes that agree with each other and not with the outlier


@dataclass(frozen=True, kw_only=True)
class PanelConclusion:
    """The conclusion of a stage's matrix about its renderers."""

    alone: tuple[str, ...]  # the renderers of the outlying vote; empty if there is none
    majority: tuple[str, ...]  # the renderers that agree against it
    why: str


def standing(matrix: AgreementMatrix, voice: Callable[[str], str]) -> PanelConclusion:
    """Return the outlier at a stage, or the reason why there is none."""
    names = matrix.answered()
    if not names:
        return PanelConclusion(alone=(), majority=(), why="No two renderers answer this stage.")
    differ = [pair for pair in combinations(names, 2) if matrix.agree(*pair) is False]
    if not differ:
        return PanelConclusion(alone=(), majority=names, why=f"All {len(names)} renderers agree.")
    votes: dict[str, list[str]] = {}
    for name in names:
        votes.setdefault(voice(name), []).append(name)
    outliers = []
    for vote, members in votes.items():
        others = [name for name in names if name not in members]
        differing = [name for name in members if any(matrix.agree(name, opponent) is False for opponent in others)]
        settled = all(matrix.agree(*pair) for pair in combinations(others, 2))
        if differing and settled and len(votes) - 1 >= LEAST_MAJORITY:
            outliers.append((vote, differing, others))
    if len(outliers) == 1:
        _, differing, others = outliers[0]
        return PanelConclusion(
            alone=tuple(differing),
            majority=tuple(others),
            why=f"{_and(differing)} alone: {_and(others)} agree among themselves{_measure(matrix, differing, others)}.",
        )
    pairs = "; ".join(f"{first} and {second} differ" for first, second in differ)
    if len(votes) == LEAST_MAJORITY:
        return PanelConclusion(alone=(), majority=(), why=f"{pairs}: no third voice to tell who is wrong.")
    if outliers:
        suspects = _and([name for _, differing, _ in outliers for name in differing])
        return PanelConclusion(
            alone=(), majority=(), why=f"{pairs}: the others agree with both, {suspects} may be wrong."
        )
    return PanelConclusion(alone=(), majority=(), why=f"{pairs}: nobody stands alone.")


def _measure(matrix: AgreementMatrix, outliers: list[str], others: list[str]) -> str:
    """Return a phrase with the difference of the outliers from the others."""
    cells = [matrix.cells[outlier, name] for outlier in outliers for name in others if (outlier, name) in matrix.cells]
    worst = max((cell.ratio for cell in cells), default=0.0)
    most = max((cell.differing for cell in cells), default=0)
    return f" ({most} pixels over the limit, {worst:.3g} times it at worst)"


def _and(names: list[str]) -> str:
    """Return names as an enumeration."""
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"


# A failure against the oracle's continued value is compared with the references, which may contradict either side.
#
# Only the oracle can continue from a subject's own stages. If these stages agree with the oracle's within every limit,
# however, the continued value is also the oracle's end-to-end answer, to within the end-to-end limits. So a reference's
# end-to-end answer may contradict it, in the pixels in which the subject fails.


Side = Literal["with", "against"]


@dataclass(frozen=True, kw_only=True)
class Contradictions:
    """The references that may contradict a value that the oracle continued."""

    renderers: Mapping[str, AgainstOracle]
    references: Sequence[str]
    checks: Sequence[Check]

    def sides(self, check: Check) -> dict[str, Side]:
        """Return the references that agree with the subject ("with") or the oracle ("against") in a continued failure.

        The result is empty if the stage fails end to end as well, if nearby problems explain its pixels end to end, or
        if an earlier stage has failed: then the continued value is no answer to the references' problem.
        """
        if not self._continued_alone(check):
            return {}
        subject, stage = self.renderers[check.configuration], check.stage
        continued = subject.continued(stage)
        if continued is None:
            return {}
        failing = continued.wrong & ~subject.end_to_end[stage].explained
        if not failing.any():
            return {}
        subject_image = subject.renderer.answers[stage]
        sides: dict[str, Side] = {}
        for name in self.references:
            reference = self.renderers[name]
            if name == ORACLE or not reference.renderer.independent or not reference.answers(stage):
                continue
            # The continued value has the errors of the subject's stages, so the limits of both apply.
            from_oracle = _differs(subject, reference, stage, continued.value)[failing]
            from_subject = _differs(subject, reference, stage, subject_image)[failing]
            if from_oracle.all() and not from_subject.any():
                sides[name] = "with"
            elif from_subject.any() and not from_oracle.any():
                sides[name] = "against"
        return sides

    def _continued_alone(self, check: Check) -> bool:
        if check.reference != ORACLE or check.outcome is not Outcome.FAIL or check.stage is Stage.CAMERA:
            return False
        whole, continued = check.end_to_end, check.continued
        if whole is None or continued is None or not whole.worst_ratio <= 1 or continued.worst_ratio <= 1:
            return False
        earlier = set(upto(check.stage)[:-1])
        return not any(
            earlier_check.outcome is Outcome.FAIL
            for earlier_check in self.checks
            if (earlier_check.configuration, earlier_check.reference) == (check.configuration, ORACLE)
            and earlier_check.stage in earlier
        )


def _differs(subject: AgainstOracle, reference: AgainstOracle, stage: Stage, value: np.ndarray) -> np.ndarray:
    """Return a mask (height, width): a value differs from the reference's by more than the limits of both renderers."""
    limits = [against.own_limits.end_to_end.get(stage, against.base.no_limit) for against in (subject, reference)]
    expected = np.asarray(reference.renderer.answers[stage], dtype=np.float64)
    return ~(ratios(stage, np.asarray(value, dtype=np.float64), expected, limits[0] + limits[1])[0] <= 1)


# Adjudication: which of subject and reference is wrong if they differ. It is not always the subject.


def adjudicated(
    checks: Sequence[Check],
    panel: Mapping[Stage, AgreementMatrix],
    independent: Mapping[str, bool],
    voice: Callable[[str], str],
    contradicted: Callable[[Check], Mapping[str, str]] = lambda _: {},
) -> list[Check]:
    """Return the checks; a failure becomes `reference_suspect` if the panel decides that the reference is wrong.

    Every independent reference that can be compared with both votes, at the failure's stage or the next stage that it
    can judge: for the subject if the subject passes against it and the reference differs from it, and for the reference
    in the opposite case. More votes for the subject than for the reference make the reference suspect, the oracle too;
    otherwise the failure remains. For a failure only against the oracle's continued value the votes come from
    `contradicted` (`Contradictions`). If the oracle is suspect, no failure remains from that stage on, against any
    reference, because limits and nearby problems are the oracle's.
    """
    verdicts = {(check.configuration, check.reference, check.stage): check for check in checks}
    references = [name for name, is_independent in independent.items() if is_independent]

    def heard(check: Check) -> Check:
        if check.outcome is not Outcome.FAIL:
            return check
        with_it, against_it = _sides(check, references, verdicts, panel, voice)
        for name, side in contradicted(check).items():
            if voice(name) not in (voice(check.reference), SUBJECT):
                (with_it if side == "with" else against_it)[name] = check.stage.value
        votes_with, votes_against = ({voice(name) for name in side} for side in (with_it, against_it))
        outcome, reason = check.outcome, check.reason
        if len(votes_with) > len(votes_against):
            words = ", ".join(f"{name} ({stage})" for name, stage in with_it.items())
            outcome = Outcome.REFERENCE_SUSPECT
            reason += f"; {words} agrees with {check.configuration} and differs from {check.reference}"
        elif votes_with:
            lists = [", ".join(side) for side in (with_it, against_it)]
            reason += f"; the panel is split: {lists[0]} with {check.configuration}, {lists[1]} with {check.reference}"
        return structs.replace(check, outcome=outcome, reason=reason, evidence={"with": with_it, "against": against_it})

    return _not_resting_on_a_suspect([heard(check) for check in checks])


def _sides(
    check: Check,
    references: Sequence[str],
    verdicts: Mapping[tuple[str, str, Stage], Check],
    panel: Mapping[Stage, AgreementMatrix],
    voice: Callable[[str], str],
) -> tuple[dict[str, str], dict[str, str]]:
    """Return the references that vote for the subject and those that vote for its reference, each with the stage."""
    stages = list(Stage)
    with_it: dict[str, str] = {}
    against_it: dict[str, str] = {}
    for name in references:
        if voice(name) in (voice(check.reference), SUBJECT):
            continue
        for stage in stages[stages.index(check.stage) :]:
            own = verdicts.get((check.configuration, name, stage))
            agree = panel[stage].agree(name, check.reference) if stage in panel else None
            if own is None or agree is None or (own.end_to_end is None and stage is not Stage.CAMERA):
                continue
            if own.outcome is Outcome.PASS and not agree:
                with_it[name] = stage.value
            elif own.outcome is Outcome.FAIL and agree:
                against_it[name] = stage.value
            break
    return with_it, against_it


def _not_resting_on_a_suspect(checks: Sequence[Check]) -> list[Check]:
    """Return the checks, without failures at and after the first stage at which the oracle is suspect."""
    order = list(Stage)
    doubted: dict[str, int] = {}  # configuration -> the first stage at which the oracle is suspect
    for check in checks:
        if check.outcome is Outcome.REFERENCE_SUSPECT and check.reference == ORACLE and check.evidence:
            place = order.index(check.stage)
            doubted[check.configuration] = min(place, doubted.get(check.configuration, place))

    def rests(check: Check) -> bool:
        first = doubted.get(check.configuration)
        return check.outcome is Outcome.FAIL and first is not None and order.index(check.stage) >= first

    return [
        structs.replace(
            check,
            outcome=Outcome.REFERENCE_SUSPECT,
            reason=f"{check.reason}; limits are {ORACLE}'s, which is suspect from "
            f"{order[doubted[check.configuration]]} on",
            suspected=ORACLE,
        )
        if rests(check)
        else check
        for check in checks
    ]
