"""What a rendered answer looks like, and what every configuration must agree on."""

import dataclasses

import numpy as np
import pytest

from rayproof.cases.scene import IDENTITY, Camera, Mesh, Scene, Shape, Square, Triangle
from rayproof.cases.stages import FACTS, IMAGE_STAGES, Stage, StageImages, exr_channels
from rayproof.tracer.configuration import Configuration
from rayproof.tracer.formulas import FORMULAS
from rayproof.tracer.render import continue_from, render
from tests.tracer.scenes import ALBEDO, FLOOR, SHAPES, camera, everything, octahedron, scene

GEOMETRY = (Stage.RAY, Stage.OBJECT, Stage.DISTANCE, Stage.POSITION, Stage.NORMAL)
RIGHT = [
    f"{precision}/{formula.slot}={formula.variant}"
    for precision in ("float32", "float64")
    for formula in FORMULAS.values()
    if formula.kind == "right" and formula.stage in (*GEOMETRY, Stage.CAMERA)
]


@pytest.fixture(scope="module")
def truth() -> StageImages:
    """Return the default formulas' answers in float64."""
    return render(everything(), tuple(Stage), Configuration(precision="float64"))


def test_images_have_the_contract_s_shape_and_type(truth: StageImages) -> None:
    for stage in IMAGE_STAGES:
        assert truth[stage].shape == (30, 40, len(exr_channels(stage, lights=2)))
        assert truth[stage].dtype == np.float64


def test_a_miss_has_the_specification_s_values(precision: str) -> None:
    answers = render(scene(SHAPES["cube"]), tuple(Stage), Configuration(precision=precision))
    missed = answers[Stage.OBJECT][..., 0] < 0

    assert 0 < missed.sum() < missed.size
    for stage in IMAGE_STAGES:
        if FACTS[stage].miss is not None:
            assert (answers[stage][missed] == FACTS[stage].miss).all()


def test_an_empty_scene_is_all_miss(precision: str) -> None:
    answers = render(scene(), tuple(Stage), Configuration(precision=precision))

    for stage in IMAGE_STAGES:
        if FACTS[stage].miss is not None:
            assert (answers[stage] == FACTS[stage].miss).all()


@pytest.mark.parametrize("name", RIGHT)
def test_every_right_formula_gives_the_same_picture(name: str, truth: StageImages) -> None:
    answers = render(everything(), GEOMETRY, Configuration.parse(name))

    same = (answers[Stage.OBJECT] == truth[Stage.OBJECT]).all(axis=-1)
    limit = 1e-4 if name.startswith("float32") else 1e-12
    assert same.mean() > 0.998
    for stage in set(GEOMETRY) - {Stage.OBJECT}:
        ours, theirs = (np.where(np.isfinite(a[stage][same]), a[stage][same], -1) for a in (answers, truth))
        np.testing.assert_allclose(ours, theirs, atol=10 * limit if stage is not Stage.RAY else limit)


@pytest.mark.parametrize("name", [name for name in RIGHT if "/square=" in name])
def test_every_right_square_formula_sees_a_sheared_square_whole(name: str) -> None:
    # The square in `everything` is not sheared: its half-width and half-height are at right angles.
    sheared = Square(albedo=ALBEDO, to_world=((1.5, 1.0, 0, 0), (0.2, 1.2, 0, 0), (0, 0.3, 1, 0), (0, 0, 0, 1)))
    seen, usual = (render(scene(sheared), (Stage.OBJECT,), Configuration.parse(one)) for one in (name, "float64"))

    hit = usual[Stage.OBJECT][..., 0] >= 0
    assert 50 < hit.sum() < 0.9 * hit.size
    assert (seen[Stage.OBJECT] == usual[Stage.OBJECT]).all(axis=-1).mean() > 0.99


@pytest.mark.parametrize("stage", IMAGE_STAGES)
def test_a_stage_alone_equals_the_stage_among_others(stage: Stage) -> None:
    alone = render(everything(), (stage,), Configuration())

    assert set(alone) == {stage}
    np.testing.assert_array_equal(alone[stage], render(everything(), tuple(Stage), Configuration())[stage])


@pytest.mark.parametrize("clip", ["depth", "shell", "none"])
def test_clipping_keeps_what_it_says(clip: str, precision: str) -> None:
    view = camera(near=6.5, far=8.0)
    what = dataclasses.replace(everything(camera=view), clip=clip)  # type: ignore[arg-type]
    answers = render(what, tuple(Stage), Configuration(precision=precision))
    t = answers[Stage.DISTANCE][..., 0]
    forward = answers[Stage.CAMERA]["view"][2, :3]
    depth = t * (answers[Stage.RAY] @ forward) if clip == "depth" else t

    kept = depth[np.isfinite(t)]
    if clip == "none":
        assert kept.min() < 6.5
        assert kept.max() > 8.0
    else:
        assert 6.5 * (1 - 1e-6) < kept.min() < 6.7
        assert 7.8 < kept.max() < 8.0 * (1 + 1e-6)
        assert np.isinf(t).any()


