"""Atomic writing of files; JSON with inf and nan; text that is safe to display.

A file is written under a temporary name in its folder and then renamed. Numbers that JSON lacks are written as the
strings "inf", "-inf" and "nan", and converted back on reading.
"""

import json
import math
import os
import re
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any, Literal

import msgspec

SCHEMA: Literal[1] = 1  # the number of the schema of every JSON document that rayproof writes
DRAFT = re.compile(r"\..*\.\d+(\.[^.]*)?")  # the temporary names of `replacing`


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """Yield a temporary path to write to; it replaces `path` at the end, and is removed if the body raises."""
    path.parent.mkdir(parents=True, exist_ok=True)
    # The process number distinguishes two writers of the same file; the suffix is the same, since some writers read it.
    draft = path.with_name(f".{path.stem}.{os.getpid()}{path.suffix}")
    try:
        yield draft
        draft.replace(path)
    finally:
        draft.unlink(missing_ok=True)


def write_text(path: Path, text: str) -> Path:
    """Write `text` as UTF-8 with plain line feeds, atomically, and return `path`."""
    with replacing(path) as draft:
        # Lone surrogates come from undecodable file names; they have no encoding and must not stop a report.
        draft.write_bytes(text.encode("utf-8", errors="replace"))
    return path


def remove_drafts(folder: Path) -> None:
    """Remove the temporary files of killed writers below `folder`; no process may be writing there."""
    for path in folder.rglob(".*"):
        if DRAFT.fullmatch(path.name) and path.is_file():
            path.unlink(missing_ok=True)


def plain(value: Any) -> Any:
    """Return `value` with every non-finite number as a string, tuples as lists and keys as text."""
    if isinstance(value, Mapping):
        return {str(key): plain(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [plain(item) for item in value]
    if isinstance(value, float) and not math.isfinite(value):
        return str(float(value))
    return value


def as_json(value: Any, *, indent: int | None = None) -> str:
    """Return `plain(value)` as JSON, Structs as objects, on one line without blanks unless `indent` is set."""
    separators = (",", ":") if indent is None else None
    write = partial(json.dumps, allow_nan=False, indent=indent, separators=separators)
    try:
        return write(value, default=msgspec.to_builtins)
    except ValueError:
        # Only if there is a non-finite number: `plain` takes ten times as long as writing.
        return write(plain(value), default=lambda record: plain(msgspec.to_builtins(record)))


def encodable(text: str) -> str:
    """Return a text that UTF-8 can encode: lone surrogates, which come from undecodable file names, are replaced."""
    return text.encode("utf-8", errors="replace").decode("utf-8")


def legible(text: object) -> str:
    """Return a text on one line without characters that control a terminal, a log, a page or a browser.

    Line ends and other white space become blanks. Control and format characters, including bidirectional overrides,
    and unassigned code points become U+FFFD.
    """
    words = str(text)
    if words.isprintable():
        return words
    return "".join(c if c.isprintable() else " " if c.isspace() else "\N{REPLACEMENT CHARACTER}" for c in words)


def several(count: int, noun: str) -> str:
    """Return a count with its noun, such as "1 case" or "2 meshes"."""
    return f"{count} {noun}{'' if count == 1 else 'es' if noun.endswith(('h', 's')) else 's'}"


def legible_lines(text: object) -> str:
    """Return a text of several lines, each of them made `legible`."""
    words = str(text)
    return words if words.isprintable() else "\n".join(map(legible, words.split("\n")))


# JSON escapes of C0 except line ends and tabs, of C1, bidirectional marks and overrides, and line separators.
_OBEYED = re.compile(r"(\\\\)|\\u(?:00[01][0-9a-f]|007f|00[89][0-9a-f]|061c|200[ef]|202[89a-e]|206[6-9]|feff)|\\[bf]")


def legible_json(text: str) -> str:
    """Return ASCII JSON of `as_json` with U+FFFD in place of characters that control a terminal or a browser.

    Escaped line ends and tabs are preserved, since a text may have several lines.
    """
    # Most records have no escape at all; this test is a hundred times as fast as the pattern.
    return _OBEYED.sub(lambda match: match[1] or "\\ufffd", text) if "\\" in text else text


def number(value: Any) -> float | None:
    """Return a number, converted from "inf", "-inf" or "nan" if necessary; None if the value is no number."""
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        return None
    if isinstance(value, str) and value not in ("inf", "-inf", "nan"):
        return None
    try:
        return float(value)
    except OverflowError:  # JSON's integers are unbounded
        return -math.inf if str(value).startswith("-") else math.inf


def at_worst(value: float | str) -> float:
    """Return an error, which may be a string, as a float; NaN, the worst error, becomes inf."""
    as_float = float(value)
    return math.inf if math.isnan(as_float) else as_float
