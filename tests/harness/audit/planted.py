"""All that can be planted: wrong formulas of the tracer, and spoilt references."""

import inspect
import sys
from collections import Counter, defaultdict
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase
from typing import TYPE_CHECKING

from rayproof.cases.case import Case
from rayproof.cases.stages import Stage
from rayproof.tracer.formulas.own_file import is_own
from tests.harness.audit.faults import FAULTS

if TYPE_CHECKING:
    from rayproof.tracer.formulas import Formula

# An intersection says what is hit and how far away it is, and shadow rays run through it too: a fault may show in a
# shadow alone. So may one of the way into object space.
MET = (Stage.OBJECT, Stage.DISTANCE, Stage.VISIBILITY)


LIAR = "liar"  # what `--only` calls the part of the audit that lets a liar loose


@dataclass(frozen=True, kw_only=True)
class PlantedFault:
    """One fault, where it is planted and what must become of it."""

    name: str  # "slot/variant" of the tracer, else a name in `tests.harness.audit.faults`
    where: str  # "tracer" or "reference"
    stage: Stage  # the one to be found wrong
    also: tuple[Stage, ...] = ()  # others that a case may find wrong in its place
    covers: tuple[str, ...] = ()  # specification items
    who: tuple[str, ...] = ()  # the references that it spoils
    cases: tuple[str, ...] = ()  # patterns of the cases that show it best; else those that cover its items
    erratum: str | None = None
    equivalent: str | None = None  # the proof that it is right on every valid scene
    configuration: str | None = None  # of the tracer, where the fault is one of its formulas
    precision: str = "float32"  # of the tracer that is judged with it

    def blames(self, stage: Stage | None) -> bool:
        """Say whether `stage` is one that may be found wrong."""
        return stage is not None and stage in (self.stage, *self.also)


def _meets(formula: "Formula") -> bool:
    return formula.slot in ("cube", "nearest", "plane", "sphere", "square", "to_object", "triangle")


def tracer_faults() -> tuple[PlantedFault, ...]:
    """Return the tracer's planted faults, and the wrong forms that the lecture prints."""
    from rayproof.tracer.formulas import FORMULAS

    return tuple(
        _of_formula(formula)
        for formula in FORMULAS.values()
        if formula.kind in ("control", "fault") and formula.known_bad is None
    )


def _of_formula(formula: "Formula") -> PlantedFault:
    from rayproof.tracer.configuration import Configuration

    precision = formula.facts.get("precision", "float32")
    return PlantedFault(
        name=formula.name,
        where="tracer",
        stage=formula.stage,
        also=(*formula.facts.get("also", ()), *(MET if _meets(formula) else ())),
        covers=formula.covers,
        cases=tuple(formula.facts.get("cases", ())),
        erratum=formula.erratum,
        equivalent=formula.equivalent,
        precision=precision,
        configuration=Configuration(precision=precision, formulas={formula.slot: formula.variant}).name,
    )


def other_faults() -> tuple[PlantedFault, ...]:
    """Return the planted faults of references."""
    return tuple(PlantedFault(name=name, **FAULTS.about(name)) for name in FAULTS)


def planted(pattern: str = "*") -> tuple[PlantedFault, ...]:
    """Return the faults whose name, or place, matches a glob; none for the liar, which is asked apart.

    A fault of the user's own is a formula, slot=FILE.py:function.

    Raises:
        LookupError: none does.
        OwnFormulaError: the user's file does not import, or holds no function that the slot can call.

    """
    if pattern == LIAR:
        return ()
    if is_own(pattern):
        from rayproof.tracer.formulas import FORMULAS

        return (_of_formula(FORMULAS.named(pattern)),)
    everything = (*tracer_faults(), *other_faults())
    found = tuple(one for one in everything if fnmatchcase(one.name, pattern) or one.where == pattern)
    if not found:
        raise LookupError(f"no planted fault matches {pattern!r}; `rayproof list formulas` lists the tracer's")
    return found


# Which cases a fault is put to: at first a few that cover its items, from as many families; a survivor sees them all.
#
# Cases are shared between faults wherever possible, because the references' renders are what costs.


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


# The tables of docs/faults.md, which a test compares with this: `python -m tests.harness.audit.planted` prints them.


def _what(fault: PlantedFault) -> str:
    """Return in a sentence what the fault does."""
    from rayproof.tracer.formulas import FORMULAS

    if fault.configuration is not None:
        formula = FORMULAS[fault.name]
        says = formula.facts.get("says")
        return f"{says[0].upper()}{says[1:]}." if says else formula.summary
    paragraphs = inspect.cleandoc(FAULTS[fault.name].__doc__ or "").split("\n\n")
    return " ".join(paragraphs[-1].split())


def tables() -> str:
    """Return a table in Markdown for each place where faults are planted, and the proofs of equivalence."""
    everything = planted()
    lines: list[str] = []
    for where in dict.fromkeys(fault.where for fault in everything):
        some = sorted((fault for fault in everything if fault.where == where), key=lambda fault: fault.name)
        lines += [f"### {where.capitalize()}", "", "| fault | stage | items | what |", "|---|---|---|---|"]
        for fault in some:
            noted = f" (Erratum {fault.erratum}.)" if fault.erratum else ""
            noted += " *Equivalent.*" if fault.equivalent else ""
            items = ", ".join(fault.covers)
            lines.append(f"| `{fault.name}` | {fault.stage.value} | {items} | {_what(fault)}{noted} |")
        lines.append("")
    lines += ["### Proofs of equivalence", ""]
    lines += [f"* `{fault.name}`: {fault.equivalent}." for fault in everything if fault.equivalent]
    return "\n".join(lines) + "\n"


if __name__ == "__main__":
    sys.stdout.write(tables())
