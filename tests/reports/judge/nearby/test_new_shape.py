"""A shape that the judge has never heard of is judged rightly: a disk, z = 0 within 1 of its origin.

It is added by what it needs where shapes are known: its numbers in `cases`, its formula in the tracer, its surface in
the oracle.
"""

import ast
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

from rayproof.cases.placement import compose, rotation, scaling, translation
from rayproof.cases.scene import Camera, Plane, PointLight, Scene, Shape, Sphere
from rayproof.cases.stages import Stage
from rayproof.reference.analytic import surfaces
from rayproof.reference.analytic.surfaces import Flat, Surface, surface_of
from rayproof.reference.analytic.vectors import length, units
from rayproof.reports import judge
from rayproof.reports.judge.against_oracle import AgainstOracle
from rayproof.reports.judge.measurement import Kind
from rayproof.reports.judge.oracle import stages_of
from rayproof.reports.run.tracer_task import shadow_epsilons
from rayproof.tracer.configuration import Configuration
from rayproof.tracer.render import render
from rayproof.tracer.shapes.primitives import KINDS, CubeArrays
from rayproof.tracer.shapes.shape import TracedShape
from tests.reports.judge.scenes import ORACLE, against, candidate, followed, put, rounded, truth_of_scene

FORMULA = f"square={Path(__file__).with_name('disk_formula.py')}:disk"


@dataclass(frozen=True, kw_only=True)
class Disk(Shape):
    """The disk of radius 1 about the origin in z = 0 of object space, facing +z."""


@dataclass(frozen=True, kw_only=True)
class Round(Flat):
    """The part of a plane that `to_object` takes within 1 of the origin."""

    to_object: np.ndarray

    def meetings(self, apex, directions):
        """Yield the plane's crossings within the disk."""
        for rays, pieces, crossing in super().meetings(apex, directions):
            with np.errstate(all="ignore"):
                local = (apex + crossing * directions - self.point) @ self.to_object.T
            yield rays, pieces, np.where(length(local[:, :2])[:, np.newaxis] < 1, crossing, np.nan)


def round_surface(_shape: Disk, linear: np.ndarray, offset: np.ndarray) -> Surface:
    """Return a disk's surface."""
    inverse = np.linalg.inv(linear)
    return Round(point=offset, normal=units(inverse[2]), to_object=inverse)


class TracedDisk(TracedShape):
    """A disk, as traced by the slot of squares."""

    slot = "square"

    def arrays(self, types):  # pyright: ignore[reportIncompatibleMethodOverride]  # a square's, as its slot asks
        """Return what a square is given as well, for its own formula is asked beside the user's."""
        return CubeArrays()


@pytest.fixture(autouse=True, scope="module")
def known():
    """Make the disk known for as long as these tests run."""
    surfaces.SURFACES[Disk], KINDS[Disk] = round_surface, TracedDisk
    yield
    del surfaces.SURFACES[Disk], KINDS[Disk]
    surface_of.cache_clear()


TURNED = compose(translation(0.3, -0.2, 0.9), rotation((1, 2, 0.5), 25.0), scaling(0.9, 0.6, 1.0))
SCENE = Scene(
    camera=Camera(
        eye=(2.0, -4.0, 3.5), target=(0.2, 0.1, 0.4), up=(0.1, 0.2, 1.0), fovy=35.0, width=64, height=48,
        near=0.1, far=50.0,
    ),
    shapes=(
        Disk(albedo=(0.7, 0.5, 0.3), to_world=TURNED, two_sided=True),
        Plane(albedo=(0.4, 0.6, 0.8)),
        Sphere(albedo=(0.5, 0.5, 0.5), center=(-0.9, 0.6, 0.5), radius=0.4),
    ),
    lights=(PointLight(position=(1.5, -1.0, 4.0), flux=(100.0, 80.0, 60.0)),),
)  # fmt: skip
# Its light goes round in the plane of the disk, so that the terminator runs through it where it is bent by rounding.
GRAZED = replace(
    SCENE,
    lights=(
        PointLight(position=tuple((np.asarray(TURNED) @ (3.0, 4.0, 1e-9, 1.0))[:3].tolist()), flux=(100.0, 80.0, 60.0)),
    ),
)


def moved(scene: Scene, roundings: float) -> Scene:
    """Return the scene with the disk larger by so many units of roundoff of float32, and tilted as much."""
    disk, *others = scene.shapes
    by = roundings * 2.0**-24
    to_world = compose(disk.to_world, rotation((3.0, -1.0, 0.0), float(np.degrees(by))), scaling(1 + by, 1 + by, 1.0))
    return replace(scene, shapes=(replace(disk, to_world=to_world), *others))


