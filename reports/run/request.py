"""What a user asks of `rayproof run`, as plain data."""

from dataclasses import dataclass
from pathlib import Path

from reports.subjects import THE_TRACER, Subject


@dataclass(frozen=True, kw_only=True)
class RunRequest:
    """One run. Empty `selectors` mean the default suite, empty `configurations` its default configurations."""

    selectors: tuple[str, ...]  # families, family/case, globs, or scene files
    out: Path
    resume: bool
    require: tuple[str, ...]  # references whose "unsupported" counts as a failure
    jobs: int  # worker processes at once
    timeout: float  # s, for one render or one judgement
    configurations: tuple[str, ...]
    json: Path | None  # where to copy results.json
    subject: Subject = THE_TRACER  # who is under test
    cached: bool = True  # take references' renders from the cache
    history: Path | None = None  # where to keep what was found, for `rayproof history`
    full: bool = False  # keep every renderer's images of every case, as EXR
