"""What a finished case depends on, as narrowly as is sound: `rayproof run --changed` redoes what of it has changed.

A case depends on its scene and closed forms, on what the run demands, on packages, processor and references, and on
code: all that renders and judges, but of the tracer's formulas only the files of those that its configurations choose
in slots that its scene may ask for (`Catalogue.asked`), and of the case families none, since the case itself is known.
Files of formulas import no other's (a contract of `lint-imports`), so that a file that is not asked for by name is not
asked at all. Which files run is not watched: a worker that has built a mesh's tree for one configuration does not build
it for the next, so that what was seen to run there would be too little.
"""

from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from rayproof.reports.cache.closure import ROOT, closure
from rayproof.reports.cache.digests import code, content_digest, digest, exact, machine
from rayproof.reports.results.document import ResultsError, load_results
from rayproof.reports.results.records import CaseRecord, ChangedRecord
from rayproof.reports.run.demands import Demands
from rayproof.reports.run.plan import CODE, PlannedCase
from rayproof.reports.run.verdict_memory import version as reference_version
from rayproof.reports.subjects import PROGRAM, Subject
from rayproof.tracer.catalogue import FORMULAS
from rayproof.tracer.configuration import Configuration

FAMILIES = "rayproof.cases.families"
# The modules that a part of the code begins with, and those in which nothing that these import counts.
Part = tuple[tuple[str, ...], tuple[str, ...]]
NOT_KEPT = "it was not done before, or ended in an error"
DIGITS = 16  # of a digest that is only compared with another of the same name
# What of a case's dependencies is no code, in words.
OF_OTHER_KINDS = {
    "case": "the case itself",
    "demands": "what the run demands",
    "formulas": "which formulas are chosen, and what is said of them",
    "machine": "the packages or the machine",
}


class Dependencies:
    """What the cases of one run depend on."""

    def __init__(self, demands: Demands, subject: Subject) -> None:
        self._demands, self._subject = demands, subject
        self._asked: set[Part] = set()
        # What many cases share is worked out once for each choice of configurations and routes, and of parts.
        self._of_choices: dict[tuple[tuple[str, ...] | bool, ...], dict[str, str]] = {}
        self._of_parts: dict[tuple[Part, ...], str] = {}
        self._parts_of: dict[tuple[tuple[str, ...], tuple[str, ...]], tuple[Part, ...]] = {}  # configurations and slots

    @property
    def known(self) -> bool:
        """Say whether it is known what a render depends on; of a program nobody knows."""
        return self._subject.name != PROGRAM

    def of(self, planned: PlannedCase) -> dict[str, str]:
        """Return digests of what is asked, and of what answers; what is equal has not changed."""
        choice = planned.configurations, planned.routes, tuple(trial.title for trial in planned.trials), planned.twice
        if choice not in self._of_choices:
            self._of_choices[choice] = {
                "demands": digest(exact([self._demands, *choice]))[:DIGITS],
                "formulas": digest(self._declared(planned.configurations))[:DIGITS],
                "machine": digest(machine())[:DIGITS],
            }
        parts = self._parts(planned)
        if parts not in self._of_parts:
            self._of_parts[parts] = digest([code(modules, without=without) for modules, without in parts])[:DIGITS]
        return {
            "case": digest(exact(planned.case))[:DIGITS],
            **self._of_choices[choice],
            "code": self._of_parts[parts],
        }

    def sources(self) -> dict[str, str]:
        """Return a digest of each file's content, by its path below the package, of all that was asked about so far."""
        return _sources(frozenset[str]().union(*(_paths(*each) for each in self._asked)))

    def files(self, planned: PlannedCase) -> frozenset[str]:
        """Return the files that a case depends on, by their paths below the package."""
        return frozenset[str]().union(*(_paths(*each) for each in self._parts(planned)))

    def _parts(self, planned: PlannedCase) -> tuple[Part, ...]:
        """Return the parts of the code: what all cases share, then each formula's module by itself."""
        slots = FORMULAS.asked(planned.case.scene) if self._subject.is_tracer else ()
        asked = planned.configurations, slots
        if asked not in self._parts_of:
            parts = self._of_formulas(*asked) if self._subject.is_tracer else ((CODE, (FAMILIES,)),)
            self._parts_of[asked] = parts
            self._asked.update(parts)
        return self._parts_of[asked]

    def _of_formulas(self, configurations: tuple[str, ...], slots: tuple[str, ...]) -> tuple[Part, ...]:
        chosen = [Configuration.parse(name) for name in configurations]
        asked = sorted({one.formula(slot).module for one in chosen for slot in slots})
        shared = (CODE, (FAMILIES, *self._formulas))
        return shared, *(((one,), (FAMILIES, *(other for other in self._formulas if other != one))) for one in asked)

    def _declared(self, configurations: tuple[str, ...]) -> list[list[str]]:
        """Return which formulas stand in every slot, asked for or not, and what is said of them."""
        if not self._subject.is_tracer:
            return []
        return [
            [
                formula.name,
                formula.kind,
                *formula.covers,
                *(f"{key} {_said(fact)}" for key, fact in formula.facts.items()),
            ]
            for name in configurations
            for formula in Configuration.parse(name).chosen
        ]

    @cached_property
    def _formulas(self) -> tuple[str, ...]:
        return tuple(sorted({formula.module for formula in FORMULAS.values()}))


