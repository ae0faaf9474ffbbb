"""Which cases a fault is put to: at first a few that cover its items, from as many families; a survivor sees them all.

Cases are shared between faults wherever possible, because the references' renders are what costs.
"""

from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from fnmatch import fnmatchcase

from cases.case import Case
from reports.audit.planted import PlantedFault

Assignment = dict[str, list[PlantedFault]]  # case name -> faults


def candidates(fault: PlantedFault, cases: Sequence[Case]) -> tuple[Case, ...]:
    """Return the cases that could show the fault."""
    if fault.cases:
        return tuple(case for case in cases if any(fnmatchcase(case.name, pattern) for pattern in fault.cases))
    return tuple(case for case in cases if set(case.covers) & set(fault.covers))


def first_round(faults: Sequence[PlantedFault], cases: Sequence[Case], *, families: int) -> Assignment:
    """Return at most `families` cases a fault, each of another family, preferring those that many faults share."""
    wanted = {fault.name: candidates(fault, cases) for fault in faults}
    popular = Counter(case.name for some in wanted.values() for case in some)
    rarity = {name: len(some) for name, some in wanted.items()}
    chosen: Assignment = defaultdict(list)
    # Faults that few cases show choose first; the others then join them.
    for fault in sorted(faults, key=lambda one: (rarity[one.name], one.name)):
        by_family: dict[str, list[Case]] = defaultdict(list)
        for case in wanted[fault.name]:
            by_family[case.family].append(case)
        if fault.cases:  # it names them itself, whatever their family
            for case in sorted(wanted[fault.name], key=lambda case: (-popular[case.name], case.name))[:families]:
                chosen[case.name].append(fault)
            continue
        best = [max(some, key=lambda case: (case.name in chosen, popular[case.name])) for some in by_family.values()]
        # Families that few faults look at say most about those that do.
        best.sort(key=lambda case: (case.name not in chosen, _spread(by_family, case), case.name))
        for case in best[:families]:
            chosen[case.name].append(fault)
    return dict(chosen)


def _spread(by_family: Mapping[str, Sequence[Case]], case: Case) -> int:
    return -len(by_family[case.family])


def second_round(faults: Sequence[PlantedFault], cases: Sequence[Case], seen: Mapping[str, set[str]]) -> Assignment:
    """Return every case that could show a survivor and that it has not met."""
    chosen: Assignment = defaultdict(list)
    for fault in faults:
        for case in candidates(fault, cases):
            if case.name not in seen.get(fault.name, set()):
                chosen[case.name].append(fault)
    return dict(chosen)
