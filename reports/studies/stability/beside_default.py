"""Comparison of a user's own formula with the default of its slot: one row for each ladder."""

from collections.abc import Sequence

from rayproof.reports.studies.stability.records import ClimbRecord
from rayproof.tracer.formulas import FORMULAS
from rayproof.tracer.formulas.own_file import is_own

ALIKE = 2.0  # errors, and shares of wrong answers, that differ by at most this factor are reported as alike
STABLE = 4.0  # K u: smaller errors are not compared, because any backward stable formula has them


def own_alone(patterns: Sequence[str]) -> bool:
    """Return whether there are patterns and each names a user's own formula."""
    return bool(patterns) and all(map(is_own, patterns))


def defaults_of(patterns: Sequence[str]) -> list[str]:
    """Return the names of the defaults of the slots of the user's own formulas, without repeats."""
    slots = dict.fromkeys(FORMULAS.named(pattern).slot for pattern in patterns)
    return [FORMULAS.variants(slot)[0].name for slot in slots]


def beside_columns(patterns: Sequence[str], precisions: Sequence[str]) -> tuple[str, ...]:
    """Return the headings of the table of `beside_rows`; a single formula is named only in the title."""
    measured = [f"{what}, {precision}" for precision in precisions for what in ("right up to", "error / K u")]
    return ("ladder", *(["formula"] if len(patterns) > 1 else []), *measured, "compared")


def beside_title(patterns: Sequence[str]) -> str:
    """Return the title of the table of `beside_rows`."""
    return f"{', '.join(patterns)}, and in brackets the default, {', '.join(defaults_of(patterns))}"


def beside_rows(records: Sequence[ClimbRecord], precisions: Sequence[str]) -> list[list[str]]:
    """Return a row for each ladder and formula of the user's own: its numbers, and in brackets the default's.

    The last column is the comparison over all precisions: better, worse, mixed, or alike.
    """
    climbs = {(record.ladder, record.formula, record.precision): record for record in records}
    rows = []
    several = len({record.formula for record in records if is_own(record.formula)}) > 1
    for ladder, formula in dict.fromkeys((record.ladder, record.formula) for record in records):
        if not is_own(formula):
            continue
        default = FORMULAS.variants(formula.partition("=")[0])[0].name
        pairs = [
            (climbs[ladder, formula, precision], climbs[ladder, default, precision])
            for precision in precisions
            if (ladder, default, precision) in climbs
        ]
        cells = [cell for own, usual in pairs for cell in (_breakpoints(own, usual), _errors(own, usual))]
        signs = {sign for own, usual in pairs for sign in signs_of(own, usual)} - {0}
        word = "mixed" if len(signs) > 1 else {1: "better", -1: "worse", 0: "alike"}[min(signs, default=0)]
        rows.append([ladder, *([formula] if several else []), *cells, word])
    return rows


def signs_of(own: ClimbRecord, usual: ClimbRecord) -> tuple[int, int, int]:
    """Return 1 if the user's formula is better, -1 if it is worse, 0 if both are alike, in each of three quantities.

    These are the last value of the ladder with right answers, the share of wrongly decided rays, and the largest error.
    """
    reached = _place(own) - _place(usual)
    wrong = _larger(_wrong(usual), _wrong(own))
    error = _larger(*(max(STABLE, climb.scaled_error or 0.0) for climb in (usual, own)))
    return (reached > 0) - (reached < 0), wrong, error


def _place(climb: ClimbRecord) -> int:
    """Return the index of the last value of the ladder at which a formula is right; -1 if it never is."""
    values = [rung.value for rung in climb.values]
    return -1 if climb.breakpoint is None else values.index(climb.breakpoint)


def _wrong(climb: ClimbRecord) -> float:
    return (climb.false_hits + climb.false_misses + climb.invalid) / max(1, climb.rays)


def _larger(first: float, second: float) -> int:
    return 1 if first > ALIKE * second else -1 if second > ALIKE * first else 0


def _breakpoints(own: ClimbRecord, usual: ClimbRecord) -> str:
    first, second = ("never" if at is None else f"{at:.3g}" for at in (own.breakpoint, usual.breakpoint))
    return f"{first} ({second})"


def _errors(own: ClimbRecord, usual: ClimbRecord) -> str:
    first, second = ("-" if (error := climb.scaled_error) is None else f"{error:.3g}" for climb in (own, usual))
    return f"{first} ({second})"
