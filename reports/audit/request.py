"""What a user asks of `rayproof audit`, as plain data."""

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True, kw_only=True)
class AuditRequest:
    """One audit. `only` is a glob over the faults' names, or a place such as "tracer"."""

    out: Path
    only: str
    quick: bool  # fewer families a fault at first, and fewer grades
    jobs: int  # worker processes at once
    timeout: float  # s, for one order
    json: Path | None  # where to copy audit.json
