"""Sentences about a run: the headline, warnings before it, left-out stages, causes, blame."""

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

AS_WELL = ". The same pixels"  # continues a cause's sentence with other mistakes that fit
EXPLAINS = ": this explains"  # continues it with the number of cases
THE_USUAL = "tracer"  # the subject that is not named


def shouts(results: RunRecord) -> list[str]:
    """Return the warnings before the headline: planted faults, an unfinished run, counts that do not add up."""
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
    """Return the result of the run's gate, if it has one, or else its verdict, in two words at most."""
    if "gate" in results:
        return f"gate {'red' if results['gate']['red'] else 'green'}"
    return str(results.get("verdict", Outcome.MISSING.value))


def last_line(results: RunRecord) -> str:
    """Return the result of a run, with the verdict of its cases if it has a gate, and its coverage if not complete.

    A coverage that is too low comes first.
    """
    cases = [f"cases: {results['verdict']}"] if "gate" in results and "verdict" in results else []
    return "; ".join([*few_answers(results), standing(results), *cases, *answered_in_words(results)])


def headline(results: RunRecord) -> str:
    """Return a sentence with the result of the run: of its gate, if it has one, and of its cases.

    A coverage that is too low comes first, then new failures with their causes, then accepted failures, then mended
    ones.
    """
    few = "".join(f"{sentence[:1].upper()}{sentence[1:]}. " for sentence in few_answers(results))
    if "gate" not in results:
        return f"{few}{_of_cases(results)}."
    gate = results["gate"]
    parts, wrong = gate_counts(gate), _by_cause(results)
    # The causes belong to the new failures, which come first.
    findings = ", ".join([f"{parts[0]} ({wrong})", *parts[1:]] if wrong and parts else parts) or "nothing fails"
    file = f"The gate {legible(gate['file'])}" if gate.get("file") else "The gate"
    return f"{few}{file} is {'red' if gate['red'] else 'green'}: {findings}; {_totals(results)}."


def gate_counts(gate: GateRecord) -> list[str]:
    """Return the counts of a gate's findings, each in words: new failures, then accepted, then mended ones."""
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
    """Return the names of the failing cases without a new failure."""
    return {*gate["cases"]} - _new_in(gate)


def mended_in(gate: GateRecord | None) -> list[str]:
    """Return sentences about failures of an earlier run, or accepted ones, that are now smaller or gone."""
    return [] if gate is None else [*gate["tighten"], *gate.get("mended", ())]


def subject_of(results: RunRecord) -> str:
    """Return the subject's name: the name that a program declares, or else the user's name for it."""
    return legible(results.get("declared", {}).get("name") or results.get("subject", THE_USUAL))


def with_its_name(results: RunRecord, text: object) -> str:
    """Replace a program's name in records, at the beginning of a text, by the program's own name."""
    names = results.get("configurations") or []
    if len(names) != 1 or "name" not in results.get("declared", {}):
        return str(text)
    left, mark, rest = str(text).partition(f"{names[0]} against ")
    return f"{subject_of(results)} against {rest}" if mark and not left else str(text)


FEWEST = 3  # most answered stages that are named; if there are more, the other stages are named


def share_answered(results: RunRecord) -> float:
    """Return the share of the planned checks that were answered; 1 if the record lacks it."""
    answered = results.get("answered") or {}
    return answered.get("checks", 0) / answered["planned"] if answered.get("planned") else 1.0


def answered_in_words(results: RunRecord) -> list[str]:
    """Return a phrase with the number of answered checks and the stages, or nothing if all checks were answered."""
    answered = results.get("answered") or {}
    if not share_answered(results) < 1:
        return []
    stages = list(map(legible, answered.get("stages", [])))
    lacking = [stage.value for stage in IMAGE_STAGES if stage.value not in stages]
    which = f"{', '.join(stages)} only" if len(stages) <= FEWEST else f"without {', '.join(lacking)}"
    words = f" ({which})" if lacking and stages else ""
    planned = answered.get("planned", 0)
    images = " of images" * (planned < results["checks"]["planned"])  # without the camera's checks, which have none
    return [f"{answered.get('checks')} of {planned} checks{images} answered{words}"]


