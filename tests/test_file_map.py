"""The map of all product files says what their docstrings say."""

import re
from collections import Counter

from tests.file_map import CHECKOUT, PACKAGES, first_sentence, table

FILES = [file for package in PACKAGES for file in sorted((CHECKOUT / package).rglob("*.py"))]


def test_the_map_in_the_documents_is_up_to_date() -> None:
    text = (CHECKOUT / "docs" / "files.md").read_text(encoding="utf-8")
    (written,) = re.findall(r"tests\.file_map -->\n\n(.*?)\n<!-- end -->", text, re.DOTALL)

    assert written == table(), "write it anew: .venv/bin/python -m tests.file_map"


def test_every_product_file_has_a_row() -> None:
    headings = [row for row in table().splitlines() if row.startswith("| **")]
    rows = [row for row in table().splitlines() if row.startswith("| `")]
    without_heading = {file.parent for file in FILES} - {file.parent for file in FILES if file.name == "__init__.py"}

    assert len(headings) + len(rows) == len(FILES) + len(without_heading)


def test_each_docstring_says_in_a_sentence_of_its_own_what_stands_in_its_file() -> None:
    sentences = Counter(first_sentence(file) for file in FILES)

    assert [sentence for sentence, count in sentences.items() if count > 1 or len(sentence.split()) < 3] == []
