"""rayproof from Python: what the names answer, what they refuse, and a function of one's own under test."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import rayproof
from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage
from rayproof.reports.api.asking import answers_from
from rayproof.reports.api.outcome import Run

SCENE = rayproof.load("primitives/sphere")
SIZE = (SCENE.camera.height, SCENE.camera.width)


def twice_as_bright(scene: Scene, stages: Sequence[Stage]) -> dict[str, np.ndarray]:
    """Answer as the closed forms do, but for light, of which there is twice as much; know no cube."""
    if any(type(shape).__name__ == "Cube" for shape in scene.shapes):
        raise NotImplementedError("it has no cubes")
    if any(type(shape).__name__ == "Triangle" for shape in scene.shapes):
        raise ArithmeticError("a triangle is too much")
    found = rayproof.oracle(scene, [stage.value for stage in stages])
    return {name: image * (2 if name in ("irradiance", "exitance", "radiance") else 1) for name, image in found.items()}


@pytest.fixture(scope="module")
def finished(tmp_path_factory: pytest.TempPathFactory) -> Run:
    cases = [f"primitives/{name}" for name in ("plane", "cube", "triangle")]
    return rayproof.run([*cases, SCENE], twice_as_bright, out=tmp_path_factory.mktemp("run") / "out", quiet=True)


def test_scenes_and_cases_are_found_by_name() -> None:
    assert [case.name for case in rayproof.select_cases("primitives/s*")] == ["primitives/sphere", "primitives/square"]
    assert rayproof.load("examples/still_life.json").lights
    with pytest.raises(LookupError, match="did you mean"):
        rayproof.load("primitives/spere")
    with pytest.raises(LookupError, match="names 6 cases, one is needed"):
        rayproof.load("primitives")
    with pytest.raises(ValueError, match="the scene"):
        rayproof.load({"shapes": 3})


def test_the_tracer_and_the_closed_forms_answer_the_same() -> None:
    ours, theirs = (answer(SCENE, ["distance", "radiance"]) for answer in (rayproof.render, rayproof.oracle))

    assert list(ours) == list(theirs) == ["distance", "radiance"]
    assert np.isclose(ours["radiance"], theirs["radiance"], rtol=1e-4).all(axis=-1).sum() > 0.98 * SIZE[0] * SIZE[1]
    with pytest.raises(ValueError, match="no image stage is called 'depth'"):
        rayproof.render(SCENE, ["depth"])


@pytest.mark.parametrize(("factor", "verdict"), [(1.0, "pass"), (1.0 + 1e-9, "fail")])
def test_an_answer_in_float64_is_judged_as_such(factor: float, verdict: str) -> None:
    image = rayproof.render(SCENE, ["radiance"], "float64")["radiance"] * factor

    judged = rayproof.judge(SCENE, {"radiance": image}, "float64")

    assert judged.verdict == verdict
    # The limit is what decides: every pixel away from edges is held to it.
    off = np.abs(image - rayproof.oracle(SCENE, ["radiance"])["radiance"])
    assert bool(np.nanmax(off - judged.limits["radiance"]) > 0) == (verdict == "fail")
    assert str(judged).startswith("1 of 10 checks measured, by analytic: " + verdict)
    with pytest.raises(TypeError, match="neither true nor false"):
        bool(judged)


def test_arrays_of_other_libraries_are_taken() -> None:
    from drjit.llvm import TensorXf

    class Foreign:  # speaks DLPack and nothing else, as arrays of JAX and PyTorch do
        def __init__(self, array: np.ndarray) -> None:
            self._array = array

        def __dlpack__(self, **_: Any) -> Any:
            return self._array.__dlpack__()

        def __dlpack_device__(self) -> Any:
            return self._array.__dlpack_device__()

    image = np.arange(SIZE[0] * SIZE[1] * 3, dtype=np.float32).reshape(*SIZE, 3)
    for given in (Foreign(image), TensorXf(image), image.tolist()):
        found = answers_from(given, SCENE, (Stage.RADIANCE,))
        assert found[Stage.RADIANCE].dtype == np.float64
        assert np.array_equal(found[Stage.RADIANCE], image)
    assert answers_from({"distance": image[..., 0]}, SCENE, ())[Stage.DISTANCE].shape == (*SIZE, 1)


@pytest.mark.process
def test_a_function_is_put_under_test(finished: Run) -> None:
    assert str(finished).startswith("4 cases planned, 2 measured, 1 unsupported: ")
    assert {name: finished.case(name).verdict for name in finished.names} == {
        "primitives/plane": "fail",
        "primitives/cube": "unsupported",
        "primitives/triangle": "error",
        "file/scene-3": "fail",
    }
    assert "ArithmeticError: a triangle is too much" in finished.case("primitives/triangle").reason
    assert finished.case("primitives/plane").blamed_items == ("RAD-1",)
    assert "2 pi instead of 4 pi" in finished.diagnosis[0]
    assert {row["case"] for row in finished.failures} == {"primitives/plane", "primitives/triangle", "file/scene-3"}
    with pytest.raises(AssertionError, match=r"2 measured[\s\S]*primitives/plane: fail RAD-1"):
        finished.raise_if_failed()
    with pytest.raises(TypeError, match="neither true nor false"):
        bool(finished)


@pytest.mark.process
def test_a_case_has_its_images_and_their_limits(finished: Run) -> None:
    case = finished.case("file/scene-3")
    ours, theirs = (case.image("irradiance", name) for name in (None, "analytic"))

    assert ours.dtype == np.float64
    assert np.array_equal(ours, 2 * theirs)
    assert (np.abs(ours - theirs) > case.limit("irradiance")).any(axis=-1).sum() > 500
    with pytest.raises(LookupError, match="no renderer 'pbrt'; known: twice_as_bright, analytic"):
        case.image("radiance", "pbrt")
    with pytest.raises(LookupError, match="no case 'primitives/spher'"):
        finished.case("primitives/spher")


class Wavering:
    """Answers as the closed forms do, and a little otherwise each time that it is asked."""

    def __init__(self, *, deterministic: bool) -> None:
        self.deterministic, self.asked = deterministic, []

    def __call__(self, scene: Scene, stages: Sequence[Stage]) -> dict[str, np.ndarray]:
        self.asked.append(scene.camera.width)
        found = rayproof.oracle(scene, [stage.value for stage in stages])
        return {**found, "radiance": found["radiance"] * (1 + 1e-6 * np.cos(len(self.asked)))}


@pytest.mark.process
def test_an_image_that_changes_from_call_to_call_fails_the_run_unless_it_is_declared(tmp_path: Path) -> None:
    cases = ["primitives/sphere", "primitives/plane"]
    silent, declared = Wavering(deterministic=True), Wavering(deterministic=False)

    fails = rayproof.run(cases, silent, out=tmp_path / "out", quiet=True)
    passes = rayproof.run(cases, declared, quiet=True)

    assert (fails.code, fails.verdict, fails.counts["pass"]) == (1, "fail", 2)
    assert len(silent.asked) == 4, "both cases are asked again at the end"
    first, others = fails.record["changing"]
    assert "primitives/sphere differently when it is asked again" in first
    assert others == "so it is with another case that was asked again"
    for name in ("junit.xml", "summary.md", "index.html"):
        assert "differently when it is asked again" in (tmp_path / "out" / name).read_text(), name
    assert (passes.code, passes.record["changing"]) == (0, [])
