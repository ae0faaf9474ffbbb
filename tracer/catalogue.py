"""Every registered formula of the tracer, in the order of the light path."""

from collections.abc import Callable, Iterator, Mapping
from functools import cached_property
from typing import Any

from rayproof.cases.declarations import DeclaredRegistry
from rayproof.cases.scene import Cube, Mesh, Plane, Shape, Sphere, Square, Triangle
from rayproof.tracer.camera import CAMERA
from rayproof.tracer.clipping import CLIPPING
from rayproof.tracer.feelers import FEELERS
from rayproof.tracer.formula import KINDS, Formula, is_own, own_formula
from rayproof.tracer.intersections import INTERSECTIONS
from rayproof.tracer.normals import NORMALS
from rayproof.tracer.shading import SHADING
from rayproof.tracer.transforms import TRANSFORMS

# Whose formulas only scenes with these shapes ask for.
SHAPES_OF: dict[str, tuple[type[Shape], ...]] = {
    "sphere": (Sphere,),
    "sphere_normal": (Sphere,),
    "cube": (Cube,),
    "cube_normal": (Cube,),
    "plane": (Plane,),
    "square": (Square,),
    "triangle": (Triangle, Mesh),
}
PLACED = ("to_object", "world_normal")  # of no use where object space is world space

REGISTRIES: tuple[DeclaredRegistry[Callable[..., Any]], ...] = (
    CAMERA,
    CLIPPING,
    TRANSFORMS,
    INTERSECTIONS,
    NORMALS,
    FEELERS,
    SHADING,
)


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
        module=registry.module(name),
        facts=facts,
        **{key: facts[key] for key in ("default", "erratum", "known_bad", "leaks", "equivalent") if key in facts},
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
        """Return the formula called "slot/variant"; a variant may be a function of the user's, "FILE.py:function".

        Raises:
            LookupError: there is none; the message lists what is known. Whether the user's file holds the function, is
                found when the formula is loaded.

        """
        if name in self._formulas:
            return self._formulas[name]
        slot, _, variant = name.partition("/")
        if slot not in self.slots:
            raise LookupError(f"no slot is called {slot!r}; known: {', '.join(sorted(self.slots))}")
        if is_own(variant):
            return own_formula(variant, default=self[f"{slot}/{self.slots[slot]}"])
        raise LookupError(f"no variant is called {name!r}; known: {', '.join(f.name for f in self.variants(slot))}")

    def __contains__(self, name: object) -> bool:
        return name in self._formulas

    def __iter__(self) -> Iterator[str]:
        return iter(self._formulas)

    def __len__(self) -> int:
        return len(self._formulas)

    def named(self, text: str) -> Formula:
        """Return the formula that a user writes "slot/variant", "slot=variant" or "slot=FILE.py:function".

        Raises:
            LookupError: there is none; the message lists what is known.
            OwnFormulaError: the file does not import, or holds no function that the slot can call.

        """
        formula = self[text.replace("=", "/", 1)]
        if is_own(formula.variant):
            formula.load()
        return formula

    @cached_property
    def slots(self) -> dict[str, str]:
        """Return the default variant of every slot, in the order of the light path."""
        return {formula.slot: formula.variant for formula in self._formulas.values() if formula.default}

    def variants(self, slot: str) -> tuple[Formula, ...]:
        """Return all formulas of a slot: the default first, planted faults last."""
        found = (formula for formula in self._formulas.values() if formula.slot == slot)
        return tuple(sorted(found, key=lambda formula: (not formula.default, formula.kind == "fault", formula.name)))


FORMULAS = Catalogue()
