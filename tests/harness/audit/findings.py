"""From what each case saw to what is said of each fault, and to the score."""

from collections import Counter
from collections.abc import Iterable, Mapping, Sequence

from rich.console import Console
from rich.table import Table
from rich.text import Text

from rayproof.cases.stages import Stage
from rayproof.reports.results.outcomes import Outcome
from rayproof.reports.terminal import console as terminal
from tests.harness.audit.orders import REFERENCES, GradedReport, LiarReport, Sighting
from tests.harness.audit.planted import PlantedFault
from tests.harness.audit.records import (
    AuditRecord,
    AuditScore,
    BlamedItems,
    FamilyFinding,
    FaultAbout,
    FaultFinding,
    LiarFinding,
    ReferenceFinding,
)

NAMED = 5  # killers that an entry names


def kills(fault: PlantedFault, sighting: Sighting) -> bool:
    """Say whether a case shows a fault: a fault of the tracer must fail, one of a reference put it under suspicion."""
    if fault.where == "tracer":
        return sighting.outcome is Outcome.FAIL
    return sighting.blamed is not None


def side_is_right(fault: PlantedFault, sighting: Sighting) -> bool:
    """Say whether whoever a case blames is the one that the fault was planted in, at a stage that it spoils."""
    if sighting.blamed is None:
        return True
    guilty = {"tracer"} if fault.where == "tracer" else set(fault.who)
    return set(sighting.blamed.split(", ")) <= guilty and fault.blames(sighting.stage)


def by_cases(fault: PlantedFault, sightings: Sequence[Sighting], stopped: str | None = None) -> FaultFinding:
    """Return the entry of audit.json of a fault that cases must kill.

    `stopped` is the message of the judge's self-test, which ends a run before any case is judged: an oracle that
    contradicts closed forms blames nobody, also where no other reference could contradict it.
    """
    killers = [one for one in sightings if kills(fault, one)]
    blamed = blamed_stage(fault, [one.stage for one in killers if one.stage])
    wrong = [one for one in sightings if not side_is_right(fault, one)]
    return {
        **_entry(fault),
        "killed": bool(killers),
        "blamed_stage": blamed,
        "blamed": sorted({one.blamed for one in sightings if one.blamed}),
        "blamed_right": bool(killers) and (stopped is not None or not wrong) and blamed == fault.stage.value,
        "killed_by": [*([stopped] if stopped else []), *(f"{one.case}: {one.reason}" for one in killers[:NAMED])],
        "wrongly_blamed": [f"{one.case}: {one.blamed} {one.stage}: {one.reason}" for one in wrong[:NAMED]],
        **_items(fault, killers),
        "families": _families(fault, sightings),
        "references": _references(fault, killers) if fault.where == "tracer" else {},
    }


def blamed_stage(fault: PlantedFault, stages: Sequence[Stage]) -> str | None:
    """Return the stage that the cases together blame: the fault's own if any case does, else what most of them say.

    What else a fault spoils (`also`) may be all that some cases show: a far root is a wrong distance on one sphere and
    a wrong object among several, and a wrong intersection may show in a shadow alone.
    """
    if fault.stage in stages:
        return fault.stage.value
    return Counter(stages).most_common(1)[0][0].value if stages else None


def _items(fault: PlantedFault, killers: Sequence[Sighting]) -> BlamedItems:
    """Return the items that cases leave to blame, the most frequent first, and whether they hold the fault's own.

    They are if every case that blames the fault's own stage leaves one of its items; None where it declares none.
    A case that shows no more than what else the fault spoils may well name another.
    """
    named = Counter(item for one in killers for item in one.items)
    own = [not {*fault.covers}.isdisjoint(one.items) for one in killers if one.stage is fault.stage]
    return {
        "blamed_items": [item for item, _ in named.most_common()],
        "items_right": bool(own) and all(own) if fault.covers else None,
    }


