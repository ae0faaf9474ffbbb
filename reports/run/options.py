"""`RunOptions` of `rayproof run`, the `CaseOptions` that each case needs of them, and which images are kept.

A case that did not pass keeps every renderer's images. Of a case that passed they are there to look at, and the command
in its record makes them again, so that a run of very many cases need not keep them.
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

MANY = 2000  # cases of a run; of a longer one that passed, a sample is kept unless somebody asks for more
USUAL_SAMPLE = 0.01
FAILED, ALL = "failed", "all"


@dataclass(frozen=True)
class KeptImages:
    """What is kept of cases that passed: the images of a `share` of them, from 0 to 1; all renderers', if `full`."""

    share: float = 1.0
    full: bool = False  # as EXR files of every renderer, of every case whatever its verdict

    def keeps(self, case: str, outcome: Outcome) -> bool:
        """Say whether the images of a case of this name and verdict are kept; by a digest of the name it is sampled.

        Which cases are in the sample depends on no other case, on no order, and on no machine.
        """
        if self.full or outcome is not Outcome.PASS or self.share >= 1:
            return True
        drawn = int.from_bytes(hashlib.sha256(f"images of {case}".encode(errors="replace")).digest()[:8], "big")
        return drawn < self.share * 2**64

    def __str__(self) -> str:
        """Return it as --keep-images takes it."""
        if self.full:
            return ALL
        return f"sample:{100 * self.share:g}%" if self.share else FAILED


EVERY_CASE = KeptImages()


def images_to_keep(text: str | None, *, cases: int) -> KeptImages:
    """Return what `failed`, `sample:1%` or `all` means; without a text, what is usual for so many cases.

    Raises:
        ValueError: the text is none of these, or the share is not above 0 and at most 100 %.

    """
    if text is None:
        return KeptImages(USUAL_SAMPLE) if cases > MANY else EVERY_CASE
    if text in (FAILED, ALL):
        return KeptImages(0.0) if text == FAILED else KeptImages(full=True)
    found = re.fullmatch(r"sample:([0-9]{1,3}(?:\.[0-9]{1,9})?)%", text)
    if found is None or not 0 < float(found[1]) <= 100:
        raise ValueError(f"--keep-images is failed, all, or a share such as sample:1% (to 100 %), got {text}")
    return KeptImages(float(found[1]) / 100)


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
    json: Path | None  # where to copy results.json
    subject: Subject = THE_TRACER  # who is under test
    cached: bool = True  # take references' renders from the cache
    history: Path | None = None  # where to keep what was found, for `rayproof report history`
    demanded: "Demanded | None" = None  # what is known to fail
    least_coverage: float | None = None  # %, of the cases that must be answered; None: half, without a gate
    diagnose: bool = True  # say which known mistake explains the failures
    shard: tuple[int, int] | None = None  # the number of a part of the plan, and of how many
    images: KeptImages = EVERY_CASE  # of which cases they are kept
    patient: bool = False  # a case whose size is estimated to take longer than `timeout` has longer
    scenes: "SceneStream | None" = None  # instead of selectors: scenes without number


@dataclass(frozen=True, kw_only=True)
class Source:
    """A user's own file with what it imports from beside it: the path that he wrote, and the contents by name."""

    path: str
    files: Mapping[str, bytes]


@dataclass(frozen=True, kw_only=True)
class CaseOptions:
    """The options of a run that concern each case: plain data that travels to workers and other machines."""

    subject: Subject = THE_TRACER
    references: tuple[str, ...]  # the panel, in its order
    require: tuple[str, ...] = ()  # references that must answer
    images: KeptImages = EVERY_CASE  # of which cases they are kept
    own: tuple[str, ...] = ()  # the user's own formulas in use, each with the SHA-256 of its file
    cached: bool = False  # references' answers and verdicts may be taken from the cache
    patient: bool = False  # a case whose size is estimated to take longer than the pool's limit has longer
    sources: tuple[Source, ...] = ()  # the user's own formulas, for machines that have not got them
    copies: tuple[tuple[str, str], ...] = ()  # there: the path of each, and where it lies

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

    found = {place: digest for name in configurations for place, digest in Configuration.parse(name).own.items()}
    return tuple(f"{place} {digest}" for place, digest in sorted(found.items()))
