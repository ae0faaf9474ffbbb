"""What a folder declares is known before anything in it is imported, and is what importing registers."""

import importlib
import subprocess
import sys
from pathlib import Path
from textwrap import dedent

import pytest

from rayproof.cases.declarations import DeclaredRegistry
from rayproof.cases.stages import Stage

INIT = """
from rayproof.cases.declarations import DeclaredRegistry
THINGS = DeclaredRegistry("thing", package="{package}", name="THINGS")
"""


def thing(name: str, *, package: str, facts: str = "") -> str:
    return f"from {package} import THINGS\n\n@THINGS.register({name!r}{facts})\nclass Thing:\n    pass\n"


@pytest.fixture
def things(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> DeclaredRegistry[type]:
    """Return a registry of a package with one file, one folder, and one file that cannot be imported."""
    package = f"declared_{tmp_path.name.replace('-', '_')}"
    folder = tmp_path / package
    (folder / "deep").mkdir(parents=True)
    (folder / "__init__.py").write_text(INIT.format(package=package))
    (folder / "flat.py").write_text(thing("one", package=package, facts=", optional=True, weight=-2.5"))
    (folder / "deep" / "__init__.py").write_text(thing("two", package=package))
    (folder / "broken.py").write_text(thing("three", package=package) + "import nothing_is_called_so\n")
    (folder / "helper.py").write_text("raise RuntimeError('nobody asks for it')\n")
    monkeypatch.syspath_prepend(tmp_path)
    return __import__(package).THINGS


def imported(things: DeclaredRegistry[type]) -> set[str]:
    return {name.removeprefix(things.package) for name in sys.modules if name.startswith(f"{things.package}.")}


@pytest.mark.process
def test_names_and_facts_are_known_without_importing(things: DeclaredRegistry[type]) -> None:
    assert list(things) == ["one", "three", "two"]
    assert len(things) == 3
    assert "two" in things
    assert "four" not in things
    assert things.about("one") == {"optional": True, "weight": -2.5}
    assert things.about("two") == {}
    assert imported(things) == set()


def test_only_what_is_asked_for_is_imported(things: DeclaredRegistry[type]) -> None:
    assert things["two"].__module__ == f"{things.package}.deep"
    assert imported(things) == {".deep"}
    assert things["two"] is things["two"]


def test_what_cannot_be_imported_says_so_when_it_is_asked_for(things: DeclaredRegistry[type]) -> None:
    with pytest.raises(ImportError, match="nothing_is_called_so"):
        things["three"]


def test_an_unknown_name_is_told_what_is_known(things: DeclaredRegistry[type]) -> None:
    for ask in (things.__getitem__, things.about):
        with pytest.raises(LookupError, match="no thing is called 'four'; known: one, three, two"):
            ask("four")


def test_a_name_that_is_declared_twice_is_refused(things: DeclaredRegistry[type], tmp_path: Path) -> None:
    (tmp_path / things.package / "other.py").write_text(thing("one", package=things.package))

    for _ in range(2):
        with pytest.raises(ValueError, match="thing 'one' is registered twice"):
            list(things)


def test_what_registers_in_another_way_is_refused_and_not_overlooked(
    things: DeclaredRegistry[type], tmp_path: Path
) -> None:
    (tmp_path / things.package / "deep" / "below").mkdir()
    late = f"from {things.package} import THINGS\n\nTHINGS.register('late')(dict)\n"
    (tmp_path / things.package / "deep" / "below" / "late.py").write_text(late)

    with pytest.raises(ValueError, match=r"\.deep\.below\.late, line 3: THINGS\.register must decorate"):
        list(things)


def test_stages_are_read_too_and_any_other_fact_is_asked_of_its_module(
    things: DeclaredRegistry[type], tmp_path: Path
) -> None:
    facts = ", stage=Stage.RAY, also=(Stage.OBJECT, 2), when=len('four')"
    text = "from rayproof.cases.stages import Stage\n" + thing("new", package=things.package, facts=facts)
    (tmp_path / things.package / "other.py").write_text(text)
    about = things.about("new")

    assert (list(about), len(about)) == (["stage", "also", "when"], 3)
    assert (about["stage"], about["also"]) == (Stage.RAY, (Stage.OBJECT, 2))
    assert about.get("optional") is None
    assert imported(things) == set()
    assert about["when"] == 4
    assert imported(things) == {".other"}


def test_a_name_that_is_no_literal_is_refused(things: DeclaredRegistry[type], tmp_path: Path) -> None:
    text = thing("new", package=things.package).replace("'new'", "str(1)")
    (tmp_path / things.package / "other.py").write_text(text)

    with pytest.raises(ValueError, match="malformed node"):
        list(things)


@pytest.mark.process
@pytest.mark.parametrize("registry", ["rayproof.reference.REFERENCES"])
def test_what_is_declared_is_what_registers(registry: str) -> None:
    # In a process of its own: here another test may have imported them before they were declared.
    module, name = registry.rsplit(".", 1)
    script = f"""
        from {module} import {name}
        declared = {{name: {name}.about(name) for name in {name}}}
        {name}._about.clear()
        for name in declared:
            {name}[name]
        print({name}._about == {{name: dict(about) for name, about in declared.items()}}, len(declared))
    """
    told = subprocess.run([sys.executable, "-c", dedent(script)], capture_output=True, text=True, check=True).stdout

    assert told.split() == ["True", str(len(getattr(importlib.import_module(module), name)))]


@pytest.mark.process
def test_a_process_that_asks_the_oracle_imports_no_other_reference() -> None:
    script = """
        import sys
        from rayproof.reference import REFERENCES
        REFERENCES["analytic"]
        print(*sorted({name.split(".")[2] for name in sys.modules if name.startswith("rayproof.reference.")}))
        print(*(name for name in ("drjit", "flint", "mitsuba", "trimesh") if name in sys.modules))
    """
    told = subprocess.run([sys.executable, "-c", dedent(script)], capture_output=True, text=True, check=True).stdout

    assert told.splitlines() == ["analytic", ""]


@pytest.mark.process
def test_what_formulas_there_are_is_known_without_dr_jit() -> None:
    script = """
        import sys
        from rayproof.tracer.configuration import Configuration
        print(*Configuration.parse("float32/lambert=fault_squared").faults)
        print("drjit" in sys.modules)
    """
    told = subprocess.run([sys.executable, "-c", dedent(script)], capture_output=True, text=True, check=True).stdout

    assert told.splitlines() == ["lambert/fault_squared", "False"]
