"""All mutants before all cases, then what is left before random scenes: the table of what the suite can see."""

from collections import defaultdict
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field
from fnmatch import fnmatchcase
from typing import Any

from rayproof.cases.case import Case
from rayproof.cases.families import all_cases
from rayproof.reports.processes.worker import Reply
from tests.harness.audit.mutants import EQUIVALENT, SURVIVES, Mutant
from tests.harness.audit.mutants.trials import RADIANCE, STAGES, WAYS, Kill, MutantOrder, MutantReport
from tests.harness.audit.records import MutantFieldFinding, MutantFinding, MutantsScore

# Families whose cases kill most come first; those that were made to kill what survived the others come last, so that
# a mutant that is killed by one of them is known to have survived the rest.
FIRST = ("random_scenes", "several_lights", "nearest", "cameras", "transforms", "clipping", "primitives")
LAST = ("combined", "reported", "watertight", "tolerances")
LARGE = ("faces/over_two_to_the_16", "meshes/twenty_thousand_faces")  # a second each, and no mutant needs them
CHUNK = 6  # mutants an order
SEED, RANDOM_SCENES, QUICK_RANDOM_SCENES = 31, 2000, 100
RANDOM_CHUNK, RANDOM_WAVE = 25, 8  # scenes an order, and orders before survivors are counted anew
QUICK_SHARE = 8  # every so many-th mutant is asked with --quick


@dataclass(kw_only=True)
class Campaign:
    """What is known of some mutants so far; `submit` hands an order to a worker, `drain` waits for all of them."""

    mutants: Sequence[Mutant]
    quick: bool
    submit: Callable[[Any, Callable[[Reply], None]], None]
    drain: Callable[[], None]
    say: Callable[[str], None]
    kills: dict[str, dict[str, Kill]] = field(default_factory=lambda: defaultdict(dict))  # mutant -> way -> kill
    random_kills: dict[str, dict[str, Kill]] = field(default_factory=lambda: defaultdict(dict))
    judged: dict[str, int] = field(default_factory=lambda: defaultdict(int))
    errors: list[str] = field(default_factory=list)

    def run(self) -> MutantsScore:
        """Judge every mutant and return the table."""
        names = [mutant.name for mutant in self.mutants]
        cases = tuple(case.name for case in ordered(all_cases()))
        for first in range(0, len(names), CHUNK):
            wanted = tuple((name, WAYS) for name in names[first : first + CHUNK])
            self._submit(MutantOrder(wanted=wanted, cases=cases), self.kills)
        self.drain()
        self.say(f"{len(self.kills)} of {len(names)} mutants fail a case")
        scenes = QUICK_RANDOM_SCENES if self.quick else RANDOM_SCENES
        for first in range(0, scenes, RANDOM_CHUNK * RANDOM_WAVE):
            self._wave(names, range(first, min(first + RANDOM_CHUNK * RANDOM_WAVE, scenes), RANDOM_CHUNK), scenes)
        return score([self._finding(mutant) for mutant in self.mutants], scenes, self.errors)

    def _wave(self, names: Iterable[str], firsts: range, scenes: int) -> None:
        """Put what no case and no random scene has killed so far to some more random scenes."""
        left = tuple(
            (name, ways)
            for name in names
            if (
                ways := tuple(way for way in WAYS if way not in self.kills[name] and way not in self.random_kills[name])
            )
        )
        if not left:
            return
        for first in firsts:
            numbers = (first, min(first + RANDOM_CHUNK, scenes))
            self._submit(MutantOrder(wanted=left, seed=SEED, numbers=numbers), self.random_kills)
        self.drain()
        self.say(f"{len(left)} mutants before {firsts[-1] + RANDOM_CHUNK} random scenes")

    def _submit(self, order: MutantOrder, kills: dict[str, dict[str, Kill]]) -> None:
        def done(reply: Reply) -> None:
            if reply.error is not None:
                self.errors.append(f"mutants {order.wanted[0][0]} ...: {reply.error}")
                return
            report: MutantReport = reply.value
            for kill in report.kills:
                kills[kill.mutant].setdefault(kill.way, kill)
            for name, count in report.judged.items():
                self.judged[name] += count

        self.submit(order, done)

    def _finding(self, mutant: Mutant) -> MutantFinding:
        kills, random_kills = self.kills[mutant.name], self.random_kills[mutant.name]
        stages = kills.get(STAGES)
        return {
            "name": mutant.name,
            "field": mutant.field,
            "what": mutant.what,
            "equivalent": reason(EQUIVALENT, mutant.name),
            "survives": reason(SURVIVES, mutant.name),
            "killed_by_radiance": _words(kills.get(RADIANCE)),
            "killed_by_stages": _words(stages),
            "stage": stages.stage.value if stages is not None and stages.stage is not None else None,
            "killed_at_random": _words(random_kills.get(RADIANCE) or random_kills.get(STAGES)),
            "judged": self.judged[mutant.name],
        }


