"""What a run asks of each case: of one that asked something else no record and no verdict is taken up."""

from dataclasses import dataclass

from rayproof.reports.run.request import RunRequest


@dataclass(frozen=True, kw_only=True)
class Demands:
    """Whom a run puts to the test before whom, and what it keeps."""

    subject: str  # as the user named it
    identity: tuple[str, ...]  # of a program: its files, and what it says that it can
    references: tuple[str, ...]  # the panel, in its order
    require: tuple[str, ...]  # those that must answer
    full: bool  # every renderer's images are kept
    certified: bool  # verdicts are held against certified arithmetic


def demands(request: RunRequest, references: tuple[str, ...]) -> Demands:
    """Return what a run with this panel asks; how it goes about it (processes, time limits, folders) is none of it."""
    return Demands(
        subject=request.subject.title,
        identity=request.subject.identity,
        references=references,
        require=tuple(sorted(set(request.require))),
        full=request.full,
        certified=request.certified,
    )
