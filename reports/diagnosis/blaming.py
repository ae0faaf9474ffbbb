"""Which specification items a case may blame, narrowed by passing checks and by what each mistake shows.

An item is out only by a check that passes and that every known mistake of the item which shows in the case would have
failed. Of a case that no mistake was asked about, for its size or for lack of time, only the stages that pass speak.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from rayproof.cases.scene import Scene
from rayproof.cases.stages import IMAGE_STAGES, Stage
from rayproof.reports.diagnosis import MISTAKES, Way
from rayproof.reports.diagnosis.answering import Unanswerable, changed
from rayproof.reports.diagnosis.hypotheses import Clock, bound
from rayproof.reports.diagnosis.trials import ALLOWED, Evidence
from rayproof.reports.judge import verdict
from rayproof.reports.results.case_records import CaseRecord
from rayproof.reports.results.outcomes import Outcome

PASSING = 4  # passing cases that are asked, those of the most shapes, lights and matrices
LEAST_PARAMETER = 0.01  # relative: an exponent or a factor that is off by less would be called a rounding


@dataclass(frozen=True, kw_only=True)
class Blamed:
    """The items that may be to blame in a case, and the check that excludes each other one."""

    items: tuple[str, ...]
    excluded: Mapping[str, str] = field(default_factory=dict)


def passing(case: CaseRecord, configuration: str) -> frozenset[Stage]:
    """Return the stages at which every check of a configuration passes."""
    return verdict.passing(_verdicts(case, configuration))


def _verdicts(case: CaseRecord, configuration: str) -> list[tuple[str, str]]:
    return [(check.stage, check.outcome) for check in case.get("checks", []) if check.configuration == configuration]


def guilty(case: CaseRecord) -> str | None:
    """Return the configuration that fails at the stage blamed, or None."""
    return next(
        (
            check.configuration
            for check in case.get("checks", [])
            if check.outcome is Outcome.FAIL and check.stage == case.get("stage")
        ),
        None,
    )


def by_stages(case: CaseRecord, *, ran: bool) -> Blamed | None:
    """Return what the stages of one case leave; None where it does not fail at a stage.

    `ran` says that the configuration's own list of items is known, as the tracer's is.
    """
    configuration = guilty(case)
    if case.get("verdict") != Outcome.FAIL.value or configuration is None:
        return None
    own = case.get("ran", {}).get(configuration, ()) if ran else ()
    verdicts = _verdicts(case, configuration)
    return Blamed(items=verdict.items_to_blame(Stage(case["stage"]), verdicts, case.get("shapes", ()), own))


Check = tuple[str, Stage]  # a case and a stage that passes there


def narrowed(
    cases: Sequence[tuple[CaseRecord, Evidence, Blamed]],
    others: Iterable[tuple[CaseRecord, Evidence]],
    configuration: str,
    *,
    seconds: float,
) -> dict[str, Blamed]:
    """Return what is left of each failing case's items when the known mistakes were asked.

    `cases` are the failing ones, with their records and what their stages leave; `others` have checks that pass. Cases
    that there was no time for are left out.
    """
    clock, found = Clock(seconds), {}
    telling = sorted(others, key=lambda other: -_richness(other[1].scene))[:PASSING]
    elsewhere = _Elsewhere([(evidence, passing(record, configuration)) for record, evidence in telling])
    for record, evidence, blamed in _one_of_each_kind_first(cases):
        here = _Here(evidence, Stage(record["stage"]), passing(record, configuration), elsewhere)
        left, excluded = [], {}
        for item in blamed.items:
            if clock.over:
                return found
            kept, by = here.holds(item)
            if kept:
                left.append(item)
            elif by is not None:
                excluded[item] = by
        # Where nothing is left no known mistake speaks of this failure: then nothing is excluded by one either.
        found[evidence.case] = Blamed(items=tuple(left), excluded=excluded) if left else blamed
    return found


class _Elsewhere:
    """The checks of passing cases that each known mistake would have failed."""

    def __init__(self, cases: Sequence[tuple[Evidence, frozenset[Stage]]]) -> None:
        self._cases, self._known = cases, {}

    def against(self, name: str) -> frozenset[Check]:
        if name not in self._known:
            found: set[Check] = set()
            for evidence, right in self._cases:
                shown = shows(evidence, name)
                if shown is not None:
                    found |= {(evidence.case, stage) for stage in shown.surely & right}
            self._known[name] = frozenset(found)
        return self._known[name]


@dataclass(frozen=True, kw_only=False)
class _Here:
    """One failing case, and what may be to blame for it."""

    evidence: Evidence
    stage: Stage  # the first that is wrong
    passing: frozenset[Stage]
    elsewhere: _Elsewhere
    _asked: dict[str, frozenset[Check] | None] = field(default_factory=dict)

    def holds(self, item: str) -> tuple[bool, str | None]:
        """Return whether an item may be to blame; if it is excluded, by which check, in words.

        It may be if a known mistake of it shows here at the stage that is wrong, and no passing check speaks against
        that mistake; or if no mistake of it is known at all. Excluded is what shows, but in no mistake without a check
        against it, where one check speaks against all.
        """
        known = [name for name in MISTAKES if item in MISTAKES[name].items]
        if not known:
            return True, None
        out = {name: against for name in known if (against := self.elsewhere.against(name))}
        for name in known:
            if name not in out and (own := self._own(name)) is not None:
                if not own:
                    return True, None
                out[name] = own
        common = frozenset.intersection(*out.values()) if out else frozenset()
        if not common:  # no check is against all: then of those alone that show here
            out = {name: own | self.elsewhere.against(name) for name in out if (own := self._own(name)) is not None}
            common = frozenset.intersection(*out.values()) if out else frozenset()
            if not common:
                return bool(out), None
        order = list(Stage)
        case, stage = min(common, key=lambda check: (check[0] != self.evidence.case, order.index(check[1]), check[0]))
        return False, f"{case}: {stage}"

    def _own(self, name: str) -> frozenset[Check] | None:
        """Return this case's passing checks that a mistake would have failed; None where it does not show here."""
        if name not in self._asked:
            shown = shows(self.evidence, name)
            if shown is None:
                self._asked[name] = frozenset()
            elif self.stage not in shown.some:
                self._asked[name] = None
            else:
                self._asked[name] = frozenset((self.evidence.case, one) for one in shown.surely & self.passing)
        return self._asked[name]


