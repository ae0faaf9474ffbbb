"""Every registered formula of the tracer, in the order of the light path."""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any, Literal

from rayproof.cases.declarations import DeclaredRegistry
from rayproof.cases.stages import Stage
from rayproof.tracer.camera import CAMERA
from rayproof.tracer.clipping import CLIPPING
from rayproof.tracer.feelers import FEELERS
from rayproof.tracer.intersections import INTERSECTIONS
from rayproof.tracer.normals import NORMALS
from rayproof.tracer.shading import SHADING
from rayproof.tracer.transforms import TRANSFORMS

Kind = Literal["right", "control", "fault"]
KINDS: tuple[Kind, ...] = ("right", "control", "fault")
REGISTRIES: tuple[DeclaredRegistry[Callable[..., Any]], ...] = (
    CAMERA,
    CLIPPING,
    TRANSFORMS,
    INTERSECTIONS,
    NORMALS,
    FEELERS,
    SHADING,
)


@dataclass(frozen=True, kw_only=True)
class Formula:
    """A formula and what is known about it.

    A "control" is a wrong form that the lecture prints or invites (`erratum`), or one that the literature knows to be
    bad (`known_bad`), kept runnable; a "fault" is planted for the audit. Unless it is `equivalent` or
    `known_bad`, its facts say what a renderer with it does: `says`, a verb phrase such as "leaves out 4 pi".
    """

    slot: str
    variant: str
    load: Callable[[], Callable[..., Any]]  # imports its module
    covers: tuple[str, ...]  # specification ids
    kind: Kind
    stage: Stage  # the one blamed when it is wrong
    folder: str  # the extension point, such as "intersections"
    default: bool = False
    erratum: str | None = None  # such as "E6"
    known_bad: str | None = None  # where a form that computes the right thing in exact arithmetic breaks down
    equivalent: str | None = None  # why a wrong form is right on every valid scene
    facts: Mapping[str, Any]  # all that was registered, what only its slot knows included

    @property
    def name(self) -> str:
        """Return "slot/variant"."""
        return f"{self.slot}/{self.variant}"

    @property
    def function(self) -> Callable[..., Any]:
        """Return the function itself."""
        return self.load()

    @property
    def summary(self) -> str:
        """Return the first line of the function's docstring."""
        return (self.function.__doc__ or "").strip().split("\n")[0]


def _formula(registry: DeclaredRegistry[Callable[..., Any]], name: str) -> Formula:
    slot, variant = name.split("/")
    facts = registry.about(name)
    if facts["kind"] not in KINDS:
        raise ValueError(f"{registry.kind} {name!r}: kind must be one of {', '.join(KINDS)}, got {facts['kind']!r}")
    return Formula(
        slot=slot,
        variant=variant,
        load=lambda: registry[name],
        covers=tuple(facts["covers"]),
        kind=facts["kind"],
        stage=facts["stage"],
        folder=registry.package.rsplit(".", 1)[1],
        facts=facts,
        **{key: facts[key] for key in ("default", "erratum", "known_bad", "equivalent") if key in facts},
    )


class Catalogue(Mapping[str, Formula]):
    """All formulas by "slot/variant", as they are declared; computing with one imports it."""

    @cached_property
    def _formulas(self) -> dict[str, Formula]:
        found = [_formula(registry, name) for registry in REGISTRIES for name in registry]
        for slot in {formula.slot for formula in found}:
            defaults = [formula.name for formula in found if formula.slot == slot and formula.default]
            folders = {formula.folder for formula in found if formula.slot == slot}
            if len(defaults) != 1 or len(folders) != 1:
                raise ValueError(f"slot {slot!r} must have one default and one folder, got {defaults} in {folders}")
        return {formula.name: formula for formula in found}

    def __getitem__(self, name: str) -> Formula:
        """Return the formula called "slot/variant"; raise LookupError that lists what is known."""
        if name in self._formulas:
            return self._formulas[name]
        slot = name.split("/")[0]
        if slot not in self.slots:
            raise LookupError(f"no slot is called {slot!r}; known: {', '.join(sorted(self.slots))}")
        raise LookupError(f"no variant is called {name!r}; known: {', '.join(f.name for f in self.variants(slot))}")

    def __contains__(self, name: object) -> bool:
        return name in self._formulas

    def __iter__(self) -> Iterator[str]:
        return iter(self._formulas)

    def __len__(self) -> int:
        return len(self._formulas)

    @cached_property
    def slots(self) -> dict[str, str]:
        """Return the default variant of every slot, in the order of the light path."""
        return {formula.slot: formula.variant for formula in self._formulas.values() if formula.default}

    def variants(self, slot: str) -> tuple[Formula, ...]:
        """Return all formulas of a slot: the default first, planted faults last."""
        found = (formula for formula in self._formulas.values() if formula.slot == slot)
        return tuple(sorted(found, key=lambda formula: (not formula.default, formula.kind == "fault", formula.name)))


FORMULAS = Catalogue()
