"""Which cases a fault is put to: at first a few that cover its items, from as many families; a survivor sees them all.

Cases are shared between faults wherever possible, because the references' renders are what costs.
"""

from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from fnmatch import fnmatchcase

from rayproof.cases.case import Case
from rayproof.reports.audit.planted import PlantedFault

Assignment = dict[str, list[PlantedFault]]  # case name -> faults


def candidates(fault: PlantedFault, cases: Sequence[Case]) -> tuple[Case, ...]:
    """Return the cases that could show the fault: those that it names first, then those that cover its items."""
    named = [case for case in cases if any(fnmatchcase(case.name, pattern) for pattern in fault.cases)]
    return (*named, *(case for case in cases if set(case.covers) & set(fault.covers) and case not in named))


def first_round(faults: Sequence[PlantedFault], cases: Sequence[Case], *, families: int) -> Assignment:
    """Return at most `families` cases a fault: those that it names, then one of each family, shared ones preferred."""
    wanted = {fault.name: candidates(fault, cases) for fault in faults}
    popular = Counter(case.name for some in wanted.values() for case in some)
    chosen: Assignment = defaultdict(list)
    # Faults that few cases show choose first; the others then join them.
    for fault in sorted(faults, key=lambda one: (len(wanted[one.name]), one.name)):
        named = [case for case in wanted[fault.name] if any(fnmatchcase(case.name, pattern) for pattern in fault.cases)]
        some = sorted(named, key=lambda case: (-popular[case.name], case.name))
        rest = [case for case in wanted[fault.name] if case not in named]
        for case in (*some, *_one_a_family(rest, chosen, popular))[:families]:
            chosen[case.name].append(fault)
    return dict(chosen)


def _one_a_family(cases: Sequence[Case], chosen: Assignment, popular: Mapping[str, int]) -> list[Case]:
    """Return the most shared case of each family: families first in which a case is chosen already, then large ones."""
    by_family: dict[str, list[Case]] = defaultdict(list)
    for case in cases:
        by_family[case.family].append(case)
    best = [max(some, key=lambda case: (case.name in chosen, popular[case.name])) for some in by_family.values()]
    return sorted(best, key=lambda case: (case.name not in chosen, -len(by_family[case.family]), case.name))


def later_round(
    faults: Sequence[PlantedFault], cases: Sequence[Case], seen: Mapping[str, set[str]], *, most: int
) -> Assignment:
    """Return up to `most` more cases for each survivor that it has not met, of as many families as possible."""
    chosen: Assignment = defaultdict(list)
    for fault in faults:
        left = [case for case in candidates(fault, cases) if case.name not in seen.get(fault.name, set())]
        met = Counter(name.split("/")[0] for name in seen.get(fault.name, set()))
        turns: list[tuple[int, Case]] = []
        for case in left:
            met[case.family] += 1
            turns.append((met[case.family], case))
        for _, case in sorted(turns, key=lambda turn: (turn[0], turn[1].name))[:most]:
            chosen[case.name].append(fault)
    return dict(chosen)
