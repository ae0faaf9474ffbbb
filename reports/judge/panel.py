"""The panel of references: matrices of who agrees with whom, who stands alone, and what the majority decides."""

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
    """Return the name under which a renderer votes: references that share code have one vote, all subjects another."""
    if name in tested:
        return SUBJECT
    return code_of(name) if name in REFERENCES else name


# Everybody against everybody: for each stage, every renderer judged against every other as the baseline.
#
# Whose interior and whose limits is always the oracle's; whom a row is compared with is its column. What the
# checks have measured already is taken from them.


SHOWN = 4  # digits of a ratio in a table that people read; checks have them all


@dataclass(frozen=True, kw_only=True)
class Cell:
    """One renderer judged against another."""

    ratio: float  # worst error over limit, of the pixels that no nearby problem explains
    differing: int  # such pixels over the limit; of the camera, which has none, 1 if it is over

    @property
    def agrees(self) -> bool:
        """Say whether the row is within every limit of its column."""
        return self.ratio <= 1


@dataclass(frozen=True, kw_only=True)
class AgreementMatrix:
    """One stage: `cells[row, column]` by names; what cannot be compared, and each with itself, is not there."""

    stage: Stage
    renderers: tuple[str, ...]
    cells: Mapping[tuple[str, str], Cell]

    def agree(self, one: str, other: str) -> bool | None:
        """Say whether two renderers agree; None where they cannot be compared."""
        cell = self.cells.get((one, other))
        return None if cell is None else cell.agrees

    def answered(self) -> tuple[str, ...]:
        """Return who can be compared with anybody here."""
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
    """Return each stage's matrix over all renderers; images of the wrong size must have been removed."""
    known = {
        (check.configuration, check.reference, check.stage): check
        for check in checks
        if check.end_to_end is not None or (check.stage is Stage.CAMERA and check.examined is not None)
    }
    names = tuple(against.renderer.name for against in renderers)
    cells: dict[Stage, dict[tuple[str, str], Cell]] = {stage: {} for stage in stages}
    able = [{stage for stage in stages if _answers(against, stage)} for against in renderers]
    for (index, mine), (other, theirs) in combinations(enumerate(renderers), 2):
        pair = RendererPair(mine, theirs)
        for stage in (stage for stage in stages if stage in able[index] & able[other]):
            cell = _cell(pair, stage, known.get((mine.renderer.name, theirs.renderer.name, stage)))
            cells[stage][mine.renderer.name, theirs.renderer.name] = cell
            cells[stage][theirs.renderer.name, mine.renderer.name] = cell
    return {stage: AgreementMatrix(stage=stage, renderers=names, cells=cells[stage]) for stage in stages}


def _answers(against: AgainstOracle, stage: Stage) -> bool:
    """Return whether a renderer answers a stage, in the scene's size."""
    if stage in against.renderer.unsupported or against.renderer.answers.get(stage) is None:
        return False
    return stage is Stage.CAMERA or against.answers(stage)


def _cell(pair: RendererPair, stage: Stage, check: Check | None) -> Cell:
    """Return the cell of two renderers; what their check has measured already is taken from it."""
    if stage is Stage.CAMERA:
        ratio = check_camera(pair).ratio if check is None else check.ratio
        return Cell(ratio=ratio, differing=int(not ratio <= 1))
    if check is not None and check.end_to_end is not None:
        return Cell(ratio=check.end_to_end.worst_ratio, differing=check.end_to_end.wrong)
    ratio, differing = pair.worst(stage)
    return Cell(ratio=ratio, differing=differing)


# Who stands alone: the one voice that differs where all others, two at least, agree among themselves.


LEAST_MAJORITY = 2  # voices that agree with each other and not with the one that stands alone


@dataclass(frozen=True, kw_only=True)
class PanelConclusion:
    """The conclusion of a stage's matrix about its renderers."""

    alone: tuple[str, ...]  # names that speak with the one voice that stands alone; none where nobody does
    majority: tuple[str, ...]  # who agrees against it
    why: str


