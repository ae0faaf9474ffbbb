"""Whole files or none: written beside their place under another name, then renamed into it."""

import os
import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

DRAFT = re.compile(r"\..*\.\d+(\.[^.]*)?")  # what `replacing` writes to


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Give a path to write to; it takes the place of `path` at the end, and vanishes if the body raises."""
    path.parent.mkdir(parents=True, exist_ok=True)
    # The process number keeps two writers of the same file apart; the suffix stays, since some writers read it.
    draft = path.with_name(f".{path.stem}.{os.getpid()}{path.suffix}")
    try:
        yield draft
        draft.replace(path)
    finally:
        draft.unlink(missing_ok=True)


def write_text(path: Path, text: str) -> Path:
    """Write `text` as UTF-8 with plain line feeds, whole or not at all, and return `path`."""
    with replacing(path) as draft:
        # Lone surrogates come in by undecodable file names; they cannot be written and must not stop a report.
        draft.write_bytes(text.encode("utf-8", errors="replace"))
    return path


def remove_drafts(folder: Path) -> None:
    """Remove what writers below `folder` that were killed had begun; nobody else may be writing there."""
    for path in folder.rglob(".*"):
        if DRAFT.fullmatch(path.name) and path.is_file():
            path.unlink(missing_ok=True)
