"""The default families are those that the difference concerns; stresses are sound scenes with known slots."""

import pytest

from rayproof.cases.scene import Scene
from rayproof.cases.stresses import STRESSES, stressing
from rayproof.reports.studies.compare.contenders import concerned, contender, questions
from rayproof.tracer.formulas import FORMULAS


@pytest.mark.parametrize("name", list(STRESSES))
def test_a_stress_yields_distinct_scenes_for_known_slots(name: str) -> None:
    scenes = dict(STRESSES[name]())

    assert all(isinstance(scene, Scene) for scene in scenes.values())
    assert len(scenes) >= 3
    assert set(STRESSES.about(name)["slots"]) <= set(FORMULAS.slots)


def test_spheres_are_compared_on_every_family_that_covers_them_and_on_their_stresses() -> None:
    pair = [contender(name, precision="float32") for name in ("sphere/textbook", "sphere/haines")]

    asked = questions((), *pair)

    assert {"primitives", "transforms", "far_sphere_1e3", "tangent_sphere"} <= {one.family for one in asked}
    assert not {"meshes", "far_cube_1e3"} & {one.family for one in asked}
    assert {one.family for one in asked if one.stress} == set(stressing("sphere"))


def test_selectors_name_cases_and_stresses() -> None:
    pair = [contender(name, precision="float32") for name in ("sphere/textbook", "sphere/haines")]

    asked = questions(("far_sphere_*", "primitives/sphere"), *pair)

    assert [one.family for one in asked] == ["primitives", "far_sphere_1e1", "far_sphere_1e3", "far_sphere_1e5"]
    with pytest.raises(LookupError, match="no case matches"):
        questions(("no_such_family",), *pair)


def test_only_shapes_that_a_slot_touches_are_concerned() -> None:
    scene = next(iter(STRESSES["squeezed_1e2"]()))[1]

    assert concerned(scene, ["sphere"]) == {0}
    assert concerned(scene, ["cube"]) == set()
    assert concerned(scene, ["to_object"]) == {0}
    assert concerned(scene, ["sphere", "ray"]) is None
