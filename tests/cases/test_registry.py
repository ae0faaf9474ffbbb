"""A table knows its names and facts before anything in it is imported, and imports what is asked for alone."""

import sys
from pathlib import Path

import pytest

from rayproof.cases.registry import Entry, Place, Table


@pytest.fixture
def things(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Table[type]:
    """Return a table of a package with one file, one folder, and one file that cannot be imported."""
    package = f"listed_{tmp_path.name.replace('-', '_')}"
    folder = tmp_path / package
    (folder / "deep").mkdir(parents=True)
    (folder / "__init__.py").touch()
    (folder / "flat.py").write_text("class Flat:\n    pass\n\nLENGTH = 4\n")
    (folder / "deep" / "__init__.py").write_text("class Deep:\n    pass\n")
    (folder / "broken.py").write_text("import nothing_is_called_so\n")
    monkeypatch.syspath_prepend(tmp_path)
    entries = {
        "flat": Entry("flat:Flat", weight=-2.5, length=Place("flat:LENGTH")),
        "deep": Entry("deep:Deep"),
        "broken": Entry("broken:Broken", optional=True),
        "absent": Entry("flat:Absent"),
    }
    return Table("thing", package=package, entries=entries)


def imported(things: Table[type]) -> set[str]:
    return {name.removeprefix(things.package) for name in sys.modules if name.startswith(f"{things.package}.")}


def test_names_and_facts_are_known_without_importing(things: Table[type]) -> None:
    assert list(things) == ["absent", "broken", "deep", "flat"]
    assert len(things) == 4
    assert "deep" in things
    assert "other" not in things
    assert things.about("broken") == {"optional": True}
    assert list(things.about("flat")) == ["weight", "length"]
    assert things.module("deep") == f"{things.package}.deep"
    assert imported(things) == set()


def test_only_what_is_asked_for_is_imported(things: Table[type]) -> None:
    assert things["deep"] is things["deep"]
    assert imported(things) == {".deep"}
    assert things.about("flat")["length"] == 4
    assert imported(things) == {".deep", ".flat"}


def test_a_thing_that_is_not_where_the_table_says_is_an_error(things: Table[type]) -> None:
    with pytest.raises(ImportError, match="nothing_is_called_so"):
        things["broken"]
    with pytest.raises(LookupError, match=r"\.flat has no 'Absent'"):
        things["absent"]


def test_an_unknown_name_is_answered_with_the_known_ones(things: Table[type]) -> None:
    for ask in (things.__getitem__, things.about, things.module):
        with pytest.raises(LookupError, match="no thing is called 'other'; known: absent, broken, deep, flat"):
            ask("other")