def liar(reports: Sequence[LiarReport]) -> LiarFinding:
    """Return how many of so many pixels of all stages a liar could spoil, by what the judge says of them."""
    return {
        "pixels": sum(report.pixels for report in reports),
        "cases": len({report.case for report in reports}),
        "spoiled_unseen": sum(report.unseen for report in reports),
        "spoiled_wide": sum(report.wide for report in reports),
        "spoiled_epsilon": sum(report.epsilon for report in reports),
        "holes": [hole for report in reports for hole in report.holes],
    }


def _entry(fault: PlantedFault) -> FaultAbout:
    return {
        "name": fault.name,
        "where": fault.where,
        "stage": fault.stage.value,
        "covers": list(fault.covers),
        "erratum": fault.erratum,
        "equivalent": fault.equivalent,
    }


def _families(fault: PlantedFault, sightings: Iterable[Sighting]) -> dict[str, FamilyFinding]:
    """Return, per family, how many cases met the fault, how many killed it, and the stage most of them blamed."""
    found: dict[str, list[Sighting]] = {}
    for one in sightings:
        found.setdefault(one.family, []).append(one)
    return {
        family: {
            "cases": len(some),
            "killed": sum(kills(fault, one) for one in some),
            "stage": blamed_stage(fault, [one.stage for one in some if kills(fault, one) and one.stage]),
        }
        for family, some in sorted(found.items())
    }


def _references(fault: PlantedFault, killers: Sequence[Sighting]) -> dict[str, ReferenceFinding]:
    """Return, per reference, whether it can see the fault, whether it alone kills it, and the stage that it blames.

    A reference can see a fault if it answers the fault's stage in some case in which the fault shows at all.
    """
    found: dict[str, ReferenceFinding] = {}
    for name in REFERENCES:
        looks = [one.looks[name] for one in killers if name in one.looks]
        found[name] = {
            "sees": any(look.answers for look in looks),
            "killed": any(look.kills for look in looks),
            "missed": [
                one.case
                for one in killers
                if name in one.looks and one.looks[name].answers and not one.looks[name].kills
            ],
            "stage": blamed_stage(fault, [look.stage for look in looks if look.kills and look.stage]),
        }
    return found


def score(
    entries: Sequence[FaultFinding],
    healthy: Sequence[Sighting],
    graded: Sequence[GradedReport],
    errors: Sequence[str] = (),
    lies: Sequence[LiarReport] = (),
) -> AuditScore:
    """Return audit.json's content; `good` says whether the harness sees everything that was planted."""
    alarms = [one for one in healthy if one.outcome not in (Outcome.PASS, Outcome.WARN)]
    smallest: dict[str, dict[str, dict[str, float]]] = {}
    for report in graded:
        smallest.setdefault(report.quantity, {})[report.precision] = report.smallest
    wanted = [entry for entry in entries if entry["equivalent"] is None]
    declared = [entry for entry in wanted if entry["items_right"] is not None]
    hidden = liar(lies) if lies else None
    problems = [*_problems(entries), *(f"false alarm: {one.fault} {one.case}: {one.reason}" for one in alarms), *errors]
    problems += [f"a liar passes: {hole}" for hole in (hidden["holes"] if hidden else ())]
    return {
        "planted": len(entries),
        "killed": sum(entry["killed"] for entry in wanted),
        "equivalent": len(entries) - len(wanted),
        "blamed_right": sum(entry["blamed_right"] for entry in wanted),
        "items_declared": len(declared),
        "items_right": sum(entry["items_right"] is True for entry in declared),
        "liar": hidden,
        "false_alarms": len(alarms),
        "unchanged_passed": len(healthy) - len(alarms),
        "good": not problems,
        "problems": problems,
        "smallest_detected": smallest,
        "faults": list(entries),
    }


def _problems(entries: Iterable[FaultFinding]) -> list[str]:
    """Return a sentence for everything that must not be so."""
    found = []
    for entry in entries:
        name = entry["name"]
        if entry["equivalent"] is not None:
            if entry["killed"]:
                found.append(f"{name} is said to be equivalent and was killed: {entry['killed_by'][0]}")
            continue
        if not entry["killed"]:
            found.append(f"{name} survives")
        elif not entry["blamed_right"]:
            why = entry["wrongly_blamed"][0] if entry["wrongly_blamed"] else f"{entry['blamed_stage']}"
            found.append(f"{name} spoils {entry['stage']} and is blamed elsewhere: {why}")
        found += [
            f"{name} is seen by {reference} and not killed by it alone"
            for reference, look in entry["references"].items()
            if look["sees"] and not look["killed"]
        ]
    return found


