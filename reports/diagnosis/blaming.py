"""Narrows the items of the specification that a failing case may break, by passing checks and known mistakes.

An item is excluded only if every known mistake of the item that would change the case would also have failed a passing
check. A passing case excludes only mistakes that concern its kinds of shapes.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from rayproof.cases.stages import Stage
from rayproof.reports.diagnosis.evidence import RIGHT, Evidence, off
from rayproof.reports.judge import verdict
from rayproof.reports.mistakes import MISTAKES, Mistake
from rayproof.reports.results.case_records import CaseRecord
from rayproof.reports.results.outcomes import Outcome

PASSING = 12  # passing cases with the same kinds of shapes that are compared, those with the least work
LEAST_SHOWN = 0.02  # share of a sample of pixels that a mistake must change to be visible


@dataclass(frozen=True, kw_only=True)
class Blamed:
    """The items that a case may break, and the excluded items with the check that excludes each."""

    items: tuple[str, ...]
    excluded: Mapping[str, str] = field(default_factory=dict)


def passing(case: CaseRecord, configuration: str) -> frozenset[Stage]:
    """Return the stages where every check of a configuration passes."""
    return verdict.passing(_verdicts(case, configuration))


def _verdicts(case: CaseRecord, configuration: str) -> list[tuple[str, str]]:
    return [(check.stage, check.outcome) for check in case.get("checks", []) if check.configuration == configuration]


def guilty(case: CaseRecord) -> str | None:
    """Return the configuration whose check fails at the case's blamed stage, or None."""
    return next(
        (
            check.configuration
            for check in case.get("checks", [])
            if check.outcome is Outcome.FAIL and check.stage == case.get("stage")
        ),
        None,
    )


def by_stages(case: CaseRecord, *, ran: bool) -> Blamed | None:
    """Return the items that remain from the checks of one case's stages; None if the case does not fail at a stage.

    `ran` is True if the items of the configuration's own formulas are recorded, as they are for the tracer.
    """
    configuration = guilty(case)
    if case.get("verdict") != Outcome.FAIL.value or configuration is None:
        return None
    own = case.get("ran", {}).get(configuration, ()) if ran else ()
    verdicts = _verdicts(case, configuration)
    return Blamed(items=verdict.items_to_blame(Stage(case["stage"]), verdicts, case.get("shapes", ()), own))


def narrowed(
    cases: Sequence[tuple[CaseRecord, Evidence, Blamed]],
    others: Iterable[tuple[CaseRecord, Evidence]],
    configuration: str,
) -> dict[str, Blamed]:
    """Return the remaining items of each failing case, by name, after the known mistakes were compared.

    An item is excluded if each of its known mistakes that is visible at the case's wrong stage would have failed a
    passing check, in this case or in a case with the same kinds of shapes. An item without known mistakes is never
    excluded.
    """
    passed = sorted(((evidence, passing(record, configuration)) for record, evidence in others), key=_by_name)
    shown: dict[tuple[str, str], frozenset[Stage]] = {}

    def shows(evidence: Evidence, name: str) -> frozenset[Stage]:
        key = evidence.case, name
        if key not in shown:
            shown[key] = stages_that_show(evidence, MISTAKES[name])
        return shown[key]

    remaining = {}
    for record, evidence, blamed in cases:
        kinds, stage = set(evidence.kinds), Stage(record["stage"])
        alike = [entry for entry in passed if kinds <= set(entry[0].kinds)][:PASSING]
        here = evidence, passing(record, configuration)
        left, excluded = [], {}
        for item in blamed.items:
            mistakes = [name for name in MISTAKES if item in MISTAKES[name].items]
            showing = [name for name in mistakes if stage in shows(evidence, name)]
            against = [
                next(
                    (
                        f"{compared.case}: {min(hit, key=list(Stage).index)}"
                        for compared, good in (here, *alike)
                        if (hit := shows(compared, name) & good)
                    ),
                    None,
                )
                for name in showing
            ]
            if not mistakes or None in against:
                left.append(item)
            elif against and len({*against}) == 1:
                excluded[item] = against[0]
        # If no item remains, no known mistake describes this failure, so that none can exclude an item either.
        remaining[evidence.case] = Blamed(items=tuple(left), excluded=excluded) if left else blamed
    return remaining


def _by_name(entry: tuple[Evidence, frozenset[Stage]]) -> tuple[int, str]:
    return entry[0].work, entry[0].case


def stages_that_show(evidence: Evidence, mistake: type[Mistake]) -> frozenset[Stage]:
    """Return the stages where a mistake changes more than 2 % of a case's sample of pixels, beyond rounding."""
    right, wrong = evidence.sampled(RIGHT), evidence.sampled(mistake())
    return frozenset(
        stage
        for stage in evidence.stages
        if np.count_nonzero(off(stage, wrong[stage], right[stage])) > LEAST_SHOWN * len(right[stage])
    )


def put(record: CaseRecord, blamed: Blamed) -> None:
    """Write the items that a case may break into its record; `item` is set only if a single item remains."""
    record["blamed_items"] = list(blamed.items)
    record["excluded"] = dict(blamed.excluded)
    record["item"] = blamed.items[0] if len(blamed.items) == 1 else None
