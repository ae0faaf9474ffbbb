"""A campaign: random scenes judged one by one, each verdict held against certified arithmetic, and wrong ones counted.

Each finished scene is a line of scenes.jsonl, so that a campaign that was interrupted can go on.
"""

import json
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, TypedDict

from rich.console import Console

from rayproof.cases.families import select
from rayproof.cases.random_scenes import FAMILY, counted
from rayproof.reports.judge.oracle import ORACLE
from rayproof.reports.processes.pool import Pool
from rayproof.reports.processes.worker import Reply
from rayproof.reports.results.files import as_json, write_text
from rayproof.reports.results.outcomes import Outcome
from rayproof.reports.run.plan import DEFAULTS, panel
from rayproof.reports.subjects import Subject
from tests.harness.verdicts.certify import WrongVerdictRecord
from tests.harness.verdicts.trials import (
    KIND,
    SceneOrder,
    SceneRecord,
    example,
    is_tenth,
    serve_scenes,
    trials,
)

LIAR = "liar"
MOST_UNDECIDED = 0.01  # of the scenes
NAME, SCENES = "verdicts.json", "scenes.jsonl"
MOST_SHOWN = 20


class UndecidedRecord(TypedDict):
    """Which scenes were left undecided; `share` is that of those of which something could be decided."""

    decidable: dict[str, list[str]]  # scene -> configurations
    share: float
    undecidable: dict[str, list[str]]
    abstained: dict[str, list[str]]  # scene -> references
    stopped: dict[str, list[str]]  # scene -> whose time was over
    uncertified: dict[str, str]  # scene -> why


class VerdictsRecord(TypedDict):
    """What verdicts.json holds."""

    seed: int
    scenes: int
    features: dict[str, int]
    wrong_verdicts: list[WrongVerdictRecord]
    undecided: UndecidedRecord
    trials: dict[str, int]
    liar: dict[str, int]


@dataclass(kw_only=True)
class Tally:
    """What became of the verdicts on the scenes so far."""

    seed: int
    scenes: list[str] = field(default_factory=list)
    wrong: list[WrongVerdictRecord] = field(default_factory=list)
    undecided: dict[str, list[str]] = field(default_factory=dict)  # scene -> configurations; most could be decided
    undecidable: dict[str, list[str]] = field(default_factory=dict)
    abstained: dict[str, list[str]] = field(default_factory=dict)  # scene -> references that did not see or answer
    stopped: dict[str, list[str]] = field(default_factory=dict)  # scene -> whose time was over: no word on the scene
    uncertified: dict[str, str] = field(default_factory=dict)  # scene -> why nobody certified its verdicts
    trials: dict[str, int] = field(default_factory=dict)
    liar: dict[str, int] = field(default_factory=dict)  # what it could spoil, in pixels of all stages

    def add(self, record: SceneRecord) -> None:
        """Add what became of a scene."""
        name = record["case"]
        self.scenes.append(name)
        if "certified" not in record:
            why = record.get("error", "")
            about = self.stopped if record.get("stopped") else self.undecided
            about[name] = [f"not judged: {why}"]
            return
        for number, certified in enumerate(record["certified"]):
            self.wrong += certified["wrong"]
            if certified["why"] is not None:
                self.uncertified[name] = certified["why"]
            for about, names in (
                (self.undecided, certified["undecided"]),
                (self.undecidable, certified["undecidable"]),
            ):
                if names:
                    about.setdefault(name, []).extend(names)
            for about, key in ((self.abstained, "abstained"), (self.stopped, "stopped")):
                if names := certified.get(key):
                    about[name] = sorted({*about.get(name, ()), *names})
            if number:
                self.trials[certified["tried"]] = self.trials.get(certified["tried"], 0) + 1
        if (lie := record.get("lie")) is not None:
            self._add_lie(lie)

    def _add_lie(self, lie: dict[str, Any]) -> None:
        """Add what a liar could hide from the judge: a lie that nobody saw is a wrong verdict."""
        self.trials[LIAR] = self.trials.get(LIAR, 0) + 1
        for kind in ("pixels", "unseen", "wide", "epsilon"):
            self.liar[kind] = self.liar.get(kind, 0) + lie[kind]
        if lie["unseen"]:
            self.wrong.append(
                {
                    "case": lie["case"],
                    "configuration": LIAR,
                    "reference": ORACLE,
                    "stage": lie["holes"][0].removeprefix(f"{lie['case']}: ").partition(" ")[0],
                    "pixel": None,
                    "value": None,
                    "enclosure": None,
                    "verdict": Outcome.PASS.value,
                    "why": f"{lie['unseen']} of {lie['pixels']} values of all stages are spoiled unseen: "
                    f"{lie['holes'][0]}",
                }
            )

    @property
    def share(self) -> float:
        """Return the share of scenes of which something could be decided and was not."""
        return len(self.undecided) / len(self.scenes) if self.scenes else 0.0

    @property
    def sound(self) -> bool:
        """Say whether no verdict is wrong, and few are missing that could be had."""
        return not self.wrong and self.share <= MOST_UNDECIDED

    def as_json(self) -> VerdictsRecord:
        """Return plain JSON data."""
        return {
            "seed": self.seed,
            "scenes": len(self.scenes),
            "features": counted(self.scenes),
            "wrong_verdicts": self.wrong,
            "undecided": {
                "decidable": self.undecided,
                "share": self.share,
                "undecidable": self.undecidable,
                "abstained": self.abstained,
                "stopped": self.stopped,
                "uncertified": self.uncertified,
            },
            "trials": self.trials,
            "liar": self.liar,
        }