def standing(matrix: AgreementMatrix, voice: Callable[[str], str]) -> PanelConclusion:
    """Return the renderer that stands alone at a stage, or the reason why there is none."""
    names = matrix.answered()
    if not names:
        return PanelConclusion(alone=(), majority=(), why="No two renderers answer this stage.")
    differ = [pair for pair in combinations(names, 2) if matrix.agree(*pair) is False]
    if not differ:
        return PanelConclusion(alone=(), majority=names, why=f"All {len(names)} renderers agree.")
    voices: dict[str, list[str]] = {}
    for name in names:
        voices.setdefault(voice(name), []).append(name)
    found = []
    for one, members in voices.items():
        others = [name for name in names if name not in members]
        guilty = [name for name in members if any(matrix.agree(name, other) is False for other in others)]
        settled = all(matrix.agree(*pair) for pair in combinations(others, 2))
        if guilty and settled and len(voices) - 1 >= LEAST_MAJORITY:
            found.append((one, guilty, others))
    if len(found) == 1:
        _, guilty, others = found[0]
        return PanelConclusion(
            alone=tuple(guilty),
            majority=tuple(others),
            why=f"{_and(guilty)} alone: {_and(others)} agree among themselves{_measure(matrix, guilty, others)}.",
        )
    pairs = "; ".join(f"{one} and {other} differ" for one, other in differ)
    if len(voices) == LEAST_MAJORITY:
        return PanelConclusion(alone=(), majority=(), why=f"{pairs}: no third voice to tell who is wrong.")
    if found:
        either = _and([name for _, guilty, _ in found for name in guilty])
        return PanelConclusion(
            alone=(), majority=(), why=f"{pairs}: the others agree with both, {either} may be wrong."
        )
    return PanelConclusion(alone=(), majority=(), why=f"{pairs}: nobody stands alone.")


def _measure(matrix: AgreementMatrix, guilty: list[str], others: list[str]) -> str:
    """Return by how much the ones alone differ, in words."""
    cells = [matrix.cells[one, other] for one in guilty for other in others if (one, other) in matrix.cells]
    worst = max((cell.ratio for cell in cells), default=0.0)
    most = max((cell.differing for cell in cells), default=0)
    return f" ({most} pixels over the limit, {worst:.3g} times it at worst)"


def _and(names: list[str]) -> str:
    """Return names as a list in words."""
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"


# A failure continued from the oracle is put before references, whose answers contradict one of the two.
#
# Continued from a subject's own stages only the oracle answers. Where those stages agree with the oracle's within
# every limit, though, what it continues from them is its answer to the question that all were asked, to within the
# limits end to end. So a reference's answer to that question may contradict it, in the very pixels where the subject
# fails.


Side = Literal["with", "against"]


@dataclass(frozen=True, kw_only=True)
class Contradictions:
    """The references that may contradict a value which the oracle continued."""

    renderers: Mapping[str, AgainstOracle]
    references: Sequence[str]
    checks: Sequence[Check]

    def sides(self, check: Check) -> dict[str, Side]:
        """Return which references side with the one under test, and which against it, in a failure continued alone.

        Nobody is asked where the failure is one end to end as well, where nearby problems explain its pixels end to
        end, or where an earlier stage has failed: what the oracle continued then answers another question.
        """
        if not self._continued_alone(check):
            return {}
        subject, stage = self.renderers[check.configuration], check.stage
        alone = subject.continued(stage)
        if alone is None:
            return {}
        failing = alone.wrong & ~subject.end_to_end[stage].explained
        if not failing.any():
            return {}
        ours = subject.renderer.answers[stage]
        sides: dict[str, Side] = {}
        for name in self.references:
            reference = self.renderers[name]
            if name == ORACLE or not reference.renderer.independent or not reference.answers(stage):
                continue
            # What was continued from the subject's stages is off by as much as these are.
            against_it = _differs(subject, reference, stage, alone.value)[failing]
            from_us = _differs(subject, reference, stage, ours)[failing]
            if against_it.all() and not from_us.any():
                sides[name] = "with"
            elif from_us.any() and not against_it.any():
                sides[name] = "against"
        return sides

    def _continued_alone(self, check: Check) -> bool:
        if check.reference != ORACLE or check.outcome is not Outcome.FAIL or check.stage is Stage.CAMERA:
            return False
        whole, alone = check.end_to_end, check.continued
        if whole is None or alone is None or not whole.worst_ratio <= 1 or alone.worst_ratio <= 1:
            return False
        earlier = set(upto(check.stage)[:-1])
        return not any(
            other.outcome is Outcome.FAIL
            for other in self.checks
            if (other.configuration, other.reference) == (check.configuration, ORACLE) and other.stage in earlier
        )


