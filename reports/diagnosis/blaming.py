"""Which specification items a case may blame, narrowed by passing checks and by what each mistake shows.

An item is out only by checks that pass and that every known mistake of the item which shows in the case would have
failed. A passing case speaks only of the kinds of shapes that it has.
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

PASSING = 12  # passing cases with the same kinds of shapes that are asked, those of the least work
LEAST_SHOWN = 0.02  # of a sample of pixels


@dataclass(frozen=True, kw_only=True)
class Blamed:
    """The items that may be to blame in a case, and the check that excludes each other one."""

    items: tuple[str, ...]
    excluded: Mapping[str, str] = field(default_factory=dict)


def passing(case: CaseRecord, configuration: str) -> frozenset[Stage]:
    """Return the stages at which every check of a configuration passes."""
    return verdict.passing(_verdicts(case, configuration))


def _verdicts(case: CaseRecord, configuration: str) -> list[tuple[str, str]]:
    return [(check.stage, check.outcome) for check in case.get("checks", []) if check.configuration == configuration]


def guilty(case: CaseRecord) -> str | None:
    """Return the configuration that fails at the stage blamed, or None."""
    return next(
        (
            check.configuration
            for check in case.get("checks", [])
            if check.outcome is Outcome.FAIL and check.stage == case.get("stage")
        ),
        None,
    )


def by_stages(case: CaseRecord, *, ran: bool) -> Blamed | None:
    """Return what the stages of one case leave; None where it does not fail at a stage.

    `ran` says that the configuration's own list of items is known, as the tracer's is.
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
    """Return what is left of each failing case's items when the known mistakes were asked.

    An item is out if each of its known mistakes that shows in the case at a wrong stage would have failed a check that
    passes, there or in a case with the same kinds of shapes; one of which no mistake is known never is.
    """
    passed = sorted(((evidence, passing(record, configuration)) for record, evidence in others), key=_by_name)
    shown: dict[tuple[str, str], frozenset[Stage]] = {}

    def shows(evidence: Evidence, name: str) -> frozenset[Stage]:
        key = evidence.case, name
        if key not in shown:
            shown[key] = stages_that_show(evidence, MISTAKES[name])
        return shown[key]

    found = {}
    for record, evidence, blamed in cases:
        kinds, stage = set(evidence.kinds), Stage(record["stage"])
        alike = [one for one in passed if kinds <= set(one[0].kinds)][:PASSING]
        here = evidence, passing(record, configuration)
        left, excluded = [], {}
        for item in blamed.items:
            known = [name for name in MISTAKES if item in MISTAKES[name].items]
            showing = [name for name in known if stage in shows(evidence, name)]
            against = [
                next(
                    (
                        f"{one.case}: {min(hit, key=list(Stage).index)}"
                        for one, good in (here, *alike)
                        if (hit := shows(one, name) & good)
                    ),
                    None,
                )
                for name in showing
            ]
            if not known or None in against:
                left.append(item)
            elif against and len({*against}) == 1:
                excluded[item] = against[0]
        # Where nothing is left no known mistake speaks of this failure: then nothing is excluded by one either.
        found[evidence.case] = Blamed(items=tuple(left), excluded=excluded) if left else blamed
    return found


def _by_name(entry: tuple[Evidence, frozenset[Stage]]) -> tuple[int, str]:
    return entry[0].work, entry[0].case


def stages_that_show(evidence: Evidence, mistake: type[Mistake]) -> frozenset[Stage]:
    """Return the stages at which a mistake changes more of a case's pixels than rounding may."""
    right, wrong = evidence.sampled(RIGHT), evidence.sampled(mistake())
    return frozenset(
        stage
        for stage in evidence.stages
        if np.count_nonzero(off(stage, wrong[stage], right[stage])) > LEAST_SHOWN * len(right[stage])
    )


def put(record: CaseRecord, blamed: Blamed) -> None:
    """Write what may be to blame into a case's record: its `item` is one only if nothing else is left."""
    record["blamed_items"] = list(blamed.items)
    record["excluded"] = dict(blamed.excluded)
    record["item"] = blamed.items[0] if len(blamed.items) == 1 else None
