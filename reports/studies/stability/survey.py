"""Every chosen formula on every ladder that applies, in every precision asked for."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase

from rayproof.cases.ladders import Ladder, all_ladders
from rayproof.reports.studies.stability.climb import climb, drawn
from rayproof.reports.studies.stability.document import record
from rayproof.reports.studies.stability.guards import broken
from rayproof.reports.studies.stability.judge import doubted, judged
from rayproof.reports.studies.stability.records import ClimbRecord
from rayproof.tracer.formulas import FORMULAS, Formula
from rayproof.tracer.formulas.own_file import is_own


@dataclass(frozen=True, kw_only=True)
class Plan:
    """Which formulas climb which ladders."""

    ladders: tuple[tuple[Ladder, tuple[Formula, ...]], ...]
    precisions: tuple[str, ...]
    quick: bool

    @property
    def climbs(self) -> int:
        """Return how many there are."""
        return sum(len(formulas) for _, formulas in self.ladders) * len(self.precisions)


def applies(ladder: Ladder, formula: Formula) -> bool:
    """Return whether a formula climbs a ladder: every variant of its slots, planted faults aside.

    A user's own formula climbs where the default of its slot does.
    """
    known = FORMULAS.slots[formula.slot] if is_own(formula.variant) else formula.variant
    chosen = not ladder.only or known in ladder.only
    return formula.slot in ladder.slots and formula.kind != "fault" and chosen


def plan(patterns: Sequence[str], *, ladders: Sequence[str], precisions: Sequence[str], quick: bool) -> Plan:
    """Return the climbs of the formulas named by `patterns` on `ladders`.

    A pattern is a slot, slot/variant, a glob, or a function of the user's, slot=FILE.py:function; none: all.

    Raises:
        LookupError: a pattern names no formula that is on any ladder, or no ladder.

    """
    known = all_ladders()
    climbing = {name for ladder in known for name in FORMULAS if applies(ladder, FORMULAS[name])}
    formulas: set[str] = set()
    own = [FORMULAS.named(pattern) for pattern in patterns if is_own(pattern)]
    for formula in own:
        if not any(applies(ladder, formula) for ladder in known):
            raise LookupError(f"the slot {formula.slot} is on no ladder")
    for pattern in [one for one in patterns if not is_own(one)] or (() if own else ("*",)):
        found = {name for name in climbing if fnmatchcase(name, pattern) or name.split("/")[0] == pattern}
        if not found:
            raise LookupError(f"no formula on a ladder is called {pattern!r}; known: {', '.join(sorted(climbing))}")
        formulas |= found
    names: set[str] = set()
    for pattern in ladders or ("*",):
        called = {ladder.name for ladder in known if fnmatchcase(ladder.name, pattern)}
        if not called:
            raise LookupError(f"no ladder is called {pattern!r}; known: {', '.join(ladder.name for ladder in known)}")
        names |= called
    pairs = (
        (
            ladder,
            tuple(
                formula
                for slot in ladder.slots
                for formula in (*FORMULAS.variants(slot), *own)
                if (formula.name in formulas or formula in own) and formula.slot == slot and applies(ladder, formula)
            ),
        )
        for ladder in known
        if ladder.name in names
    )
    chosen = tuple((ladder, climbers) for ladder, climbers in pairs if climbers)
    return Plan(ladders=chosen, precisions=tuple(precisions), quick=quick)


def survey(planned: Plan, *, doubts: Callable[[str], None]) -> Iterator[ClimbRecord]:
    """Yield a record per climb; tell `doubts` what makes the truth or the arithmetic itself unsure."""
    for precision in planned.precisions:
        for guard in broken(precision):
            doubts(guard)
    for ladder, formulas in planned.ladders:
        for precision in planned.precisions:
            given = drawn(ladder, precision, quick=planned.quick)
            if doubt := doubted(given):
                doubts(doubt)
            for formula in formulas:
                yield record(judged(climb(given, formula)))