@dataclass(frozen=True, kw_only=True)
class Shown:
    """Stages of a case at which a mistake's answer is not the right one."""

    some: frozenset[Stage]  # in some way, in some pixel
    surely: frozenset[Stage]  # in every way, in more pixels than rounding may take


def shows(evidence: Evidence, name: str) -> Shown | None:
    """Return at which stages a mistake shows in a case; None where one of its ways has no answer."""
    some: set[Stage] = set()
    surely = set(IMAGE_STAGES)
    for way in _representative(name):
        try:
            pixels = changed(way, evidence.right, evidence.oracle)
        except Unanswerable:
            return None
        counts = {stage: int(np.count_nonzero(where)) for stage, where in pixels.items()}
        some |= {stage for stage, count in counts.items() if count}
        surely &= {stage for stage, count in counts.items() if count > ALLOWED * evidence.right.edge.size}
    return Shown(some=frozenset(some), surely=frozenset(surely))


def _representative(name: str) -> Iterable[Way]:
    """Yield a mistake's ways; one with a parameter by the least that would be called a mistake."""
    mistake = MISTAKES[name]
    fit = mistake.fit
    if fit is None:
        yield from mistake.ways
    else:
        least = fit.grid[0] if fit.grid else fit.nothing * (1 + LEAST_PARAMETER)
        yield from (bound(way, least) for way in mistake.ways)


def _richness(scene: Scene) -> int:
    """Return how much a scene asks for: kinds of shapes, lights, and matrices that turn or stretch."""
    kinds = {type(shape) for shape in scene.shapes}
    moved = any(np.any(np.asarray(shape.to_world)[:3, :3] != np.eye(3)) for shape in scene.shapes)
    return len(kinds) + 2 * min(len(scene.lights), 2) + 2 * moved


def _one_of_each_kind_first(
    cases: Sequence[tuple[CaseRecord, Evidence, Blamed]],
) -> list[tuple[CaseRecord, Evidence, Blamed]]:
    """Return the cases so that those of another stage or other shapes come first."""
    seen: dict[tuple[Any, ...], int] = {}
    places = []
    for record, _, blamed in cases:
        kind = record["stage"], blamed.items
        seen[kind] = seen.get(kind, -1) + 1
        places.append(seen[kind])
    return [cases[index] for index in sorted(range(len(cases)), key=lambda index: (places[index], index))]


def put(record: CaseRecord, blamed: Blamed) -> None:
    """Write what may be to blame into a case's record: its `item` is one only if nothing else is left."""
    record["blamed_items"] = list(blamed.items)
    record["excluded"] = dict(blamed.excluded)
    record["item"] = blamed.items[0] if len(blamed.items) == 1 else None