def _said(fact: object) -> str:
    """Return a fact of a formula in a word that is the same in every process."""
    return getattr(fact, "__qualname__", None) or repr(fact)


@dataclass(frozen=True, kw_only=True)
class Before:
    """What an earlier run says of a case: under which key its record is kept, and what it depended on."""

    key: str
    depends: Mapping[str, str]
    versions: Mapping[str, str]


class Earlier:
    """The earlier run in a results folder, held against what a run depends on now."""

    def __init__(self, folder: Path, dependencies: Dependencies, references: tuple[str, ...]) -> None:
        self._dependencies, self._references = dependencies, references
        self._cases: dict[str, Before] = {}
        self._sources: Mapping[str, str] = {}
        self._taken, self._because = 0, Counter[str]()
        try:
            results = load_results(folder)
        except (ResultsError, OSError):
            return  # there is none, so that everything is done
        self._sources = results.get("sources", {})
        for record in results["cases"]:
            before = _before(record, references)
            if before is not None:
                self._cases[record["name"]] = before

    def unchanged(self, planned: PlannedCase, kept: Callable[[str], CaseRecord | None]) -> CaseRecord | None:
        """Return the record of a case on which nothing has changed; None, if it must be done again.

        `kept` gives the record of a key, unless there is none, or it ended in an error, or a reference abstained.
        """
        if not self._dependencies.known:
            return None
        before = self._cases.get(planned.case.name)
        changed = [] if before is None else self._changed(before, planned)
        record = None if before is None or changed else kept(before.key)
        if record is not None:
            self._taken += 1
        self._because.update(changed if record is not None or changed else [NOT_KEPT])
        return record

    def _changed(self, before: Before, planned: PlannedCase) -> list[str]:
        """Return what has changed, in words and by the names of files."""
        now = self._dependencies.of(planned)
        found = [words for part, words in OF_OTHER_KINDS.items() if now[part] != before.depends.get(part)]
        if now["code"] != before.depends.get("code"):
            files = self._dependencies.files(planned)
            known = _sources(files)
            changed = sorted(file for file in files if known[file] != self._sources.get(file))
            found += changed or ["a file that is gone"]
        return found + [
            f"the version of {name}" for name in self._references if before.versions.get(name) != self._versions[name]
        ]

    @cached_property
    def _versions(self) -> dict[str, str]:
        return {name: reference_version(name) for name in self._references}

    def record(self, *, planned: int) -> ChangedRecord:
        """Return how many cases were taken up and rendered, and how often what was the reason to do one again."""
        because = dict(self._because.most_common())
        return {"taken_up": self._taken, "rendered": planned - self._taken, "because": because}


def _before(record: CaseRecord, references: tuple[str, ...]) -> Before | None:
    key, depends, versions = record.get("key"), record.get("depends"), record.get("versions", {})
    if not isinstance(key, str) or not isinstance(depends, dict):
        return None
    return Before(key=key, depends=depends, versions={name: versions.get(name, "") for name in references})


def _paths(modules: tuple[str, ...], without: tuple[str, ...]) -> tuple[str, ...]:
    return tuple(path.relative_to(ROOT).as_posix() for path in closure(modules, without=without))


def _sources(files: frozenset[str]) -> dict[str, str]:
    return {file: content_digest(ROOT / file)[:DIGITS] for file in sorted(files)}