def left_out_in_words(results: RunRecord) -> list[str]:
    """Return sentences about the stages that the subject leaves out in some cases of a kind."""
    return [f"{subject_of(results)} {legible(part)}" for part in (results.get("answered") or {}).get("left_out", ())]


def says_little(results: RunRecord) -> bool:
    """Return whether a pass would prove little: stages of cases are left out, or few cases were answered."""
    return bool(left_out_in_words(results) or few_answers(results))


LEAST_COVERAGE = 50.0  # % of the cases


def few_answers(results: RunRecord) -> list[str]:
    """Return a sentence if nothing failed but too few of the cases were answered, or else nothing.

    A case is answered if some stage that the subject writes was judged in it.
    """
    answered, least = results.get("answered") or {}, results.get("least_coverage", LEAST_COVERAGE)
    cases, planned = answered.get("cases", 0), answered.get("planned_cases", 0)
    if not planned or 100 * cases >= float(least) * planned or results.get("verdict") in BAD:
        return []
    return [f"few answers: {cases} of {several(planned, 'case')} answered, and {least:g} % are asked for"]


def remarks(results: RunRecord) -> list[str]:
    """Return the sentences that must accompany the headline, each on a subject of its own."""
    sentences = [*map(legible, of_the_whole(results)), *no_say(results), *left_out_in_words(results)]
    return [f"{sentence[:1].upper()}{sentence[1:]}." for sentence in sentences]


def _of_cases(results: RunRecord) -> str:
    """Return the numbers of cases by verdict, with the subject if it is not the tracer, and the causes of failures."""
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
    """Return the causes of the new failures, the cause of the most cases first."""
    groups = [group for group in failure_groups(results) if not group.accepted and group.what]
    parts = [f"{group.short} in {several(group.count, 'case')}" for group in groups[:MOST_GROUPS]]
    left = len(groups) - MOST_GROUPS
    return ", ".join([*parts, *([f"and {several(left, 'more cause')}"] if left > 0 else [])])


@dataclass(kw_only=True)
class FailureGroup:
    """The cases that fail for the same cause or, if no cause is known, with the same blamed stage and items."""

    what: str  # the sentence of the cause, or the stage and the items with their names; empty if nothing is blamed
    short: str  # the same for a headline
    verdict: str
    accepted: bool  # by the gate's file, or because they failed in the run before
    worst: CaseRecord  # in its short form for lists
    names: list[str]  # of the first cases, the worst first
    count: int = 0


NAMED = 8  # cases of a group


def failure_groups(results: RunRecord) -> list[FailureGroup]:
    """Return the groups of the cases that fail: the new ones first, of each kind the largest first.

    Groups of the same size are in the order of the light path, since the first wrong stage is most likely the cause.
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
    """Return the part of a cause's sentences that describes the mistake, as a part of a longer sentence."""
    sentence = cause.split(EXPLAINS)[0].split(AS_WELL)[0].rstrip(".")
    return f"{sentence[:1].lower()}{sentence[1:]}" if sentence.startswith("The ") else sentence


def of_the_whole(results: RunRecord) -> list[str]:
    """Return sentences about failures of the whole run: factors that all cases share, images that change."""
    return [*results.get("wrong_factors", []), *results.get("changing", [])]


def causes(results: RunRecord) -> list[str]:
    """Return the sentences of the mistakes that explain a run's failures, or the sentence that no mistake does."""
    diagnosis = results.get("diagnosis")
    entries = diagnosis if isinstance(diagnosis, list | tuple) else []
    return [legible(entry["sentence"]) for entry in entries if isinstance(entry, Mapping) and entry.get("sentence")]


def cause_of(results: RunRecord, case: CaseRecord) -> str:
    """Return the sentences of the mistakes that explain a case's failure, or an empty string."""
    diagnosis = results.get("diagnosis")
    entries = diagnosis if isinstance(diagnosis, list | tuple) else []
    return " ".join(
        legible(entry["sentence"])
        for entry in entries
        if isinstance(entry, Mapping)
        and entry.get("sentence")
        and isinstance(entry.get("cases"), list | tuple)
        and case.get("name") in entry["cases"]
    )


