"""Every law says what it is, and holds for the oracle, which is right by other tests: a law that does not is wrong."""

from collections.abc import Iterator
from importlib import import_module
from inspect import isfunction, signature
from pkgutil import iter_modules

import pytest

from rayproof.cases import laws
from rayproof.cases.case import ITEMS
from rayproof.cases.families import select
from rayproof.cases.laws import LAWS
from rayproof.cases.laws.relations import Relation
from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage, StageImages
from rayproof.reference.analytic import Analytic
from rayproof.reports.judge.laws import judge
from rayproof.reports.judge.oracle import stages_of
from rayproof.reports.run.law_task import small

# Each holds shapes, lights and clipping that some law needs; between them every law has something to say.
CASES = ("random_scenes/seed_2", "sidedness/plane_from_below_two_sided")
ORACLE = Analytic()
KEPT: dict[Scene, StageImages] = {}


def ask(scene: Scene) -> StageImages:
    """Return the oracle's answers."""
    if scene not in KEPT:
        KEPT[scene] = ORACLE.render(scene, stages_of(scene))
    return KEPT[scene]


def relations(law: str) -> Iterator[Relation]:
    """Yield what the law says of the cases."""
    for case in select(CASES):
        yield from LAWS[law](small(case.scene), ask)


def test_every_law_on_a_page_is_in_the_table() -> None:
    pages = [import_module(f"{LAWS.package}.{page.name}") for page in iter_modules(laws.__path__)]
    written = {
        law for page in pages for law in vars(page).values() if isfunction(law) and law.__module__ == page.__name__
    }
    asking = {law.__name__ for law in written if [*signature(law).parameters] == ["scene", "ask"]}

    assert asking == {LAWS[name].__name__ for name in LAWS}


@pytest.mark.parametrize("law", LAWS)
def test_a_law_is_proved_and_says_whom_it_implicates(law: str) -> None:
    words, about = LAWS[law].__doc__ or "", LAWS.about(law)

    assert "Proof: " in words
    assert "Source: " in words
    assert isinstance(about["stage"], Stage)
    assert about["implicates"]
    assert set(about["implicates"]) <= set(ITEMS)


@pytest.mark.parametrize("law", LAWS)
def test_a_law_holds_for_the_oracle(law: str) -> None:
    found = [judge(relation, "float64") for relation in relations(law)]

    assert [one for one in found if one.alarm] == []
    assert any(one.examined for one in found)
