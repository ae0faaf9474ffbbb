"""Hostile features of random scenes (cracked mesh, light on a surface, tight near, ...), each a function of a draft.

To add one: a function of a `Draft` in this module, under `@FEATURES.register("name", step=..., what=...)`. `step` is
the order of application; `what` is the sentence for the reader; a scene has at most one feature of a `group`;
`bare=True` if it needs no shape. Numbered scenes must not change: a new feature changes the assignment of features, and
so requires a new major number of `cases.random_scenes.EDITION`.
"""

from collections.abc import Callable
from dataclasses import replace
from enum import IntEnum
from typing import cast

import numpy as np

from rayproof.cases.placement import compose, mapped, rotation, scaling, shear, translation, vector
from rayproof.cases.random_scenes.draft import FLUX, Draft, placement, rgb, shape_of
from rayproof.cases.registry import Registry
from rayproof.cases.scene import Cube, Mesh, Plane, PointLight, Rgb, Sphere, Square, Triangle, Vector

FEATURES: Registry[Callable[[Draft], None]] = Registry(
    "feature of random scenes", package="rayproof.cases.random_scenes.features"
)


class Step(IntEnum):
    """The order of application of features: shapes come before cameras and lights that aim at them."""

    SHAPES = 0
    PLACES = 1
    LIGHTS = 2
    CAMERA = 3
    WHOLE = 4


# Shapes: faces and shapes that coincide or touch, matrices of every kind, surfaces of no area.


def _mesh(draft: Draft) -> tuple[int, Mesh]:
    index = draft.any_of(Mesh)
    return index, cast(Mesh, draft.shapes[index])


@FEATURES.register("duplicate_face", step=Step.SHAPES, what="A mesh has faces twice, in the same winding.")
def duplicate_face(draft: Draft) -> None:
    """Repeat one to three faces of a mesh."""
    index, mesh = _mesh(draft)
    chosen = [draft.draws.whole(0, len(mesh.faces) - 1) for _ in range(draft.draws.whole(1, 3))]
    draft.alter(index, faces=np.concatenate([mesh.faces, mesh.faces[chosen]]))


@FEATURES.register("reversed_face", step=Step.SHAPES, what="A mesh has faces twice, in both windings.")
def reversed_face(draft: Draft) -> None:
    """Repeat one to three faces of a mesh with two corners swapped."""
    index, mesh = _mesh(draft)
    chosen = [draft.draws.whole(0, len(mesh.faces) - 1) for _ in range(draft.draws.whole(1, 3))]
    draft.alter(index, faces=np.concatenate([mesh.faces, mesh.faces[chosen][:, [0, 2, 1]]]))


@FEATURES.register("cracked_mesh", step=Step.SHAPES, what="A mesh's faces do not quite meet.")
def cracked_mesh(draft: Draft) -> None:
    """Give one face corners of its own, off by 1e-7 to 1e-2 of their size."""
    index, mesh = _mesh(draft)
    face, gap = draft.draws.whole(0, len(mesh.faces) - 1), draft.draws.logarithmic(1e-7, 1e-2)
    own = mesh.vertices[mesh.faces[face]].astype(np.float64)
    moved = own + gap * (own.mean(axis=0) - own)
    faces = mesh.faces.copy()
    faces[face] = np.arange(3) + len(mesh.vertices)
    draft.alter(index, vertices=np.concatenate([mesh.vertices, moved]), faces=faces)


@FEATURES.register("degenerate_triangle", step=Step.SHAPES, what="A triangle or a face has no area.")
def degenerate_triangle(draft: Draft) -> None:
    """Add a face whose corners lie on a line, or a triangle that is a point or a line."""
    if draft.draws.chance(0.5):
        index, mesh = _mesh(draft)
        face = mesh.faces[draft.draws.whole(0, len(mesh.faces) - 1)]
        draft.alter(index, faces=np.concatenate([mesh.faces, [[face[0], face[1], face[1]]]]))
        return
    start, end = draft.draws.vector(-1, 1), draft.draws.vector(-1, 1)
    triangle = Triangle(albedo=rgb(draft.draws, 0.2, 0.9), vertices=(start, end, draft.draws.choice((start, end))))
    draft.shapes.append(triangle)


