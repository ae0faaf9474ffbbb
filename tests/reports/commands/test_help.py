"""`--help`: its examples are commands, its patterns name cases; `rayproof list terms`: every term of the page."""

import re
import shlex
from fnmatch import fnmatchcase

import pytest

from rayproof import ROOT
from rayproof.cases.families import select
from rayproof.reports.cli import application
from rayproof.reports.commands.list import ENTRY, TERMS
from rayproof.reports.results.outcomes import Outcome
from rayproof.tracer.formulas import FORMULAS
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
    refused = rayproof("list", "terms", "shadw ray")
    assert (refused.code, refused.error) == (2, "rayproof: no term is called 'shadw ray'; did you mean shadow ray?\n")


def test_every_verdict_that_is_no_pass_or_plain_failure_is_explained() -> None:
    text = TERMS.read_text(encoding="utf-8")

    assert [outcome.value for outcome in Outcome if outcome.value.replace("_", " ") not in text] == []


HELP = "".join(file.read_text() for file in sorted((ROOT / "reports" / "commands").glob("*.py")))


@pytest.mark.parametrize("line", re.findall("For example: rayproof (.*)", HELP))
def test_an_example_of_help_is_a_command(line: str) -> None:
    application().parse_args(shlex.split(line), exit_on_error=False, print_error=False)


@pytest.mark.parametrize("pattern", sorted({*re.findall(r"[`\" ](\w+/\*)(?=[`\" ,])", HELP)}))
def test_a_pattern_of_help_names_something(pattern: str) -> None:
    if pattern.partition("/")[0] in FORMULAS.slots:
        assert any(fnmatchcase(name, pattern) for name in FORMULAS)
    else:
        assert select([pattern])
