"""One place inside a scene file: a value that knows its path and refuses in one line what should not be there."""

import json
import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from difflib import get_close_matches
from typing import Any, NoReturn

import numpy as np

from rayproof.cases.scene import Matrix, SceneError, Vector

LONGEST = 60  # characters of a hostile value that a message repeats


def shown(value: Any, longest: int = LONGEST) -> str:
    """Return `value` as JSON on one line: control characters escaped, beyond `longest` characters shortened."""
    try:
        text = json.dumps(value, ensure_ascii=True)
    except (TypeError, ValueError, RecursionError):
        text = ascii(value)
    return text if len(text) <= longest else f"{text[: longest - 3]}..."


class Repeated(dict[str, Any]):
    """A JSON object that named a key twice; `key` is the first such."""

    def __init__(self, members: dict[str, Any], key: str) -> None:
        super().__init__(members)
        self.key = key


def object_from(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """Return a JSON object from its pairs, as `object_pairs_hook` of `json.loads`; repeated keys are remembered."""
    members = dict(pairs)
    if len(members) == len(pairs):
        return members
    keys = [key for key, _ in pairs]
    return Repeated(members, next(key for place, key in enumerate(keys) if key in keys[:place]))


@dataclass(frozen=True, kw_only=True)
class Field:
    """A value of a scene file with its path, such as `shapes[2].radius`, and the file's name. Every reader refuses."""

    value: Any
    path: str
    where: str

    def refuse(self, problem: str) -> NoReturn:
        """Raise SceneError that names file, field and problem in one line."""
        raise SceneError(f"{self.where}: {self.path or 'scene'} {problem}")

    def expected(self, what: str) -> NoReturn:
        """Raise SceneError that names file, field, what it must be and what it is."""
        self.refuse(f"must be {what}, got {shown(self.value)}")

    def members(self, required: Sequence[str], optional: Sequence[str] = ()) -> dict[str, "Field"]:
        """Return an object's members by key; refuse unknown, repeated and missing keys."""
        if not isinstance(self.value, dict):
            self.expected("an object")
        if isinstance(self.value, Repeated):
            self.refuse(f"names the key {shown(self.value.key)} twice")
        for key in self.value:
            if key not in required and key not in optional:
                near = get_close_matches(str(key), [*required, *optional], n=1)
                hint = f"did you mean {near[0]}?" if near else f"known: {', '.join((*required, *optional))}"
                self.refuse(f"has an unknown key {shown(key)}; {hint}")
        for key in required:
            if key not in self.value:
                self.refuse(f"lacks the key {shown(key)}")
        prefix = f"{self.path}." if self.path else ""
        return {key: Field(value=self.value[key], path=f"{prefix}{key}", where=self.where) for key in self.value}

    def items(self) -> Iterator["Field"]:
        """Yield an array's items."""
        if not isinstance(self.value, list):
            self.expected("an array")
        for index, item in enumerate(self.value):
            yield Field(value=item, path=f"{self.path}[{index}]", where=self.where)

    def number(self) -> float:
        """Return a finite number; JSON's true and false are none."""
        if isinstance(self.value, bool) or not isinstance(self.value, (int, float)):
            self.expected("a number")
        try:
            number = float(self.value)
        except OverflowError:
            number = math.inf
        if not math.isfinite(number):
            self.expected("a finite number")
        return number

    def whole(self) -> int:
        """Return a whole number; 64.0 is one, as in JSON Schema."""
        number = self.number()
        if not number.is_integer():
            self.expected("a whole number")
        return int(self.value)

    def flag(self) -> bool:
        """Return true or false."""
        if not isinstance(self.value, bool):
            self.expected("true or false")
        return self.value

    def text(self) -> str:
        """Return a string."""
        if not isinstance(self.value, str):
            self.expected("a string")
        return self.value

    def choice(self, known: Sequence[str]) -> Any:
        """Return one of the `known` strings."""
        if not isinstance(self.value, str) or self.value not in known:
            self.expected(f"one of {', '.join(known)}")
        return self.value

    def exactly(self, count: int) -> list["Field"]:
        """Return the items of an array that must have `count` of them."""
        items = list(self.items())
        if len(items) != count:
            self.expected(f"an array of {count}, not of {len(items)}")
        return items

    def vector(self) -> Vector:
        """Return three finite numbers."""
        x, y, z = (item.number() for item in self.exactly(3))
        return (x, y, z)

    def matrix(self) -> Matrix:
        """Return four rows of four finite numbers."""
        rows = []
        for row in self.exactly(4):
            x, y, z, w = (item.number() for item in row.exactly(4))
            rows.append((x, y, z, w))
        first, second, third, last = rows
        return (first, second, third, last)

    def triples(self, *, whole: bool) -> np.ndarray:
        """Return an array of at least one triple of numbers, shape (n, 3), as float64 or int64."""
        rows = [
            [item.whole() if whole else item.number() for item in row.exactly(3)]
            for row in self.items()
        ]  # fmt: skip
        if not rows:
            self.expected("an array of at least one triple")
        try:
            return np.array(rows, dtype=np.int64 if whole else np.float64)
        except OverflowError:
            self.refuse("holds a whole number beyond 64 bits")
