"""The table of case families; `all_cases` and `select` by name or pattern. Cases are seeded and deterministic.

To add a family: a function without parameters that yields `Case`s named `family/case`, in the module of its subject or
a new module, and a line in the table; with `on_request=True` it is selected only by name and is not in the default
suite.
"""

from collections.abc import Callable, Iterator, Sequence
from difflib import get_close_matches
from fnmatch import fnmatchcase
from functools import cache

from rayproof.cases.case import RANDOM, Case
from rayproof.cases.registry import Entry, Table

CASE_FAMILIES: Table[Callable[[], Iterator[Case]]] = Table(
    "case family",
    package="rayproof.cases.families",
    entries={
        "acne": Entry("acne:acne"),
        "alone": Entry("primitives:alone"),
        "along_the_way": Entry("shadows:along_the_way"),
        "antialiased": Entry("primitives:antialiased"),
        "behind": Entry("around_the_eye:behind"),
        "benchmarked": Entry("trees:benchmarked", on_request=True),
        "cameras": Entry("cameras:cameras"),
        "cie_isotropic_source": Entry("radiometry:cie_isotropic_source"),
        "clipping": Entry("clipping:clipping"),
        "combined": Entry("combined:combined"),
        "crowds": Entry("trees:crowds"),
        "extremes": Entry("extremes:extremes"),
        "faces": Entry("trees:faces"),
        "flux_conservation": Entry("radiometry:flux_conservation"),
        "inside": Entry("around_the_eye:inside"),
        "integrating_sphere": Entry("radiometry:integrating_sphere"),
        "invariance": Entry("radiometry:invariance"),
        "inverse_square": Entry("radiometry:inverse_square"),
        "meshes": Entry("meshes:meshes"),
        "models": Entry("meshes:models"),
        "nearest": Entry("nearest:nearest"),
        "normals": Entry("transforms:normals"),
        "parallel_rays": Entry("cameras:parallel_rays"),
        "primitives": Entry("primitives:primitives"),
        "random_scenes": Entry("nearest:random_scenes"),
        "reported": Entry("reported:reported"),
        "several_lights": Entry("lights:several_lights"),
        "shadows": Entry("shadows:shadows"),
        "sidedness": Entry("sidedness:sidedness"),
        "simplified": Entry("lights:simplified"),
        "tolerances": Entry("tolerances:tolerances"),
        "transforms": Entry("transforms:transforms"),
        "walls": Entry("clipping:walls"),
        "watertight": Entry("watertight:watertight"),
    },
)


@cache
def cases_of(family: str) -> tuple[Case, ...]:
    """Return the cases of one family in the order of the family's function.

    Raises:
        LookupError: there is no such family.
        ValueError: the family yields a case under another family's name, or two under one name.

    """
    cases: dict[str, Case] = {}
    for case in CASE_FAMILIES[family]():
        if case.family != family:
            raise ValueError(f"family {family!r} yields case {case.name!r}, which names another family")
        if case.name in cases:
            raise ValueError(f"case {case.name!r} is yielded twice")
        cases[case.name] = case
    return tuple(cases.values())


def all_cases() -> tuple[Case, ...]:
    """Return the default suite, by family in alphabetical order, then in the order of the family's function."""
    return tuple(case for family in CASE_FAMILIES if not on_request(family) for case in cases_of(family))


def on_request(family: str) -> bool:
    """Return whether a family is selected only by name."""
    return bool(CASE_FAMILIES.about(family).get("on_request", False))


def select(patterns: Sequence[str]) -> tuple[Case, ...]:
    """Return the cases that match any pattern, in `all_cases` order; a pattern is a family, a case or a glob.

    Random scenes come last, in the order of `patterns`; each is named random/SEED/NUMBER.

    Raises:
        LookupError: a pattern matches nothing; the message lists similar names.

    """
    drawn = {case.name: case for case in map(_random_case, filter(_is_random, patterns))}
    chosen: set[str] = set()
    for pattern in (pattern for pattern in patterns if not _is_random(pattern)):
        # For a plain name only its own family is built: building the meshes takes half a second.
        family = pattern.partition("/")[0]
        if family not in CASE_FAMILIES and not _is_glob(family):
            searched: tuple[Case, ...] = ()
        else:
            searched = cases_of(family) if family in CASE_FAMILIES else all_cases()
        named = {case.name for case in searched if pattern == case.family or fnmatchcase(case.name, pattern)}
        if not named:
            near = _near(pattern)
            hint = f"did you mean {', '.join(near)}?" if near else f"families: {', '.join(CASE_FAMILIES)}"
            raise LookupError(f"no case matches {pattern[:80]!a}; {hint}")
        chosen |= named
    families = dict.fromkeys(sorted(name.partition("/")[0] for name in chosen))
    named = (case for family in families for case in cases_of(family) if case.name in chosen)
    return (*named, *drawn.values())


def _is_glob(text: str) -> bool:
    return any(letter in text for letter in "*?[")


def _near(pattern: str) -> list[str]:
    """Return up to three names similar to a pattern without a match.

    They are families with a name like the pattern's first part, or cases of these with a name like its second part. If
    no family has such a name, the second part is compared with all cases, which takes as long as making all scenes.
    """
    family, _, rest = pattern[:80].lower().partition("/")
    families = [family] if family in CASE_FAMILIES else get_close_matches(family, CASE_FAMILIES, n=2, cutoff=0.6)
    if not families:
        parts = {case.name: case.name.partition("/")[2] for case in all_cases()}
        near = get_close_matches(rest or family, sorted(set(parts.values())), n=3, cutoff=0.7)
        return [name for part in near for name, rest_of_name in parts.items() if rest_of_name == part][:3]
    if not rest:
        return families
    suggestions = []
    for family_near in families:
        parts = [case.name.partition("/")[2] for case in cases_of(family_near)]
        within = [part for part in parts if part.replace("_", "").startswith(rest.replace("_", "").replace("-", ""))]
        near = dict.fromkeys([*get_close_matches(rest, parts, n=3, cutoff=0.6), *within])
        suggestions += [f"{family_near}/{part}" for part in near]
    return suggestions[:3] or families


def _random_case(name: str) -> Case:
    from rayproof.cases.random_scenes import case_named  # here, because most runs do not need it

    return case_named(name)


def _is_random(pattern: str) -> bool:
    """Return whether a pattern names random scenes, which are in no list."""
    return pattern.partition("/")[0] == RANDOM
