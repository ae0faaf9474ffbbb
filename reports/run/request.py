"""What a user asks of `rayproof run`, as plain data."""

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from rayproof.reports.run.kept_images import EVERY_CASE, KeptImages
from rayproof.reports.subjects import THE_TRACER, Subject

if TYPE_CHECKING:
    from rayproof.reports.gate.gating import Demanded
    from rayproof.reports.run.scene_stream import SceneStream


@dataclass(frozen=True, kw_only=True)
class RunRequest:
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
    demanded: "Demanded | None" = None  # what is known to fail, and how much must be measured
    diagnose: bool = True  # say which known mistake explains the failures
    shard: tuple[int, int] | None = None  # the number of a part of the plan, and of how many
    images: KeptImages = EVERY_CASE  # of which cases they are kept
    patient: bool = False  # a case whose size is estimated to take longer than `timeout` has longer
    scenes: "SceneStream | None" = None  # instead of selectors: scenes without number
