"""`Configuration`: a precision, and one formula for every slot; parsed from and written as text."""

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from rayproof.cases.rounding import PRECISIONS
from rayproof.tracer.formulas import FORMULAS, Formula
from rayproof.tracer.formulas.own_file import MARK, digest, is_own

# A user's file may have slashes in its path; the next part begins after its function's name.
_PART = re.compile(rf"(?:[^/=]+=[^=:]*{re.escape(MARK)}\w*(?:\([^()]*\))?|[^/]*)(?:/|$)")


def parts_of(text: str) -> list[str]:
    """Return the parts of a configuration's name: its precision, and "slot=variant" or "slot=FILE.py:function"."""
    return [part.removesuffix("/") for part in _PART.findall(f"{text}/")[:-1]]


@dataclass(frozen=True, kw_only=True, eq=False)
class Configuration:
    """A precision and the formulas that differ from the default; equal and hashed by `name`.

    Raises LookupError, listing the known names, for an unknown precision, slot or variant.
    """

    precision: str = "float32"
    formulas: Mapping[str, str] = field(default_factory=dict)  # slot -> variant, where it is not the default

    def __post_init__(self) -> None:
        if self.precision not in PRECISIONS:
            raise LookupError(f"no precision is called {self.precision!r}; known: {', '.join(PRECISIONS)}")
        formulas = {slot: FORMULAS[f"{slot}/{variant}"].variant for slot, variant in self.formulas.items()}
        order = FORMULAS.slots
        chosen = {slot: formulas[slot] for slot in order if formulas.get(slot, order[slot]) != order[slot]}
        object.__setattr__(self, "formulas", chosen)

    @classmethod
    def parse(cls, text: str) -> "Configuration":
        """Return the configuration of a name such as "float32/ray=inverse_matrices/triangle=signed_areas".

        Raises:
            ValueError: a part does not read slot=variant, or a slot is named twice.
            LookupError: an unknown precision, slot or variant.

        """
        precision, *parts = parts_of(text)
        chosen: dict[str, str] = {}
        for part in parts:
            slot, equals, variant = part.partition("=")
            if not equals or slot in chosen:
                raise ValueError(f"configuration {text!r}: each part must read slot=variant, once a slot; got {part!r}")
            chosen[slot] = variant
        return cls(precision=precision, formulas=chosen)

    @property
    def name(self) -> str:
        """Return the canonical name, which `parse` reads back."""
        return "/".join([self.precision, *(f"{slot}={variant}" for slot, variant in self.formulas.items())])

    def formula(self, slot: str) -> Formula:
        """Return the formula chosen for `slot`; raise LookupError for an unknown slot."""
        variant = self.formulas.get(slot) or FORMULAS.slots.get(slot, "")
        return FORMULAS[f"{slot}/{variant}"]

    def __getitem__(self, slot: str) -> Callable[..., Any]:
        """Return the function chosen for `slot`; raise LookupError for an unknown slot."""
        return self.formula(slot).function

    @property
    def chosen(self) -> tuple[Formula, ...]:
        """Return the formula of every slot, in the order of the light path."""
        return tuple(self.formula(slot) for slot in FORMULAS.slots)

    @property
    def items(self) -> frozenset[str]:
        """Return the specification ids of all its formulas."""
        return frozenset(item for formula in self.chosen for item in formula.covers)

    @property
    def faults(self) -> tuple[str, ...]:
        """Return the names of the planted faults in use."""
        return tuple(formula.name for formula in self.chosen if formula.kind == "fault")

    @property
    def own(self) -> dict[str, str]:
        """Return the SHA-256 of each file of the user's that is in use, by "slot=FILE.py:function"; it is loaded.

        Raises:
            OwnFormulaError: one cannot be loaded, or does not fit its slot.

        """
        return {f"{slot}={name}": digest(self.formula(slot)) for slot, name in self.formulas.items() if is_own(name)}

    @property
    def controls(self) -> tuple[str, ...]:
        """Return the names of the wrong forms in use that the lecture prints or invites."""
        return tuple(formula.name for formula in self.chosen if formula.kind == "control")

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Configuration) and self.name == other.name

    def __hash__(self) -> int:
        return hash(self.name)