def _checks(ledger: Mapping[str, int]) -> str:
    """Return the number of checks that passed, with the other outcomes if there are any."""
    left = ", ".join(
        f"{ledger[outcome.value]} {outcome.value.replace('_', ' ')}"
        for outcome in Outcome
        if outcome is not Outcome.PASS and ledger[outcome.value]
    )
    if not left:
        return several(ledger["planned"], "check")
    return f"{ledger[Outcome.PASS.value]} of {ledger['planned']} checks ({left})"


def no_say(results: RunRecord) -> list[str]:
    """Return sentences about references of the panel that abstained or were stopped, and about growing memory."""
    sentences = [*map(legible, results.get("growing", []))]
    for name, names in _stopped(results).items():
        more = f" and {len(names) - 1} more" if len(names) > 1 else ""
        sentences.append(f"a time limit stopped {display_name(name)} in {names[0]}{more}")
    lost = _lost(results)
    sentences += lost.values()
    for name, cases in _abstained(results).items():
        if name in lost:
            continue
        case, why = next(iter(cases.items()))
        more = f" and {len(cases) - 1} more" if len(cases) > 1 else ""
        sentences.append(f"{display_name(name)} had no say in {case}{more}, where it was asked: {why}")
    return sentences


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
    """Return reference -> case -> reason of the abstentions, without stopped renders and unreadable entries."""
    abstained, stopped = results.get("abstained"), _stopped(results)
    if not isinstance(abstained, Mapping):
        return {}
    reasons = {
        str(name): {case: why for case, why in cases.items() if case not in stopped.get(str(name), [])}
        for name, cases in abstained.items()
        if isinstance(cases, Mapping)
    }
    return {name: cases for name, cases in reasons.items() if cases}


def _stopped(results: RunRecord) -> dict[str, list[str]]:
    """Return renderer -> cases that a time limit stopped, without unreadable entries."""
    stopped = results.get("stopped")
    if not isinstance(stopped, Mapping):
        return {}
    return {str(name): list(map(str, cases)) for name, cases in stopped.items() if isinstance(cases, list | tuple)}


# The results of a pixel, by their names in results.json, and in words for a reader.
KINDS = {
    "strict": "strictly",
    "wide": "by a limit over 1 % of the value",
    "rounding": "explained by rounding",
    "epsilon": "explained only by a declared epsilon",
    "wrong": "wrong",
    "unexamined": "not examined",
}


def examined_line(results: RunRecord) -> str | None:
    """Return a sentence with the pixel counts of all checks; None if the run's record lacks them."""
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


FEW = 4  # items that are listed by name


def blame(case: CaseRecord) -> str:
    """Return the blamed stage of a case and the specification ids that may be to blame, or an empty string."""
    return " ".join(filter(None, (legible(case.get("stage") or ""), blamed_items(case))))


def blame_in_words(case: CaseRecord) -> str:
    """Return the blamed stage of a case, and the items that may be to blame with their names; or an empty string."""
    blamed = case.get("blamed_items")
    items = [str(item) for item in blamed if item] if isinstance(blamed, list | tuple) else []
    items = items or [str(item) for item in (case.get("item"),) if item]
    words = [f"{legible(item)} ({TITLES[item]})" if item in TITLES else legible(item) for item in items]
    named = " or ".join(words) if len(words) <= FEW else f"one of {len(words)} items"
    return " ".join(filter(None, (legible(case.get("stage") or ""), named)))


def blamed_items(case: CaseRecord) -> str:
    """Return the specification ids that may be to blame for a case, in words, or an empty string."""
    blamed = case.get("blamed_items")
    items = [legible(item) for item in blamed if item] if isinstance(blamed, list | tuple) else []
    if len(items) <= 1:
        return items[0] if items else legible(case.get("item") or "")
    return f"{', '.join(items[:-1])} or {items[-1]}" if len(items) <= FEW else f"one of {len(items)} items"


def excluded(case: CaseRecord) -> str:
    """Return in words the items that a case's evidence excludes, each with its check, or an empty string."""
    exclusions = case.get("excluded")
    pairs = exclusions.items() if isinstance(exclusions, Mapping) else ()
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
    """Return sentences about results that are worse than the history, one per cause or else per blamed items.

    Each begins with the worst of its cases, and contains the number of the others.
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
