"""Sentences about a run: the headline, shouts before it, what was left out, causes, blame."""

from collections.abc import Mapping, Sequence
from typing import cast

from rayproof.cases.stages import IMAGE_STAGES, Stage
from rayproof.reports.results.case_records import CaseRecord, worst_ratio
from rayproof.reports.results.case_table import Cases, briefs, named
from rayproof.reports.results.files import legible, several
from rayproof.reports.results.outcomes import Outcome
from rayproof.reports.results.records import RunRecord, WorseRecord

AS_WELL = ". The same pixels"  # how a cause's sentence goes on with what fits as well
THE_USUAL = "tracer"  # the subject that goes without saying


def shouts(results: RunRecord) -> list[str]:
    """Return what no reader may overlook: planted faults, a run cut short, a ledger that does not add up."""
    warnings = []
    if results.get("faults"):
        names = ", ".join(map(legible, results["faults"]))
        warnings.append(
            f"PLANTED FAULTS IN USE: {names}. This run audits the harness; it says nothing about the tracer."
        )
    if not results.get("finished", False):
        warnings.append("UNFINISHED RUN: what is shown is what was done when it stopped; `--resume` continues it.")
    for key, what in (("summary", "cases"), ("checks", "checks")):
        ledger = results[key]
        total = sum(ledger[outcome.value] for outcome in Outcome)
        if total != ledger["planned"]:
            warnings.append(f"LEDGER BROKEN: {ledger['planned']} {what} planned, {total} have a verdict.")
    return warnings


def standing(results: RunRecord) -> str:
    """Return in two words at most how the run stands: before its gate, where one is set, or else its verdict."""
    if "gate" in results:
        return f"gate {'red' if results['gate']['red'] else 'green'}"
    return str(results.get("verdict", Outcome.MISSING.value))


def last_line(results: RunRecord) -> str:
    """Return how a run stands, what its cases come to where a gate is set, and how much was answered if not all.

    Where few cases were answered that comes first.
    """
    cases = [f"cases: {results['verdict']}"] if "gate" in results and "verdict" in results else []
    return "; ".join([*few_answers(results), standing(results), *cases, *answered_in_words(results)])


def headline(results: RunRecord) -> str:
    """Return what the run comes to: of its gate, where one is set, and then of its cases.

    That few cases were answered comes first.
    """
    few = "".join(f"{sentence[:1].upper()}{sentence[1:]}. " for sentence in few_answers(results))
    if "gate" not in results:
        return f"{few}{_of_cases(results)}"
    through = "" if results["gate"]["red"] or not results["gate"]["cases"] else "Let through: "
    return f"{few}{legible(results['gate']['sentence'])} {through}{_of_cases(results)}"


def subject_of(results: RunRecord) -> str:
    """Return the name of the renderer under test: the one that a program declares, or else what the user wrote."""
    return legible(results.get("declared", {}).get("name") or results.get("subject", THE_USUAL))


def with_its_name(results: RunRecord, text: object) -> str:
    """Return a text that begins with what a program is called in records with the program's own name instead."""
    names = results.get("configurations") or []
    if len(names) != 1 or "name" not in results.get("declared", {}):
        return str(text)
    left, mark, rest = str(text).partition(f"{names[0]} against ")
    return f"{subject_of(results)} against {rest}" if mark and not left else str(text)


FEWEST = 3  # stages that are named as those that are answered; of more those are that are not


def share_answered(results: RunRecord) -> float:
    """Return which share of the planned checks was answered; 1 where a record does not say."""
    answered = results.get("answered") or {}
    return answered.get("checks", 0) / answered["planned"] if answered.get("planned") else 1.0


def answered_in_words(results: RunRecord) -> list[str]:
    """Return how many of the planned checks were answered, with the stages, where not all were; else nothing."""
    answered = results.get("answered") or {}
    if not share_answered(results) < 1:
        return []
    stages = list(map(legible, answered.get("stages", [])))
    lacking = [stage.value for stage in IMAGE_STAGES if stage.value not in stages]
    which = f"{', '.join(stages)} only" if len(stages) <= FEWEST else f"without {', '.join(lacking)}"
    words = f" ({which})" if lacking and stages else ""
    planned = answered.get("planned", 0)
    images = " of images" * (planned < results["checks"]["planned"])  # without those of the camera, which has none
    return [f"{answered.get('checks')} of {planned} checks{images} answered{words}"]


def left_out_in_words(results: RunRecord) -> list[str]:
    """Return in sentences which kinds of cases the subject answers in part, and what it leaves out of them."""
    return [f"{subject_of(results)} {legible(part)}" for part in (results.get("answered") or {}).get("left_out", ())]


def says_little(results: RunRecord) -> bool:
    """Return whether a pass would say less than it seems to: parts of cases are left out, or few cases answered."""
    return bool(left_out_in_words(results) or few_answers(results))


LEAST_COVERAGE = 50.0  # % of the cases


