"""A formula of one's own beside the default of its slot: a line for each ladder, and the ladders that differ most."""

from pathlib import Path
from typing import Any, cast

import pytest

from rayproof.cases.ladders import all_ladders
from rayproof.reports.studies.stability.beside_default import beside_rows, own_alone, signs_of
from rayproof.reports.studies.stability.figures import most_different
from rayproof.tracer.formulas import FORMULAS
from tests.reports.commands.conftest import Rayproof

DEFAULT = FORMULAS.variants("sphere")[0].name
OWN = "sphere=./mine.py:hit"
MINE = """
import drjit as dr

def hit(ray, sphere, interval):
    f = ray.origin - sphere.center
    a, h = dr.squared_norm(ray.direction), -dr.dot(f, ray.direction)
    quarter = h * h - a * (dr.squared_norm(f) - dr.square(sphere.radius))
    root = dr.sqrt(dr.select(quarter >= 0, quarter, 0))
    return dr.select(quarter >= 0, interval.smallest((h - root) / a, (h + root) / a), dr.inf)
"""


def climb(
    formula: str, *, ladder: str = "A", breakpoint: float | None = 3.0, wrong: int = 0, error: float = 1.0
) -> Any:
    """Return the record of a climb of three values."""
    rungs = [{"value": value, "rays": 100, "median": error, "false_hits": 0} for value in (1.0, 2.0, 3.0)]
    return {
        "ladder": ladder, "formula": formula, "precision": "float32", "breakpoint": breakpoint, "false_hits": wrong,
        "false_misses": 0, "invalid": 0, "rays": 300, "worst_error_over_Ku": error, "values": rungs,
    }  # fmt: skip


@pytest.mark.parametrize(
    ("own", "signs", "word"),
    [
        ({}, (0, 0, 0), "alike"),
        ({"error": 3.9}, (0, 0, 0), "alike"),  # as small as a backward stable formula's
        ({"error": 50.0}, (0, 0, -1), "worse"),
        ({"breakpoint": None}, (-1, 0, 0), "worse"),
        ({"breakpoint": 1.0, "wrong": 0, "error": 1.0}, (-1, 0, 0), "worse"),
        ({"wrong": 9, "breakpoint": 3.0}, (0, -1, 0), "worse"),
    ],
)
def test_what_is_compared(own: dict[str, Any], signs: tuple[int, int, int], word: str) -> None:
    records = [climb(DEFAULT), climb(OWN, **own)]

    assert signs_of(records[1], records[0]) == signs
    ((ladder, *_, said),) = beside_rows(records, ["float32"])
    assert (ladder, said) == ("A", word)


def test_a_formula_that_is_better_in_one_way_and_worse_in_another_is_mixed() -> None:
    records = [climb(DEFAULT, breakpoint=1.0), climb(OWN, breakpoint=3.0, error=99.0)]

    assert beside_rows(records, ["float32"])[0] == ["A", "3 (1)", "99 (1)", "mixed"]


def test_several_formulas_have_their_names_in_the_lines() -> None:
    records = [climb(DEFAULT), climb(OWN), climb("sphere=./mine.py:other")]

    assert [row[:2] for row in beside_rows(records, ["float32"])] == [["A", OWN], ["A", "sphere=./mine.py:other"]]
    assert own_alone([OWN])
    assert not own_alone([OWN, "sphere/haines"])
    assert not own_alone([])


def test_the_ladders_with_the_farthest_lines_are_drawn_in_their_order() -> None:
    ladders = [ladder for ladder in all_ladders() if ladder.kind == "sweep"][:5]
    records = [
        climb(formula, ladder=ladder.name, error=error)
        for place, ladder in enumerate(ladders)
        for formula, error in ((DEFAULT, 1.0), (OWN, 10.0 ** (place % 3)))
    ]

    kept = most_different(ladders, cast(Any, records), 2)

    assert kept == [ladders[1], ladders[2]] or kept == [ladders[2], ladders[4]]
    assert ladders[0] not in kept


def test_one_line_a_ladder_and_a_figure_of_twelve(
    rayproof: Rayproof, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.py").write_text(MINE)

    ended = rayproof("stability", OWN, "--quick", "--precision", "float32", "--figure", "f.svg", "--table", "t.csv")

    assert ended.code == 0, ended.error
    assert f"in brackets the default, {DEFAULT}" in " ".join(ended.out.split())
    lines = (tmp_path / "t.csv").read_text().splitlines()[1:]
    assert lines[0] == '"ladder","right up to, float32","error / K u, float32",compared' or lines[0].startswith(
        "ladder,"
    )
    assert len({line.split(",")[0] for line in lines[1:]}) == len(lines) - 1
    (far,) = (line for line in lines if line.startswith("SPH-FAR"))
    assert far.endswith("worse")
    assert "--figure shows the 12 of" in ended.out
    assert (tmp_path / "f.svg").is_file()
