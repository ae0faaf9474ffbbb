"""What a search came to, as results.json has it and in sentences: one entry a cause, with all that fits as well."""

from collections.abc import Sequence

from rayproof.reports.diagnosis import MISTAKES
from rayproof.reports.diagnosis.search import Found, Searched
from rayproof.reports.diagnosis.trial import Evidence, differ, trial
from rayproof.reports.results.item_titles import TITLES
from rayproof.reports.results.records import AlternativeRecord, CaseRecord, CauseRecord, RepeatedRecord

FEW = 4  # items that are told by name
CHANGING = "changes_from_call_to_call"  # no hypothesis: its pixels cannot be foretold


def entries(
    searched: Searched, failing: Sequence[Evidence], others: Sequence[Evidence], *, of: int
) -> list[CauseRecord]:
    """Return one entry for each cause; where nothing fits, one that says so.

    `failing` are the cases to be explained, `of` how many failed, `others` cases beyond the run that may tell apart
    what the run does not.
    """
    if not searched.found:
        return [_nothing(searched, of)] if searched.tried else []
    found = sorted(searched.found, key=_preference)
    # Ways of one mistake are one mistake.
    by_name: dict[tuple[str, ...], Found] = {}
    for one in found:
        by_name.setdefault((*sorted(one.hypothesis.mistakes), one.hypothesis.way.says or ""), one)
    members = list(by_name.values())
    first = members[0]
    # A factor that is estimated to be pi says nothing beside "leaves out 1/pi".
    plain = not first.hypothesis.parameters
    rest = [one for one in members[1:] if not (plain and one.hypothesis.parameters)]
    explained = [case.case for case in failing if _explains(first, case)]
    predicted = [name for name in explained if name not in searched.fitted]
    telling = {
        member.hypothesis.sentence: next(
            (case.case for case in others if differ(case, first.hypothesis.way, member.hypothesis.way)), None
        )
        for member in rest
    }
    told_apart = next((name for name in telling.values() if name is not None), None)
    found_entries: list[CauseRecord] = []
    for name in first.hypothesis.mistakes:
        mistake = MISTAKES[name]
        parameter = first.hypothesis.parameters.get(name)
        beside = [other for other in first.hypothesis.mistakes if other != name]
        alternatives: list[AlternativeRecord] = [
            {
                "mistake": "+".join(member.hypothesis.mistakes),
                "sentence": member.hypothesis.sentence,
                "items": list(member.hypothesis.items),
                "parameters": {**member.hypothesis.parameters},
            }
            for member in rest
            if name not in member.hypothesis.mistakes or member.hypothesis.way.says is not None
        ]
        phrase = first.hypothesis.phrase(name)
        found_entries.append(
            {
                "mistake": name,
                "items": list(mistake.items),
                "sentence": _sentence(phrase, mistake.items, len(explained), of, beside, alternatives, told_apart),
                "explains": {"cases": len(explained), "of": of},
                "cases": explained,
                "with": beside,
                "alternatives": alternatives,
                "told_apart_by": told_apart,
                "predicted": {"cases": len(predicted), "of": of - len(searched.fitted)},
                "parameters": {} if parameter is None else {name: parameter},
                "tried": searched.tried,
            }
        )
    return found_entries


def _preference(found: Found) -> tuple[int, bool, int]:
    """Return what puts a plain mistake before an estimated one, and one mistake before two."""
    estimated = bool(found.hypothesis.parameters)
    traced = bool(found.hypothesis.way.formulas)
    return len(found.hypothesis.mistakes), estimated, traced


def _explains(found: Found, case: Evidence) -> bool:
    seen = MISTAKES[found.hypothesis.mistakes[0]].seen
    if seen is not None:
        return seen(case) is True
    tally = found.tallies.get(case.case)
    if tally is None:
        tally = trial(case, found.hypothesis.way)
    return tally is not None and tally.explains


def _sentence(
    phrase: str,
    items: Sequence[str],
    cases: int,
    of: int,
    beside: Sequence[str],
    alternatives: Sequence[AlternativeRecord],
    told_apart: str | None,
) -> str:
    named = ", ".join(f"{item} {TITLES[item]}" for item in items)
    said = f"The renderer {phrase} [{named}]: this explains {cases} of {of} failing case{'' if of == 1 else 's'}"
    if beside:
        said += f", together with: it {' and '.join(MISTAKES[name].says for name in beside)}"
    if alternatives:
        said += f". The same pixels come of one that {', or '.join(one['sentence'] for one in alternatives)}"
        said += f"; {told_apart} would tell" if told_apart is not None else "; no case that was asked tells them apart"
    return f"{said}."


def of_images_that_change(repeated: RepeatedRecord, case: str, failing: Sequence[str], *, of: int) -> CauseRecord:
    """Return the cause of failures of a renderer whose images differ from call to call by more than right ones may."""
    item = "IMG-1"
    said = (
        f"The renderer writes another image each time it is asked [{item} {TITLES[item]}]: in {case} two differ in "
        f"{repeated['differing']} pixels of {repeated['stage']}, beyond the limits. No formula is looked for in "
        f"{len(failing)} of {of} failing case{'' if of == 1 else 's'}, since images that change prove nothing."
    )
    return {
        "mistake": CHANGING,
        "items": [item],
        "sentence": said,
        "explains": {"cases": len(failing), "of": of},
        "cases": list(failing),
        "with": [],
        "alternatives": [],
        "told_apart_by": None,
        "predicted": None,
        "parameters": {},
        "tried": 0,
    }


def what_is_left(cases: Sequence[CaseRecord]) -> str:
    """Return in a sentence which items the cases that nothing explains leave, and which are excluded in all of them."""
    told = [case for case in cases if case.get("blamed_items")]
    if not told:
        return ""
    left = [item for item in TITLES if any(item in case["blamed_items"] for case in told)]
    out = {
        item: next(check for case in told if (check := case["excluded"].get(item)) is not None)
        for item in TITLES
        if item not in left and any(item in case["excluded"] for case in told)
    }
    named = " or ".join(f"{item} {TITLES[item]}" for item in left)
    said = f"To blame is {named}." if len(left) <= FEW else f"{len(left)} items may be to blame."
    if out:
        said += f" Excluded: {', '.join(f'{item} (by {check})' for item, check in out.items())}."
    return said


def _nothing(searched: Searched, of: int) -> CauseRecord:
    stopped = "" if searched.finished else " (the search was stopped at its time limit)"
    return {
        "mistake": None,
        "items": [],
        "sentence": f"None of {searched.tried} known mistakes explains the {of} failing"
        f" case{'' if of == 1 else 's'}{stopped}.",
        "explains": {"cases": 0, "of": of},
        "cases": [],
        "with": [],
        "alternatives": [],
        "told_apart_by": None,
        "predicted": None,
        "parameters": {},
        "tried": searched.tried,
    }
