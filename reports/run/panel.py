"""The panel of a run: which references are heard, and why others are not."""

from collections.abc import Sequence
from dataclasses import dataclass, field

from rayproof.reports.judge.oracle import ORACLE
from rayproof.reports.subjects import THE_TRACER, Subject
from rayproof.reports.subjects.choosing import reason_missing


@dataclass(frozen=True, kw_only=True)
class Panel:
    """The references of a run, the oracle first, and the reasons of those that are left out."""

    names: tuple[str, ...]
    absent: dict[str, str] = field(default_factory=dict)


def panel(require: Sequence[str], subject: Subject = THE_TRACER) -> Panel:
    """Return the references that judge `subject`: the usual ones and the required.

    A program that is not installed is left out, and so is whatever shares its code with the subject.

    Raises:
        LookupError: a required reference is not known, not installed, or the one under test.

    """
    from rayproof.reference import REFERENCES

    names, absent = [], {}
    for name in REFERENCES:
        about = REFERENCES.about(name)
        if about.get("on_request", False) and name not in require:
            continue
        why = reason_missing(name) if about.get("optional", False) else None
        if why is None and name == subject.name:
            why = "It is under test."
        if why is None and _kin(name, subject):
            why = f"It shares its code with {subject.name}, which is under test: its word would prove nothing."
        if why is None:
            names.append(name)
        elif name in require:
            raise LookupError(f"--require {name}: {why}")
        else:
            absent[name] = why
    for name in require:
        REFERENCES[name]  # an unknown one is explained here
    return Panel(names=tuple(sorted(names, key=lambda name: (name != ORACLE, name))), absent=absent)


def _kin(reference: str, subject: Subject) -> bool:
    """Say whether a reference lives in the same file or folder as the subject."""
    from rayproof.reference import REFERENCES

    if subject.name not in REFERENCES:
        return False
    one, other = (REFERENCES[name].__module__.split(".")[2] for name in (reference, subject.name))
    return one == other
