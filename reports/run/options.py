"""`RunOptions` of `rayproof run`, the `CaseOptions` of each case, and the choice of the images that are kept.

A case that did not pass keeps every renderer's images. The images of a case that passed can be made again by the
command in its record, so that a run of very many cases need not keep them.
"""

import hashlib
import re
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from rayproof.reports.results.outcomes import Outcome
from rayproof.reports.subjects import THE_TRACER, Subject
from rayproof.tracer.formulas.own_file import is_own

if TYPE_CHECKING:
    from rayproof.reports.history.gating import Demanded
    from rayproof.reports.run.scenes import SceneStream

MANY = 2000  # cases; by default a longer run only keeps the images of a sample of the cases that passed
USUAL_SAMPLE = 0.01
FAILED, ALL = "failed", "all"


@dataclass(frozen=True)
class KeptImages:
    """The images that are kept of cases that passed: a `share` of them, from 0 to 1, or all renderers' if `full`."""

    share: float = 1.0
    full: bool = False  # as EXR files of every renderer, of every case whatever its verdict

    def keeps(self, case: str, outcome: Outcome) -> bool:
        """Return whether the images of a case of this name and verdict are kept; a digest of the name decides.

        The sample does not depend on other cases, on the order of the cases or on the machine.
        """
        if self.full or outcome is not Outcome.PASS or self.share >= 1:
            return True
        drawn = int.from_bytes(hashlib.sha256(f"images of {case}".encode(errors="replace")).digest()[:8], "big")
        return drawn < self.share * 2**64

    def __str__(self) -> str:
        """Return the value of --keep-images."""
        if self.full:
            return ALL
        return f"sample:{100 * self.share:g}%" if self.share else FAILED


EVERY_CASE = KeptImages()


def images_to_keep(text: str | None, *, cases: int) -> KeptImages:
    """Parse `failed`, `sample:1%` or `all`; without a text, return the default for this number of cases.

    Raises:
        ValueError: the text is none of these, or the share is not above 0 and at most 100 %.

    """
    if text is None:
        return KeptImages(USUAL_SAMPLE) if cases > MANY else EVERY_CASE
    if text in (FAILED, ALL):
        return KeptImages(0.0) if text == FAILED else KeptImages(full=True)
    match = re.fullmatch(r"sample:([0-9]{1,3}(?:\.[0-9]{1,9})?)%", text)
    if match is None or not 0 < float(match[1]) <= 100:
        raise ValueError(f"--keep-images is failed, all, or a share such as sample:1% (to 100 %), got {text}")
    return KeptImages(float(match[1]) / 100)


@dataclass(frozen=True, kw_only=True)
class RunOptions:
    """One run. Empty `selectors` mean the default suite, empty `configurations` its default configurations."""

    selectors: tuple[str, ...]  # families, family/case, globs, or scene files
    out: Path
    resume: bool
    require: tuple[str, ...]  # references whose "unsupported" counts as a failure
    jobs: int  # worker processes at once
    timeout: float  # s, for one render or one judgement
    worker_memory: float = float("inf")  # bytes of a worker process
    configurations: tuple[str, ...]
    json: Path | None  # path of a copy of results.json
    subject: Subject = THE_TRACER  # the renderer under test
    cached: bool = True  # take references' renders from the cache
    history: Path | None = None  # the database of `rayproof report history`
    demanded: "Demanded | None" = None  # the expected failures
    least_coverage: float | None = None  # %, of the cases that must be answered; None: half, without a gate
    diagnose: bool = True  # search for a known mistake that explains the failures
    shard: tuple[int, int] | None = None  # the number of a part of the plan, and the number of parts
    images: KeptImages = EVERY_CASE  # the cases whose images are kept
    patient: bool = False  # a case whose size is estimated to take longer than `timeout` has longer
    scenes: "SceneStream | None" = None  # a stream of scenes, instead of selectors


@dataclass(frozen=True, kw_only=True)
class Source:
    """A user's own file and the files that it imports from its folder: the path as written, and contents by name."""

    path: str
    files: Mapping[str, bytes]


@dataclass(frozen=True, kw_only=True)
class CaseOptions:
    """The options of a run that concern each case: plain data that travels to workers and other machines."""

    subject: Subject = THE_TRACER
    references: tuple[str, ...]  # the panel, in its order
    require: tuple[str, ...] = ()  # references that must answer
    images: KeptImages = EVERY_CASE  # the cases whose images are kept
    own: tuple[str, ...] = ()  # the user's own formulas in use, each with the SHA-256 of its file
    cached: bool = False  # references' answers and verdicts may be taken from the cache
    patient: bool = False  # a case whose size is estimated to take longer than the pool's limit has longer
    sources: tuple[Source, ...] = ()  # the user's own formulas, for machines without these files
    copies: tuple[tuple[str, str], ...] = ()  # on such a machine: the path of each, and the path of its copy

    @property
    def of_records(self) -> dict[str, Any]:
        """Return the options on which a case's record depends; processes, time limits and the cache are not among them.

        The title of a subject is how the user named it; its identity is a program's files and capabilities.
        """
        return {
            "subject": (self.subject.title, self.subject.identity),
            "references": self.references,
            "require": self.require,
            "images": self.images,
            "own": self.own,
        }


def case_options(request: RunOptions, references: tuple[str, ...]) -> CaseOptions:
    """Return the options of each case of a run with this panel."""
    return CaseOptions(
        subject=request.subject,
        references=references,
        require=tuple(sorted(set(request.require))),
        images=request.images,
        own=_own(request.configurations),
        cached=request.cached,
        patient=request.patient,
    )


def _own(configurations: tuple[str, ...]) -> tuple[str, ...]:
    if not any(is_own(name) for name in configurations):
        return ()
    from rayproof.tracer.configuration import Configuration

    digests = {place: digest for name in configurations for place, digest in Configuration.parse(name).own.items()}
    return tuple(f"{place} {digest}" for place, digest in sorted(digests.items()))