def wrong(found: AgainstOracle) -> dict[Stage, int]:
    """Return how many pixels of each stage are wrong."""
    return {stage: int(np.count_nonzero(one.wrong)) for stage, one in found.end_to_end.items() if one.wrong.any()}


@pytest.mark.parametrize("scene", [SCENE, GRAZED], ids=["lit", "grazed"])
@pytest.mark.parametrize("precision", ["float32", "float64"])
def test_the_tracer_is_right(scene, precision):
    configuration = Configuration.parse(f"{precision}/{FORMULA}")
    answers = render(scene, stages_of(scene), configuration)
    subject = replace(
        candidate(answers), precision=precision, shadow_epsilon=shadow_epsilons(scene, answers, configuration)
    )
    found = AgainstOracle(truth_of_scene(scene), subject)

    assert np.count_nonzero(answers[Stage.OBJECT][..., 0] == 0) > 300
    assert wrong(found) == {}
    assert [one.wrong.sum() for stage in stages_of(scene) if (one := found.continued(stage)) is not None] == [0] * 9


@pytest.mark.parametrize("scene", [SCENE, GRAZED], ids=["lit", "grazed"])
@pytest.mark.parametrize("roundings", [2.0, -2.0])
def test_a_disk_within_rounding_is_right_at_outline_shadow_and_terminator(scene, roundings):
    answers = rounded(ORACLE.render(moved(scene, roundings), stages_of(scene)))

    assert wrong(against(scene, answers)) == {}


@pytest.mark.parametrize("roundings", [3000.0, -3000.0])
def test_a_disk_that_is_larger_or_smaller_is_wrong(roundings):
    # Its outline moves by a hundredth of a pixel, and its normal turns by 2e-4.
    answers = rounded(ORACLE.render(moved(SCENE, roundings), stages_of(SCENE)))

    assert wrong(against(SCENE, answers))[Stage.NORMAL] > 100


def outline(truth: dict) -> np.ndarray:
    """Return the pixels (height, width) of the disk beside ones that show something else, and those beside it."""
    disk = truth[Stage.OBJECT][..., 0] == 0
    near = np.zeros_like(disk)
    for axis, way in ((0, 1), (0, -1), (1, 1), (1, -1)):
        near |= disk != np.roll(disk, way, axis=axis)
    return near


def test_what_is_wrong_beside_outline_and_shadow_is_found():
    truth = truth_of_scene(SCENE).truth
    pixels = np.argwhere(outline(truth) & (truth[Stage.RADIANCE].max(axis=-1) > 0))
    row, column = (int(place) for place in pixels[len(pixels) // 2])
    pixel = row, column
    objects = put(truth[Stage.OBJECT], pixel, (1.0 - min(truth[Stage.OBJECT][(*pixel, 0)], 1.0), 0.0))
    shadowed = put(truth[Stage.VISIBILITY], pixel, 1.0 - truth[Stage.VISIBILITY][pixel])
    spoilt = {
        Stage.OBJECT: followed(SCENE, truth, Stage.OBJECT, objects),
        Stage.VISIBILITY: followed(SCENE, truth, Stage.VISIBILITY, shadowed),
        Stage.RADIANCE: rounded(dict(truth) | {Stage.RADIANCE: put(truth[Stage.RADIANCE], pixel, 0.37)}),
    }

    for stage, ours in spoilt.items():
        assert against(SCENE, ours).end_to_end[stage].kinds[pixel] == Kind.WRONG
    for ours in (spoilt[Stage.VISIBILITY], spoilt[Stage.RADIANCE]):
        alone = {Stage.RADIANCE: ours[Stage.RADIANCE]}
        assert against(SCENE, alone).end_to_end[Stage.RADIANCE].kinds[pixel] == Kind.WRONG


# Files that may name kinds of shapes: how they amplify rounding, which item is to blame, what is known of defects, and
# the scenes that the judge tests itself by.
KNOWING = {"conditioning.py", "verdict.py", "known_defects.py", "closed_forms.py", "sentinels.py", "limit_sentinels.py"}


def test_no_file_of_the_judge_names_a_kind_of_shape_beside_those_that_must():
    kinds = {kind.__name__ for kind in surfaces.SURFACES} - {"Disk"}
    naming = set()
    (folder,) = judge.__path__
    for path in Path(folder).rglob("*.py"):
        tree = ast.parse(path.read_text(encoding="utf-8"))
        names = {name.name for node in ast.walk(tree) if isinstance(node, ast.ImportFrom) for name in node.names}
        names |= {node.attr for node in ast.walk(tree) if isinstance(node, ast.Attribute)}
        if kinds & names:
            naming.add(path.name)

    assert kinds >= {"Sphere", "Cube", "Mesh"}
    assert naming <= KNOWING
