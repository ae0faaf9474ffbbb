"""What Embree declares that it cannot do, and that it declares nothing else."""

import numpy as np
import pytest

from rayproof.cases.scene import Cube, Mesh, Plane, PointLight, Scene, Sphere, Square, Triangle
from rayproof.cases.stages import IMAGE_STAGES, Stage
from rayproof.reference import REFERENCES, embree
from rayproof.reference.embree import Embree
from tests.reference.mitsuba3.geometry import SHEARED, WHITE, answer, looking_down

LIGHT = PointLight(position=(1, 1, 3), flux=(10.0, 20.0, 30.0))
GEOMETRY = IMAGE_STAGES[1 : IMAGE_STAGES.index(Stage.IRRADIANCE)]
CORNERS = ((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.0, 1.0, 0.0))
MESH = Mesh(albedo=WHITE, vertices=np.array(CORNERS, dtype=np.float32), faces=np.array([(0, 1, 2)]))
FLAT = (Square(albedo=WHITE), Cube(albedo=WHITE, to_world=SHEARED), Triangle(albedo=WHITE, vertices=CORNERS), MESH)


@pytest.mark.parametrize(
    ("shapes", "answered"),
    [
        pytest.param((), (Stage.RAY, *GEOMETRY), id="empty"),
        pytest.param(FLAT, (Stage.RAY, *GEOMETRY), id="flat"),
        pytest.param((*FLAT, Sphere(albedo=WHITE)), (Stage.RAY,), id="sphere"),
        pytest.param((*FLAT, Plane(albedo=WHITE)), (Stage.RAY,), id="plane"),
    ],
)
@pytest.mark.parametrize("shading", ["inverse_square", "simplified"])
def test_it_answers_rays_always_and_geometry_where_all_is_flat(embree, shapes, answered, shading):
    scene = Scene(camera=looking_down(height=5), shapes=shapes, lights=(LIGHT,), shading=shading)

    assert {stage for stage in Stage if embree.unsupported(scene, stage) is None} == set(answered)
    assert set(embree.render(scene, answered)) == set(answered)


def test_a_light_out_of_its_reach_is_declared(embree):
    light = PointLight(position=(1e20, 0, 0), flux=(1.0, 1.0, 1.0))
    scene = Scene(camera=looking_down(height=5), shapes=FLAT, lights=(light,))

    assert "1e+20" in embree.unsupported(scene, Stage.VISIBILITY)


def test_it_has_no_radiance_to_take_a_mean_of(embree):
    with pytest.raises(ValueError, match="no radiance"):
        embree.render(Scene(camera=looking_down(height=5), shapes=FLAT), (Stage.RADIANCE,), samples=2)


def test_it_is_an_independent_witness_that_is_always_asked(embree):
    about = REFERENCES.about("embree")
    scene = Scene(camera=looking_down(height=5), shapes=FLAT)

    assert about["independent"]
    assert not about.get("optional", False)
    assert embree.version().startswith("Embree (embreex 4.")
    assert set(embree.settings(scene)) == {"scene", "feelers"}


def test_it_says_how_to_install_what_is_missing(monkeypatch):
    monkeypatch.setattr(embree, "find_spec", lambda name: None)

    assert "pip install embreex" in str(Embree.missing())


def test_degenerate_triangles_alone_are_an_empty_scene(embree):
    flat = Triangle(albedo=WHITE, vertices=((0.0, 0.0, 0.0), (1.0, 1.0, 1.0), (2.0, 2.0, 2.0)))
    scene = Scene(camera=looking_down(height=5), shapes=(flat,), lights=(LIGHT,))

    shape, visibility = answer(embree, scene, Stage.OBJECT, Stage.VISIBILITY)

    assert np.all(shape == -1)
    assert not visibility.any()
