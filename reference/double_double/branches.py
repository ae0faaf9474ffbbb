"""Work that few rays need, left out where no ray of a packet needs it."""

from collections.abc import Callable, Sequence
from typing import Any

import drjit as dr

from rayproof.reference.double_double.pair_arithmetic import Bool, Pair
from rayproof.reference.double_double.questions import Questions


def only_where(needed: Bool, ask: Questions, work: Callable[[Questions], Sequence[Any]]) -> list[Any]:
    """Return what `work` returns, pairs and arrays, where it is needed; elsewhere zero and false.

    Neighbouring rays make a packet, so this pays where rays come in the order of an image.
    """
    kinds: list[type] = []

    def needed_by_some() -> tuple[Any, ...]:
        inner = Questions(type(ask.least))
        values = work(inner)
        kinds.extend(type(value) for value in values)
        parts = [
            part for value in values for part in ((value.high, value.low) if isinstance(value, Pair) else (value,))
        ]
        return (*parts, inner.least)

    def needed_by_none() -> tuple[Any, ...]:
        # Opaque: a literal that both sides return ends in Dr.Jit 1.5.0 outside the scope of its definition.
        float64 = type(ask.least)
        pieces = [part for kind in kinds for part in ((float64, float64) if kind is Pair else (kind,))]
        return (*(dr.opaque(piece, 0) for piece in pieces), dr.opaque(float64, dr.inf))

    *parts, least = dr.if_stmt((), needed, needed_by_some, needed_by_none)
    ask.least = dr.select(least < ask.least, least, ask.least)
    rest = iter(parts)
    return [Pair(next(rest), next(rest)) if kind is Pair else next(rest) for kind in kinds]