def few_answers(results: RunRecord) -> list[str]:
    """Return in a sentence that nothing failed but too few of the cases were answered; nothing where that is not so.

    A case is answered if some stage that the subject writes was judged in it.
    """
    answered, least = results.get("answered") or {}, results.get("least_coverage", LEAST_COVERAGE)
    cases, planned = answered.get("cases", 0), answered.get("planned_cases", 0)
    if not planned or 100 * cases >= float(least) * planned or results.get("verdict") in BAD:
        return []
    return [f"few answers: {cases} of {several(planned, 'case')} answered, and {least:g} % are asked for"]


def _of_cases(results: RunRecord) -> str:
    """Return the verdict of the cases in one sentence, with who was under test if not the tracer, and the blame."""
    summary = results["summary"]
    subject = subject_of(results)
    total = several(summary["planned"], "case")
    total = total if subject == THE_USUAL else f"{subject}: {total}"
    worst_first = [outcome for outcome in reversed(Outcome) if summary[outcome.value]]
    if not worst_first:
        return "Nothing was measured."
    shared = "".join(f" But {legible(sentence)}." for sentence in of_the_whole(results))
    shared += "".join(f" Warning: {legible(sentence)}." for sentence in results.get("growing", []))
    for name, cases in _stopped(results).items():
        shared += f" A time limit stopped {name} in {several(len(cases), 'case')}."
    for name, cases in _abstained(results).items():
        shared += f" {name} had no say in {several(len(cases), 'case')}."
    shared += "".join(f" {sentence}." for sentence in left_out_in_words(results))
    answered = answered_in_words(results)
    if worst_first == [Outcome.PASS]:
        if answered:
            pass_on = f"pass{'es' if summary['planned'] == 1 else ''} on the"
            return f"{total} {pass_on} {answered[0].replace('answered', 'that it answers')}.{shared}"
        every = "each passes" if of_the_whole(results) else "all pass"
        return f"{total}: {every}, in {_checks(cast('dict[str, int]', results['checks']))}.{shared}"
    shared += f" {answered[0]}." if answered else ""
    parts = [f"{summary[outcome.value]} {outcome.value.replace('_', ' ')}" for outcome in worst_first]
    # In the order of the light path: what goes wrong first is most likely what is wrong.
    order = list(Stage)
    guilty = sorted(
        (case for case in briefs(results["cases"]) if case["verdict"] in BAD and blame(case)),
        key=lambda case: order.index(Stage(case["stage"])) if case.get("stage") in order else len(order),
    )
    named = ", ".join(list(dict.fromkeys(blame(case) for case in guilty))[:4])
    if _named(results):
        short = " ".join(f"{sentence.split(AS_WELL)[0].rstrip('.')}." for sentence in causes(results))
        return f"{total}: {', '.join(parts)}. {short}{shared}"
    return f"{total}: {', '.join(parts)}." + (f" Blamed: {named}." if named else "") + shared


def of_the_whole(results: RunRecord) -> list[str]:
    """Return in sentences what fails a run beside its cases: factors that all share, images that change."""
    return [*results.get("wrong_factors", []), *results.get("changing", [])]


def causes(results: RunRecord) -> list[str]:
    """Return the sentences of the mistakes that explain a run's failures, or the one that none does."""
    told = results.get("diagnosis")
    entries = told if isinstance(told, list | tuple) else []
    return [legible(one["sentence"]) for one in entries if isinstance(one, Mapping) and one.get("sentence")]


def cause_of(results: RunRecord, case: CaseRecord) -> str:
    """Return the sentences of the mistakes that explain a case's failure, or an empty string."""
    told = results.get("diagnosis")
    entries = told if isinstance(told, list | tuple) else []
    return " ".join(
        legible(one["sentence"])
        for one in entries
        if isinstance(one, Mapping)
        and one.get("sentence")
        and isinstance(one.get("cases"), list | tuple)
        and case.get("name") in one["cases"]
    )


def _named(results: RunRecord) -> bool:
    """Say whether some mistake is named."""
    told = results.get("diagnosis")
    entries = told if isinstance(told, list | tuple) else []
    return any(isinstance(one, Mapping) and one.get("mistake") for one in entries)


def _checks(ledger: Mapping[str, int]) -> str:
    """Return how many checks passed, of how many where they are not all."""
    left = ", ".join(
        f"{ledger[outcome.value]} {outcome.value.replace('_', ' ')}"
        for outcome in Outcome
        if outcome is not Outcome.PASS and ledger[outcome.value]
    )
    if not left:
        return several(ledger["planned"], "check")
    return f"{ledger[Outcome.PASS.value]} of {ledger['planned']} checks ({left})"


