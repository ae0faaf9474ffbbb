"""Data as JSON holds it: numbers that it lacks are the strings "inf", "-inf" and "nan", and are read back from them."""

import json
import math
from collections.abc import Mapping
from typing import Any


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
    """Return `plain(value)` as JSON, on one line without blanks unless it is to be indented."""
    separators = (",", ":") if indent is None else None
    try:
        return json.dumps(value, allow_nan=False, indent=indent, separators=separators)
    except ValueError:
        # Only where there is such a number: looking for it in Python takes ten times as long as writing.
        return json.dumps(plain(value), allow_nan=False, indent=indent, separators=separators)


def encodable(text: str) -> str:
    """Return a text as it can be written in UTF-8: without the lone surrogates that undecodable file names bring."""
    return text.encode("utf-8", errors="replace").decode("utf-8")


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