def _differs(subject: AgainstOracle, reference: AgainstOracle, stage: Stage, value: np.ndarray) -> np.ndarray:
    """Return where a value at a stage is over the limit of two renderers from the reference's, (height, width)."""
    limits = [each.own_limits.end_to_end.get(stage, each.base.no_limit) for each in (subject, reference)]
    theirs = np.asarray(reference.renderer.answers[stage], dtype=np.float64)
    return ~(ratios(stage, np.asarray(value, dtype=np.float64), theirs, limits[0] + limits[1])[0] <= 1)


# Adjudication: when subject and reference differ, who is wrong? Never the one under test alone by default.


def adjudicated(
    checks: Sequence[Check],
    panel: Mapping[Stage, AgreementMatrix],
    independent: Mapping[str, bool],
    voice: Callable[[str], str],
    contradicted: Callable[[Check], Mapping[str, str]] = lambda _: {},
) -> list[Check]:
    """Return the checks; a failure is `reference_suspect` where the panel says that the reference is wrong.

    Every independent voice that can compare both takes a side, at the failure's stage or the next one that it can
    judge: it sides with the one under test if that passes against it while it differs from the reference, and with
    the reference the other way round. More voices for the one under test than for the reference make the reference
    suspect, the oracle like any other; a split panel leaves the failure standing. Of a failure that is one only where
    continued from the oracle `contradicted` says who sides with whom (`Contradictions`). Where the oracle is suspect
    no failure from that stage on stands, against whomever: limits and nearby problems are the suspect oracle's own.
    """
    verdicts = {(check.configuration, check.reference, check.stage): check for check in checks}
    references = [name for name, alone in independent.items() if alone]

    def heard(check: Check) -> Check:
        if check.outcome is not Outcome.FAIL:
            return check
        with_it, against_it = _sides(check, references, verdicts, panel, voice)
        for name, side in contradicted(check).items():
            if voice(name) not in (voice(check.reference), SUBJECT):
                (with_it if side == "with" else against_it)[name] = check.stage.value
        mine, theirs = ({voice(name) for name in side} for side in (with_it, against_it))
        outcome, told = check.outcome, check.reason
        if len(mine) > len(theirs):
            words = ", ".join(f"{name} ({stage})" for name, stage in with_it.items())
            outcome = Outcome.REFERENCE_SUSPECT
            told += f"; {words} agrees with {check.configuration} and differs from {check.reference}"
        elif mine:
            both = [", ".join(side) for side in (with_it, against_it)]
            told += f"; the panel is split: {both[0]} with {check.configuration}, {both[1]} with {check.reference}"
        return structs.replace(check, outcome=outcome, reason=told, evidence={"with": with_it, "against": against_it})

    return _not_resting_on_a_suspect([heard(check) for check in checks])


def _sides(
    check: Check,
    references: Sequence[str],
    verdicts: Mapping[tuple[str, str, Stage], Check],
    panel: Mapping[Stage, AgreementMatrix],
    voice: Callable[[str], str],
) -> tuple[dict[str, str], dict[str, str]]:
    """Return the witnesses that side with the subject and those that side with its reference, with the stage."""
    stages = list(Stage)
    mine: dict[str, str] = {}
    theirs: dict[str, str] = {}
    for name in references:
        if voice(name) in (voice(check.reference), SUBJECT):
            continue
        for stage in stages[stages.index(check.stage) :]:
            own = verdicts.get((check.configuration, name, stage))
            agree = panel[stage].agree(name, check.reference) if stage in panel else None
            if own is None or agree is None or (own.end_to_end is None and stage is not Stage.CAMERA):
                continue
            if own.outcome is Outcome.PASS and not agree:
                mine[name] = stage.value
            elif own.outcome is Outcome.FAIL and agree:
                theirs[name] = stage.value
            break
    return mine, theirs


def _not_resting_on_a_suspect(checks: Sequence[Check]) -> list[Check]:
    """Return the checks; no failure stands at and after the first stage at which the oracle is suspect."""
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