@FEATURES.register("coincident_shapes", step=Step.PLACES, what="Two shapes share a surface.")
def coincident_shapes(draft: Draft) -> None:
    """Put a shape where another one is: the same one again, or another kind in the same plane."""
    index = draft.any_of(Sphere, Cube, Square, Triangle, Mesh, Plane)
    shape, colour = draft.shapes[index], rgb(draft.draws, 0.2, 0.9)
    if isinstance(shape, Square | Plane) and draft.draws.chance(0.5):
        corners = ((-0.4, -0.4, 0.0), (0.4, -0.4, 0.0), (-0.1, 0.4, 0.0))
        twin = Triangle(albedo=colour, to_world=shape.to_world, vertices=corners, two_sided=shape.two_sided)
    elif isinstance(shape, Cube) and draft.draws.chance(0.5):
        lid = compose(shape.to_world, translation(0, 0, 0.5))
        twin = Square(albedo=colour, to_world=lid, two_sided=draft.draws.chance(0.5))
    else:
        twin = replace(shape, albedo=colour)
    draft.shapes.insert(draft.draws.whole(0, len(draft.shapes)), twin)


@FEATURES.register("touching_shapes", step=Step.PLACES, what="Two shapes touch in a point, an edge or a face.")
def touching_shapes(draft: Draft) -> None:
    """Put a sphere or a cube next to a cube or onto a square, so that they just touch."""
    index = draft.any_of(Cube, Square, Plane)
    host = draft.shapes[index].to_world
    height = 0.5 if isinstance(draft.shapes[index], Cube) else 0.0
    colour = rgb(draft.draws, 0.2, 0.9)
    if draft.draws.chance(0.5):
        guest = Sphere(albedo=colour, radius=0.25, to_world=compose(host, translation(0.1, 0.05, height + 0.25)))
    else:
        aside = draft.draws.choice((0.0, 0.25, 1.0))
        guest = Cube(albedo=colour, to_world=compose(host, translation(aside, 0, height + 0.5)))
    draft.shapes.append(guest)


def _placed(draft: Draft) -> int:
    """Return the index of a shape that a matrix may deform."""
    return draft.any_of(Sphere, Cube, Square, Triangle, Mesh)


@FEATURES.register("mirrored", step=Step.SHAPES, what="A shape's matrix mirrors.")
def mirrored(draft: Draft) -> None:
    """Mirror a shape along one of its axes."""
    index = _placed(draft)
    factors = [1.0, 1.0, 1.0]
    factors[draft.draws.whole(0, 2)] = -1.0
    draft.alter(index, to_world=compose(draft.shapes[index].to_world, scaling(*factors)))


@FEATURES.register("sheared", step=Step.SHAPES, what="A shape's matrix shears and stretches.")
def sheared(draft: Draft) -> None:
    """Shear a shape and stretch it unevenly."""
    index, draws = _placed(draft), draft.draws
    slant = shear(xy=draws.uniform(-1, 1), xz=draws.uniform(-1, 1), yz=draws.uniform(-1, 1))
    stretch = scaling(draws.uniform(0.5, 1.5), draws.uniform(0.5, 1.5), draws.uniform(0.5, 1.5))
    draft.alter(index, to_world=compose(draft.shapes[index].to_world, slant, stretch))


@FEATURES.register("ill_conditioned", step=Step.SHAPES, what="A shape's matrix has a condition number near 1000.")
def ill_conditioned(draft: Draft) -> None:
    """Squeeze a shape along a skew axis by 300 to 1000."""
    index, draws = _placed(draft), draft.draws
    turn, ratio = rotation(draws.direction(), draws.uniform(0, 180)), draws.logarithmic(300, 1000)
    size = ratio ** draws.uniform(0, 0.5)
    squeeze = scaling(size, size ** draws.uniform(0, 1), size / ratio)
    draft.alter(index, to_world=compose(draft.shapes[index].to_world, squeeze, turn))