def no_say(results: RunRecord) -> list[str]:
    """Return in sentences which references of the announced panel answered nothing in some cases, and what grows."""
    silenced = [*map(legible, results.get("growing", []))]
    for name, names in _stopped(results).items():
        more = f" and {len(names) - 1} more" if len(names) > 1 else ""
        silenced.append(f"a time limit stopped {name} in {names[0]}{more}")
    for name, cases in _abstained(results).items():
        case, why = next(iter(cases.items()))
        more = f" and {len(cases) - 1} more" if len(cases) > 1 else ""
        silenced.append(f"{name} had no say in {case}{more}, where it was asked: {why}")
    return silenced


def _abstained(results: RunRecord) -> dict[str, dict[str, str]]:
    """Return reference to case to why, of a record as far as it can be read, but for those that were stopped."""
    told, stopped = results.get("abstained"), _stopped(results)
    if not isinstance(told, Mapping):
        return {}
    found = {
        str(name): {case: why for case, why in cases.items() if case not in stopped.get(str(name), [])}
        for name, cases in told.items()
        if isinstance(cases, Mapping)
    }
    return {name: cases for name, cases in found.items() if cases}


def _stopped(results: RunRecord) -> dict[str, list[str]]:
    """Return who was stopped by a time limit to the cases, of a record as far as it can be read."""
    told = results.get("stopped")
    if not isinstance(told, Mapping):
        return {}
    return {str(name): list(map(str, cases)) for name, cases in told.items() if isinstance(cases, list | tuple)}


# What became of a pixel, as results.json names it, and what a reader is told of so many.
KINDS = {
    "strict": "strictly",
    "wide": "by a limit over 1 % of the value",
    "side": "at an edge by the value of a side",
    "interval": "at an edge by what its sides span",
    "epsilon": "excused by a declared epsilon",
    "wrong": "wrong",
    "unexamined": "not examined",
}


def examined_line(results: RunRecord) -> str | None:
    """Return what became of all pixels of all checks in one sentence; None where a run's record does not say."""
    ledger = results.get("examined")
    if (
        not isinstance(ledger, Mapping)
        or not all(isinstance(ledger.get(kind), int) for kind in ("pixels", *KINDS))
        or not ledger["pixels"]
    ):
        return None
    parts = [f"{ledger[kind]:,} {words}" for kind, words in KINDS.items() if ledger[kind] or kind == "unexamined"]
    return f"{ledger['pixels']:,} pixels over all checks: {', '.join(parts)}."


BAD = frozenset({Outcome.FAIL, Outcome.REFERENCE_SUSPECT, Outcome.ERROR, Outcome.MISSING})


FEW = 4  # items that are told by name


def blame(case: CaseRecord) -> str:
    """Return the blamed stage of a case and the specification ids that may be to blame, or an empty string."""
    return " ".join(filter(None, (legible(case.get("stage") or ""), blamed_items(case))))


def blamed_items(case: CaseRecord) -> str:
    """Return the specification ids that may be to blame for a case, in words, or an empty string."""
    told = case.get("blamed_items")
    items = [legible(item) for item in told if item] if isinstance(told, list | tuple) else []
    if len(items) <= 1:
        return items[0] if items else legible(case.get("item") or "")
    return f"{', '.join(items[:-1])} or {items[-1]}" if len(items) <= FEW else f"one of {len(items)} items"


def excluded(case: CaseRecord) -> str:
    """Return which items a case's evidence excludes, and by which checks, in words, or an empty string."""
    told = case.get("excluded")
    pairs = told.items() if isinstance(told, Mapping) else ()
    return ", ".join(f"{legible(item)} (by {legible(check)})" for item, check in pairs)


def worst_first(cases: Sequence[CaseRecord]) -> Sequence[CaseRecord]:
    """Return the cases by verdict, then by error over limit, then by name; the worst first."""
    if isinstance(cases, Cases):
        return cases.worst_first()
    order = [outcome.value for outcome in Outcome]

    def key(case: CaseRecord) -> tuple[int, float, str]:
        ratio = worst_ratio(case)
        return (-order.index(case["verdict"]), -(ratio if ratio is not None else 0.0), case["name"])

    return sorted(cases, key=key)


def worse_by_cause(results: RunRecord) -> list[str]:
    """Return what is worse than the run's history, one sentence for each cause, or else for what is blamed.

    Each begins with the worst of its cases, and says how many others there are.
    """
    groups: dict[str, list[WorseRecord]] = {}
    for entry in results["history"]["worse"] if "history" in results else ():
        case = named(results["cases"], entry["case"])
        blamed = (cause_of(results, case) or blame(case)) if case is not None and entry["what"] == "verdict" else ""
        groups.setdefault(blamed or str(entry["what"]), []).append(entry)
    sentences = []
    for cause, (worst, *others) in groups.items():
        why = f" [{cause}]" if worst["what"] == "verdict" and cause != "verdict" else ""
        names = len({entry["case"] for entry in others} - {worst["case"]})
        more = f"; and {names} more case{'s' if names > 1 else ''}" if names else ""
        sentences.append(f"{worst['sentence']}{why}{more}")
    return sentences
