"""A scene for rtrace: rays of a Radiance view, materials, lights, surfaces, planes as discs.

Source: rpict(1), "-vp -vd -vu -vh -vv": an image point (x, y) in [0, 1]^2, y upwards, is seen along
direction + (x - 1/2) horizontal + (y - 1/2) vertical.
"""

import itertools
from collections.abc import Iterable, Iterator, Sequence
from functools import lru_cache
from math import frexp, inf, pi

import numpy as np

from rayproof.cases.placement import world_triangles
from rayproof.cases.scene import Camera, Cube, Mesh, Plane, PointLight, Rgb, Scene, Shape, Sphere, Square, Triangle

# Rays of a supersampled image that are in memory at once.
AT_ONCE = 2**20


def view(camera: Camera) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the unit viewing direction and the image's horizontal and vertical extent one unit ahead, (3,) each."""
    direction = np.asarray(camera.target, dtype=np.float64) - np.asarray(camera.eye, dtype=np.float64)
    direction /= np.linalg.norm(direction)
    up = np.asarray(camera.up, dtype=np.float64)
    # The part of `up` that the direction leaves, and the third axis from both.
    vertical = up - (up @ direction) * direction
    vertical /= np.linalg.norm(vertical)
    horizontal = np.cross(direction, vertical)
    height = 2.0 * np.tan(camera.alpha)
    return direction, horizontal * (height * camera.width / camera.height), vertical * height