@FEATURES.register("plane_alone", step=Step.SHAPES, group="shapes", what="There is nothing but an infinite plane.")
def plane_alone(draft: Draft) -> None:
    """Leave one plane that the camera looks down on."""
    draft.shapes[:] = [shape_of(Plane, draft.draws, translation(0, 0, -0.5))]
    draft.target = draft.draws.vector(-0.5, 0.5)


@FEATURES.register("crowded", step=Step.SHAPES, group="shapes", what="There are twelve to twenty shapes of one kind.")
def crowded(draft: Draft) -> None:
    """Add enough shapes of a kind for renderers to put them into a hierarchy."""
    kind = draft.draws.choice((Sphere, Cube, Square, Triangle))
    for _ in range(draft.draws.whole(12, 20)):
        draft.shapes.append(shape_of(kind, draft.draws, compose(placement(draft.draws), scaling(0.4, 0.4, 0.4))))


@FEATURES.register("two_sided", step=Step.SHAPES, what="Every shape is two-sided.")
def two_sided(draft: Draft) -> None:
    """Make every shape two-sided."""
    draft.shapes[:] = [replace(shape, two_sided=True) for shape in draft.shapes]


@FEATURES.register("empty", step=Step.SHAPES, group="shapes", bare=True, what="There is no shape.")
def empty(draft: Draft) -> None:
    """Remove every shape."""
    draft.shapes.clear()


@FEATURES.register("albedo_extremes", step=Step.SHAPES, what="Albedos are 0, or 1e12 apart between channels.")
def albedo_extremes(draft: Draft) -> None:
    """Give some shapes albedos from 0 to 1e6."""
    options = ((0.0, 0.0, 0.0), (0.0, 1.0, 0.5), (1e-6, 1.0, 1e6), (1.0, 1e-12, 0.3))
    draft.shapes[:] = [
        replace(shape, albedo=draft.draws.choice(options)) if index == 0 or draft.draws.chance(0.5) else shape
        for index, shape in enumerate(draft.shapes)
    ]


# Lights: their number, their brightness, and positions that are difficult for renderers.


def _move(draft: Draft, position: Vector) -> None:
    """Move one of the lights."""
    index = draft.draws.whole(0, len(draft.lights) - 1)
    draft.lights[index] = replace(draft.lights[index], position=position)


@FEATURES.register("no_light", step=Step.LIGHTS, group="lights", bare=True, what="There is no light.")
def no_light(draft: Draft) -> None:
    """Remove every light."""
    draft.lights.clear()


@FEATURES.register("many_lights", step=Step.LIGHTS, group="lights", bare=True, what="There are ten to twenty lights.")
def many_lights(draft: Draft) -> None:
    """Add lights all around."""
    while len(draft.lights) < draft.draws.choice((10, 14, 20)):
        place = np.asarray(draft.draws.direction()) * draft.draws.uniform(2, 6)
        draft.lights.append(PointLight(position=vector(place), flux=rgb(draft.draws, 0, FLUX)))


@FEATURES.register("light_inside", step=Step.LIGHTS, group="light place", what="A light is inside a shape.")
def light_inside(draft: Draft) -> None:
    """Put a light into a sphere or a cube."""
    _move(draft, draft.inner_point(draft.any_of(Sphere, Cube)))


@FEATURES.register("light_on_surface", step=Step.LIGHTS, group="light place", what="A light lies on a surface.")
def light_on_surface(draft: Draft) -> None:
    """Put a light onto a shape's surface."""
    _move(draft, draft.surface_point(draft.draws.whole(0, len(draft.shapes) - 1)))


@FEATURES.register("light_at_eye", step=Step.LIGHTS, group="light place", bare=True, what="A light is at the eye.")
def light_at_eye(draft: Draft) -> None:
    """Put a light at the eye."""
    _move(draft, draft.eye)


@FEATURES.register("grazing_light", step=Step.LIGHTS, group="light place", what="A light all but grazes a surface.")
def grazing_light(draft: Draft) -> None:
    """Put a light 1e-6 to 1e-2 above the plane of a square or a cube's face."""
    index = draft.any_of(Square, Cube)
    height = 0.0 if isinstance(draft.shapes[index], Square) else 0.5
    above = height + draft.draws.logarithmic(1e-6, 1e-2)
    _move(draft, mapped(draft.shapes[index].to_world, (draft.draws.uniform(0.2, 3), draft.draws.uniform(-1, 1), above)))


