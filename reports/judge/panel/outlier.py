"""Who stands alone: the one voice that differs where all others, two at least, agree among themselves."""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import combinations

from rayproof.reports.judge.panel.matrix import Matrix

LEAST_MAJORITY = 2  # voices that agree with each other and not with the one that stands alone


@dataclass(frozen=True, kw_only=True)
class Standing:
    """What a stage's matrix says of its parties."""

    alone: tuple[str, ...]  # names that speak with the one voice that stands alone; none where nobody does
    majority: tuple[str, ...]  # who agrees against it
    why: str


def standing(matrix: Matrix, voice: Callable[[str], str]) -> Standing:
    """Return who stands alone at a stage, or why nobody does."""
    names = matrix.answered()
    if not names:
        return Standing(alone=(), majority=(), why="No two renderers answer this stage.")
    differ = [pair for pair in combinations(names, 2) if matrix.agree(*pair) is False]
    if not differ:
        return Standing(alone=(), majority=names, why=f"All {len(names)} renderers agree.")
    voices: dict[str, list[str]] = {}
    for name in names:
        voices.setdefault(voice(name), []).append(name)
    found = []
    for one, members in voices.items():
        others = [name for name in names if name not in members]
        guilty = [name for name in members if any(matrix.agree(name, other) is False for other in others)]
        settled = all(matrix.agree(*pair) for pair in combinations(others, 2))
        if guilty and settled and len(voices) - 1 >= LEAST_MAJORITY:
            found.append((one, guilty, others))
    if len(found) == 1:
        _, guilty, others = found[0]
        return Standing(
            alone=tuple(guilty),
            majority=tuple(others),
            why=f"{_and(guilty)} alone: {_and(others)} agree among themselves{_measure(matrix, guilty, others)}.",
        )
    pairs = "; ".join(f"{one} and {other} differ" for one, other in differ)
    if len(voices) == LEAST_MAJORITY:
        return Standing(alone=(), majority=(), why=f"{pairs}: no third voice to tell who is wrong.")
    if found:
        either = _and([name for _, guilty, _ in found for name in guilty])
        return Standing(alone=(), majority=(), why=f"{pairs}: the others agree with both, {either} may be wrong.")
    return Standing(alone=(), majority=(), why=f"{pairs}: nobody stands alone.")


def _measure(matrix: Matrix, guilty: list[str], others: list[str]) -> str:
    """Return by how much the ones alone differ, in words."""
    cells = [matrix.cells[one, other] for one in guilty for other in others if (one, other) in matrix.cells]
    worst = max((cell.ratio for cell in cells), default=0.0)
    most = max((cell.differing for cell in cells), default=0)
    return f" ({most} interior pixels over the limit, {worst:.3g} times it at worst)"


def _and(names: list[str]) -> str:
    """Return names as a list in words."""
    return names[0] if len(names) == 1 else f"{', '.join(names[:-1])} and {names[-1]}"
