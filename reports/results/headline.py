"""Sentences about a run: the headline, shouts before it, what was left out, causes, blame."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import cast

from rayproof.cases.stages import IMAGE_STAGES, Stage
from rayproof.reports.results.case_records import CaseRecord, worst_ratio
from rayproof.reports.results.case_table import Cases, briefs, named
from rayproof.reports.results.files import legible, several
from rayproof.reports.results.outcomes import TITLES, Outcome
from rayproof.reports.results.records import GateRecord, RunRecord, WorseRecord
from rayproof.reports.results.wrong_pixels import display_name

AS_WELL = ". The same pixels"  # how a cause's sentence goes on with what fits as well
EXPLAINS = ": this explains"  # how it goes on with the number of cases
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
    """Return in one sentence how the run stands: before its gate, where one is set, and by its cases.

    That few cases were answered comes first. What is new is next, with its causes, then what is accepted, then what is
    mended.
    """
    few = "".join(f"{sentence[:1].upper()}{sentence[1:]}. " for sentence in few_answers(results))
    if "gate" not in results:
        return f"{few}{_of_cases(results)}."
    gate = results["gate"]
    parts, wrong = gate_counts(gate), _by_cause(results)
    # The causes are those of what is new, which comes first.
    said = ", ".join([f"{parts[0]} ({wrong})", *parts[1:]] if wrong and parts else parts) or "nothing fails"
    file = f"The gate {legible(gate['file'])}" if gate.get("file") else "The gate"
    return f"{few}{file} is {'red' if gate['red'] else 'green'}: {said}; {_totals(results)}."


def gate_counts(gate: GateRecord) -> list[str]:
    """Return the counts of what a gate found, each with its words: first what is new, then accepted, then mended."""
    uncovered = [*gate.get("uncovered", ())]
    counts = {
        "new": len(_new_in(gate)),
        "no longer accepted, since the entry expired": len(gate["expired"]),
        "accepted": len(accepted_cases(gate)),
        "mended": len(mended_in(gate)),
        "accepted and not made any more": len(gate["stale"]),
    }
    parts = [f"{count} {words}" for words, count in counts.items() if count]
    return [*parts, *uncovered[:1], *([f"and {len(uncovered) - 1} more"] if len(uncovered) > 1 else [])]


def _new_in(gate: GateRecord) -> set[str]:
    """Return the names of the cases, or the whole run, that a gate finds worse than it accepts."""
    lines = [*gate["regressions"], *gate.get("worse", ())]
    return {line.partition(": ")[0].partition(" (")[0] for line in lines}  # an entry's name has its item in brackets


def accepted_cases(gate: GateRecord) -> set[str]:
    """Return the names of the failing cases in which nothing is new."""
    return {*gate["cases"]} - _new_in(gate)


def mended_in(gate: GateRecord | None) -> list[str]:
    """Return in sentences what failed before, or is accepted, and fails less or not at all."""
    return [] if gate is None else [*gate["tighten"], *gate.get("mended", ())]


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


def remarks(results: RunRecord) -> list[str]:
    """Return in sentences what a reader of the headline must know beside it, each about something of its own."""
    sentences = [*map(legible, of_the_whole(results)), *no_say(results), *left_out_in_words(results)]
    return [f"{sentence[:1].upper()}{sentence[1:]}." for sentence in sentences]


def _of_cases(results: RunRecord) -> str:
    """Return the verdicts of the cases with who was under test if not the tracer, and what is wrong."""
    summary = results["summary"]
    if not any(summary[outcome.value] for outcome in Outcome):
        return "Nothing was measured"
    wrong = _by_cause(results)
    whole = [f"but {legible(sentence)}" for sentence in of_the_whole(results)]
    whole += [f"{sentence[:1].lower()}{sentence[1:]}" for sentence in _lost(results).values()]
    return "; ".join([_totals(results), *([wrong] if wrong else []), *whole])


def _totals(results: RunRecord) -> str:
    """Return the numbers of cases by verdict, the worst first, and how many checks were answered if not all."""
    summary = results["summary"]
    subject, total = subject_of(results), several(summary["planned"], "case")
    total = total if subject == THE_USUAL else f"{subject}: {total}"
    worst_first = [outcome for outcome in reversed(Outcome) if summary[outcome.value]]
    if not worst_first:
        return "nothing was measured"
    answered = answered_in_words(results)
    if worst_first != [Outcome.PASS]:
        parts = [f"{summary[outcome.value]} {outcome.value.replace('_', ' ')}" for outcome in worst_first]
        return f"{total}: {', '.join([*parts, *answered])}"
    if answered:
        pass_on = f"pass{'es' if summary['planned'] == 1 else ''} on the"
        return f"{total} {pass_on} {answered[0].replace('answered', 'that it answers')}"
    every = "each passes" if of_the_whole(results) else "all pass"
    return f"{total}: {every}, in {_checks(cast('dict[str, int]', results['checks']))}"


MOST_GROUPS = 3  # that a headline names


def _by_cause(results: RunRecord) -> str:
    """Return what is wrong in the cases that are new failures, the cause of the most cases first."""
    groups = [group for group in failure_groups(results) if not group.accepted and group.what]
    parts = [f"{group.short} in {several(group.count, 'case')}" for group in groups[:MOST_GROUPS]]
    left = len(groups) - MOST_GROUPS
    return ", ".join([*parts, *([f"and {several(left, 'more cause')}"] if left > 0 else [])])


@dataclass(kw_only=True)
class FailureGroup:
    """The cases that fail for one cause, or for what is blamed in them where no cause is known."""

    what: str  # the sentence of the cause, or the stage and the items with their names; empty where nothing is blamed
    short: str  # the same for a headline
    verdict: str
    accepted: bool  # by the gate's file, or because they failed in the run before
    worst: CaseRecord  # as lists have it
    names: list[str]  # of the first cases, the worst first
    count: int = 0


NAMED = 8  # cases of a group


def failure_groups(results: RunRecord) -> list[FailureGroup]:
    """Return the groups of the cases that fail: the new ones first, of each kind the largest first.

    Groups of a size are in the order of the light path, since what goes wrong first is most likely what is wrong.
    """
    accepted = accepted_cases(results["gate"]) if "gate" in results else set[str]()
    groups: dict[tuple[bool, str], FailureGroup] = {}
    for case in briefs(worst_first(results["cases"])):
        if Outcome(case["verdict"]) not in BAD:
            continue
        cause, let_through = cause_of(results, case), case["name"] in accepted
        what = cause or blame_in_words(case)
        key = let_through, what or f" {case['verdict']}"
        if key not in groups:
            short = _short(cause) if cause else what
            groups[key] = FailureGroup(
                what=what, short=short, verdict=case["verdict"], accepted=let_through, worst=case, names=[]
            )
        group = groups[key]
        group.count += 1
        group.names += [case["name"]][: NAMED - len(group.names)]
    order = list(Stage)

    def rank(group: FailureGroup) -> tuple[bool, int, int]:
        stage = group.worst.get("stage")
        return group.accepted, -group.count, order.index(Stage(stage)) if stage in order else len(order)

    return sorted(groups.values(), key=rank)


def _short(cause: str) -> str:
    """Return the part of a cause's sentences that says what is wrong, as a part of a longer sentence."""
    sentence = cause.split(EXPLAINS)[0].split(AS_WELL)[0].rstrip(".")
    return f"{sentence[:1].lower()}{sentence[1:]}" if sentence.startswith("The ") else sentence


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
        silenced.append(f"a time limit stopped {display_name(name)} in {names[0]}{more}")
    lost = _lost(results)
    silenced += lost.values()
    for name, cases in _abstained(results).items():
        if name in lost:
            continue
        case, why = next(iter(cases.items()))
        more = f" and {len(cases) - 1} more" if len(cases) > 1 else ""
        silenced.append(f"{display_name(name)} had no say in {case}{more}, where it was asked: {why}")
    return silenced


