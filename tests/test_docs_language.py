"""The documents avoid words that only this project would use, and pages begin with their subject.

Only patterns that are always wrong are listed, so that no sentence has to dodge the test. It replaces a limit on the
number of words, which had made sentences shorter and harder; no other test reads the language of the documents.
"""

import re
from pathlib import Path

import pytest

CHECKOUT = Path(__file__).parents[1]
PAGES = sorted([*CHECKOUT.glob("*.md"), *(CHECKOUT / "docs").glob("*.md"), CHECKOUT / "reports" / "terms.md"])
AVOIDED = {
    r"^This (page|document|tutorial) ": "begin with what the thing is or does",
    r"(?<!light )\bfeelers?\b": "shadow ray",
    r"\brungs?\b": "step of a ladder",
    r"\b(brims?|skimming|whirls?|swings?)\b": "the name of the quantity",
    r"\b(voices?|shouts?)\b": "vote, warning",
    r"\b(accus\w+|guilty|innocent|acquit\w*)\b": "failed, wrong, right",
    r"\bwitness(es|ed)?\b": "reference",
    r"\bsides with\b": "agrees with",
    r"\bheld against\b": "compared with",
    r"\b(of|by|to|for) whom\b": "name the person or the program",
    r"\bradiance alone\b": "only radiance",
}


def prose(text: str) -> str:
    """Return a page without fenced and indented blocks and without words in backticks; lines keep their numbers."""
    text = re.sub(r"^```.*?^```", lambda block: "\n" * block.group().count("\n"), text, flags=re.M | re.S)
    return re.sub(r"`[^`\n]*`", "", re.sub(r"^    .*", "", text, flags=re.M))


def avoided(text: str) -> list[str]:
    """Return a message for each avoided word, with its line and the word to use."""
    return [
        f"line {number}: {match.group()!r}: {instead}"
        for number, line in enumerate(prose(text).splitlines(), 1)
        for pattern, instead in AVOIDED.items()
        for match in re.finditer(pattern, line, re.IGNORECASE)
    ]


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_a_page_avoids_private_words(page: Path) -> None:
    assert avoided(page.read_text(encoding="utf-8")) == []


def test_an_avoided_word_is_reported_with_its_line_unless_it_is_code() -> None:
    page = (
        "# Title\n\nThis page lists feelers.\n\n    feeler\n\n`feeler` and the light feeler\n```\nvoices\n```\nvoices\n"
    )

    assert [message.split(":")[0] for message in avoided(page)] == ["line 3", "line 3", "line 11"]