@pytest.mark.parametrize("name", sorted(SHAPES))
def test_of_two_equal_shapes_the_first_is_seen(name: str) -> None:
    twice = render(scene(SHAPES[name], SHAPES[name]), (Stage.OBJECT,), Configuration())[Stage.OBJECT]

    assert set(np.unique(twice[..., 0])) <= {-1.0, 0.0}


@pytest.mark.parametrize("order", [(0, 1), (1, 0)], ids=["mesh-first", "triangle-first"])
def test_a_tie_between_mesh_and_triangle_goes_to_the_lower_index(order: tuple[int, int]) -> None:
    mesh = octahedron()
    corners = tuple(tuple(map(float, vertex)) for vertex in mesh.vertices[mesh.faces[3]])
    shapes: tuple[Shape, ...] = (mesh, Triangle(albedo=ALBEDO, vertices=corners))  # type: ignore[arg-type]
    seen = render(scene(*(shapes[k] for k in order)), (Stage.OBJECT,), Configuration())[Stage.OBJECT]

    front = seen[(seen[..., 1] == (3 if order[0] == 0 else 0)) & (seen[..., 0] == 0)]
    assert len(front) > 10


@pytest.mark.parametrize("order", [(0, 1), (1, 0)], ids=["tree-first", "unrolled-first"])
def test_a_tie_between_a_tree_and_an_unrolled_shape_goes_to_the_lower_index(order: tuple[int, int]) -> None:
    """Along the axis, square to both, t is 2 to the last bit by every formula.

    No case can ask this: of surfaces that coincide the judge takes either.
    """
    corners = np.array(((-1.0, -1.0, 0.0), (2.0, -1.0, 0.0), (-1.0, 2.0, 0.0)))
    mesh = Mesh(albedo=ALBEDO, vertices=corners, faces=np.array(((0, 1, 2),)))
    shapes: tuple[Shape, ...] = (mesh, Square(albedo=ALBEDO, to_world=IDENTITY))
    camera = Camera(
        eye=(0.0, 0.0, 2.0),
        target=(0.0, 0.0, 0.0),
        up=(0.0, 1.0, 0.0),
        fovy=20.0,
        width=3,
        height=3,
        near=0.1,
        far=9.0,
    )
    both = Scene(camera=camera, shapes=tuple(shapes[k] for k in order))
    answers = render(both, (Stage.OBJECT, Stage.DISTANCE), Configuration())

    assert answers[Stage.DISTANCE][1, 1, 0] == 2
    assert answers[Stage.OBJECT][1, 1, 0] == 0


def test_faces_of_a_mesh_are_its_triangles() -> None:
    mesh = octahedron(to_world=SHAPES["mesh"].to_world)
    answers = render(scene(FLOOR, mesh), (Stage.OBJECT, Stage.POSITION), Configuration())
    hit = answers[Stage.OBJECT][..., 0] == 1
    matrix = np.asarray(mesh.to_world)
    local = (answers[Stage.POSITION][hit] - matrix[:3, 3]) @ np.linalg.inv(matrix[:3, :3]).T
    octant = {tuple(np.sign(mesh.vertices[face].sum(axis=0))): index for index, face in enumerate(mesh.faces)}
    clear = np.abs(local).min(axis=-1) > 1e-4

    assert hit.sum() > 50
    assert (answers[Stage.OBJECT][hit][:, 1] == [octant[tuple(np.sign(p))] for p in local])[clear].all()


def test_samples_average_a_finer_image() -> None:
    what = scene(FLOOR, SHAPES["cube"])
    fine = dataclasses.replace(what, camera=camera(width=120, height=90))
    configuration = Configuration(precision="float64")

    mean = render(what, (Stage.RADIANCE,), configuration, samples=3)[Stage.RADIANCE]
    pixels = render(fine, (Stage.RADIANCE,), configuration)[Stage.RADIANCE]

    np.testing.assert_allclose(mean, pixels.reshape(30, 3, 40, 3, 3).mean(axis=(1, 3)), rtol=1e-9)


@pytest.mark.parametrize("formulas", [{}, {"cube": "entry_only"}, {"world_normal": "fault_model_matrix"}])
def test_each_stage_continues_from_those_before_it(formulas: dict[str, str]) -> None:
    asked = everything()
    configuration = Configuration(precision="float64", formulas=formulas)
    whole = render(asked, IMAGE_STAGES, configuration)

    for index, stage in enumerate(IMAGE_STAGES):
        before = {one: whole[one] for one in IMAGE_STAGES[:index]}
        found = continue_from(asked, stage, before, configuration)

        assert np.allclose(found, whole[stage], rtol=1e-9, atol=1e-12), stage


def test_a_stage_continues_from_another_renderers_wrong_one() -> None:
    asked, configuration = everything(), Configuration(precision="float64")
    whole = render(asked, IMAGE_STAGES, configuration)
    mirrored = np.flip(whole[Stage.RAY], axis=1)

    found = continue_from(asked, Stage.OBJECT, {Stage.RAY: mirrored}, configuration)

    assert np.array_equal(found, np.flip(whole[Stage.OBJECT], axis=1))
