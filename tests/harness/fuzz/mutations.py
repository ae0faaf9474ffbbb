"""Files broken on purpose: bytes changed anywhere, words of a text replaced, members of JSON made into others."""

import copy
import json
import random
import re
from collections.abc import Callable
from typing import Any

WORDS: tuple[bytes, ...] = (
    b"",
    b"0",
    b"-1",
    b"1e400",
    b"-1e308",
    b"nan",
    b"inf",
    b"9" * 30,
    b"4294967296",
    b"2147483648",
    b"1e-320",
    b"0x10",
    b"\0",
    b"\xff\xfe",
    b"\xe2\x80\xae",
    b"\x1b[31m",
    b"\n::error::x\n",
    b"../../etc/passwd",
    b"/etc/passwd",
    b"a" * 5000,
)
VALUES: tuple[Any, ...] = (
    None,
    True,
    False,
    0,
    -1,
    1,
    2**31,
    2**64,
    10**400,
    1e308,
    -1e-320,
    0.5,
    "",
    "nan",
    "inf",
    "\x1b[31m\u202e\n::error::x",
    "../../etc/passwd",
    "a" * 5000,
    "\ud800",
    [],
    {},
    [[]],
    [None],
    {"": None},
    [0, 0, 0],
    [1, 2],
)
TOKEN = re.compile(rb"[-+\w.]+")
MOST_CHANGES = 4


def mutated(seed: bytes, chance: random.Random) -> bytes:
    """Return a seed with one to four changes; half of those of JSON are changes of its members."""
    document = _document(seed) if chance.random() < 0.6 else None
    if document is not None:
        for _ in range(chance.randint(1, MOST_CHANGES)):
            document = _changed(document, chance)
        return json.dumps(document).encode("utf-8", errors="surrogatepass")
    content = seed
    for _ in range(chance.randint(1, MOST_CHANGES)):
        content = chance.choice(CHANGES)(content, chance)
    return content


def _document(seed: bytes) -> Any:
    try:
        return json.loads(seed)
    except (ValueError, RecursionError):
        return None


def _changed(document: Any, chance: random.Random) -> Any:
    """Return JSON with one place of it replaced, removed, doubled, or moved to where another one is."""
    places = list(_places(document, ()))
    if not places:
        return copy.deepcopy(chance.choice(VALUES))
    changed = copy.deepcopy(document)
    *way, last = chance.choice(places)
    holder = _at(changed, way)
    act = chance.randrange(5)
    if act == 0:
        del holder[last]
    elif act == 1:
        holder[last] = copy.deepcopy(_at(document, chance.choice(places)))
    elif act == 2 and isinstance(holder, list):
        holder.insert(last, copy.deepcopy(holder[last]))
    elif act == 3:
        holder[last] = [holder[last]] * chance.choice((1, 2, 1000))
    else:
        holder[last] = copy.deepcopy(chance.choice(VALUES))
    return changed


def _places(document: Any, way: tuple[Any, ...]) -> Any:
    keys = document if isinstance(document, dict) else range(len(document)) if isinstance(document, list) else ()
    for key in keys:
        yield (*way, key)
        yield from _places(document[key], (*way, key))


def _at(document: Any, way: Any) -> Any:
    for key in way:
        document = document[key]
    return document


def _flip(content: bytes, chance: random.Random) -> bytes:
    if not content:
        return b"\0"
    changed = bytearray(content)
    changed[chance.randrange(len(changed))] ^= 1 << chance.randrange(8)
    return bytes(changed)


def _cut(content: bytes, chance: random.Random) -> bytes:
    return content[: chance.randrange(len(content) + 1)]


def _drop(content: bytes, chance: random.Random) -> bytes:
    start = chance.randrange(len(content) + 1)
    return content[:start] + content[start + chance.randint(1, 40) :]


def _double(content: bytes, chance: random.Random) -> bytes:
    start = chance.randrange(len(content) + 1)
    return (
        content[:start] + content[start : start + chance.randint(1, 200)] * chance.choice((2, 3, 100)) + content[start:]
    )


def _insert(content: bytes, chance: random.Random) -> bytes:
    start = chance.randrange(len(content) + 1)
    return content[:start] + chance.choice(WORDS) + content[start:]


def _word(content: bytes, chance: random.Random) -> bytes:
    words = list(TOKEN.finditer(content))
    if not words:
        return _insert(content, chance)
    word = chance.choice(words)
    return content[: word.start()] + chance.choice((*WORDS, chance.choice(words)[0])) + content[word.end() :]


def _number(content: bytes, chance: random.Random) -> bytes:
    """Overwrite four bytes by a whole number that is a limit somewhere."""
    if len(content) < 4:
        return content
    start = chance.randrange(len(content) - 3)
    value = chance.choice((0, 1, 2**31 - 1, 2**31, 2**32 - 1, 2**16, 0x7F800000, 0x7FC00000))
    return content[:start] + value.to_bytes(4, "little") + content[start + 4 :]


CHANGES: tuple[Callable[[bytes, random.Random], bytes], ...] = (
    _flip,
    _cut,
    _drop,
    _double,
    _insert,
    _word,
    _word,
    _number,
)
