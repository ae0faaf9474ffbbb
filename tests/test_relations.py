"""Relations between images of one renderer, which hold for any right renderer: of the tracer, and of the oracle.

The image of a scene that was changed in a known way follows from the image of the scene itself: a mirrored world is
seen mirrored, and a light in a closed sphere lights nothing outside of it. No reference is needed, so that the tracer
and the oracle, which judges all else, are tested without each other. Both render in float64 here.
Source: Chen, Cheung and Yiu, Metamorphic Testing: A New Approach for Generating Next Test Cases (1998).
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from math import atan, degrees, radians, tan
from typing import Any

import numpy as np
import pytest

from rayproof.cases.families import select
from rayproof.cases.placement import compose, matrix, rotation, scaling, translation, vector
from rayproof.cases.rounding import UNIT_ROUNDOFF
from rayproof.cases.scene import Cube, Mesh, PointLight, Scene, Shape, Sphere, Square, Triangle
from rayproof.cases.stages import IMAGE_STAGES, Stage, StageImages
from rayproof.reference.analytic import Analytic
from rayproof.reports.judge.forward.conditioning import basis_condition
from rayproof.tracer.configuration import Configuration
from rayproof.tracer.render import render

Renderer = Callable[[Scene], StageImages]
Map = Callable[[np.ndarray], np.ndarray]
LIGHT_STAGES = (Stage.IRRADIANCE, Stage.EXITANCE, Stage.RADIANCE)
SIZE = (41, 31)  # px
# Roundings from pixel to radiance: ray 16, hit 16, position 4, normal 16, light 12 (`reports.judge.forward.limits`).
ROUNDINGS = 64


@dataclass(frozen=True, kw_only=True)
class Pair:
    """One stage of a changed scene: the image that the relation expects, and the rendered one, (height, width, n)."""

    stage: Stage
    expected: np.ndarray
    rendered: np.ndarray
    scene: Scene
    exact: bool = False  # equal to the last bit
    truncation: float = 0.0  # relative: what a finite sum leaves out
    pixels: np.ndarray | None = None  # (height, width) bool: those that the relation concerns; None: all

    def wrong(self) -> int:
        """Return the number of pixels that differ by more than rounding.

        Rounding changes a value by some u of its own size. It also turns the ray by some u, which moves the value by u
        times pixels per radian pixels over the image: over one pixel it changes by the range of the 3 x 3 neighbours.
        """
        with np.errstate(invalid="ignore"):
            error = np.where(self.expected == self.rendered, 0.0, np.abs(self.expected - self.rendered))
        right = np.all(error <= self._limit(), axis=-1)  # False for NaN
        return int(np.sum(~right if self.pixels is None else ~right & self.pixels))

    def _limit(self) -> np.ndarray | float:
        if self.exact or self.stage in (Stage.OBJECT, Stage.VISIBILITY):
            return 0.0
        view = self.scene.camera
        finite = np.where(np.isfinite(self.expected), self.expected, 0.0)
        padded = np.pad(finite, ((1, 1), (1, 1), (0, 0)), mode="edge")
        around = np.lib.stride_tricks.sliding_window_view(padded, (3, 3), axis=(0, 1))
        spread = around.max(axis=(-2, -1)) - around.min(axis=(-2, -1))
        per_radian = view.height / (2 * tan(radians(view.fovy) / 2))
        stretched = [np.linalg.cond(np.asarray(shape.to_world)[:3, :3]) for shape in self.scene.shapes]
        condition = basis_condition(view) * max(1.0, *map(float, stretched))
        size = np.abs(finite)
        if self.stage in (Stage.RAY, Stage.NORMAL):
            size = np.ones_like(finite)
        elif self.stage is Stage.POSITION:
            size = np.linalg.norm(view.eye) + np.linalg.norm(finite, axis=-1, keepdims=True)
        return ROUNDINGS * UNIT_ROUNDOFF["float64"] * condition * (size + per_radian * spread) + self.truncation * size


Relation = Callable[[Scene, Renderer], Iterator[Pair]]


def pairs(
    before: StageImages,
    after: StageImages,
    scene: Scene,
    maps: Mapping[Stage, Map],
    stages: tuple[Stage, ...] = IMAGE_STAGES,
    *,
    exact: bool = False,
) -> Iterator[Pair]:
    """Yield a pair for each stage; `maps` changes the images of the scene as the relation says."""
    for stage in stages:
        expected = maps.get(stage, lambda image: image)(before[stage])
        yield Pair(stage=stage, expected=expected, rendered=after[stage], scene=scene, exact=exact)


def seen_by(scene: Scene, **changes: Any) -> Scene:
    """Return the scene with a changed camera."""
    return replace(scene, camera=replace(scene.camera, **changes))


def moved(scene: Scene, motion: Any, *, scale: float = 1.0) -> Scene:
    """Return the scene with camera, shapes and lights moved by a matrix; `scale` is its factor of lengths.

    Light is spread over scale^2 of the area, so that the flux grows by as much.
    """
    whole, view = np.asarray(motion), scene.camera

    def point(place: Any) -> Any:
        return vector(whole[:3, :3] @ np.asarray(place) + whole[:3, 3])

    lights = [
        PointLight(position=point(light.position), flux=vector(np.asarray(light.flux) * scale**2))
        for light in scene.lights
    ]
    changed = seen_by(
        scene,
        eye=point(view.eye),
        target=point(view.target),
        up=vector(whole[:3, :3] @ np.asarray(view.up)),
        near=view.near * scale,
        far=view.far * scale,
    )
    shapes = (replace(shape, to_world=matrix(whole @ np.asarray(shape.to_world))) for shape in scene.shapes)
    return replace(changed, shapes=tuple(shapes), lights=tuple(lights))


def moved_images(motion: Any, *, scale: float = 1.0) -> dict[Stage, Map]:
    """Return what moving the whole scene does to the image of each stage."""
    whole = np.asarray(motion)

    def turned(image: np.ndarray) -> np.ndarray:
        return image @ (whole[:3, :3] / scale).T

    def points(image: np.ndarray) -> np.ndarray:
        hit = np.any(image != 0, axis=-1, keepdims=True)
        return np.where(hit, image @ whole[:3, :3].T + whole[:3, 3], 0.0)

    return {
        Stage.RAY: turned,
        Stage.NORMAL: turned,
        Stage.POSITION: points,
        Stage.DISTANCE: lambda image: image * scale,
    }


def turned_world(scene: Scene, draw: Renderer) -> Iterator[Pair]:
    """Turn and move everything: dot products of differences of points stay (Weyl, Symmetry, 1952)."""
    motion = compose(translation(0.4, -0.3, 0.2), rotation((0.3, -0.5, 0.8), 77.0))
    yield from pairs(draw(scene), draw(moved(scene, motion)), scene, moved_images(motion))


def mirrored_world(scene: Scene, draw: Renderer) -> Iterator[Pair]:
    """Mirror everything in x = 0: right = forward x up changes its sign, and normals still point outward."""
    mirror = scaling(-1, 1, 1)
    flipped = {stage: images[:, ::-1] for stage, images in draw(scene).items() if stage is not Stage.CAMERA}
    yield from pairs(flipped, draw(moved(scene, mirror)), scene, moved_images(mirror))


def small_world(scene: Scene, draw: Renderer) -> Iterator[Pair]:
    """Scale lengths by 1/128 and flux by its square: no formula has a length of its own (Buckingham 1914)."""
    scale = 2.0**-7  # a power of two, so that the corners of triangles, which are stored in float32, scale exactly
    motion = scaling(scale, scale, scale)
    yield from pairs(draw(scene), draw(moved(scene, motion, scale=scale)), scene, moved_images(motion, scale=scale))


def wider_image(scene: Scene, draw: Renderer) -> Iterator[Pair]:
    """Add columns, then rows with the wider angle that they need: tan(alpha) / H stays, and so does the middle."""
    width, height = SIZE
    middle = draw(scene)
    wide = draw(seen_by(scene, width=width + 20))
    yield from pairs(middle, {stage: wide[stage][:, 10:-10] for stage in IMAGE_STAGES}, scene, {})
    angle = degrees(2 * atan(tan(radians(scene.camera.fovy) / 2) * (height + 12) / height))
    tall = draw(seen_by(scene, height=height + 12, fovy=angle))
    yield from pairs(middle, {stage: tall[stage][6:-6] for stage in IMAGE_STAGES}, scene, {})


def same_view(scene: Scene, draw: Renderer) -> Iterator[Pair]:
    """Slide `up` and the target along the line of sight: only the direction to the target, and up across it, count."""
    eye, target, up = (np.asarray(getattr(scene.camera, name)) for name in ("eye", "target", "up"))
    forward = (target - eye) / np.linalg.norm(target - eye)
    after = draw(seen_by(scene, up=vector(2.5 * up + 0.7 * forward), target=vector(eye + 1.7 * (target - eye))))
    yield from pairs(draw(scene), after, scene, {})


def clipped_hits(scene: Scene, draw: Renderer) -> Iterator[Pair]:
    """Clip at a middle distance: hits before a far limit and behind a near one stay, and there are no others."""
    whole = draw(replace(scene, clip="none"))
    eye, target = np.asarray(scene.camera.eye), np.asarray(scene.camera.target)
    middle = float(np.linalg.norm(target - eye))
    for clip in ("depth", "shell"):
        cosine = whole[Stage.RAY] @ ((target - eye) / middle) if clip == "depth" else 1.0
        away = whole[Stage.DISTANCE][..., 0] * cosine
        seen = np.isfinite(away)
        before, behind = seen & (away < middle * (1 - 1e-6)), seen & (away > middle * (1 + 1e-6))
        changed = replace(scene, clip=clip)
        front = draw(seen_by(changed, near=1e-3 * middle, far=middle))
        back = draw(seen_by(changed, near=middle, far=1e3 * middle))
        hits = np.where(before[..., np.newaxis], whole[Stage.OBJECT], -1.0)
        for after, expected, pixels in (
            (front, hits, before | behind | ~seen),
            (back, whole[Stage.OBJECT], behind | ~seen),
        ):
            stage = Stage.OBJECT
            yield Pair(stage=stage, expected=expected, rendered=after[stage], scene=scene, pixels=pixels)
        nearest = np.maximum(back[Stage.DISTANCE], (middle / np.broadcast_to(cosine, away.shape))[..., np.newaxis])
        yield Pair(stage=Stage.DISTANCE, expected=nearest, rendered=back[Stage.DISTANCE], scene=scene)


def shapes_behind(scene: Scene, draw: Renderer) -> Iterator[Pair]:
    """Put a shape of each kind behind the eye and light the scene from before it: they are neither seen nor in the way.

    The plane through the eye has what is seen, the light and the way between them on one side, the shapes on the other.
    """
    view = scene.camera
    eye, target = np.asarray(view.eye), np.asarray(view.target)
    distance = float(np.linalg.norm(target - eye))
    forward = (target - eye) / distance
    light = PointLight(position=vector(eye + 0.001 * distance * forward), flux=vector(np.full(3, 40 * distance**2)))
    lit = replace(scene, lights=(light,))
    corners = ((-0.5, -0.5, 0.0), (0.5, -0.5, 0.0), (0.0, 0.5, 0.0))
    kinds: tuple[Shape, ...] = (
        Sphere(albedo=(0.9, 0.9, 0.9), radius=0.5),
        Cube(albedo=(0.9, 0.9, 0.9)),
        Square(albedo=(0.9, 0.9, 0.9)),
        Triangle(albedo=(0.9, 0.9, 0.9), vertices=corners),
        Mesh(albedo=(0.9, 0.9, 0.9), vertices=np.array(corners), faces=np.array([(0, 1, 2)])),
    )
    places = [eye - (view.near + 0.2 * distance * (number + 1)) * forward for number in range(len(kinds))]
    size = 0.1 * distance
    crowd = [
        replace(shape, to_world=compose(translation(*map(float, place)), scaling(size, size, size)))
        for shape, place in zip(kinds, places, strict=True)
    ]
    after = draw(replace(lit, shapes=(*lit.shapes, *crowd)))
    yield from pairs(draw(lit), after, scene, {})


def cubes_of_squares(scene: Scene, draw: Renderer) -> Iterator[Pair]:
    """Put six squares that face outward in the place of each cube: they are its surface."""
    turns = [rotation((1, 0, 0), angle) for angle in (0, 90, 180, 270)]
    turns += [rotation((0, 1, 0), angle) for angle in (90, 270)]
    sides = [np.round(compose(turn, translation(0, 0, 0.5)), 6) for turn in turns]
    shapes: list[Shape] = []
    owners: list[int] = []
    for number, shape in enumerate(scene.shapes):
        parts = [
            Square(albedo=shape.albedo, two_sided=shape.two_sided, to_world=matrix(np.asarray(shape.to_world) @ side))
            for side in (sides if isinstance(shape, Cube) else ())
        ] or [shape]
        shapes += parts
        owners += [number] * len(parts)
    after = dict(draw(replace(scene, shapes=tuple(shapes))))
    index = after[Stage.OBJECT]
    after[Stage.OBJECT] = np.stack([np.array([*owners, -1.0])[index[..., 0].astype(int)], index[..., 1]], axis=-1)
    yield from pairs(draw(scene), after, scene, {})


def lights_one_by_one(scene: Scene, draw: Renderer) -> Iterator[Pair]:
    """Switch the lights on one by one: irradiance is a sum over lights (Kajiya, The Rendering Equation, 1986)."""
    parts = [draw(replace(scene, lights=(light,))) for light in scene.lights]
    total = {stage: np.sum([part[stage] for part in parts], axis=0) for stage in LIGHT_STAGES}
    yield from pairs(total, draw(scene), scene, {}, LIGHT_STAGES)


def caged_light(scene: Scene, draw: Renderer) -> Iterator[Pair]:
    """Switch on a light behind the eye, in a sphere that begins at 0.9 or 0.995 of the way: every way to it is shut."""
    eye, target = np.asarray(scene.camera.eye), np.asarray(scene.camera.target)
    place = vector(eye + 0.25 * (eye - target))
    bright = PointLight(position=place, flux=vector(np.full(3, 50.0 * np.sum((eye - target) ** 2))))
    for share in (0.9, 0.995):
        radius = float((1 - share) * 1.25 * np.linalg.norm(eye - target))
        cage = Sphere(albedo=(0.0, 0.0, 0.0), center=place, radius=radius)
        dark = replace(scene, shapes=(*scene.shapes, cage))
        after = draw(replace(dark, lights=(*dark.lights, bright)))
        yield from pairs(draw(dark), after, scene, {}, LIGHT_STAGES, exact=True)


def twelve_lights(scene: Scene, draw: Renderer) -> Iterator[Pair]:
    """Put a light at each vertex of an icosahedron about its place: the mean stays, for n.L / r^2 is harmonic in it.

    The twelve vertices average polynomials up to degree 5 as the sphere does, so that the mean differs by terms of
    (radius / r)^6. Only pixels that all thirteen light are compared. Source: Axler, Bourdon and Ramey, Harmonic
    Function Theory (2001), theorem 1.4; Delsarte, Goethals and Seidel, Spherical Codes and Designs (1977).
    """
    golden = (1 + 5**0.5) / 2
    vertices = np.array([(0, a, b * golden) for a in (-1, 1) for b in (-1, 1)]) / np.hypot(1, golden)
    eye, target = np.asarray(scene.camera.eye), np.asarray(scene.camera.target)
    nearest = 0.3 * float(np.linalg.norm(eye - target))  # of what is seen, to a light behind the eye
    share = 0.004
    centre = eye + 0.3 * (eye - target)

    def lit_from(place: np.ndarray) -> StageImages:
        return draw(replace(scene, lights=(PointLight(position=vector(place), flux=(300.0, 200.0, 100.0)),)))

    ring = [lit_from(centre + share * nearest * np.roll(vertex, turn)) for turn in range(3) for vertex in vertices]
    middle = lit_from(centre)
    for stage in LIGHT_STAGES:
        images = np.stack([image[stage] for image in ring])
        lit = np.all(images > 0, axis=(0, -1)) & np.all(middle[stage] > 0, axis=-1)
        yield Pair(
            stage=stage,
            expected=images.mean(axis=0),
            rendered=middle[stage],
            scene=scene,
            truncation=8 * share**6,
            pixels=lit,
        )


def shifted_channels(scene: Scene, draw: Renderer) -> Iterator[Pair]:
    """Move the channels of flux and albedo on by one, multiply flux by 2^12 and albedo by 1/2: no digit changes.

    No formula has two channels in it, light is linear in both factors, and rounding commutes with powers of two (IEEE
    754-2019, section 4.3).
    """
    lights = (replace(light, flux=vector(np.roll(light.flux, 1) * 2.0**12)) for light in scene.lights)
    shapes = (replace(shape, albedo=vector(np.roll(shape.albedo, 1) * 0.5)) for shape in scene.shapes)
    after = draw(replace(scene, shapes=tuple(shapes), lights=tuple(lights)))
    reflected = dict.fromkeys(LIGHT_STAGES, lambda image: np.roll(image, 1, axis=-1) * 2.0**11)
    maps = {**reflected, Stage.IRRADIANCE: lambda image: np.roll(image, 1, axis=-1) * 2.0**12}
    yield from pairs(draw(scene), after, scene, maps, exact=True)


def scene_of(name: str) -> Scene:
    """Return a small image of a case."""
    (case,) = select([name])
    return seen_by(case.scene, width=SIZE[0], height=SIZE[1])


# A relation, a scene with the shapes and lights that it needs, and a planted fault of the tracer that breaks it.
RELATIONS: tuple[tuple[Relation, str, str], ...] = (
    (turned_world, "several_lights/inverse_square", "to_object=fault_moved_direction"),
    (mirrored_world, "random_scenes/seed_2", "world_normal=fault_world_winding"),
    (small_world, "random_scenes/seed_2", "shadow_ray=fault_wide_offset"),
    (wider_image, "random_scenes/seed_2", "half_extent=fault_no_aspect"),
    (same_view, "random_scenes/seed_2", "basis=fault_up_as_given"),
    (clipped_hits, "random_scenes/seed_2", "clip_depth=fault_far_ignored"),
    (shapes_behind, "random_scenes/seed_2", "sphere=fault_negative_root"),
    (cubes_of_squares, "random_scenes/seed_2", "square=fault_disc_local"),
    (lights_one_by_one, "several_lights/inverse_square", "sum_lights=fault_mean"),
    (caged_light, "shadows/every_blocker", "segment=fault_short"),
    (twelve_lights, "several_lights/inverse_square", "lambert=fault_missing"),
    (shifted_channels, "several_lights/inverse_square", "exitance=fault_albedo_squared"),
)


def traced(configuration: str) -> Renderer:
    """Return the tracer with a configuration."""
    chosen = Configuration.parse(configuration)
    return lambda scene: render(scene, IMAGE_STAGES, chosen)


def drawn_by_the_oracle(scene: Scene) -> StageImages:
    """Return the oracle's images."""
    return Analytic().render(scene, IMAGE_STAGES)


@pytest.mark.parametrize(("relation", "name", "fault"), RELATIONS)
@pytest.mark.parametrize("draw", [traced("float64"), drawn_by_the_oracle], ids=["tracer", "oracle"])
def test_a_relation_holds(draw: Renderer, relation: Relation, name: str, fault: str) -> None:
    compared = list(relation(scene_of(name), draw))

    assert [(pair.stage, pair.wrong()) for pair in compared if pair.wrong()] == []
    assert all(pair.pixels is None or pair.pixels.sum() > 100 for pair in compared)
    assert all(np.ptp(pair.expected) > 0 for pair in compared if pair.stage in (Stage.OBJECT, Stage.RADIANCE))


@pytest.mark.parametrize(("relation", "name", "fault"), RELATIONS)
def test_a_planted_fault_breaks_the_relation(relation: Relation, name: str, fault: str) -> None:
    assert any(pair.wrong() for pair in relation(scene_of(name), traced(f"float64/{fault}")))