@dataclass(frozen=True, kw_only=True)
class Campaign:
    """What a user asks for."""

    count: int
    seed: int
    subject: Subject
    resume: bool
    out: Path
    jobs: int
    timeout: float  # s, for all of one scene


def run(asked: Campaign) -> Tally:
    """Judge the scenes that are not judged yet; return what became of all, which is in verdicts.json as well."""
    console = Console(highlight=False)
    asked.out.mkdir(parents=True, exist_ok=True)
    journal = asked.out / SCENES
    if not asked.resume:
        journal.unlink(missing_ok=True)
    known = {record["case"]: record for record in _kept(journal) if record["subject"] == asked.subject.title}
    pool = Pool(jobs=asked.jobs, timeout=asked.timeout, copies={KIND: asked.jobs}, target=serve_scenes)

    def done(reply: Reply, name: str) -> None:
        record: SceneRecord = reply.value
        if reply.error is not None:
            record = {"case": name, "subject": asked.subject.title, "error": reply.error, "stopped": reply.stopped}
        else:
            with journal.open("a", encoding="utf-8") as file:
                file.write(as_json(record) + "\n")
        known[name] = record
        console.print(f"{len(known)} of {asked.count}: {name} ({reply.seconds:.1f} s)", soft_wrap=True)

    try:
        for order in _orders(asked, console):
            name = f"{FAMILY}/{order.seed}/{order.number}"
            if name not in known:
                future = pool.submit(KIND, order)
                future.add_done_callback(lambda future, name=name: done(future.result(), name))
        while not pool.idle:
            pool.step()
    finally:
        pool.close()
        tally = Tally(seed=asked.seed)
        for number in range(asked.count):
            if record := known.get(f"{FAMILY}/{asked.seed}/{number}"):
                tally.add(record)
        write_text(asked.out / NAME, as_json(tally.as_json(), indent=1) + "\n")
    _tell(tally, asked.out, console)
    return tally


def _kept(journal: Path) -> Iterator[SceneRecord]:
    """Yield the scenes of an earlier run; the last line may have been cut short."""
    if journal.is_file():
        for line in journal.read_text(encoding="utf-8").splitlines():
            try:
                yield json.loads(line)
            except ValueError:
                return


def _orders(asked: Campaign, console: Console) -> Iterator[SceneOrder]:
    """Yield the order of each scene."""
    program = None
    if asked.subject.is_tracer:
        built = example(asked.out / "programs")
        if isinstance(built, Subject):
            program = built
        else:
            console.print(built, style="yellow", soft_wrap=True)
    names = panel((), asked.subject).names
    for number in range(asked.count):
        (case,) = select([f"{FAMILY}/{asked.seed}/{number}"])
        yield SceneOrder(
            seed=asked.seed,
            number=number,
            subject=asked.subject,
            configurations=DEFAULTS,
            panel=names,
            trials=trials(case, program) if asked.subject.is_tracer else (),
            lying=is_tenth(number),
        )


def _tell(tally: Tally, out: Path, console: Console) -> None:
    """Print features, wrong verdicts and what is undecided."""

    def line(text: str, style: str | None = None) -> None:
        console.print(text, style=style, soft_wrap=True, markup=False)

    line("features: " + ", ".join(f"{name} {count}" for name, count in counted(tally.scenes).items()))
    if tally.trials:
        line("tried beside: " + ", ".join(f"{name} {count}" for name, count in sorted(tally.trials.items())))
    for wrong in tally.wrong[:MOST_SHOWN]:
        at = f", pixel {tuple(wrong['pixel'])}" if wrong["pixel"] else ""
        line(
            f"wrong: {wrong['case']} {wrong['configuration']} {wrong['stage']}{at}: {wrong['verdict']}: {wrong['why']}",
            "red",
        )
    for name in list(tally.undecided)[:MOST_SHOWN]:
        line(f"undecided: {name}: {', '.join(tally.undecided[name])}", "yellow")
    for name in list(tally.stopped)[:MOST_SHOWN]:
        line(f"stopped by a time limit: {name}: {', '.join(tally.stopped[name])}", "yellow")
    scenes = len({wrong["case"] for wrong in tally.wrong})
    line(
        f"{len(tally.scenes)} scenes, wrong verdicts in {scenes}; undecided though decidable in {len(tally.undecided)} "
        f"({tally.share:.1%}), undecidable in {len(tally.undecidable)}, a reference abstains in "
        f"{len(tally.abstained)}, a time limit stopped somebody in {len(tally.stopped)}; {out / NAME}"
    )
