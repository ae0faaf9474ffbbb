"""Which law is put to which case: by default a covering choice, or the whole matrix."""

from collections.abc import Sequence
from fnmatch import fnmatchcase

from cases.case import Case
from cases.families import select
from cases.laws import LAWS
from reports.laws.suite import Pair

DEFAULT: tuple[tuple[str, str], ...] = ()


def chosen(selectors: Sequence[str], *, everything: bool) -> tuple[Pair, ...]:
    """Return the pairs that selectors name: laws, cases, families or globs of either; none: the default choice.

    A case without a law gets every law, or with none named those that the default choice puts to anything.

    Raises:
        LookupError: a selector names neither a law nor a case.

    """
    laws = [law for law in LAWS if any(fnmatchcase(law, selector) for selector in selectors)]
    wanted = [one for one in selectors if not any(fnmatchcase(law, one) for law in LAWS)]
    cases = select(wanted) if wanted else ()
    if not everything and not cases:
        return tuple(pair for pair in default() if not laws or pair.law in laws)
    every_case = cases or select(["*"])
    pairs = [(law, case) for case in every_case for law in (laws or LAWS)]
    own = {law for law in LAWS if LAWS.about(law).get("own", False)}
    return tuple(Pair(law=law, case=case) for law, case in pairs if law not in own or case is every_case[0])


def default() -> tuple[Pair, ...]:
    """Return the covering choice, in its order."""
    cases: dict[str, Case] = {case.name: case for case in select(sorted({name for _, name in DEFAULT}))}
    return tuple(Pair(law=law, case=cases[name]) for law, name in DEFAULT)
