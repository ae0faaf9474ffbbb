"""The scene's classes: `Camera`, `Sphere`, `Cube`, `Mesh`, `PointLight`, `Scene`, ...; validated where they are made.

Conventions are the specification's: right-handed world, metres, watts, degrees at the interface, linear RGB,
4x4 row-major matrices that act on column vectors with last row (0, 0, 0, 1); unit primitives in object space
placed by `to_world`; object normals outward, along +z, or by counter-clockwise winding.
"""

import hashlib
import json
import math
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any, Literal, Self

import numpy as np

Vector = tuple[float, float, float]
Rgb = tuple[float, float, float]
Row = tuple[float, float, float, float]
Matrix = tuple[Row, Row, Row, Row]
Shading = Literal["inverse_square", "simplified"]
Clip = Literal["depth", "shell", "none"]

SHADINGS: tuple[Shading, ...] = ("inverse_square", "simplified")
CLIPS: tuple[Clip, ...] = ("depth", "shell", "none")
IDENTITY: Matrix = ((1.0, 0.0, 0.0, 0.0), (0.0, 1.0, 0.0, 0.0), (0.0, 0.0, 1.0, 0.0), (0.0, 0.0, 0.0, 1.0))
# cos of the angle below which `up` counts as parallel to the viewing direction: closer than this the basis has
# lost half the digits of float64, and float32 has none left.
PARALLEL = 1.0 - 2.0**-27
SIMILAR = 1e-13  # 1 to within the rounding of the float64 numbers that describe a matrix

LONGEST_SHOWN = 60  # characters of a hostile value that a message repeats


class SceneError(ValueError):
    """A scene that the specification calls invalid; the message names the field, the value and its unit."""


def shown(value: Any, longest: int = LONGEST_SHOWN) -> str:
    """Return `value` as JSON on one line: control characters escaped, beyond `longest` characters shortened."""
    try:
        text = json.dumps(value, ensure_ascii=True)
    except (TypeError, ValueError, RecursionError):
        text = ascii(value)
    return text if len(text) <= longest else f"{text[: longest - 3]}..."


def _plain(name: str, value: Any) -> Any:
    """Return a number as Python's own, and sequences and arrays of numbers as tuples of such; refuse anything else.

    NumPy's numbers compare and print like Python's, but a renderer that gets one may refuse it much later.
    """
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, tuple | list):
        return tuple(_plain(name, part) for part in value)
    if isinstance(value, int | float) and not isinstance(value, bool):
        return value
    raise SceneError(f"{name} must be made of numbers, got {value!r}")


def _three(name: str, values: Any, unit: str = "") -> Any:
    """Return three numbers as a tuple of Python's own."""
    kept = _plain(name, values)
    if not isinstance(kept, tuple) or len(kept) != 3 or any(isinstance(part, tuple) for part in kept):
        raise SceneError(f"{name} must be three numbers, got {values!r}{' ' + unit if unit else ''}")
    return kept


def _number(name: str, value: Any, unit: str = "") -> Any:
    """Return a number as Python's own."""
    kept = _plain(name, value)
    if isinstance(kept, tuple):
        raise SceneError(f"{name} must be a number, got {value!r}{' ' + unit if unit else ''}")
    return kept


def _keep(thing: Any, **values: Any) -> None:
    """Replace fields of a frozen `thing` by plain values."""
    for name, value in values.items():
        object.__setattr__(thing, name, value)


def _finite(name: str, values: Any, unit: str = "") -> None:
    if not np.all(np.isfinite(np.asarray(values, dtype=np.float64))):
        raise SceneError(f"{name} must be finite, got {values}{' ' + unit if unit else ''}")


def _not_negative(name: str, values: Any, unit: str = "") -> None:
    _finite(name, values, unit)
    if min(values) < 0:
        raise SceneError(f"{name} must not be negative, got {values}{' ' + unit if unit else ''}")


def _length(vector: Any) -> float:
    with np.errstate(over="ignore"):  # infinite is long enough
        return float(np.linalg.norm(vector))


def _direction(vector: Any) -> np.ndarray:
    """Return a vector over its length, by an exact power of two first: its square might overflow."""
    scaled = np.ldexp(vector, -int(np.frexp(np.max(np.abs(vector)))[1]))
    return scaled / np.linalg.norm(scaled)


