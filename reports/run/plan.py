"""The plan: which configurations of the tracer are asked about which cases.

The default suite runs the default configuration in float32 and in float64 on every case, and every alternative
formula, in float32, on the cases that cover its specification item.
"""

from dataclasses import dataclass
from functools import lru_cache

from cases.case import Case
from reports.cache.digests import code, digest, machine, plain
from reports.subjects import THE_TRACER, Subject

DEFAULTS = ("float32", "float64")
# The specification's second way where it has two. Literature's further variants are for `rayproof stability`.
ALTERNATIVES = (
    "ray/inverse_matrices",
    "triangle/moeller_trumbore",
    "square/half_vectors",
    "feeler/skip_last",
    "feeler/minimum_t",
    "feeler/doubles",
)
PACKAGES = (
    "drjit",
    "embreex",
    "mitsuba",
    "numpy",
    "openexr",
    "pyradiance",
    "python-flint",
    "scikit-image",
    "scipy",
    "trimesh",
)  # whose numbers are in a result
# All that renders, judges, writes a record and writes its files.
SOURCES = (
    "cases",
    "tracer",
    "reference",
    "reports/judge",
    "reports/run",
    "reports/cache",
    "reports/subjects",
    "reports/publish",
)


@dataclass(frozen=True, kw_only=True)
class PlannedCase:
    """A case and the configurations that it is put to."""

    case: Case
    configurations: tuple[str, ...]


@lru_cache(maxsize=1)
def alternatives() -> dict[str, frozenset[str]]:
    """Return each alternative configuration with the specification items that it covers and the default does not.

    Raises:
        LookupError: an alternative is not registered (any more).
        ValueError: it covers nothing that the default does not.

    """
    from tracer.catalogue import FORMULAS
    from tracer.configuration import Configuration

    usual = Configuration(precision="float32").items
    found = {}
    for name in ALTERNATIVES:
        formula = FORMULAS[name]
        items = frozenset(formula.covers) - usual
        if not items:
            raise ValueError(f"{name} is no alternative: the default formulas cover {', '.join(formula.covers)} too")
        found[Configuration(precision="float32", formulas={formula.slot: formula.variant}).name] = items
    return found


def plan(
    cases: tuple[Case, ...], configurations: tuple[str, ...], subject: Subject = THE_TRACER
) -> tuple[PlannedCase, ...]:
    """Return every case with its configurations; `configurations`, if any, replace the default suite's.

    Another subject than the tracer has no configurations, only its name.

    Raises:
        LookupError, ValueError: a configuration names something unknown.

    """
    from tracer.configuration import Configuration

    if not subject.is_tracer:
        return tuple(PlannedCase(case=case, configurations=(subject.name,)) for case in cases)
    if configurations:
        names = tuple(dict.fromkeys(Configuration.parse(name).name for name in configurations))
        return tuple(PlannedCase(case=case, configurations=names) for case in cases)
    return tuple(
        PlannedCase(
            case=case,
            configurations=DEFAULTS
            + tuple(name for name, items in sorted(alternatives().items()) if items & set(case.covers)),
        )
        for case in cases
    )


@lru_cache(maxsize=1)
def code_digest() -> str:
    """Return the SHA-256 of the code, and the packages, that decide a result; one of other code is never taken up."""
    return digest([code(SOURCES), machine(PACKAGES)])


def key(planned: PlannedCase, references: tuple[str, ...]) -> str:
    """Return the digest under which a finished case may be taken up again by `--resume`."""
    return question(planned, references, code_digest())


def question(planned: PlannedCase, references: tuple[str, ...], of_code: str) -> str:
    """Return the digest of a case, whom it is put to, before whom, and the digest of all code."""
    return digest([plain(planned.case), planned.configurations, references, of_code])
