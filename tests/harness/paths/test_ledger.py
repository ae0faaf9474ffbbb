"""No cell of the ledger is empty, and a path that no case meets is a hole."""

# pyright: reportArgumentType=false
# Records are incomplete on purpose.

from rayproof.cases.families import all_cases, select
from tests.command_line import Command
from tests.harness.paths import ledger
from tests.harness.paths.__main__ import paths


def test_every_path_is_executed_and_compared(command: Command) -> None:
    ended = command(paths)

    assert (ended.code, "0 empty cells" in ended.out) == (0, True)
    elsewhere = [entry for entry in ledger.ledger(all_cases())["paths"] if not entry["here"]]
    assert elsewhere
    assert all(entry["name"].startswith("backend/") and not entry["executed"] for entry in elsewhere)


def test_a_path_that_no_case_meets_is_a_hole() -> None:
    few = ledger.ledger(select(["primitives/sphere"]))

    assert "trees/cubes: executed" in few["empty"]
    assert "trees/cubes: compared" in few["empty"]
    assert not [hole for hole in few["empty"] if hole.startswith("route/stages")]


def test_the_worst_of_a_comparison_stands_beside_the_paths_that_it_took() -> None:
    cases = select(["faces/nine"])
    compared = [{"case": "faces/nine", "path": "frames", "worst": 0.5, "verdict": "pass"}]

    found = ledger.ledger(cases, compared=compared)

    by_name = {entry["name"]: entry for entry in found["paths"]}
    assert [one["worst"] for one in by_name["route/frames"]["compared"]] == [0.5]
    assert by_name["route/numbers"]["compared"][0]["worst"] is None
