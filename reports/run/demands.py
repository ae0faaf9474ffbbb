"""What a run asks of each case: of one that asked something else no record and no verdict is taken up."""

from dataclasses import dataclass

from rayproof.reports.run.kept_images import KeptImages
from rayproof.reports.run.request import RunRequest
from rayproof.tracer.formulas.own_file import is_own


@dataclass(frozen=True, kw_only=True)
class Demands:
    """Whom a run puts to the test before whom, and what it keeps."""

    subject: str  # as the user named it
    identity: tuple[str, ...]  # of a program: its files, and what it says that it can
    references: tuple[str, ...]  # the panel, in its order
    require: tuple[str, ...]  # those that must answer
    images: KeptImages  # of which cases they are kept
    own: tuple[str, ...]  # the user's own formulas in use, each with the SHA-256 of its file


def demands(request: RunRequest, references: tuple[str, ...]) -> Demands:
    """Return what a run with this panel asks; how it goes about it (processes, time limits, folders) is none of it."""
    return Demands(
        subject=request.subject.title,
        identity=request.subject.identity,
        references=references,
        require=tuple(sorted(set(request.require))),
        images=request.images,
        own=_own(request.configurations),
    )


def _own(configurations: tuple[str, ...]) -> tuple[str, ...]:
    if not any(is_own(name) for name in configurations):
        return ()
    from rayproof.tracer.configuration import Configuration

    found = {place: digest for name in configurations for place, digest in Configuration.parse(name).own.items()}
    return tuple(f"{place} {digest}" for place, digest in sorted(found.items()))