@FEATURES.register("flux_extremes", step=Step.LIGHTS, bare=True, what="Fluxes are 0, or 1e12 apart between channels.")
def flux_extremes(draft: Draft) -> None:
    """Give lights channels that are 0 or 1e12 apart."""
    options: tuple[Rgb, ...] = ((0.0, 0.0, 0.0), (0.0, FLUX, 1e-9 * FLUX), (1e-6, 1.0, 1e6), (1e12, 1.0, 0.0))
    draft.lights[:] = [replace(light, flux=draft.draws.choice(options)) for light in draft.lights]


@FEATURES.register("simplified", step=Step.LIGHTS, group="shading", bare=True, what="Shading is simplified.")
def simplified(draft: Draft) -> None:
    """Use the lights' colours unchanged."""
    draft.shading = "simplified"
    scale = 1 / FLUX
    draft.lights[:] = [
        replace(light, flux=cast(Rgb, tuple(value * scale for value in light.flux))) for light in draft.lights
    ]


@FEATURES.register("light_in_plane", step=Step.LIGHTS, group="light place", what="A light lies in a surface's plane.")
def light_in_plane(draft: Draft) -> None:
    """Put a light into the plane of a square or a triangle, outside of it."""
    index = draft.any_of(Square, Triangle)
    shape = draft.shapes[index]
    if isinstance(shape, Triangle):
        first, second, third = map(np.asarray, shape.vertices)
        _move(draft, mapped(shape.to_world, vector(first + 1.7 * (second - first) + 0.4 * (third - first))))
    else:
        _move(draft, mapped(shape.to_world, (draft.draws.uniform(0.6, 2), draft.draws.uniform(-1, 1), 0.0)))


# Cameras: position of the eye, field of view, clipping, size of the image; and features of the whole scene.


@FEATURES.register("eye_inside", step=Step.CAMERA, group="eye", what="The eye is inside a shape.")
def eye_inside(draft: Draft) -> None:
    """Put the eye into a sphere or a cube."""
    draft.eye = draft.inner_point(draft.any_of(Sphere, Cube))
    draft.near = 1e-3


@FEATURES.register("eye_on_surface", step=Step.CAMERA, group="eye", what="The eye lies on a surface.")
def eye_on_surface(draft: Draft) -> None:
    """Put the eye onto a shape's surface."""
    index = draft.draws.whole(0, len(draft.shapes) - 1)
    draft.eye = draft.surface_point(index)
    draft.near = draft.draws.choice((1e-3, 0.05))


@FEATURES.register("grazing_view", step=Step.CAMERA, group="eye", what="The view all but grazes a square.")
def grazing_view(draft: Draft) -> None:
    """Look at a square from 1e-3 to 1e-1 above its plane."""
    shape = draft.shapes[draft.any_of(Square)]
    draft.eye = mapped(shape.to_world, (2.5, draft.draws.uniform(-0.4, 0.4), draft.draws.logarithmic(1e-3, 1e-1)))
    draft.target = mapped(shape.to_world, (0.0, 0.0, 0.0))


@FEATURES.register("on_axis", step=Step.CAMERA, group="eye", what="The view is along an axis, with unturned shapes.")
def on_axis(draft: Draft) -> None:
    """Look along an axis of the world at a cube that is not turned."""
    axis = draft.draws.whole(0, 2)
    eye, up = [0.0, 0.0, 0.0], [0.0, 0.0, 0.0]
    eye[axis], up[(axis + 1) % 3] = draft.draws.choice((-4.0, 4.0)), 1.0
    draft.shapes.append(Cube(albedo=(0.7, 0.5, 0.3)))
    draft.eye, draft.target, draft.up = (eye[0], eye[1], eye[2]), (0.0, 0.0, 0.0), (up[0], up[1], up[2])


@FEATURES.register("tight_near", step=Step.CAMERA, group="near", bare=True, what="The near plane cuts the geometry.")
def tight_near(draft: Draft) -> None:
    """Put the near plane near the camera's target."""
    draft.near = draft.distance * draft.draws.uniform(0.9, 1.02)


