"""`rayproof run random`: batches of random scenes through an ordinary run, and what their verdicts were worth."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import TypedDict

from rich.console import Console

from rayproof.cases.families import select
from rayproof.cases.random_scenes import FAMILY, counted
from rayproof.reports.audit.orders import LiarReport
from rayproof.reports.judge.oracle import ORACLE
from rayproof.reports.processes.pool import Pool
from rayproof.reports.random.trials import LIAR, example, lies, trials
from rayproof.reports.results.atomic import write_text
from rayproof.reports.results.document import load_results
from rayproof.reports.results.json_numbers import as_json
from rayproof.reports.results.outcomes import Outcome
from rayproof.reports.results.records import CaseRecord, WrongVerdictRecord
from rayproof.reports.run.plan import DEFAULTS
from rayproof.reports.run.request import RunRequest
from rayproof.reports.run.suite import FAILED, INTERRUPTED
from rayproof.reports.run.suite import run as run_suite
from rayproof.reports.subjects import Subject

BATCH = 500  # scenes that are held in memory, and in one report, at once
MOST_UNDECIDED = 0.01  # of the scenes
NAME = "random.json"
MOST_SHOWN = 20


class UndecidedRecord(TypedDict):
    """Which scenes were left undecided; `share` is that of those of which something could be decided."""

    decidable: dict[str, list[str]]  # scene -> configurations
    share: float
    undecidable: dict[str, list[str]]
    abstained: dict[str, list[str]]  # scene -> references
    stopped: dict[str, list[str]]  # scene -> whose time was over
    uncertified: dict[str, str]  # scene -> why


class RandomRecord(TypedDict):
    """What random.json holds."""

    seed: int
    scenes: int
    features: dict[str, int]
    wrong_verdicts: list[WrongVerdictRecord]
    undecided: UndecidedRecord
    trials: dict[str, int]
    liar: dict[str, int]
    folders: list[str]


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
    folders: list[str] = field(default_factory=list)
    seconds: float = 0.0

    def add(self, folder: Path) -> None:
        """Add what a results folder holds."""
        results = load_results(folder)
        self.folders.append(str(folder))
        self.seconds += results.get("seconds", 0.0)
        for case in results["cases"]:
            self._add(case)

    def _add(self, case: CaseRecord) -> None:
        name = case["name"]
        self.scenes.append(name)
        certified = case.get("certified")
        if certified is None and case.get("stopped"):
            self.stopped[name] = case["stopped"]
            return
        if certified is None:
            self.undecided[name] = [f"not judged: {case['reason']}"]
            return
        for number, one in enumerate(certified):
            self.wrong += one["wrong"]
            if one["why"] is not None:
                self.uncertified[name] = one["why"]
            for about, names in ((self.undecided, one["undecided"]), (self.undecidable, one["undecidable"])):
                if names:
                    about.setdefault(name, []).extend(names)
            for about, key in ((self.abstained, "abstained"), (self.stopped, "stopped")):
                if names := one.get(key):
                    about[name] = sorted({*about.get(name, ()), *names})
            if number:
                self.trials[one["tried"]] = self.trials.get(one["tried"], 0) + 1

    def add_lies(self, reports: Sequence[LiarReport], errors: Sequence[str]) -> None:
        """Add what a liar could hide from the judge: each scene with a lie that nobody saw is a wrong verdict."""
        self.trials[LIAR] = self.trials.get(LIAR, 0) + len(reports)
        self.uncertified |= {f"{LIAR} {number}": why for number, why in enumerate(errors)}
        unseen: list[WrongVerdictRecord] = [
            {
                "case": report.case,
                "configuration": LIAR,
                "reference": ORACLE,
                "stage": report.holes[0].removeprefix(f"{report.case}: ").partition(" ")[0],
                "pixel": None,
                "value": None,
                "enclosure": None,
                "verdict": Outcome.PASS.value,
                "why": f"{report.unseen} of {report.pixels} values of all stages are spoiled unseen: {report.holes[0]}",
            }
            for report in reports
            if report.unseen
        ]
        self.wrong += unseen
        for kind in ("pixels", "unseen", "interval", "wide", "epsilon"):
            self.liar[kind] = self.liar.get(kind, 0) + sum(getattr(report, kind) for report in reports)

    @property
    def share(self) -> float:
        """Return the share of scenes of which something could be decided and was not."""
        return len(self.undecided) / len(self.scenes) if self.scenes else 0.0

    @property
    def sound(self) -> bool:
        """Say whether no verdict is wrong, and few are missing that could be had."""
        return not self.wrong and self.share <= MOST_UNDECIDED

    def as_json(self) -> RandomRecord:
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
            "folders": self.folders,
        }


def run(request: RunRequest, pool: Pool | None, *, count: int, seed: int) -> tuple[int, tuple[Path, ...]]:
    """Run `count` scenes of `seed`; return the exit code and the folders of the reports.

    The code is 0 if no verdict is wrong and at most 1 % of the scenes are left undecided that need not be, 1
    otherwise, 130 when interrupted. A fault that was planted and found makes no run fail.
    """
    console = Console(highlight=False)
    tally, folders = Tally(seed=seed), []
    program = None
    if request.subject.is_tracer:
        built = example(request.out / "programs")
        if isinstance(built, Subject):
            program = built
        else:
            console.print(built, style="yellow", soft_wrap=True)
    for first in range(0, count, BATCH):
        last = min(first + BATCH, count) - 1
        folder = request.out if count <= BATCH else request.out / f"{first}-{last}"
        code = run_suite(_batch(request, folder, range(first, last + 1), seed, program), pool)
        folders.append(folder)
        tally.add(folder)
        if code != INTERRUPTED:
            console.print("a liar is loose on each tenth scene", soft_wrap=True)
            try:
                tally.add_lies(*lies(select(_names(seed, range(first, last + 1))), request))
            except KeyboardInterrupt:
                code = INTERRUPTED
        write_text(request.out / NAME, as_json(tally.as_json()) + "\n")
        if code == INTERRUPTED:
            return INTERRUPTED, tuple(folders)
        pool = None
    if request.json is not None:
        whole = load_results(folders[0]) if len(folders) == 1 else {}
        write_text(request.json, as_json({**whole, **tally.as_json()}) + "\n")
    _tell(tally, request.out, console)
    return 0 if tally.sound else FAILED, tuple(folders)


def _names(seed: int, chosen: range) -> tuple[str, ...]:
    return tuple(f"{FAMILY}/{seed}/{number}" for number in chosen)


def _batch(request: RunRequest, folder: Path, chosen: range, seed: int, program: Subject | None) -> RunRequest:
    """Return the request for one batch of scenes."""
    names = _names(seed, chosen)
    tried = {case.name: trials(case, program) for case in select(names)} if request.subject.is_tracer else {}
    return replace(
        request,
        selectors=names,
        out=folder,
        json=None,
        configurations=request.configurations or DEFAULTS,
        certified=True,
        trials=tried,
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
