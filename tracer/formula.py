"""A formula of the tracer as everybody else sees it: its name, what it covers, and a way to load it."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any, Literal

from rayproof.cases.stages import Stage

Kind = Literal["right", "control", "fault"]
KINDS: tuple[Kind, ...] = ("right", "control", "fault")
MARK = ".py:"  # what tells a user's function, FILE.py:function, from the name of a variant


def is_own(variant: str) -> bool:
    """Return whether a variant, or a name that has it, is a function of the user's."""
    return MARK in variant


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
        """Return "slot/variant", or "slot=FILE.py:function" of a user's own."""
        return f"{self.slot}{'=' if is_own(self.variant) else '/'}{self.variant}"

    @property
    def function(self) -> Callable[..., Any]:
        """Return the function itself."""
        return self.load()

    @property
    def summary(self) -> str:
        """Return the first line of the function's docstring."""
        return (self.function.__doc__ or "").strip().split("\n")[0]
