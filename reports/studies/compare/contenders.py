"""`Contender`: a named configuration; the differing slots, and the cases and stages that depend on them."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from fnmatch import fnmatchcase

from rayproof.cases.case import Case
from rayproof.cases.families import all_cases, select
from rayproof.cases.rounding import PRECISIONS
from rayproof.cases.scene import IDENTITY, Scene
from rayproof.cases.stages import Stage
from rayproof.cases.stresses import STRESSES, stressing
from rayproof.tracer.configuration import Configuration, parts_of
from rayproof.tracer.formulas import FORMULAS, PLACED, SHAPES_OF
from rayproof.tracer.formulas.own_file import is_own

# Camera slots that affect an image only if rays are made by the inverse matrices, and slots that affect no image.
MATRICES = ("view", "projection", "inverse")
UNSEEN = ("corners", "pixel")
BY_MATRICES = {"ray": "inverse_matrices"}


@dataclass(frozen=True, kw_only=True)
class Contender:
    """A configuration and its name in the user's request."""

    label: str
    configuration: Configuration


def contender(text: str, *, precision: str) -> Contender:
    """Return the contender named "slot/variant", "slot=FILE.py:function", or "float32/slot=variant/...".

    A single formula runs in `precision`. Raises ValueError or LookupError, with a message of one line, for an unknown
    name.
    """
    first, *rest = parts_of(text)
    if first in PRECISIONS:
        chosen = Configuration.parse("/".join([first, *(_part(part) for part in rest)]))
        label = text
    else:
        formula = FORMULAS.named(text)
        chosen = Configuration(precision=precision, formulas={formula.slot: formula.variant})
        label = text if is_own(text) else formula.name
    _ = chosen.own  # load the user's formula now, so that an error in it is reported before anything is computed
    return Contender(label=label, configuration=chosen)


def _part(part: str) -> str:
    """Return "slot=variant"; the slot of a bare variant is the only slot with a variant of this name."""
    if "=" in part:
        return part
    slots = [slot for slot in FORMULAS.slots if f"{slot}/{part}" in FORMULAS]
    if len(slots) != 1:
        problem = f"is a variant of {', '.join(slots)}" if slots else "is no variant of any slot"
        raise LookupError(f"{part!r} {problem}; write slot=variant")
    return f"{slots[0]}={part}"


def differing(base: Configuration, candidate: Configuration) -> tuple[str, ...]:
    """Return the slots whose functions differ between the two configurations, in the order of the light path."""
    return tuple(slot for slot in FORMULAS.slots if base[slot] is not candidate[slot])


def seen(base: Contender, candidate: Contender) -> tuple[Contender, Contender]:
    """Return the two contenders, with rays made from matrices if only matrices differ, so that images can differ.

    Raises:
        LookupError: only slots differ that no image depends on.

    """
    slots = differing(base.configuration, candidate.configuration)
    if slots and set(slots) <= set(UNSEEN):
        raise LookupError(
            f"no image depends on {' or '.join(slots)}, so there is nothing to compare; "
            f"judge it by rayproof run cameras --formula {slots[0]}=..."
        )
    if not slots or not set(slots) <= {*MATRICES, *UNSEEN}:
        return base, candidate
    if "CAM-5" in base.configuration.formula("ray").covers:
        return base, candidate
    return _by_matrices(base), _by_matrices(candidate)


def _by_matrices(contender: Contender) -> Contender:
    formulas = {**contender.configuration.formulas, **BY_MATRICES}
    return replace(contender, configuration=replace(contender.configuration, formulas=formulas))


def stages_at_stake(base: Configuration, candidate: Configuration) -> tuple[Stage, ...]:
    """Return the stages whose formulas differ, in order; all stages if the precisions differ.

    The camera stage has no image: a difference there is measured in the rays. Two equal configurations differ in no
    stage; their distances are compared, as a control.
    """
    if base.precision != candidate.precision:
        return tuple(stage for stage in Stage if stage not in (Stage.CAMERA, Stage.DISTANCE))
    stages = {base.formula(slot).stage for slot in differing(base, candidate)}
    if Stage.CAMERA in stages:
        stages = stages - {Stage.CAMERA} | {Stage.RAY}
    return tuple(stage for stage in Stage if stage in stages) or (Stage.OBJECT,)


# The shapes of a scene that a slot's formula can affect.


def concerned(scene: Scene, slots: Sequence[str]) -> frozenset[int] | None:
    """Return the indices of the shapes that a change of `slots` can affect, None for all of them.

    Pixels that show other shapes are equal by construction; counting them would hide every difference.
    """
    if not slots or any(slot not in SHAPES_OF and slot not in PLACED for slot in slots):
        return None
    return frozenset(
        index
        for index, shape in enumerate(scene.shapes)
        for slot in slots
        if (shape.to_world != IDENTITY if slot in PLACED else isinstance(shape, SHAPES_OF[slot]))
    )


# The scenes of a comparison: the families of cases that depend on the differing slots, and stressing scenes.


@dataclass(frozen=True, kw_only=True)
class SceneFamily:
    """A family of scenes. The scenes of a stress are replicates of one difficulty."""

    family: str
    scenes: tuple[tuple[str, Scene], ...]
    stress: bool


def questions(
    selectors: Sequence[str], base: Contender, candidate: Contender, files: Sequence[Case] = ()
) -> tuple[SceneFamily, ...]:
    """Return the families that `selectors` name, and each case of scene `files` as a family of its own.

    Without selectors and files, return the families that depend on the differing formulas.

    Raises:
        LookupError: a selector names neither a case nor a stress.

    """
    if not selectors and not files:
        return _concerning(base, candidate)
    stresses, cases = stresses_and_cases(selectors)
    alone = (SceneFamily(family=case.name, scenes=((case.name, case.scene),), stress=False) for case in files)
    return (*_families(cases), *alone, *_stresses(stresses))


def stresses_and_cases(selectors: Sequence[str]) -> tuple[list[str], tuple[Case, ...]]:
    """Return the stresses, sorted by name, and the cases that `selectors` name.

    Raises:
        LookupError: a selector names neither a case nor a stress.

    """
    stresses = sorted(name for name in STRESSES if any(fnmatchcase(name, selector) for selector in selectors))
    others = [selector for selector in selectors if not any(fnmatchcase(name, selector) for name in STRESSES)]
    return stresses, select(others) if others else ()


def _concerning(base: Contender, candidate: Contender) -> tuple[SceneFamily, ...]:
    slots = differing(base.configuration, candidate.configuration)
    formulas = [contender.configuration.formula(slot) for contender in (base, candidate) for slot in slots]
    items = {item for formula in formulas for item in formula.covers}
    cases = [case for case in all_cases() if not items or items & set(case.covers)]
    stresses = {name for slot in slots for name in stressing(slot)} if slots else set(STRESSES)
    return (*_families(cases), *_stresses(sorted(stresses)))


def _families(cases: Sequence[Case]) -> tuple[SceneFamily, ...]:
    return tuple(
        SceneFamily(
            family=name, scenes=tuple((case.name, case.scene) for case in cases if case.family == name), stress=False
        )
        for name in dict.fromkeys(case.family for case in cases)
    )


def _stresses(names: Sequence[str]) -> tuple[SceneFamily, ...]:
    return tuple(SceneFamily(family=name, scenes=tuple(STRESSES[name]()), stress=True) for name in names)
