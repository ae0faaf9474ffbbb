"""A fault is in force inside its block and nowhere after it."""

import sys
from typing import Any

import pytest

from rayproof.cases.scene import Scene, Square
from rayproof.reference.embree import facets
from rayproof.reports.audit.faults import FAULTS
from rayproof.reports.audit.faults.patching import altered, replaced
from rayproof.reports.results import outcomes
from tests.reports.judge.scenes import SCENE


def _state() -> dict[str, dict[str, int]]:
    """Return the identity of everything that the project's modules and their classes hold, by holder and name."""
    found: dict[str, dict[str, int]] = {}
    for module in list(sys.modules.values()):
        name = module.__name__
        if name.split(".", 1)[0] != "rayproof":
            continue
        found[name] = _identities(module)
        for value in list(vars(module).values()):
            if isinstance(value, type) and value.__module__ == name:
                found[f"{name}.{value.__qualname__}"] = _identities(value)
    return found


def _identities(holder: Any) -> dict[str, int]:
    return dict(zip(vars(holder), map(id, vars(holder).values()), strict=True))


@pytest.mark.parametrize("name", list(FAULTS))
def test_a_fault_changes_something_and_is_taken_out_again(name: str) -> None:
    before = _state()

    with FAULTS[name]():
        during = _state()

    assert during != before
    after = _state()
    assert all(held.items() <= after[holder].items() for holder, held in before.items())


def test_a_function_is_replaced_wherever_it_was_imported_to() -> None:
    from rayproof.reports.run.record import totals

    right = outcomes.worst

    def wrong(found: Any) -> Any:
        return right(found)

    with replaced(right, wrong):
        assert outcomes.worst is wrong
        assert totals.worst is wrong
    assert outcomes.worst is totals.worst is right


def test_what_was_kept_of_right_answers_is_forgotten_and_so_is_what_was_kept_of_wrong_ones() -> None:
    scene = Scene(camera=SCENE.camera, shapes=(Square(albedo=(0.5, 0.5, 0.5)),))

    def count() -> int:
        return len(facets.facets(scene).shape)

    assert count() == 2
    with altered(facets, "HALVES", facets.HALVES[:1]):
        assert count() == 1
    assert count() == 2


def test_a_fault_that_would_not_be_planted_is_told() -> None:
    with pytest.raises(LookupError, match="no module holds"), replaced(object(), None):
        pass


def test_a_fault_is_taken_out_even_if_what_it_spoils_raises() -> None:
    right = outcomes.ledger

    with pytest.raises(TypeError), altered(outcomes, "ledger", None):
        outcomes.ledger([], planned=0)

    assert outcomes.ledger is right
