"""audit.json in a results folder: the score on the report's front page, and the kill matrix below it."""

import json
from pathlib import Path
from typing import Any, TypedDict, TypeGuard

from rayproof.reports.results.audit_records import AuditRecord, FaultFinding, LiarFinding

NAME = "audit.json"
NEEDED = ("planted", "killed", "equivalent", "blamed_right", "false_alarms", "faults")


class AuditFront(TypedDict):
    """What the page shows of an audit."""

    sentence: str
    good: bool
    problems: list[str]
    families: list[str]
    references: list[str]
    smallest: dict[str, dict[str, dict[str, float]]]  # quantity -> precision -> stage -> relative error
    faults: list[FaultFinding]


def load_audit(folder: Path) -> AuditRecord | None:
    """Return the contents of `folder`/audit.json, or None where there is none that can be read."""
    try:
        found = json.loads((folder / NAME).read_text(encoding="utf-8"))
    except (OSError, ValueError):
        return None
    return found if _is_audit(found) else None


def _is_audit(found: Any) -> TypeGuard[AuditRecord]:
    """Return whether a file's content is an audit, as far as its score is told."""
    return isinstance(found, dict) and all(key in found for key in NEEDED) and isinstance(found["faults"], list)


def sentence(audit: AuditRecord) -> str:
    """Return the score in one line."""
    wanted = number(audit["planted"]) - number(audit["equivalent"])
    return (
        f"Audit: {number(audit['killed'])} of {wanted} planted faults killed, {number(audit['blamed_right'])} of them "
        f"blamed right, {number(audit['false_alarms'])} false alarms; {number(audit['equivalent'])} more are provably "
        "equivalent." + _items(audit) + _liar(audit.get("liar"))
    )


def _items(audit: AuditRecord) -> str:
    """Return how often the right item of the specification was blamed, as a sentence; nothing of an older audit."""
    declared = number(audit.get("items_declared"))
    return (
        f" Of {declared} that spoil an item, {number(audit.get('items_right'))} are blamed on it."
        if declared > 0
        else ""
    )


def _liar(liar: LiarFinding | None) -> str:
    """Return what a liar could hide, as a sentence; nothing where none was let loose."""
    if not isinstance(liar, dict) or number(liar.get("pixels")) <= 0:
        return ""
    unseen, pixels = number(liar.get("spoiled_unseen")), number(liar["pixels"])
    hidden = ", ".join(
        f"{number(liar.get(f'spoiled_{kind}'))} {words}"
        for kind, words in (("interval", "in intervals"), ("wide", "in wide limits"), ("epsilon", "behind an epsilon"))
    )
    return f" A liar can spoil {unseen} of {pixels} pixels x stages unseen ({unseen / pixels:.2%}); {hidden}."


def number(value: Any) -> int:
    """Return a count of audit.json; -1 for anything that is none."""
    return value if isinstance(value, int) and not isinstance(value, bool) else -1


def front(audit: AuditRecord | None) -> AuditFront | None:
    """Return what the page shows of an audit: score, problems, matrix and the smallest errors detected."""
    if audit is None:
        return None
    faults = [fault for fault in audit["faults"] if isinstance(fault, dict)]
    return {
        "sentence": sentence(audit),
        "good": audit.get("good") is True,
        "problems": audit.get("problems", []),
        "families": sorted({family for fault in faults for family in fault.get("families", {})}),
        "references": list(dict.fromkeys(name for fault in faults for name in fault.get("references", {}))),
        "smallest": audit.get("smallest_detected", {}),
        "faults": faults,
    }
