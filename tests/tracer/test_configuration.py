"""Configurations: names that read back, formulas by slot, and what they cover."""

import pickle
from pathlib import Path

import pytest

from rayproof.tracer.configuration import Configuration
from rayproof.tracer.formulas import FORMULAS
from rayproof.tracer.formulas.own_file import OwnFormulaError


@pytest.mark.parametrize(
    "name",
    [
        "float32",
        "float64/ray=inverse_matrices/triangle=signed_areas",
        "float64/sphere=mine.py:nearest_hit",
        "float32/ray=half_depth/sphere=../some folder/mine.py:nearest_hit/triangle=/abs/mine.py:areas/cosine=scaled",
        *(f"float32/{f.slot}={f.variant}" for f in FORMULAS.values() if not f.default),
    ],
)
def test_a_name_reads_back(name: str) -> None:
    configuration = Configuration.parse(name)

    assert configuration.name == name
    assert pickle.loads(pickle.dumps(configuration)) == configuration
    assert hash(Configuration.parse(name)) == hash(configuration)


def test_to_name_a_formula_of_one_s_own_executes_nothing(tmp_path: Path) -> None:
    # Names come out of results.json too, which may be anybody's.
    (tmp_path / "mine.py").write_text("raise SystemExit('executed')\n")

    chosen = Configuration.parse(f"float32/sphere={tmp_path}/mine.py:nearest_hit")

    assert chosen.faults == chosen.controls == ()
    assert "HIT-1" in chosen.items
    with pytest.raises(OwnFormulaError, match="executed"):
        chosen["sphere"]


def test_items_follow_the_formulas() -> None:
    usual, other = Configuration(), Configuration(formulas={"ray": "inverse_matrices"})

    assert "CAM-4" in usual.items
    assert "CAM-5" not in usual.items
    assert other.items == usual.items - {"CAM-4"} | {"CAM-5"}


def test_controls_and_faults_are_told_apart() -> None:
    assert Configuration().controls == Configuration().faults == ()
    assert Configuration(formulas={"sample": "corner"}).controls == ("sample/corner",)
