"""All that can be planted: wrong formulas of the tracer, and spoilt references, loader, judge, run and report."""

from dataclasses import dataclass
from fnmatch import fnmatchcase
from typing import TYPE_CHECKING

from rayproof.cases.stages import Stage
from rayproof.reports.audit.faults import FAULTS
from rayproof.reports.audit.mutants.trials import selected
from rayproof.tracer.formula import is_own

if TYPE_CHECKING:
    from rayproof.tracer.formula import Formula

# An intersection says what is hit and how far away it is, and feelers run through it too: a fault may show in a shadow
# alone. So may one of the way into object space.
MET = (Stage.OBJECT, Stage.DISTANCE, Stage.VISIBILITY)


LIAR = "liar"  # what `--only` calls the part of the audit that lets a liar loose


@dataclass(frozen=True, kw_only=True)
class PlantedFault:
    """One fault, where it is planted and what must become of it."""

    name: str  # "slot/variant" of the tracer, else a name in `reports.audit.faults`
    where: str  # "tracer", "reference", "loader", "judge", "run" or "report"
    stage: Stage | None  # the one to be found wrong; None: a guard must stop the run
    also: tuple[Stage, ...] = ()  # others that a case may find wrong in its place
    covers: tuple[str, ...] = ()  # specification items
    who: tuple[str, ...] = ()  # the references that it spoils
    cases: tuple[str, ...] = ()  # patterns of the cases that show it best; else those that cover its items
    erratum: str | None = None
    equivalent: str | None = None  # the proof that it is right on every valid scene
    configuration: str | None = None  # of the tracer, where the fault is one of its formulas
    precision: str = "float32"  # of the tracer that is judged with it
    path: str | None = None  # of the tracer, where the fault is in one of its execution paths alone (`tracer.paths`)
    routes: tuple[str, ...] = ()  # by which it must be rendered too, to be seen (`reports.paths`)

    @property
    def on_guard(self) -> bool:
        """Say whether guards and not cases must kill it."""
        return self.stage is None

    def blames(self, stage: Stage | None) -> bool:
        """Say whether `stage` is one that may be found wrong."""
        return stage is not None and stage in (self.stage, *self.also)


def _meets(formula: "Formula") -> bool:
    return formula.folder == "intersections" or formula.slot == "to_object"


def tracer_faults() -> tuple[PlantedFault, ...]:
    """Return the tracer's planted faults, and the wrong forms that the lecture prints."""
    from rayproof.tracer.catalogue import FORMULAS

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
    """Return the planted faults of the tracer's paths, and of references, loader, judge, run and report."""
    return tuple(PlantedFault(name=name, **FAULTS.about(name)) for name in FAULTS)


def in_paths() -> dict[str, list[str]]:
    """Return execution path of the tracer -> the names of the faults that are planted in it alone."""
    found: dict[str, list[str]] = {}
    for fault in other_faults():
        if fault.path is not None:
            found.setdefault(fault.path, []).append(fault.name)
    return found


def planted(pattern: str = "*") -> tuple[PlantedFault, ...]:
    """Return the faults whose name, or place, matches a glob; none for the liar and for mutants, which are asked apart.

    A fault of the user's own is a formula, slot=FILE.py:function.

    Raises:
        LookupError: none does.
        OwnFormulaError: the user's file does not import, or holds no function that the slot can call.

    """
    if pattern == LIAR:
        return ()
    if is_own(pattern):
        from rayproof.tracer.catalogue import FORMULAS

        return (_of_formula(FORMULAS.named(pattern)),)
    everything = (*tracer_faults(), *other_faults())
    found = tuple(one for one in everything if fnmatchcase(one.name, pattern) or one.where == pattern)
    if not found and not selected(pattern):
        raise LookupError(f"no planted fault matches {pattern!r}; `rayproof list formulas` lists the tracer's")
    return found