@dataclass(frozen=True, kw_only=True)
class Motion:
    """A small motion of shapes, of the size of the rounding errors of their numbers.

    The world is moved by an affine map, x + linear (x - center) + shift; shapes that share corners have the same map.
    In addition, each number that only one shape has is moved by up to `amount` of its size.
    """

    linear: np.ndarray  # (3, 3)
    center: np.ndarray  # (3,) m
    shift: np.ndarray  # (3,) m
    amount: float  # 1: the largest relative change of a number
    size: float  # m: of the corners' coordinates, which change by at most `amount` of it
    draw: np.random.Generator
    seed: int  # the motion of a place is drawn from its coordinates and this number, so that equal places stay equal

    def number(self, value: float, size: float | None = None) -> float:
        """Return a number moved by up to `amount` of its size."""
        return value + self.amount * (abs(value) if size is None else size) * float(self.draw.uniform(-1, 1))

    def matrix(self, to_world: Matrix) -> Matrix:
        """Return the model matrix after the map."""
        entries = np.array(to_world, dtype=np.float64)
        offset = entries[:3, 3] - self.center
        entries[:3, 3] += self.linear @ offset + self.shift
        entries[:3, :3] += self.linear @ entries[:3, :3]
        rows = entries.tolist()
        return (tuple(rows[0]), tuple(rows[1]), tuple(rows[2]), tuple(rows[3]))

    def of_places(self, places: np.ndarray) -> np.ndarray:
        """Return by how much [m] corners at these places (n, 3) [m] move beyond the map: equal places alike."""
        bits = np.ascontiguousarray(places + 0.0).view(np.uint64)  # 0 and -0 are one place
        mixed = np.full(len(bits), np.uint64(self.seed))
        moves = np.empty(places.shape)
        with np.errstate(over="ignore"):
            for axis in range(3):
                mixed = scrambled(mixed ^ bits[:, axis])
            for axis in range(3):
                mixed = scrambled(mixed + GOLDEN)
                moves[:, axis] = (mixed >> np.uint64(11)).astype(np.float64) * 2.0**-52 - 1
        return self.amount * self.size * moves


GOLDEN = np.uint64(0x9E3779B97F4A7C15)  # 2^64 over the golden ratio: the step between successive numbers