def ordered(cases: Iterable[Case]) -> list[Case]:
    """Return the cases of one sample a pixel in the order in which mutants meet them."""

    def turn(case: Case) -> int:
        if case.name in LARGE:
            return len(FIRST) + 1
        if case.family in LAST:
            return len(FIRST) + 2 + LAST.index(case.family)
        return FIRST.index(case.family) if case.family in FIRST else len(FIRST)

    return sorted((case for case in cases if case.samples == 1), key=turn)


def reason(reasons: dict[str, str], name: str) -> str | None:
    """Return the reason of the first pattern that a mutant's name matches."""
    return next((why for pattern, why in reasons.items() if fnmatchcase(name, pattern)), None)


def _words(kill: Kill | None) -> str | None:
    return None if kill is None else f"{kill.case}: {kill.reason}"


def score(findings: Sequence[MutantFinding], scenes: int, errors: Sequence[str]) -> MutantsScore:
    """Return the table with its sums, and a sentence for each thing that must not be so."""
    wrong = [finding for finding in findings if finding["equivalent"] is None]
    by_field: dict[str, list[MutantFinding]] = {}
    for finding in findings:
        by_field.setdefault(finding["field"], []).append(finding)
    return {
        "of": len(wrong),
        "equivalent": len(findings) - len(wrong),
        "killed_by_radiance": sum(finding["killed_by_radiance"] is not None for finding in wrong),
        "killed_by_stages": sum(finding["killed_by_stages"] is not None for finding in wrong),
        "killed_by_new_families": sum(_by_new_family(finding) for finding in wrong),
        "random_scenes": scenes,
        "problems": [*_problems(findings), *errors],
        "fields": [_field_finding(name, some) for name, some in by_field.items()],
        "mutants": list(findings),
    }


def _by_new_family(finding: MutantFinding) -> bool:
    killer = finding["killed_by_radiance"]
    return killer is not None and killer.split("/")[0] in LAST


def _field_finding(name: str, findings: Sequence[MutantFinding]) -> MutantFieldFinding:
    wrong = [finding for finding in findings if finding["equivalent"] is None]
    return {
        "field": name,
        "mutants": len(findings),
        "equivalent": len(findings) - len(wrong),
        "killed_by_radiance": sum(finding["killed_by_radiance"] is not None for finding in wrong),
        "killed_by_stages": sum(finding["killed_by_stages"] is not None for finding in wrong),
        "killed_by_new_families": sum(_by_new_family(finding) for finding in wrong),
        "survivors": [_rule(finding) for finding in wrong if finding["killed_by_radiance"] is None],
    }


def _rule(finding: MutantFinding) -> str:
    return finding["name"].split("/", 2)[2]


def _problems(findings: Iterable[MutantFinding]) -> list[str]:
    problems = []
    for finding in findings:
        name, killed = finding["name"], finding["killed_by_radiance"]
        shown = killed or finding["killed_by_stages"] or finding["killed_at_random"]
        if finding["equivalent"] is not None and shown is not None:
            problems.append(f"{name} is said to be equivalent and was killed: {shown}")
        if finding["equivalent"] is None and killed is None and finding["survives"] is None:
            at_random = (
                f"; a random scene kills it: {finding['killed_at_random']}" if finding["killed_at_random"] else ""
            )
            problems.append(f"{name} survives with only radiance, and no reason is given{at_random}")
        if finding["survives"] is not None and killed is not None:
            problems.append(f"{name} is listed as a survivor and was killed: {killed}")
    return problems


def markdown(table: MutantsScore) -> str:
    """Return the table of fields as docs/faults.md shows it, with the proofs and the reasons below it."""
    head = (
        "| field or formula | mutants | equivalent | killed by radiance | by all stages | by new families | survivors |"
    )
    rows = [
        f"| `{one['field']}` | {one['mutants']} | {one['equivalent'] or ''} | {one['killed_by_radiance']} | "
        f"{one['killed_by_stages']} | {one['killed_by_new_families'] or ''} | "
        f"{', '.join(f'`{rule}`' for rule in one['survivors'])} |"
        for one in table["fields"]
    ]
    return "\n".join([
        head, "|---|---|---|---|---|---|---|", *rows,
        "", "Equivalent mutants:", "", *_listed(table, "equivalent"),
        "", "Survivors with only radiance:", "", *_listed(table, "survives"), "",
    ])  # fmt: skip


def _listed(table: MutantsScore, key: str) -> list[str]:
    """Return a line for each reason, with the mutants that have it."""
    names: dict[str, list[str]] = {}
    for finding in table["mutants"]:
        why = finding["equivalent"] if key == "equivalent" else finding["survives"]
        if why is not None:
            names.setdefault(why, []).append(finding["name"].removeprefix("mutant/"))
    return [f"* {', '.join(f'`{name}`' for name in some)}: {why}." for why, some in names.items()]
