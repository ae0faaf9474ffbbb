"""`SceneLadder`: ladders of scenes for whole renderers; one number of a small scene grows.

The numbers of a scene are float32 numbers, so that a renderer that stores float32 renders exactly the oracle's scene.
To add a ladder, add a `SceneLadder` to SCENE_LADDERS with a function from the number to the scene. The measurement is
in `reports.run.renderer_limits`.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from rayproof.cases.case import Case, covering
from rayproof.cases.placement import (
    camera_around,
    compose,
    frontal_fovy,
    matrix,
    rotation,
    scaling,
    translation,
    vector,
)
from rayproof.cases.scene import (
    IDENTITY,
    Camera,
    Cube,
    Mesh,
    PointLight,
    Scene,
    Shape,
    Sphere,
    Square,
    Triangle,
    Vector,
)

WIDTH, HEIGHT = 32, 24  # px, at most 48 x 36
LEAST_INTERIOR, MOST_EXPLAINED = 12, 0.5  # a value with fewer pixels, or with more explained by rounding, is undecided
MOST_RUNGS = 17  # after both ends, a bisection of four more renders finds the last passing value
ORIGIN: Vector = (0.0, 0.0, 0.0)
GREY: Vector = (0.7, 0.5, 0.3)
LAMP = PointLight(position=(2.0, -3.0, 4.0), flux=(300.0, 200.0, 400.0))


@dataclass(frozen=True, kw_only=True)
class Formulas:
    """The formula ladder that sweeps the same quantity in the same unit, and its default formula."""

    ladder: str
    formula: str  # slot/variant


@dataclass(frozen=True, kw_only=True)
class SceneLadder:
    """One sweep over scenes, from easy to hard."""

    name: str
    quantity: str  # the growing quantity, for the reader
    unit: str  # of the values; empty for a ratio or a number
    values: tuple[float, ...]
    scene: Callable[[float], Scene]
    control: bool = False  # all its values are always rendered
    formulas: Formulas | None = None

    def __post_init__(self) -> None:
        if not 1 < len(self.values) <= MOST_RUNGS:
            raise ValueError(f"ladder {self.name} must have 2 to {MOST_RUNGS} rungs, got {len(self.values)}")

    def case(self, rung: int) -> Case:
        """Return the case of the value with that index."""
        scene = in_float32(self.scene(self.values[rung]))
        return Case(
            name=f"limits/{self.name}/{rung}",
            scene=scene,
            stresses=f"{self.quantity}: {self.values[rung]:g}{f' {self.unit}' if self.unit else ''}.",
            covers=covering(scene),
            least_interior=LEAST_INTERIOR,
            most_explained=MOST_EXPLAINED,
            tuned=False,
        )


def in_float32(scene: Scene) -> Scene:
    """Return a scene whose lengths are all float32 numbers."""
    near, far = _rounded((scene.camera.near, scene.camera.far))
    camera = replace(
        scene.camera,
        eye=_rounded(scene.camera.eye),
        target=_rounded(scene.camera.target),
        up=_rounded(scene.camera.up),
        fovy=_rounded((scene.camera.fovy,))[0],
        near=near,
        far=far,
    )
    lights = [replace(light, position=_rounded(light.position), flux=_rounded(light.flux)) for light in scene.lights]
    return replace(scene, camera=camera, lights=tuple(lights), shapes=tuple(map(_rounded_shape, scene.shapes)))


def _rounded_shape(shape: Shape) -> Shape:
    shape = replace(shape, albedo=_rounded(shape.albedo))
    if shape.to_world != IDENTITY:
        shape = replace(shape, to_world=matrix(np.asarray(shape.to_world, dtype=np.float32)))
    if isinstance(shape, Sphere):
        return replace(shape, center=_rounded(shape.center), radius=_rounded((shape.radius,))[0])
    if isinstance(shape, Triangle):
        first, second, third = map(_rounded, shape.vertices)
        return replace(shape, vertices=(first, second, third))
    return shape


def _rounded(numbers: Sequence[float]) -> tuple[float, ...]:
    return tuple(float(np.float32(number)) for number in numbers)


def _seen(distance: float = 4.0, *, fovy: float = 40.0, target: Vector = ORIGIN, elevation: float = 30.0) -> Camera:
    return camera_around(
        target,
        distance=distance,
        azimuth=-50,
        elevation=elevation,
        width=WIDTH,
        height=HEIGHT,
        fovy=fovy,
        near=distance / 64,
        far=distance * 64,
    )


def _ball(**changes: object) -> Scene:
    """Return a sphere of radius 1 m on a floor, lit, with a shadow; `changes` replace fields of the scene."""
    floor = Square(albedo=(0.5, 0.5, 0.5), to_world=compose(translation(0, 0, -1.25), scaling(4, 4, 1)))
    scene = Scene(camera=_seen(6.0), shapes=(Sphere(albedo=GREY), floor), lights=(LAMP,))
    return replace(scene, **changes)


def _times(light: PointLight, factor: float) -> PointLight:
    first, second, third = (factor * number for number in light.flux)
    return replace(light, flux=(first, second, third))


def _grown(size: float, away: Vector = ORIGIN) -> Scene:
    """Return a sphere, a cube and a triangle `size` times as large about the origin, and then moved by `away` [m]."""
    motion = compose(translation(*away), scaling(size, size, size))

    def point(x: float, y: float, z: float) -> Vector:
        return vector(np.multiply((x, y, z), size) + away)

    camera = _seen(7.0)
    camera = replace(camera, eye=point(*camera.eye), target=away, near=camera.near * size, far=camera.far * size)
    shapes = (
        Sphere(albedo=GREY, center=point(-1.0, -0.5, 0.0), radius=0.75 * size),
        Cube(albedo=(0.3, 0.6, 0.4), to_world=compose(motion, translation(1, 0.5, 0), scaling(0.5, 0.625, 0.5))),
        Triangle(albedo=(0.5, 0.4, 0.6), vertices=(point(-3, -3, -1), point(4, -2, -1), point(0, 4, -1))),
    )
    light = replace(_times(LAMP, size**2), position=point(*LAMP.position))
    return Scene(camera=camera, shapes=shapes, lights=(light,))


def _distant(distance: float) -> Scene:
    """Return a sphere of radius 1 m that fills the image from `distance` m."""
    camera = _seen(distance, fovy=2 * math.degrees(math.atan(1.5 / distance)))
    return Scene(camera=camera, shapes=(Sphere(albedo=GREY),), lights=(LAMP,))


def _offset(distance: float) -> Scene:
    return _grown(1.0, vector(np.multiply((0.6, -0.64, 0.48), distance)))


def _narrow(fovy: float) -> Scene:
    return Scene(camera=_seen(fovy=fovy), shapes=(Sphere(albedo=GREY),), lights=(LAMP,))


def _wide(flare: float) -> Scene:
    """Return a room seen with an angle of 180 degrees less `flare`."""
    room = Cube(albedo=GREY, to_world=scaling(2, 2.5, 2), two_sided=True)
    camera = camera_around(
        ORIGIN, distance=0.5, azimuth=-50, elevation=20, width=WIDTH, height=HEIGHT, fovy=180 - flare
    )
    return Scene(camera=replace(camera, near=1e-12), shapes=(room,), lights=(replace(LAMP, position=(0.5, -0.5, 1)),))


def _sized(width: float, height: float) -> Scene:
    scene = _ball()
    return replace(scene, camera=replace(scene.camera, width=round(width), height=round(height)))


def _clipped(ratio: float) -> Scene:
    """Return the ball between two planes at its distance divided and multiplied by the root of their ratio."""
    scene, middle = _ball(), 6.0
    camera = replace(scene.camera, near=middle / math.sqrt(ratio), far=middle * math.sqrt(ratio))
    return replace(scene, camera=camera)


def _grazed(degrees: float) -> Scene:
    """Return a square of 2 m that is seen at a given angle [degrees] from its plane and fills the image."""
    rise = math.radians(degrees)
    camera = _seen(4.0, elevation=degrees, fovy=20)
    tilted = compose(rotation((0, 0, 1), -50), scaling(1 / math.sin(rise), 1, 1))
    camera = replace(camera, far=1e8)
    return Scene(camera=camera, shapes=(Square(albedo=GREY, to_world=tilted),), lights=(LAMP,))


def _plate(thickness: float) -> Scene:
    """Return a cube that is flattened to a plate, and another behind it."""
    flat = compose(rotation((1, 1, 0), 35), scaling(1, 1, thickness / 2))
    below = compose(translation(0, 0, -1), scaling(1.5, 1.5, 0.25))
    plates = (Cube(albedo=GREY, to_world=flat), Cube(albedo=(0.3, 0.6, 0.4), to_world=below))
    return Scene(camera=_seen(5.0), shapes=plates, lights=(LAMP,))


def _sliver(aspect: float) -> Scene:
    """Return a triangle of base 2 m with a given ratio of base to height; the image is as high as the triangle."""
    height = 2 / aspect
    base = np.array(((-1.0, 0.0, 0.0), (1.0, 0.0, 0.0), (0.25, height, 0.0)))
    turned = base @ np.asarray(compose(rotation((1, 2, 3), 40)))[:3, :3].T
    first, second, third = (vector(row) for row in np.float32(turned).astype(float))
    inside = vector(np.mean((first, second, third), axis=0))
    fovy = frontal_fovy(height=HEIGHT, pixel=height / HEIGHT, distance=4.0)
    camera = replace(_seen(4.0, target=inside, fovy=fovy), up=vector(np.subtract(third, first)))
    return Scene(camera=camera, shapes=(Triangle(albedo=GREY, vertices=(first, second, third)),), lights=(LAMP,))


def _squeezed(condition: float) -> Scene:
    """Return a rotated ellipsoid with two axes of 1 m and one of 1 / `condition` m."""
    squeezed = compose(rotation((3, 1, 0), 50), scaling(1, 1, 1 / condition), rotation((1, 2, 0), 30))
    return Scene(camera=_seen(5.0), shapes=(Sphere(albedo=GREY, to_world=squeezed),), lights=(LAMP,))


def _unequal(ratio: float) -> Scene:
    """Return a sphere of radius 1 m on another that is larger by a given factor."""
    large = Sphere(albedo=(0.5, 0.5, 0.5), center=(0.0, 0.0, -1.0 - ratio), radius=ratio)
    return Scene(camera=_seen(6.0), shapes=(Sphere(albedo=GREY), large), lights=(LAMP,))


def _shells(gap: float) -> Scene:
    """Return four spheres inside each other; the radius of each is smaller by `gap` than that around it."""
    shells = [Sphere(albedo=GREY, radius=1 - place * gap, two_sided=True) for place in range(4)]
    return Scene(camera=_seen(5.0), shapes=tuple(shells), lights=(LAMP,))


def _lit_from(distance: float) -> Scene:
    """Return the ball under a light at `distance` m, as bright on the ball as the usual one."""
    light = PointLight(position=vector(np.multiply((0.36, -0.48, 0.8), distance)), flux=LAMP.flux)
    return _ball(lights=(_times(light, (distance / 5) ** 2),))


def _lamps(number: float) -> Scene:
    """Return the ball under `number` lights on a spiral, together as bright as a single one."""
    turns = [(0.5 * place, 3 + 2 * place / number) for place in range(round(number))]
    lights = [
        replace(_times(LAMP, 1 / number), position=(3 * math.cos(angle), 3 * math.sin(angle), height))
        for angle, height in turns
    ]
    return _ball(lights=tuple(lights))


def _many(number: float) -> Scene:
    """Return `number` spheres on a square grid."""
    side = math.ceil(math.sqrt(number))
    shapes = [
        Sphere(albedo=GREY, center=(4 * (place % side + 0.5) / side - 2, 4 * (place // side + 0.5) / side - 2, 0.0),
               radius=1.5 / side)
        for place in range(round(number))
    ]  # fmt: skip
    return Scene(camera=_seen(6.0), shapes=tuple(shapes), lights=(LAMP,))


def _hills(faces: float) -> Scene:
    """Return a hilly square of about `faces` triangles."""
    side = max(1, round(math.sqrt(faces / 2)))
    x, y = (axis.ravel() for axis in np.meshgrid(np.linspace(-2, 2, side + 1), np.linspace(-2, 2, side + 1)))
    corners = np.stack((x, y, 0.25 * np.sin(3 * x) * np.cos(2 * y)), axis=1).astype(np.float32)
    first = (np.arange(side)[:, np.newaxis] * (side + 1) + np.arange(side)).ravel()
    lower = np.stack((first, first + 1, first + side + 1), axis=1)
    upper = np.stack((first + 1, first + side + 2, first + side + 1), axis=1)
    mesh = Mesh(albedo=GREY, vertices=corners, faces=np.concatenate((lower, upper)).astype(np.int32))
    return Scene(camera=_seen(6.0), shapes=(mesh,), lights=(LAMP,))


def _same(number: float) -> Scene:
    """Return a mesh with `number` faces at the same place, and a sphere before it.

    The image is small because certified numbers take long for many ties.
    """
    corners = np.array(((-3, -3, -1), (4, -2, -1), (0, 4, -1)), dtype=np.float32)
    faces = np.tile(np.arange(3, dtype=np.int32), (round(number), 1))
    mesh = Mesh(albedo=(0.5, 0.4, 0.6), vertices=corners, faces=faces)
    camera = replace(_seen(6.0), width=WIDTH // 2, height=HEIGHT // 2)
    return Scene(camera=camera, shapes=(Sphere(albedo=GREY), mesh), lights=(LAMP,))


def _albedo(albedo: float) -> Scene:
    return _ball(shapes=(Sphere(albedo=(albedo, albedo / 2, albedo / 4)),))


def _flux(factor: float) -> Scene:
    return _ball(lights=(PointLight(position=LAMP.position, flux=(factor, factor / 2, factor / 4)),))


def decades(first: int, last: int, step: int = 1) -> tuple[float, ...]:
    """Return powers of ten from the `first` exponent to the `last`."""
    return tuple(float(f"1e{exponent}") for exponent in range(first, last + (1 if step > 0 else -1), step))


def _halves(first: int, last: int) -> tuple[float, ...]:
    """Return powers of ten and three times each, from the `first` exponent to the `last`, up or down."""
    up = last > first
    exponents = range(first, last) if up else range(first, last, -1)
    pairs = [
        (f"1e{exponent}", f"3e{exponent}") if up else (f"1e{exponent}", f"3e{exponent - 1}") for exponent in exponents
    ]
    return (*(float(text) for pair in pairs for text in pair), float(f"1e{last}"))


def _doubled(last: int, step: int = 1) -> tuple[float, ...]:
    """Return powers of two up to the `last` exponent or the one before it."""
    return tuple(2.0**exponent for exponent in range(last % step, last + 1, step))


RAYS = "ray/reference_point"
SCENE_LADDERS: tuple[SceneLadder, ...] = (
    SceneLadder(
        name="distance", quantity="Distance of a sphere in radii", unit="", values=_halves(1, 8),
        scene=_distant, control=True, formulas=Formulas(ladder="SPH-FAR", formula="sphere/haines"),
    ),
    SceneLadder(
        name="offset", quantity="Offset of scene and camera from the origin", unit="m", values=_halves(0, 8),
        scene=_offset, control=True, formulas=Formulas(ladder="XF-FAR", formula="to_object/inverse"),
    ),
    SceneLadder(name="large", quantity="Size of the world", unit="m", values=decades(0, 16), scene=_grown),
    SceneLadder(name="small", quantity="Size of the world", unit="m", values=decades(0, -16, -1), scene=_grown),
    SceneLadder(
        name="narrow", quantity="Field of view", unit="degrees", values=(40.0, *decades(1, -6, -1)),
        scene=_narrow, formulas=Formulas(ladder="CAM-NARROW", formula=RAYS),
    ),
    SceneLadder(
        name="wide", quantity="180 degrees less the field of view", unit="degrees",
        values=(90.0, *decades(1, -5, -1)), scene=_wide, formulas=Formulas(ladder="CAM-WIDE", formula=RAYS),
    ),
    SceneLadder(
        name="aspect", quantity="Width over height of the image", unit="", values=(1.0, 2.0, 4.0, 8.0, 16.0, 48.0),
        scene=lambda ratio: _sized(48, 48 / ratio) if ratio > 1 else _sized(36, 36),
    ),
    SceneLadder(
        name="tall", quantity="Height over width of the image", unit="", values=(1.0, 2.0, 4.0, 9.0, 18.0, 36.0),
        scene=lambda ratio: _sized(36 / ratio, 36),
    ),
    SceneLadder(
        name="far_near", quantity="Far plane over near plane", unit="", values=decades(1, 17),
        scene=_clipped, formulas=Formulas(ladder="CAM-RATIO", formula=RAYS),
    ),
    SceneLadder(
        name="grazing", quantity="Angle between ray and square", unit="degrees", values=(30.0, *_halves(1, -5)),
        scene=_grazed,
    ),
    SceneLadder(
        name="plate", quantity="Thickness of a plate", unit="m", values=_halves(0, -8),
        scene=_plate, control=True,
    ),
    SceneLadder(
        name="sliver", quantity="Base over height of a triangle", unit="", values=_halves(0, 8),
        scene=_sliver, control=True, formulas=Formulas(ladder="TRI-SLIV", formula="triangle/woop_kahan"),
    ),
    SceneLadder(
        name="condition", quantity="Condition of the matrix", unit="", values=_halves(0, 8),
        scene=_squeezed, control=True,
    ),
    SceneLadder(name="radii", quantity="Ratio of two spheres' radii", unit="", values=_halves(0, 8), scene=_unequal),
    SceneLadder(
        name="shells", quantity="Gap between nested spheres", unit="m", values=_halves(-1, -9),
        scene=_shells, formulas=Formulas(ladder="TRI-ORDER", formula="nearest/smaller"),
    ),
    SceneLadder(name="light_far", quantity="Distance of the light", unit="m", values=decades(1, 17), scene=_lit_from),
    SceneLadder(name="bright", quantity="Flux of the light", unit="W", values=decades(2, 36, 3), scene=_flux),
    SceneLadder(name="dim", quantity="Flux of the light", unit="W", values=decades(2, -36, -3), scene=_flux),
    SceneLadder(name="albedo", quantity="Albedo", unit="", values=(1.0, *decades(-1, -40, -3)), scene=_albedo),
    SceneLadder(name="lights", quantity="Number of lights", unit="", values=_doubled(7), scene=_lamps),
    SceneLadder(name="shapes", quantity="Number of spheres", unit="", values=_doubled(8, 2), scene=_many),
    SceneLadder(name="faces", quantity="Number of faces of a mesh", unit="", values=_doubled(15, 2), scene=_hills),
    SceneLadder(name="same_faces", quantity="Number of identical faces", unit="", values=_doubled(6), scene=_same),
    SceneLadder(
        name="image", quantity="Height of the image", unit="px", values=(36.0, 24.0, 16.0, 12.0, 8.0, 6.0, 5.0),
        scene=lambda height: _sized(height * 4 / 3, height),
    ),
)  # fmt: skip
