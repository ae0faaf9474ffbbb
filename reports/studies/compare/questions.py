"""On what two contenders are compared: the families that concern what differs between them, and stressing scenes."""

from collections.abc import Sequence
from dataclasses import dataclass
from fnmatch import fnmatchcase

from rayproof.cases.families import all_cases, select
from rayproof.cases.scene import Scene
from rayproof.cases.stresses import STRESSES, stressing
from rayproof.reports.studies.compare.contenders import Contender, differing


@dataclass(frozen=True, kw_only=True)
class Question:
    """One family of scenes. The scenes of a stress are replicates of one difficulty."""

    family: str
    scenes: tuple[tuple[str, Scene], ...]
    stress: bool


def questions(selectors: Sequence[str], base: Contender, candidate: Contender) -> tuple[Question, ...]:
    """Return the families that `selectors` name; by default those that the differing formulas concern.

    Raises:
        LookupError: a selector names neither a case nor a stress.

    """
    if not selectors:
        return _concerning(base, candidate)
    named = {name for name in STRESSES if any(fnmatchcase(name, selector) for selector in selectors)}
    others = [one for one in selectors if not any(fnmatchcase(name, one) for name in STRESSES)]
    return (*_families(others), *_stresses(sorted(named)))


def _concerning(base: Contender, candidate: Contender) -> tuple[Question, ...]:
    slots = differing(base.configuration, candidate.configuration)
    formulas = [one.configuration.formula(slot) for one in (base, candidate) for slot in slots]
    items = {item for formula in formulas for item in formula.covers}
    cases = [case for case in all_cases() if not items or items & set(case.covers)]
    names = dict.fromkeys(case.family for case in cases)
    families = tuple(
        Question(
            family=name, scenes=tuple((case.name, case.scene) for case in cases if case.family == name), stress=False
        )
        for name in names
    )
    stresses = {name for slot in slots for name in stressing(slot)} if slots else set(STRESSES)
    return (*families, *_stresses(sorted(stresses)))


def _families(patterns: Sequence[str]) -> tuple[Question, ...]:
    cases = select(patterns) if patterns else ()
    return tuple(
        Question(
            family=name, scenes=tuple((case.name, case.scene) for case in cases if case.family == name), stress=False
        )
        for name in dict.fromkeys(case.family for case in cases)
    )


def _stresses(names: Sequence[str]) -> tuple[Question, ...]:
    return tuple(Question(family=name, scenes=tuple(STRESSES[name]()), stress=True) for name in names)