@FEATURES.register("tight_far", step=Step.CAMERA, group="far", bare=True, what="The far plane cuts the geometry.")
def tight_far(draft: Draft) -> None:
    """Put the far plane through the camera's target."""
    draft.far = draft.distance * draft.draws.uniform(1.0, 1.1)


@FEATURES.register("deep_frustum", step=Step.CAMERA, group="near", bare=True, what="far / near is 1e7.")
def deep_frustum(draft: Draft) -> None:
    """Put the near plane next to the eye and the far plane very far."""
    draft.near = 1e-3
    draft.far = max(draft.far, 1e4)


@FEATURES.register("shell_clip", step=Step.CAMERA, group="clip", bare=True, what="Clipping is a spherical shell.")
def shell_clip(draft: Draft) -> None:
    """Clip by distance, somewhere in the geometry."""
    draft.clip, draft.near = "shell", draft.distance * draft.draws.uniform(0.2, 1)


@FEATURES.register("no_clip", step=Step.CAMERA, group="clip", bare=True, what="Nothing is clipped.")
def no_clip(draft: Draft) -> None:
    """Clip nothing."""
    draft.clip = "none"


@FEATURES.register("one_pixel", step=Step.CAMERA, group="size", bare=True, what="The image has 1 x 1 pixel.")
def one_pixel(draft: Draft) -> None:
    """Make the image one pixel."""
    draft.width, draft.height = 1, 1


@FEATURES.register("few_pixels", step=Step.CAMERA, group="size", bare=True, what="The image has 7 x 3 pixels.")
def few_pixels(draft: Draft) -> None:
    """Make the image 7 x 3 pixels."""
    draft.width, draft.height = 7, 3


@FEATURES.register("one_column", step=Step.CAMERA, group="size", bare=True, what="The image has 1 x 200 pixels.")
def one_column(draft: Draft) -> None:
    """Make the image 1 x 200 pixels."""
    draft.width, draft.height = 1, 200


@FEATURES.register("narrow_view", step=Step.CAMERA, group="fovy", what="fovy is 1e-3 to 1e-2 degrees.")
def narrow_view(draft: Draft) -> None:
    """Look at a point of a surface through a telescope."""
    draft.target = draft.surface_point(draft.draws.whole(0, len(draft.shapes) - 1))
    if draft.distance == 0:
        draft.target = (draft.eye[0] + 1.0, draft.eye[1], draft.eye[2])
    draft.fovy = draft.draws.choice((1e-3, draft.draws.logarithmic(1e-3, 1e-2)))


@FEATURES.register("wide_view", step=Step.CAMERA, group="fovy", bare=True, what="fovy is 150 to 175 degrees.")
def wide_view(draft: Draft) -> None:
    """Look with a very wide angle from close by."""
    draft.fovy = draft.draws.choice((175.0, draft.draws.uniform(150, 175)))
    if draft.eye == draft.target:
        return
    draft.eye = vector(np.asarray(draft.target) + 0.35 * np.subtract(draft.eye, draft.target))


@FEATURES.register("tiny", step=Step.WHOLE, group="scale", bare=True, what="The scene is 1e-4 to 1e-2 m large.")
def tiny(draft: Draft) -> None:
    """Shrink everything."""
    draft.scale = draft.draws.choice((1e-4, draft.draws.logarithmic(1e-4, 1e-2)))


@FEATURES.register("huge", step=Step.WHOLE, group="scale", bare=True, what="The scene is 1e2 to 1e4 m large.")
def huge(draft: Draft) -> None:
    """Enlarge everything."""
    draft.scale = draft.draws.choice((1e4, draft.draws.logarithmic(1e2, 1e4)))


@FEATURES.register("far_away", step=Step.WHOLE, bare=True, what="The scene is 10 to 10 000 m from the origin.")
def far_away(draft: Draft) -> None:
    """Move everything away from the origin; of a tiny scene by as many of its own sizes."""
    reach = draft.draws.logarithmic(10, 1e4) * min(1.0, draft.scale)
    draft.offset = vector(np.asarray(draft.draws.direction()) * reach)