def scrambled(bits: np.ndarray) -> np.ndarray:
    """Return 64 bits that look like random ones (Steele, Lea and Flood, 2014: SplitMix64's finaliser)."""
    bits = (bits ^ (bits >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
    bits = (bits ^ (bits >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
    return bits ^ (bits >> np.uint64(31))


@dataclass(frozen=True, kw_only=True)
class Shape:
    """The properties of every shape: its placement, its albedo and whether both of its sides are lit and seen.

    Raises SceneError for a singular or non-finite matrix and for a negative albedo.
    """

    albedo: Rgb  # diffuse reflectance per channel, >= 0
    to_world: Matrix = IDENTITY
    two_sided: bool = False

    def __post_init__(self) -> None:
        _keep(self, albedo=_three("albedo", self.albedo), to_world=_plain("to_world", self.to_world))
        if not isinstance(self.two_sided, bool | np.bool_):
            raise SceneError(f"two_sided must be true or false, got {self.two_sided!r}")
        _keep(self, two_sided=bool(self.two_sided))
        _not_negative("albedo", self.albedo)
        rows = self.to_world if isinstance(self.to_world, tuple) else ()
        if [len(row) if isinstance(row, tuple) else 1 for row in rows] != [4, 4, 4, 4]:
            raise SceneError(f"to_world must be 4x4, got {self.to_world!r}")
        matrix = np.asarray(self.to_world, dtype=np.float64)
        if matrix.shape != (4, 4):
            raise SceneError(f"to_world must be 4x4, got shape {matrix.shape}")
        _finite("to_world", self.to_world)
        if tuple(matrix[3]) != (0.0, 0.0, 0.0, 1.0):
            raise SceneError(f"to_world's last row must be (0, 0, 0, 1), got {tuple(matrix[3])}")
        # Scale-free singularity: the smallest singular value against the largest, both in units of the matrix.
        singular = np.linalg.svd(matrix[:3, :3], compute_uv=False)
        if not singular[2] > singular[0] * 2.0**-50:
            raise SceneError(f"to_world is singular: singular values {tuple(map(float, singular))}")

    @cached_property
    def digest(self) -> str:
        """Return a text that equal shapes share, even from different files, and that differs for different shapes."""
        return repr(self)

    @property
    def corners(self) -> np.ndarray:
        """Return the world points (n, 3) [m] at which other shapes may adjoin; of most shapes there are none."""
        return np.zeros((0, 3))

    @property
    def extent(self) -> float:
        """Return the length [m] of the longest vector that the shape is placed and shaped by."""
        matrix = np.asarray(self.to_world, dtype=np.float64)
        return float(np.linalg.norm(matrix[:3, 3]) + np.abs(matrix[:3, :3]).sum(axis=1).max())

    def moved(self, motion: Motion) -> Self:
        """Return the shape with its numbers moved."""
        return replace(self, to_world=motion.matrix(self.to_world))

    def read_in(self, precision: str) -> Self:
        """Return the shape with its numbers rounded once to a precision, as a renderer reads them."""
        rows = np.asarray(self.to_world, dtype=precision).tolist()
        return replace(self, to_world=tuple(map(tuple, rows)))

    def _placed(self, points: np.ndarray) -> np.ndarray:
        """Return object-space points (n, 3) in the world [m]."""
        if self.to_world == IDENTITY:
            return points
        matrix = np.asarray(self.to_world, dtype=np.float64)
        return points @ matrix[:3, :3].T + matrix[:3, 3]

    def _moved_corners(self, points: np.ndarray, motion: Motion) -> np.ndarray:
        """Return object-space corners (n, 3) moved as their places in the world are."""
        if self.to_world == IDENTITY:
            return points + motion.of_places(points)
        matrix = np.asarray(self.to_world, dtype=np.float64)[:3, :3]
        return points + motion.of_places(self._placed(points)) @ np.linalg.inv(matrix).T


SQUARE_CORNERS = np.array([[-0.5, -0.5, 0.0], [0.5, -0.5, 0.0], [0.5, 0.5, 0.0], [-0.5, 0.5, 0.0]])
CUBE_CORNERS = np.array([(x, y, z) for x in (-0.5, 0.5) for y in (-0.5, 0.5) for z in (-0.5, 0.5)])


@dataclass(frozen=True, kw_only=True)
class Sphere(Shape):
    """A sphere in object space; with a non-uniform `to_world` an ellipsoid."""

    center: Vector = (0.0, 0.0, 0.0)  # m
    radius: float = 1.0  # m, > 0

    def __post_init__(self) -> None:
        super().__post_init__()
        _keep(self, center=_three("center", self.center, "m"), radius=_number("radius", self.radius, "m"))
        _finite("center", self.center, "m")
        _finite("radius", self.radius, "m")
        if not self.radius > 0:
            raise SceneError(f"radius must be positive, got {self.radius} m")

    @property
    def extent(self) -> float:
        """Return the length [m] of the longest vector that the sphere is placed and shaped by."""
        matrix = np.asarray(self.to_world, dtype=np.float64)
        reach = float(np.linalg.norm(self.center)) + self.radius
        return float(np.linalg.norm(matrix[:3, 3]) + np.abs(matrix[:3, :3]).sum(axis=1).max() * reach)

    def moved(self, motion: Motion) -> Self:
        """Return the sphere with matrix, centre and radius moved."""
        size = float(np.linalg.norm(self.center)) + self.radius
        x, y, z = (motion.number(coordinate, size) for coordinate in self.center)
        moved = replace(super().moved(motion), center=(x, y, z))
        return replace(moved, radius=motion.number(self.radius))

    def read_in(self, precision: str) -> Self:
        """Return the sphere with matrix, centre and radius rounded once to a precision."""
        x, y, z = np.asarray(self.center, dtype=precision).tolist()
        radius = float(np.asarray(self.radius, dtype=precision))
        return replace(super().read_in(precision), center=(x, y, z), radius=radius)


@dataclass(frozen=True, kw_only=True)
class Cube(Shape):
    """The cube [-0.5, 0.5]^3 in object space."""

    @property
    def corners(self) -> np.ndarray:
        """Return the eight corners."""
        return self._placed(CUBE_CORNERS)


@dataclass(frozen=True, kw_only=True)
class Square(Shape):
    """The square [-0.5, 0.5]^2 in z = 0 of object space, facing +z."""

    @property
    def corners(self) -> np.ndarray:
        """Return the four corners."""
        return self._placed(SQUARE_CORNERS)


@dataclass(frozen=True, kw_only=True)
class Plane(Shape):
    """The infinite plane z = 0 of object space, facing +z."""


@dataclass(frozen=True, kw_only=True)
class Triangle(Shape):
    """A triangle by three object-space vertices, rounded once to float32; its normal is by their winding."""

    vertices: tuple[Vector, Vector, Vector]  # m

    def __post_init__(self) -> None:
        super().__post_init__()
        _keep(self, vertices=tuple(_three("vertices", vertex, "m") for vertex in self.vertices))
        _finite("vertices", self.vertices, "m")
        with np.errstate(over="ignore"):  # an overflow is refused below, in words
            rounded = np.asarray(self.vertices, dtype=np.float32)
        if rounded.shape != (3, 3):
            raise SceneError(f"vertices must be three points of three coordinates, got shape {rounded.shape}")
        _finite("vertices (as float32)", rounded.tolist(), "m")
        object.__setattr__(self, "vertices", tuple(tuple(map(float, vertex)) for vertex in rounded))

    @property
    def corners(self) -> np.ndarray:
        """Return the three corners."""
        return self._placed(np.asarray(self.vertices, dtype=np.float64))

    @property
    def extent(self) -> float:
        """Return the greatest distance [m] of a corner from the world's origin."""
        return float(np.linalg.norm(self.corners, axis=1).max())

    def moved(self, motion: Motion) -> Self:
        """Return the triangle with its matrix and, each by itself, its corners moved."""
        corners = self._moved_corners(np.asarray(self.vertices, dtype=np.float64), motion)
        return replace(super().moved(motion), vertices=tuple(map(tuple, corners.tolist())))

    def read_in(self, precision: str) -> Self:
        """Return the triangle itself: corners in the world are rounded once for every renderer."""
        return self


@dataclass(frozen=True, kw_only=True, eq=False)
class Mesh(Shape):
    """A mesh of triangles: float32 object-space vertices (n, 3) [m] and int32 faces (m, 3). Equal by content.

    `file` is the mesh's file, relative to the scene file, or None for an inline mesh.
    """

    vertices: np.ndarray = field(repr=False)
    faces: np.ndarray = field(repr=False)
    file: str | None = None

    def __post_init__(self) -> None:
        super().__post_init__()
        with np.errstate(over="ignore"):  # an overflow is refused below, in words
            vertices = np.array(self.vertices, dtype=np.float32, order="C")
        faces = np.asarray(self.faces)  # checked before they are rounded to 32 bits, which would wrap around
        if vertices.ndim != 2 or vertices.shape[1] != 3:
            raise SceneError(f"vertices must have shape (n, 3), got {vertices.shape}")
        if faces.ndim != 2 or faces.shape[1] != 3 or len(faces) == 0:
            raise SceneError(f"faces must have shape (m, 3) with m >= 1, got {faces.shape}")
        if not np.all(np.isfinite(vertices)):
            row = int(np.flatnonzero(~np.isfinite(vertices).all(axis=1))[0])
            raise SceneError(f"vertices must be finite, got {vertices[row].tolist()} m at index {row}")
        least, greatest = faces.min(), faces.max()
        if not (least >= 0 and greatest < len(vertices)):
            wrong = greatest if least >= 0 else least
            raise SceneError(f"faces must index the {len(vertices)} vertices, got index {wrong}")
        original, faces = faces, np.array(faces, dtype=np.int32, order="C")
        if original.dtype.kind not in "iu" and np.any(original != faces):
            raise SceneError(
                f"faces must index the {len(vertices)} vertices, got index {original[original != faces][0]}"
            )
        vertices.setflags(write=False)
        faces.setflags(write=False)
        object.__setattr__(self, "vertices", vertices)
        object.__setattr__(self, "faces", faces)

    @property
    def corners(self) -> np.ndarray:
        """Return all vertices in the world."""
        return self._placed(self.vertices.astype(np.float64))

    @property
    def extent(self) -> float:
        """Return the greatest distance [m] of a vertex from the world's origin."""
        return float(np.linalg.norm(self.corners, axis=1).max())

    def moved(self, motion: Motion) -> Self:
        """Return the mesh with its matrix and its vertices moved; vertices at one place move as one."""
        vertices = self._moved_corners(self.vertices.astype(np.float64), motion)
        return replace(super().moved(motion), vertices=vertices)

    def read_in(self, precision: str) -> Self:
        """Return the mesh itself: corners in the world are rounded once for every renderer."""
        return self

    @cached_property
    def digest(self) -> str:
        """Return the SHA-256 of the mesh's content, independent of its file."""
        content = hashlib.sha256(self.vertices.tobytes() + self.faces.tobytes())
        # Including the number of vertices: the bytes of a face are also those of a vertex with tiny coordinates.
        content.update(repr((len(self.vertices), self.albedo, self.to_world, self.two_sided)).encode())
        return content.hexdigest()

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Mesh) and self.digest == other.digest

    def __hash__(self) -> int:
        return hash(self.digest)


@dataclass(frozen=True, kw_only=True)
class PointLight:
    """An isotropic point light; its intensity is flux / (4 pi). In `simplified` shading flux is the light's RGB."""

    position: Vector  # m
    flux: Rgb  # W per channel, >= 0

    def __post_init__(self) -> None:
        _keep(self, position=_three("position", self.position, "m"), flux=_three("flux", self.flux, "W"))
        _finite("position", self.position, "m")
        _not_negative("flux", self.flux, "W")


@dataclass(frozen=True, kw_only=True)
class Camera:
    """A pinhole camera; rays pass through pixel centres, or `sample_offset` away from them; row 0 is the top row."""

    eye: Vector  # m
    target: Vector  # m
    up: Vector  # any length, not parallel to target - eye
    fovy: float  # full vertical angle, degrees
    width: int  # px
    height: int  # px
    near: float  # m
    far: float  # m
    # px, to the right and down: rays pass through points so far from the pixels' centres, inside of the pixels. Not in
    # `repr`, from which nearby problems are drawn.
    sample_offset: tuple[float, float] = field(default=(0.0, 0.0), repr=False)

    def __post_init__(self) -> None:
        for name, unit in (("eye", "m"), ("target", "m"), ("up", "")):
            _keep(self, **{name: _three(name, getattr(self, name), unit)})
            _finite(name, getattr(self, name), unit)
        for name, unit in (("near", "m"), ("far", "m"), ("fovy", "degrees")):
            _keep(self, **{name: _number(name, getattr(self, name), unit)})
            _finite(name, getattr(self, name), unit)
        for name in ("width", "height"):
            size = getattr(self, name)
            size = size.item() if isinstance(size, np.integer) else size
            _keep(self, **{name: size})
            if not isinstance(size, int) or isinstance(size, bool) or size <= 0:
                raise SceneError(f"{name} must be a positive whole number, got {size} px")
        _keep(self, sample_offset=_plain("sample_offset", self.sample_offset))
        offset = self.sample_offset
        if not isinstance(offset, tuple) or np.shape(offset) != (2,) or not np.all(np.abs(offset) <= 0.5):
            raise SceneError(f"sample_offset must be two numbers from -0.5 to 0.5 px, got {shown(offset)}")
        if not 0 < self.fovy < 180:
            raise SceneError(f"fovy must lie inside (0, 180), got {self.fovy} degrees")
        if not self.near > 0:
            raise SceneError(f"near must be positive, got {self.near} m")
        if not self.near < self.far:
            raise SceneError(f"near must be less than far, got near {self.near} m and far {self.far} m")
        # Halved before they are subtracted: the difference may overflow.
        forward = np.subtract(np.divide(self.target, 2), np.divide(self.eye, 2))
        if not _length(forward) > 0:
            raise SceneError(f"eye and target must differ, got {self.eye} m twice")
        if not _length(self.up) > 0:
            raise SceneError(f"up must not be zero, got {self.up}")
        cosine = float(abs(np.dot(_direction(forward), _direction(self.up))))
        if cosine > PARALLEL:
            raise SceneError(f"up must not be parallel to the viewing direction, got up {self.up}")

    @property
    def aspect(self) -> float:
        """Return width / height."""
        return self.width / self.height

    @property
    def alpha(self) -> float:
        """Return half the vertical angle [rad]."""
        return math.radians(self.fovy) / 2


@dataclass(frozen=True, kw_only=True)
class Scene:
    """A scene: camera, shapes, lights, and the settings of clipping and shading."""

    camera: Camera
    shapes: tuple[Shape, ...]
    lights: tuple[PointLight, ...] = ()
    shading: Shading = "inverse_square"
    clip: Clip = "depth"

    def __post_init__(self) -> None:
        _keep(self, shapes=tuple(self.shapes), lights=tuple(self.lights))
        for name, kind, parts in (
            ("camera", Camera, (self.camera,)),
            ("shapes", Shape, self.shapes),
            ("lights", PointLight, self.lights),
        ):
            for part in parts:
                if not isinstance(part, kind):
                    raise SceneError(f"{name} must be made of {kind.__name__}, got {part!r}")
        if self.shading not in SHADINGS:
            raise SceneError(f"shading must be one of {', '.join(SHADINGS)}, got {self.shading!r}")
        if self.clip not in CLIPS:
            raise SceneError(f"clip must be one of {', '.join(CLIPS)}, got {self.clip!r}")


def is_similarity(matrix: Matrix) -> bool:
    """Return whether a matrix changes all lengths by one factor."""
    linear = np.asarray(matrix, dtype=np.float64)[:3, :3]
    gram = linear.T @ linear
    return bool(np.abs(gram / (np.trace(gram) / 3) - np.eye(3)).max() <= SIMILAR)
