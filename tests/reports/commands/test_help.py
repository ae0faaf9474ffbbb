"""`rayproof list terms`: every term that the page has, and none that it has not."""

import pytest

from rayproof.reports.commands.list import ENTRY, TERMS
from rayproof.reports.results.outcomes import Outcome
from tests.reports.commands.conftest import Rayproof, rayproof

__all__ = ["rayproof"]

WORDS = [name for name, _ in ENTRY.findall(TERMS.read_text(encoding="utf-8"))]


def test_every_entry_of_the_page_is_a_term_and_says_something() -> None:
    assert TERMS.read_text(encoding="utf-8").count("\n**") == len(WORDS) == len(set(WORDS))


@pytest.mark.parametrize("word", ["end to end", "end-to-end", "K u", "reference_suspect"])
def test_a_term_is_told_in_one_line(rayproof: Rayproof, word: str) -> None:
    told = rayproof("list", "terms", *word.split())

    assert (told.code, told.error) == (0, "")
    assert told.out.count("\n") == 1
    assert told.out.partition(": ")[0] in WORDS


def test_all_are_listed_and_an_unknown_one_is_refused_with_one_that_is_near(rayproof: Rayproof) -> None:
    assert rayproof("list", "terms").out.strip().split(", ") == WORDS
    refused = rayproof("list", "terms", "shadw", "ray")
    assert (refused.code, refused.error) == (2, "rayproof: no term is called 'shadw ray'; did you mean shadow ray?\n")


def test_every_verdict_that_is_no_pass_or_plain_failure_is_explained() -> None:
    text = TERMS.read_text(encoding="utf-8")

    assert [outcome.value for outcome in Outcome if outcome.value.replace("_", " ") not in text] == []
