"""A file of one's own: what is right runs in its slot, what is wrong is told in one line with 2."""

from pathlib import Path

import numpy as np
import pytest

from rayproof.cases.scene import Scene, Sphere
from rayproof.cases.stages import Stage
from rayproof.cases.stresses import STRESSES
from rayproof.reports.studies.compare.contenders import contender
from rayproof.tracer.render import render
from tests.reports.commands.conftest import Rayproof

GOOD = """
import drjit as dr

def nearest_hit(ray, sphere, interval):
    f = ray.origin - sphere.center
    a, h = dr.squared_norm(ray.direction), -dr.dot(f, ray.direction)
    quarter = h * h - a * (dr.squared_norm(f) - dr.square(sphere.radius))
    root = dr.sqrt(dr.select(quarter >= 0, quarter, 0))
    return dr.select(quarter >= 0, interval.smallest((h - root) / a, (h + root) / a), dr.inf)
"""
BODY = "def nearest_hit(ray, sphere, interval):\n    return {}\n"
WRONG = {
    "no file": ("", "absent.py:nearest_hit", "no such file"),
    "no import": ("import absent_module\n", "mine.py:nearest_hit", "ModuleNotFoundError"),
    "no Python": ("def (:\n", "mine.py:nearest_hit", "SyntaxError"),
    "exits": ("raise SystemExit(7)\n", "mine.py:nearest_hit", "SystemExit"),
    "no function": (GOOD, "mine.py:nearest", "nearest_hit"),
    "another signature": ("def nearest_hit(ray, sphere):\n    return 1\n", "mine.py:nearest_hit", "interval"),
    "raises": (BODY.format("1 / 0"), "mine.py:nearest_hit", "ZeroDivisionError: division by zero (line 2)"),
    "a Python number": (BODY.format("1.0"), "mine.py:nearest_hit", "float"),
    "nothing": (BODY.format("None"), "mine.py:nearest_hit", "NoneType"),
    "a vector": (BODY.format("ray.direction"), "mine.py:nearest_hit", "Array3f"),
    "no such parameter": (GOOD, "mine.py:nearest_hit(eps=1e-4)", "eps"),
    "no number": (GOOD, "mine.py:nearest_hit(interval=x)", "'interval=x' must be name=number"),
    "too few": (BODY.format("type(ray.direction.x)([1, 2, 3])"), "mine.py:nearest_hit", "3 entries"),
}


@pytest.fixture
def scene() -> Scene:
    return next(iter(STRESSES["far_sphere_1e1"]()))[1]


@pytest.mark.parametrize(("text", "place", "named"), WRONG.values(), ids=WRONG.keys())
def test_a_mistake_ends_with_2_and_one_line(
    rayproof: Rayproof, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, text: str, place: str, named: str
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "mine.py").write_text(text)

    ended = rayproof("compare", "sphere/textbook", f"sphere=./{place}", "far_sphere_1e1")

    assert ended.code == 2
    assert ended.out == ""
    assert ended.error.count("\n") == 1
    assert named in ended.error
    assert place.split(":")[0] in ended.error


def test_a_function_of_ones_own_runs_in_its_slot(tmp_path: Path, scene: Scene) -> None:
    (tmp_path / "mine.py").write_text(GOOD)
    (tmp_path / "blind.py").write_text(BODY.format("type(ray.direction.x)(float('inf'))"))

    mine, blind = (
        contender(f"sphere={tmp_path}/{file}.py:nearest_hit", precision="float32") for file in ("mine", "blind")
    )

    found = render(scene, [Stage.OBJECT], mine.configuration)[Stage.OBJECT]
    assert isinstance(scene.shapes[0], Sphere)
    assert np.any(found[..., 0] == 0)
    assert np.all(render(scene, [Stage.OBJECT], blind.configuration)[Stage.OBJECT] == -1)
    assert str(tmp_path) in mine.configuration.name


def test_each_file_imports_its_own_neighbours(tmp_path: Path, scene: Scene) -> None:
    for name, value in (("before", "1"), ("after", "float('inf')")):
        folder = tmp_path / name
        folder.mkdir()
        (folder / "mine.py").write_text(
            "from neighbour import factor\n" + GOOD.replace("(h + root) / a)", "(h + root) / a) * factor")
        )
        (folder / "neighbour.py").write_text(f"factor = {value}\n")

    before, after = (
        contender(f"sphere={tmp_path}/{name}/mine.py:nearest_hit", precision="float32") for name in ("before", "after")
    )

    assert np.any(render(scene, [Stage.OBJECT], before.configuration)[Stage.OBJECT][..., 0] == 0)
    assert np.all(render(scene, [Stage.OBJECT], after.configuration)[Stage.OBJECT] == -1)


def test_a_variant_alone_names_the_one_slot_that_has_it() -> None:
    assert (
        contender("float64/inverse_matrices", precision="float32").configuration.name == "float64/ray=inverse_matrices"
    )
