"""The default families are those that the difference concerns; stresses are sound scenes with known slots."""

import pytest

from rayproof.cases.stresses import stressing
from rayproof.reports.studies.compare.contenders import contender, questions


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