# The kill matrix and the score, for a reader of the terminal.


SHORT = {name: name.removeprefix("mitsuba_") for name in REFERENCES}


def show(console: Console, result: AuditRecord) -> None:
    """Print the matrix, the graded faults, what is wrong and the score."""
    page = console if console.is_terminal else terminal()
    page.print(_matrix(result["faults"]))
    if result["smallest_detected"]:
        page.print(_graded(result["smallest_detected"]))
    if result["items_right"] < result["items_declared"]:
        page.print(_items_table(result["faults"]))
    for problem in result["problems"]:
        page.print(Text(problem, style="red"), soft_wrap=True)
    page.print(Text(f"{sentence(result)} {result['seconds']} s", style="bold"), soft_wrap=True)


def _matrix(faults: list[FaultFinding]) -> Table:
    table = Table(
        title="fault x reference and family: the stage blamed; - cannot see it, . sees it not", title_justify="left"
    )
    for column in ("fault", "where", "spoils", "killed", *SHORT.values(), "families (killed/cases)"):
        table.add_column(column, overflow="fold")
    for fault in faults:
        looks = [fault["references"].get(name) for name in REFERENCES]
        families = [f"{name} {one['killed']}/{one['cases']}" for name, one in fault["families"].items()]
        table.add_row(
            fault["name"],
            fault["where"],
            fault["stage"],
            Text("equivalent" if fault["equivalent"] else fault["blamed_stage"] or "SURVIVES"),
            *(Text("" if look is None else look["stage"] or ("." if look["sees"] else "-")) for look in looks),
            Text(", ".join(families) or "; ".join(fault["killed_by"])),
        )
    return table


def _items_table(faults: list[FaultFinding]) -> Table:
    table = Table(title="faults that some case blames on another item of the specification", title_justify="left")
    for column in ("fault", "its items", "blamed"):
        table.add_column(column, overflow="fold")
    for fault in faults:
        if fault["items_right"] is False and fault["equivalent"] is None:
            table.add_row(fault["name"], ", ".join(fault["covers"]), ", ".join(fault["blamed_items"]))
    return table


def _graded(smallest: Mapping[str, Mapping[str, Mapping[str, float]]]) -> Table:
    stages = list(dict.fromkeys(s for one in smallest.values() for found in one.values() for s in found))
    table = Table(title="smallest relative error that each stage detects, 1e-2 to 1e-7", title_justify="left")
    for column in ("quantity", "precision", *stages):
        table.add_column(column)
    for quantity, one in smallest.items():
        for precision, found in one.items():
            table.add_row(quantity, precision, *(f"{found[s]:.1e}" if s in found else "" for s in stages))
    return table


def sentence(audit: AuditRecord) -> str:
    """Return the score in one line."""
    text = (
        f"Audit: {audit['killed']} of {audit['planted'] - audit['equivalent']} planted faults killed, "
        f"{audit['blamed_right']} of them blamed right, {audit['false_alarms']} false alarms; {audit['equivalent']} "
        "more are provably equivalent."
    )
    if audit["items_declared"]:
        text += f" Of {audit['items_declared']} that spoil an item, {audit['items_right']} are blamed on it."
    return text + _liar(audit.get("liar"))


def _liar(liar: LiarFinding | None) -> str:
    """Return what a liar could hide, as a sentence; nothing where none was let loose."""
    if not liar or not liar["pixels"]:
        return ""
    unseen, pixels = liar["spoiled_unseen"], liar["pixels"]
    return (
        f" A liar can spoil {unseen} of {pixels} pixels x stages unseen ({unseen / pixels:.2%}); "
        f"{liar['spoiled_wide']} in wide limits, "
        f"{liar['spoiled_epsilon']} behind an epsilon."
    )
