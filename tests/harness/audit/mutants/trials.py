"""Judge mutants by the oracle: by radiance alone, as a program's that writes nothing else, and by all image stages.

A mutant's answers are rounded to float32 and judged by the limits of float32. Where they are equal to the oracle's own
after that rounding nothing is asked, for those pass. The oracle alone is the witness here: other references would only
add voices against the mutant.
"""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from functools import cache, lru_cache

import numpy as np

from rayproof.cases.case import Case
from rayproof.cases.families import select
from rayproof.cases.random_scenes import wide_case
from rayproof.cases.stages import Stage
from rayproof.reference.analytic import Analytic
from rayproof.reports.judge.answers import Answers
from rayproof.reports.judge.case import judge_case
from rayproof.reports.judge.oracle import ORACLE, stages_of
from rayproof.reports.results.outcomes import Outcome
from tests.harness.audit.mutants import Mutant, Rows, fields, frames, tolerances

RADIANCE, STAGES = "radiance", "stages"
WAYS = (RADIANCE, STAGES)
KEPT = 200  # cases whose right answers and edges a worker keeps: some 2 MB each


@cache
def mutants() -> dict[str, Mutant]:
    """Return every mutant by its name."""
    found = [*frames.mutants(), *fields.mutants(), *frames.mutants_in_space(), *tolerances.mutants()]
    names = {mutant.name: mutant for mutant in found}
    if len(names) < len(found):
        raise LookupError("two mutants have the same name")
    return names


def selected(pattern: str) -> Sequence[Mutant]:
    """Return the mutants whose name matches a glob."""
    return [mutant for name, mutant in mutants().items() if fnmatchcase(name, pattern)]


@dataclass(frozen=True, kw_only=True)
class MutantOrder:
    """Judge mutants, by these ways each, on cases in this order until each way has killed; or on random scenes."""

    wanted: tuple[tuple[str, tuple[str, ...]], ...]  # mutant's name, and the ways by which it is to be judged
    cases: tuple[str, ...] = ()
    seed: int = 0
    numbers: tuple[int, int] = (0, 0)  # of random scenes: the first and the one after the last


@dataclass(frozen=True, kw_only=True)
class Kill:
    """A mutant that failed a case."""

    mutant: str
    way: str
    case: str
    stage: Stage | None
    reason: str


@dataclass(frozen=True, kw_only=True)
class MutantReport:
    """The first kill of each mutant by each way, and on how many cases it was not the oracle's twin."""

    kills: tuple[Kill, ...]
    judged: dict[str, int]  # mutant's name -> in how many scenes it was judged, for it differed from the oracle


class Question:
    """A case with its right answers, for many mutants."""

    def __init__(self, case: Case) -> None:
        self.case = case
        self._oracle = Analytic()
        self._stages = [stage for stage in stages_of(case.scene) if stage is not Stage.CAMERA]
        right = self._oracle.render(case.scene, self._stages)
        self.right: Rows = {stage: right[stage].reshape(-1, right[stage].shape[-1]) for stage in self._stages}
        self._rounded = {stage: _rounded(rows) for stage, rows in self.right.items()}
        self._witness = Answers(
            name=ORACLE, precision="float64", independent=True, answers=right,
            unsupported={Stage.CAMERA: "mutants have images alone"},)  # fmt: skip

    def kills(self, mutant: Mutant, ways: Sequence[str]) -> Iterator[Kill | None]:
        """Yield for each way in which the mutant differs from the oracle the kill, or None where it passes."""
        with np.errstate(all="ignore"):
            try:
                rows = mutant.answer(self.case.scene, self.right)
            except np.linalg.LinAlgError:  # a singular matrix, say: it has no image here, and fails by that alone
                rows = None
            wrong = {} if rows is None else {stage: _rounded(row) for stage, row in rows.items()}
        for way in ways:
            stages = self._stages if way == STAGES else [stage for stage in self._stages if stage is Stage.RADIANCE]
            if any(
                stage in wrong and not np.array_equal(wrong[stage], self._rounded[stage], equal_nan=True)
                for stage in stages
            ):
                yield self._kill(mutant, way, stages, wrong)

    def _kill(self, mutant: Mutant, way: str, stages: Sequence[Stage], rows: Rows) -> Kill | None:
        camera = self.case.scene.camera
        candidate = Answers(
            name="mutant",
            precision="float32",
            answers={
                stage: rows[stage].astype(np.float64).reshape(camera.height, camera.width, -1) for stage in stages
            },
            unsupported={stage: "not written" for stage in Stage if stage not in stages},
            chained=False,
        )
        judged = judge_case(self.case, [candidate], [self._witness], self._oracle, {})
        if judged.outcome is not Outcome.FAIL:
            return None
        return Kill(mutant=mutant.name, way=way, case=self.case.name, stage=judged.stage, reason=judged.reason)


def _rounded(rows: np.ndarray) -> np.ndarray:
    with np.errstate(all="ignore"):
        return rows.astype(np.float32)


@lru_cache(maxsize=KEPT)
def _question(name: str) -> Question:
    (case,) = select([name])
    return Question(case)


def work(order: MutantOrder) -> MutantReport:
    """Do an order."""
    kills: list[Kill] = []
    judged = dict.fromkeys((name for name, _ in order.wanted), 0)
    left = {name: list(ways) for name, ways in order.wanted}
    questions = (
        (_question(name) for name in order.cases)
        if order.cases
        else (Question(wide_case(order.seed, number)) for number in range(*order.numbers))
    )
    for question in questions:
        for name in [name for name, ways in left.items() if ways]:
            answers = list(question.kills(mutants()[name], left[name]))
            judged[name] += bool(answers)
            found = [kill for kill in answers if kill is not None]
            kills += found
            left[name] = [way for way in left[name] if way not in {kill.way for kill in found}]
        if not any(left.values()):
            break
    return MutantReport(kills=tuple(kills), judged=judged)