def through(camera: Camera, x: np.ndarray, y: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return unit directions (n, 3) through image points in pixels from the top left, and their cosine with F (n,)."""
    direction, horizontal, vertical = view(camera)
    right, down = camera.sample_offset
    across = ((x + right) / camera.width - 0.5)[:, np.newaxis]
    upward = (0.5 - (y + down) / camera.height)[:, np.newaxis]
    towards = direction + across * horizontal + upward * vertical
    length = np.linalg.norm(towards, axis=1)
    return towards / length[:, np.newaxis], 1.0 / length


def centers(camera: Camera) -> tuple[np.ndarray, np.ndarray]:
    """Return x and y [px] of the pixels' centres, row by row from the top left, (lines * width,) each."""
    y, x = np.indices((camera.height, camera.width))
    return x.ravel() + 0.5, y.ravel() + 0.5


def parts(camera: Camera, samples: int) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """Yield x and y [px] of the centres of samples x samples parts of every pixel, pixel after pixel, in portions.

    Each portion has whole rounds over the image: shape (rounds * height * width,).
    """
    # A sample's offset is a share of its own part of the pixel.
    x, y = (place - (1 - 1 / samples) * move for place, move in zip(centers(camera), camera.sample_offset, strict=True))
    offsets = (np.arange(samples) + 0.5) / samples - 0.5
    moves = [(right, down) for down in offsets for right in offsets]
    rounds = max(1, AT_ONCE // len(x))
    for first in range(0, len(moves), rounds):
        chosen = moves[first : first + rounds]
        yield (
            np.concatenate([x + right for right, _ in chosen]),
            np.concatenate([y + down for _, down in chosen]),
        )


def interval(scene: Scene, cosine: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return from where to where [m] along unit directions of that cosine with F a hit counts, (n,) each."""
    camera = scene.camera
    if scene.clip == "depth":
        return camera.near / cosine, camera.far / cosine
    if scene.clip == "shell":
        return np.full_like(cosine, camera.near), np.full_like(cosine, camera.far)
    return np.zeros_like(cosine), np.full_like(cosine, np.inf)


# The size of a scene, and rtrace's unit of length for it.
#
# rtrace has one absolute length, FTINY = 1e-6 (fvect.h): it ignores nearer hits, refuses smaller spheres, and merges
# surfaces that are closer to each other. So a scene is written in units in which its largest coordinate is between 512
# and 1024; the factor is a power of two, so that no number is rounded.


FTINY = 1e-6  # in rtrace's units
LARGEST_EXPONENT = 10
# A plane's disc reaches at most this many times as far as everything else: rtrace finds no hits beyond 1e10 units.
HORIZON = 1e6
# The disc is a thousandth larger than the area that it must cover, so that no ray passes near its rim.
MARGIN = 1.001
CUBE_CORNERS = np.array(list(itertools.product((-0.5, 0.5), repeat=3)))
SQUARE_CORNERS = np.array([(-0.5, -0.5, 0.0), (0.5, -0.5, 0.0), (0.5, 0.5, 0.0), (-0.5, 0.5, 0.0)])


def scale(scene: Scene) -> float:
    """Return rtrace's units per metre, a power of two."""
    return 2.0 ** (LARGEST_EXPONENT - frexp(extent(scene))[1])


@lru_cache(maxsize=4)
def extent(scene: Scene) -> float:
    """Return the largest distance [m] from the origin, along an axis, of the eye, a light or a finite shape.

    A plane counts by its distance from the eye.
    """
    places = [scene.camera.eye, *(light.position for light in scene.lights)]
    largest = [float(np.abs(places).max())]
    for shape in scene.shapes:
        if isinstance(shape, Plane):
            largest.append(abs(height(shape, scene.camera.eye)[0]))
        else:
            low, high = box(shape)
            largest.append(float(np.maximum(np.abs(low), np.abs(high)).max()))
    # A scene of nothing but an eye at the origin has no size: any unit will do.
    return max(largest) or 1.0


@lru_cache(maxsize=256)
def box(shape: Shape) -> tuple[np.ndarray, np.ndarray]:
    """Return the lowest and highest world coordinates [m] of a finite shape, (3,) each."""
    if isinstance(shape, Triangle | Mesh):
        corners = world_triangles(shape).reshape(-1, 3).astype(np.float64)
        return corners.min(axis=0), corners.max(axis=0)
    matrix = np.asarray(shape.to_world, dtype=np.float64)
    if isinstance(shape, Sphere):
        center = matrix[:3, :3] @ np.asarray(shape.center) + matrix[:3, 3]
        half = shape.radius * np.sqrt((matrix[:3, :3] ** 2).sum(axis=1))
        return center - half, center + half
    if isinstance(shape, Cube | Square):
        corners = placed(matrix, CUBE_CORNERS if isinstance(shape, Cube) else SQUARE_CORNERS)
        return corners.min(axis=0), corners.max(axis=0)
    raise TypeError(f"{type(shape).__name__} has no box")


def placed(matrix: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Return object-space points (n, 3) in world space."""
    return points @ matrix[:3, :3].T + matrix[:3, 3]


def height(plane: Plane, point: tuple[float, float, float]) -> tuple[float, np.ndarray]:
    """Return a point's signed height [m] above the plane and the plane's unit normal (3,)."""
    matrix = np.asarray(plane.to_world, dtype=np.float64)
    # The inverse transpose's third column, without the inverse: a mirror turns the cross product around.
    normal = np.cross(matrix[:3, 0], matrix[:3, 1]) * np.sign(np.linalg.det(matrix[:3, :3]))
    normal /= np.linalg.norm(normal)
    return float(normal @ (np.asarray(point) - matrix[:3, 3])), normal


def reach(scene: Scene) -> float:
    """Return the radius [m] of the discs that replace planes, each about the projection of the eye onto its plane.

    Shadow rays run between visible points and lights, so that a ball about the eye that contains both also contains
    every crossing of a shadow ray with the plane.
    """
    camera = scene.camera
    vertical = np.tan(camera.alpha)
    farthest = inf if scene.clip == "none" else camera.far * float(np.sqrt(1 + vertical**2 * (1 + camera.aspect**2)))
    lights = [float(np.linalg.norm(np.subtract(light.position, camera.eye))) for light in scene.lights]
    return min(MARGIN * max(farthest, *lights) if lights else MARGIN * farthest, HORIZON * extent(scene))


# Materials and lights in Radiance's scene language (refman, "Materials"), and the conversion of radiances to watts.
#
# A point light is a sphere of radius r and radiance C: it sends the intensity pi r^2 C into every direction, and rtrace
# aims one ray at its centre. It is an `illum` with the alternate material `void`, which a camera's ray passes through.


# In rtrace's units, where the scene measures up to 1024: some roundings of those above FTINY, below which it refuses
# a sphere, and so small that its half solid angle at the far end of the scene is 1e-5.
LIGHT_RADIUS = 2.0**-7
# W/(m^2 sr): exact in float32, like the light's radius, so that neither costs a rounding.
LIGHT_RADIANCE = 2.0**34
# The intensity [W/sr] of that light, in rtrace's unit of length.
INTENSITY = pi * LIGHT_RADIUS**2 * LIGHT_RADIANCE
WHITE: Rgb = (1.0, 1.0, 1.0)
WHITE_PAINT = "void plastic white 0 0 5 1 1 1 0 0"
# Radiance's plastic is two-sided (-bv+). This pattern blackens surfaces seen from behind: Rdot, the cosine between the
# reversed ray and the normal, is negative there.
ONE_SIDED = 'void brightfunc one_sided 2 "if(Rdot,1,0)" . 0 0'


def painted(scene: Scene) -> list[str]:
    """Return a material `m<n>` for each shape: its albedo, and black from behind unless it is two-sided."""
    shapes = enumerate(scene.shapes)
    return [ONE_SIDED, *(_plastic(i, s.albedo, "void" if s.two_sided else "one_sided") for i, s in shapes)]


def light(source: PointLight, color: Sequence[float], scale: float) -> list[str]:
    """Return the light `source` in units of 1/scale m, with radiances LIGHT_RADIANCE times `color`."""
    place = " ".join(repr(coordinate * scale) for coordinate in source.position)
    radiance = " ".join(repr(LIGHT_RADIANCE * channel) for channel in color)
    return [f"void illum glow 1 void 0 3 {radiance}", f"glow sphere light 0 0 4 {place} {LIGHT_RADIUS!r}"]


def _plastic(index: int, albedo: Rgb, modifier: str) -> str:
    # The fourth and fifth number: no specular reflection, no roughness.
    return f"{modifier} plastic m{index} 0 0 5 {' '.join(map(repr, albedo))} 0 0"


# The specification's shapes as Radiance's, in Radiance's scene language (refman, "Surfaces").
#
# Face m of shape n is called `s<n>.<m>`; numbers are written with all the digits that a float64 has.


# Each side of the cube as indices into its corners, counter-clockwise seen from outside.
CUBE_SIDES = ((0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3))


def radius(sphere: Sphere) -> float:
    """Return the radius [m] of a sphere under a similarity."""
    return sphere.radius * float(np.linalg.norm(np.asarray(sphere.to_world)[:3, 0]))


def surfaces(scene: Scene, scale: float) -> Iterator[str]:
    """Yield the finite shapes' surfaces, in units of 1/scale m; shape n's modifier is `m<n>`."""
    for index, shape in enumerate(scene.shapes):
        if not isinstance(shape, Plane):
            yield from (f"m{index} {text}" for text in _surfaces(shape, f"s{index}", scale))


def discs(scene: Scene, scale: float) -> Iterator[tuple[int, str]]:
    """Yield each plane's index and the disc about the foot of the eye that replaces it, without a modifier."""
    eye = np.asarray(scene.camera.eye)
    for index, shape in enumerate(scene.shapes):
        if isinstance(shape, Plane):
            above, normal = height(shape, scene.camera.eye)
            numbers = _numbers([*((eye - above * normal) * scale), *normal, 0.0, reach(scene) * scale])
            yield index, f"ring s{index}.0 {numbers}"


def _surfaces(shape: Shape, name: str, scale: float) -> Iterator[str]:
    if isinstance(shape, Triangle | Mesh):
        corners = world_triangles(shape).astype(np.float64)
        first, second = corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
        # Degenerate triangles are never hit; Radiance would warn of each.
        kept = np.flatnonzero(np.any(np.cross(first, second) != 0, axis=1))
        # Each vertex is formatted only once, although several faces share it.
        vertices, uses = np.unique((corners[kept] * scale).reshape(-1, 3), axis=0, return_inverse=True)
        words = [" ".join(map(repr, vertex)) for vertex in vertices.tolist()]
        faces = uses.reshape(-1, 3)
        # Each face only once: oconv divides a box with more than 64 surfaces repeatedly, up to 2^14 times per side.
        for row in np.sort(np.unique(faces, axis=0, return_index=True)[1]).tolist():
            a, b, c = faces[row].tolist()
            yield f"polygon {name}.{kept[row]} 0 0 9 {words[a]} {words[b]} {words[c]}"
        return
    matrix = np.asarray(shape.to_world, dtype=np.float64)
    if isinstance(shape, Sphere):
        center = placed(matrix, np.asarray([shape.center]))[0]
        yield f"sphere {name}.0 {_numbers([*(center * scale), radius(shape) * scale])}"
    elif isinstance(shape, Square):
        yield f"polygon {name}.0 {_numbers(_turned(matrix, SQUARE_CORNERS) * scale)}"
    elif isinstance(shape, Cube):
        for side in CUBE_SIDES:
            yield f"polygon {name}.0 {_numbers(_turned(matrix, CUBE_CORNERS[list(side)]) * scale)}"
    else:
        raise LookupError(f"Radiance has not been taught the shape {type(shape).__name__}")


def _turned(matrix: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Return corners in world space, turned around under a mirror: a polygon's normal is by its winding."""
    world = placed(matrix, corners)
    return (world[::-1] if np.linalg.det(matrix[:3, :3]) < 0 else world).ravel()


def _numbers(values: Iterable[float]) -> str:
    digits = [repr(float(value)) for value in values]
    return f"0 0 {len(digits)} {' '.join(digits)}"
