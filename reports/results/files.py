"""Files written whole or not at all; JSON with inf and nan.

A file is written beside its place under another name, then renamed into it. The numbers that JSON lacks are the strings
"inf", "-inf" and "nan", and are read back from them.
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
    """Return `plain(value)` as JSON, Structs as objects, on one line without blanks unless it is to be indented."""
    separators = (",", ":") if indent is None else None
    write = partial(json.dumps, allow_nan=False, indent=indent, separators=separators)
    try:
        return write(value, default=msgspec.to_builtins)
    except ValueError:
        # Only where there is such a number: looking for it in Python takes ten times as long as writing.
        return write(plain(value), default=lambda record: plain(msgspec.to_builtins(record)))


def encodable(text: str) -> str:
    """Return a text as it can be written in UTF-8: without the lone surrogates that undecodable file names bring."""
    return text.encode("utf-8", errors="replace").decode("utf-8")


def legible(text: object) -> str:
    """Return a text on one line without anything that a terminal, a log, a page or a browser would obey.

    Line ends and other white space become blanks; control and format characters, text reversed by bidirectional
    overrides among them, and what has no character at all become U+FFFD.
    """
    words = str(text)
    if words.isprintable():
        return words
    return "".join(c if c.isprintable() else " " if c.isspace() else "\N{REPLACEMENT CHARACTER}" for c in words)


def several(count: int, noun: str) -> str:
    """Return how many there are of a thing, such as "1 case" or "2 meshes"."""
    return f"{count} {noun}{'' if count == 1 else 'es' if noun.endswith(('h', 's')) else 's'}"


def legible_lines(text: object) -> str:
    """Return a text of several lines with each of them `legible`."""
    words = str(text)
    return words if words.isprintable() else "\n".join(map(legible, words.split("\n")))


# As JSON escapes them: C0 but for line ends and tabs, C1, bidirectional marks and overrides, separators of lines.
_OBEYED = re.compile(r"(\\\\)|\\u(?:00[01][0-9a-f]|007f|00[89][0-9a-f]|061c|200[ef]|202[89a-e]|206[6-9]|feff)|\\[bf]")


def legible_json(text: str) -> str:
    """Return JSON of ASCII characters, as `as_json` writes it, with U+FFFD for what a terminal or browser would obey.

    Line ends and tabs stay as they are escaped: a text may have lines.
    """
    # Most records have no escape at all, which is seen a hundred times sooner than the pattern goes through them.
    return _OBEYED.sub(lambda match: match[1] or "\\ufffd", text) if "\\" in text else text


def number(value: Any) -> float | None:
    """Return a number, also where it is "inf", "-inf" or "nan"; None where there is none."""
    if isinstance(value, bool) or not isinstance(value, int | float | str):
        return None
    if isinstance(value, str) and value not in ("inf", "-inf", "nan"):
        return None
    try:
        return float(value)
    except OverflowError:  # JSON's whole numbers have no end
        return -math.inf if str(value).startswith("-") else math.inf


def at_worst(value: float | str) -> float:
    """Return an error that may be written as a string; NaN, than which nothing is worse, as inf."""
    as_float = float(value)
    return math.inf if math.isnan(as_float) else as_float
