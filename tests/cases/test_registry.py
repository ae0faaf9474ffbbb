"""Registries: a name is found without its siblings, a list asks every module, a broken one stops it."""

import sys
from pathlib import Path

import pytest

from cases.registry import Registry

REGISTERING = "from shelf import THINGS\n\nTHINGS.register({name!r})({name!r})\n"


@pytest.fixture
def things(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Registry[str]:
    """Return the registry of a package with three modules, of which `broken` cannot be imported."""
    folder = tmp_path / "shelf"
    (folder / "nested").mkdir(parents=True)
    (folder / "__init__.py").write_text(
        "from cases.registry import Registry\n\nTHINGS = Registry('thing', package='shelf')\n"
    )
    (folder / "broken.py").write_text("raise RuntimeError('it is broken')\n")
    (folder / "plain.py").write_text(REGISTERING.format(name="plain"))
    (folder / "nested" / "__init__.py").write_text("")
    (folder / "nested" / "inner.py").write_text(REGISTERING.format(name="nest_egg"))
    monkeypatch.syspath_prepend(str(tmp_path))
    for name in [name for name in sys.modules if name.split(".")[0] == "shelf"]:
        monkeypatch.delitem(sys.modules, name)
    import shelf  # type: ignore[import-not-found]

    return shelf.THINGS


@pytest.mark.parametrize("name", ["plain", "nest_egg"])
def test_a_name_is_found_without_the_modules_that_are_called_otherwise(things, name):
    assert things[name] == name
    assert name in things
    assert things.about(name) == {}
    assert "shelf.broken" not in sys.modules


@pytest.mark.parametrize("asked", [list, len, lambda things: things["unknown"], lambda things: "unknown" in things])
def test_whoever_needs_all_modules_hears_of_one_that_is_broken(things, asked):
    with pytest.raises(RuntimeError, match="it is broken"):
        asked(things)


def test_an_unknown_name_is_answered_with_those_that_are_known(things, tmp_path):
    (tmp_path / "shelf" / "broken.py").write_text("")

    assert list(things) == ["nest_egg", "plain"]
    with pytest.raises(LookupError, match="no thing is called 'unknown'; known: nest_egg, plain"):
        things["unknown"]
