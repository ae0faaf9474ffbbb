"""Case families: one file each, named after what it stresses; generated, seeded, deterministic.

To add one: a function without parameters that yields `Case`s named `family/case`, in a new file, under
`@CASE_FAMILIES.register("family")`.
"""

from collections.abc import Callable, Iterator, Sequence
from difflib import get_close_matches
from fnmatch import fnmatchcase
from functools import cache

from cases.case import Case
from cases.registry import Registry

CASE_FAMILIES: Registry[Callable[[], Iterator[Case]]] = Registry("case family", package="cases.families")


@cache
def all_cases() -> tuple[Case, ...]:
    """Return every case, by family in alphabetical order, then in the order in which the family yields them.

    Raises:
        ValueError: a family yields a case under another family's name, or two cases share a name.

    """
    cases: dict[str, Case] = {}
    for family in CASE_FAMILIES:
        for case in CASE_FAMILIES[family]():
            if case.family != family:
                raise ValueError(f"family {family!r} yields case {case.name!r}, which names another family")
            if case.name in cases:
                raise ValueError(f"case {case.name!r} is yielded twice")
            cases[case.name] = case
    return tuple(cases.values())


def select(patterns: Sequence[str]) -> tuple[Case, ...]:
    """Return the cases that any pattern names, in `all_cases` order; a pattern is a family, a case or a glob.

    Raises:
        LookupError: a pattern names nothing; the message lists names like it.

    """
    cases = all_cases()
    chosen: set[str] = set()
    for pattern in patterns:
        named = {case.name for case in cases if pattern == case.family or fnmatchcase(case.name, pattern)}
        if not named:
            known = [*dict.fromkeys(case.family for case in cases), *(case.name for case in cases)]
            near = get_close_matches(pattern, known, n=3, cutoff=0.5)
            hint = f"did you mean {', '.join(near)}?" if near else f"families: {', '.join(CASE_FAMILIES)}"
            raise LookupError(f"no case matches {pattern[:80]!r}; {hint}")
        chosen |= named
    return tuple(case for case in cases if case.name in chosen)