def _lost(results: RunRecord) -> dict[str, str]:
    """Return, for each reference that ended with an error in every case of the run, a sentence with its first error."""
    abstained, summary = _abstained(results), results.get("summary")
    if not abstained or not isinstance(summary, Mapping):
        return {}
    done = sum(summary[outcome.value] for outcome in Outcome if outcome is not Outcome.MISSING)
    errors = {name: next(iter(cases.values())) for name, cases in abstained.items() if len(cases) == done}
    return {
        name: f"The panel lost {display_name(name)}: {legible(error).rstrip('.')}" for name, error in errors.items()
    }


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
    "rounding": "explained by rounding",
    "epsilon": "explained only by a declared epsilon",
    "wrong": "wrong",
    "unexamined": "not examined",
}


def examined_line(results: RunRecord) -> str | None:
    """Return what became of all pixels of all checks in one sentence; None where a run's record does not say."""
    ledger = results.get("examined")
    if (
        not isinstance(ledger, Mapping)
        or not all(isinstance(ledger.get(kind), int) for kind in ("pixels", "strict", "wrong", "unexamined"))
        or not ledger["pixels"]
    ):
        return None
    counts = {kind: ledger.get(kind, 0) for kind in KINDS}
    parts = [f"{counts[kind]:,} {words}" for kind, words in KINDS.items() if counts[kind] or kind == "unexamined"]
    return f"{ledger['pixels']:,} pixels over all checks: {', '.join(parts)}."


BAD = frozenset({Outcome.FAIL, Outcome.REFERENCE_SUSPECT, Outcome.ERROR, Outcome.MISSING})


FEW = 4  # items that are told by name


def blame(case: CaseRecord) -> str:
    """Return the blamed stage of a case and the specification ids that may be to blame, or an empty string."""
    return " ".join(filter(None, (legible(case.get("stage") or ""), blamed_items(case))))


def blame_in_words(case: CaseRecord) -> str:
    """Return the blamed stage of a case, and the items that may be to blame with their names; or an empty string."""
    told = case.get("blamed_items")
    items = [str(item) for item in told if item] if isinstance(told, list | tuple) else []
    items = items or [str(item) for item in (case.get("item"),) if item]
    words = [f"{legible(item)} ({TITLES[item]})" if item in TITLES else legible(item) for item in items]
    named = " or ".join(words) if len(words) <= FEW else f"one of {len(words)} items"
    return " ".join(filter(None, (legible(case.get("stage") or ""), named)))


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
