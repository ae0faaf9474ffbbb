"""`Conditioning`: amplification factors of rounding at each pixel, for camera, shapes, normals and lights.

By the implicit function theorem a hit moves along its ray by (normal component of the data's error) / |n.d|; the data
are the ray's origin, its far end and the surface's own placement, each transformed by the model matrix and its inverse.
Sources: Higham, Accuracy and Stability of Numerical Algorithms, 2nd ed. (2002), chapters 1 and 3; Pharr, Jakob and
Humphreys, Physically Based Rendering, 4th ed. (2023), section 6.8.
"""

import math
from dataclasses import dataclass

import numpy as np

from rayproof.cases.placement import placed, world_triangles
from rayproof.cases.scene import IDENTITY, Camera, Cube, Mesh, Scene, Shape, Sphere, Square, Triangle
from rayproof.cases.stages import Stage, StageImages
from rayproof.reports.judge.answers import crossed, dot, largest, length

# A hit nearer to grazing than this is next to an outline, where nearby problems decide instead of a limit.
LEAST_COSINE = 1e-9
SIMILAR = 1e-6  # largest condition number, minus 1, of a matrix that stretches all directions alike
# The factors of curved shapes.
CURVED = ("carried", "put_back", "solved", "swollen", "local", "whirl", "loss", "curvature", "bend", "give")
# Six of the 16 roundings of a ray belong to sx = 2 px / w - 1 or sy, and have absolute errors of u: two of the quotient
# (1 / w, product), two of the factor, and two of the subtrahend and the difference. The four roundings from there to
# the ray are relative.
ABSOLUTE, RELATIVE = 6, 4


@dataclass(frozen=True, kw_only=True)
class Conditioning:
    """Amplification factors per pixel, shape (height, width); multiply by a count of unit roundoffs."""

    hit: np.ndarray  # bool
    pixel_angle: np.ndarray  # rad per pixel, the smaller of the two image directions
    ray: np.ndarray  # rad: direction error per roundoff of the computation from the camera's axes on
    aim: np.ndarray  # rad: the same for the coordinates of eye and target
    axial: np.ndarray  # cosine of the ray's angle to the view's axis
    cosine: np.ndarray  # |n.d|; 1 on a miss
    distance: np.ndarray  # m, the absolute value; 0 on a miss
    surface: np.ndarray  # m: error of the surface along its normal, per roundoff
    point: np.ndarray  # m: error of the surface in any direction, per roundoff
    carried: np.ndarray  # m: the same for an ellipsoid whose hits are computed in object space; 0 for other shapes
    put_back: np.ndarray  # m: shift of such a hit along the surface when it is projected onto its sphere
    solved: np.ndarray  # m: error of an ellipsoid along its normal if t is solved from a distant origin
    swollen: np.ndarray  # m: the same at the nearest point of its outline
    matrix: np.ndarray  # 1: condition number of the model matrix
    local: np.ndarray  # 1: relative error of the object-space point for a curved normal
    whirl: np.ndarray  # rad per roundoff: turn of a curved surface's normal by the position's error
    loss: np.ndarray  # 1: by how much it shortens the normal before normalisation, relative, per roundoff
    curvature: np.ndarray  # 1/m: largest normal curvature
    bend: np.ndarray  # 1/m: change of angle of the normal at the hit by an error of the position
    give: np.ndarray  # 1/m: by how much it shortens the normal before normalisation, relative
    baking: np.ndarray  # 1: error of a triangle's normal taken from baked world-space corners, per roundoff of float32
    placing: np.ndarray  # 1: error of a square's or cube's normal taken from its corners in world space, per roundoff

    @property
    def along_ray(self) -> np.ndarray:
        """Return the error of the distance for a given ray [m per roundoff]."""
        return self.surface / self.cosine + self.distance

    def turned(self, moved: np.ndarray | float) -> np.ndarray:
        """Return the angle [rad] by which a position's error [m] turns the normal, linear before normalisation."""
        return np.minimum(self.curvature * moved, _off(self.bend * moved, self.give * moved))

    def rounded(self, units: float) -> np.ndarray:
        """Return the angle [rad] by which `units` roundings turn a normal computed from the object-space point."""
        carried = np.minimum(self.matrix * self.local * units, _off(self.whirl * units, self.loss * units))
        return self.matrix * units + carried

    @property
    def swing(self) -> np.ndarray:
        """Return the shift of the hit along the surface per angle of the ray [m per rad]."""
        return self.distance / self.cosine


def _off(across: np.ndarray, along: np.ndarray) -> np.ndarray:
    """Return a bound of the angle [rad] by which a unit vector turns if moved by `across` and `along` itself."""
    return np.where(along < 1, across / np.where(along < 1, 1 - along, 1.0), np.inf)


def basis_condition(camera: Camera) -> float:
    """Return the relative error of the camera's axes per unit roundoff of eye, target and up (CAM-1)."""
    eye, target, up = (np.asarray(vector, dtype=np.float64) for vector in (camera.eye, camera.target, camera.up))
    forward = target - eye
    sine = np.linalg.norm(np.cross(forward, up)) / (np.linalg.norm(forward) * np.linalg.norm(up))
    return float((1 + (np.linalg.norm(eye) + np.linalg.norm(target)) / np.linalg.norm(forward)) / sine)


def aim_condition(camera: Camera) -> float:
    """Return the direction error [rad] per unit roundoff of eye and target, by cancellation in their difference.

    Only the rounding of these data is large compared with the difference; roundings of later operations are not.
    """
    eye, target, up = (np.asarray(vector, dtype=np.float64) for vector in (camera.eye, camera.target, camera.up))
    apart = float(np.linalg.norm(target - eye))
    sine = float(np.linalg.norm(np.cross(target - eye, up))) / (apart * float(np.linalg.norm(up)))
    reach = math.tan(camera.alpha) * max(1.0, camera.aspect)
    return float(np.linalg.norm(eye) + np.linalg.norm(target)) / apart / sine * min(1 + reach, 2.0)


def image_reach(camera: Camera) -> float:
    """Return the shift of a ray's point at depth 1 if both pixel coordinates (sx, sy) change by 1."""
    return math.tan(camera.alpha) * math.hypot(camera.aspect, 1.0)


def ray_condition(camera: Camera, axial: np.ndarray) -> np.ndarray:
    """Return the direction error per unit roundoff [rad]: the axes, tan(alpha), and the pixel's coordinates.

    The error of F + a R + b U is 1 + |a| + |b| times that of the axes, so it turns by at most sqrt(3) times that error
    in any field of view: its length is sqrt(1 + a^2 + b^2), 1 over the cosine `axial` of its angle to the axis. An
    error of sx moves a by aspect tan(alpha) times that error, which turns the ray by at most this times `axial`.
    """
    reach = math.tan(camera.alpha) * max(1.0, camera.aspect)
    slope, widest = camera.alpha / (math.sin(camera.alpha) * math.cos(camera.alpha)), min(reach, 1.0)
    # Sixteen relative roundings exceed the sum of both kinds, unless the image is wide.
    coordinates = np.maximum(1.0, (RELATIVE + ABSOLUTE * image_reach(camera) * axial / widest) / 16)
    return basis_condition(camera) * min(1 + reach, 2.0) + (coordinates + slope) * widest


def off_axis(camera: Camera, directions: np.ndarray) -> np.ndarray:
    """Return the cosine of the angle between rays and the view's axis, shape (height, width)."""
    forward = np.subtract(camera.target, camera.eye, dtype=np.float64)
    return np.clip(directions @ (forward / np.linalg.norm(forward)), 0.0, 1.0)


def pixel_angle(camera: Camera, directions: np.ndarray) -> np.ndarray:
    """Return the smaller angle between neighbouring pixels' rays [rad], shape (height, width)."""
    return 2 * math.tan(camera.alpha) / camera.height * off_axis(camera, directions) ** 2


def condition(scene: Scene, truth: StageImages) -> Conditioning:
    """Return the amplification factors of a scene, from the analytic answers up to the normal."""
    directions, objects = truth[Stage.RAY], truth[Stage.OBJECT]
    shape = objects.shape[:2]
    hit = objects[..., 0] >= 0
    cosine = np.ones(shape)
    cosine[hit] = np.abs(dot(truth[Stage.NORMAL][hit], directions[hit])).clip(LEAST_COSINE)
    distance = np.where(hit, np.abs(truth[Stage.DISTANCE][..., 0]), 0.0)
    fields = {name: np.zeros(shape) for name in ("surface", "point", "baking", "placing", *CURVED)} | {
        "matrix": np.ones(shape)
    }
    for index, scene_shape in enumerate(scene.shapes):
        mask = objects[..., 0] == index
        if np.any(mask):
            for name, values in _of_shape(scene, scene_shape, mask, truth, distance).items():
                fields[name][mask] = values
    aim, axial = aim_condition(scene.camera), off_axis(scene.camera, directions)
    return Conditioning(
        hit=hit,
        pixel_angle=pixel_angle(scene.camera, directions),
        ray=ray_condition(scene.camera, axial) - aim,
        aim=np.full(shape, aim),
        axial=axial,
        cosine=cosine,
        distance=distance,
        **fields,
    )


def _of_shape(scene: Scene, shape: Shape, mask: np.ndarray, truth: StageImages, distance: np.ndarray) -> dict:
    """Return the factors at the pixels of one shape."""
    eye = np.abs(np.asarray(scene.camera.eye, dtype=np.float64))
    normal, position = np.abs(truth[Stage.NORMAL][mask]), np.abs(truth[Stage.POSITION][mask])
    singular = np.linalg.svd(placed(shape)[0], compute_uv=False)
    number = singular[0] / singular[2]
    if isinstance(shape, Triangle | Mesh):
        corners = world_triangles(shape).astype(np.float64)
        faces = corners[truth[Stage.OBJECT][mask][:, 1].astype(int)]
        reach = distance[mask] + _longest_edge(faces)
        surface = dot(normal, eye + position) + reach * _aspect(faces)
        point = length(eye + position) + reach
        # A corner's error is half a unit in the last place of its coordinates, independent of the hit's place on the
        # triangle.
        moved = 0.0 if shape.to_world == IDENTITY else largest(length(faces)) / _least_height(faces)
        return {"surface": surface, "point": point, "matrix": number * _aspect(faces), "baking": moved}
    carried = _carried(shape, eye, position)
    factors = {"surface": dot(normal, carried), "point": length(carried), "matrix": np.full(len(normal), number)}
    if isinstance(shape, Sphere):
        factors |= _curved(shape, np.asarray(scene.camera.eye), truth, mask)
        # A renderer that treats an ellipsoid as an instance treats a mirrored sphere as one too.
        factors["carried"] = factors["point"] * (number > 1 + SIMILAR or np.linalg.det(placed(shape)[0]) < 0)
    if isinstance(shape, Cube | Square):
        factors["placing"] = _placing(shape, truth[Stage.NORMAL][mask])
    return factors


def _curved(shape: Sphere, eye: np.ndarray, truth: StageImages, mask: np.ndarray) -> dict:
    """Return the amplification factors of a sphere's normals and hits, at its pixels (n,).

    Let p be the object-space point relative to the centre. w = M^-T p is the normal before normalisation, and is linear
    in p. An error e of p turns it by at most |(1 - n n^T) M^-T e| / (|w| - |M^-T e|): hardly at all where a squeezed
    sphere is flat, because M^-T e is along the normal there. e is the error of the point, transformed by an inverse of
    which each column may have a relative error of |M^-1| |M| (Higham, 2002, section 14.1). For an error dx of the
    position, e is M^-1 dx.

    Mitsuba moves the origin of an object-space ray o + t d, |d| = 1 along the least stretch, to t = -(o.d) / |d|, which
    is close to the sphere only if |d| is 1, and solves from there. The remaining o is squared and r^2 subtracted: a
    rounding of |o|^2 changes r by half of |o|^2 / r, and so the surface along its normal, r / |w| per unit, by |o|^2 /
    |w|. For the outline, w is that of the ray's point closest to the centre, scaled to the sphere. Finally o + t d is
    projected onto the sphere, radially from the centre. Due to the roundings of t and of the point this shift is a
    share of |p|, and the same share of a flat ellipsoid's long axis, which is more than the point's distance from the
    surface.
    """
    rays, position, normal = (truth[stage][mask] for stage in (Stage.RAY, Stage.POSITION, Stage.NORMAL))
    (linear, shift), center = placed(shape), np.asarray(shape.center)
    inverse, singular = np.linalg.inv(linear), np.linalg.svd(linear, compute_uv=False)
    arrived = (np.abs(position) + np.abs(shift)) @ np.abs(inverse).T + np.abs(center)
    off = length(arrived @ (np.abs(inverse) @ np.abs(linear)).T)
    local = (position - shift) @ inverse.T - center
    whole, share = length(local @ inverse), dot(np.abs(local), arrived + np.abs(eye) @ np.abs(inverse).T)
    ways, start = rays @ inverse.T * singular[2], inverse @ (eye - shift) - center
    left, closest = (start - ways * ((ways @ start) / length(ways) ** n)[:, np.newaxis] for n in (1, 2))
    squeezed = singular[0] > (1 + SIMILAR) * singular[2]
    distant_error, share = dot(left, left) * squeezed, share + np.abs(dot(position - eye, normal)) * whole
    return {
        "put_back": length(local @ linear.T) * squeezed * share / shape.radius**2,
        "solved": distant_error / whole,
        "swollen": distant_error * length(closest) / np.maximum(length(closest @ inverse) * shape.radius, 1e-300),
        "local": length(arrived) / shape.radius,
        "whirl": _across(normal, inverse.T) * off / whole,
        "loss": off / (singular[2] * whole),
        "curvature": singular[0] / (singular[2] ** 2 * shape.radius),
        "bend": _across(normal, inverse.T @ inverse) / whole,
        "give": 1 / (singular[2] ** 2 * whole),
    }


def _across(normal: np.ndarray, matrix: np.ndarray) -> np.ndarray:
    """Return the Frobenius norm (n,) of a matrix without its part along each normal (n, 3), a bound of other norms."""
    whole = float((matrix**2).sum())
    # The difference has an error of a few roundings of the subtrahend.
    return np.sqrt(np.maximum(whole - ((normal @ matrix) ** 2).sum(axis=1), 1e-15 * whole))


def _placing(shape: Cube | Square, normals: np.ndarray) -> np.ndarray:
    """Return the angle (n,) per roundoff by which rounding of the corners turns the sides with these normals (n, 3).

    A corner's magnitude is |M| 1/2 + |T|; a side turns by its corners' shift over the least height of its triangles.
    """
    linear, shift = placed(shape)
    corner = np.linalg.norm(np.abs(linear).sum(axis=1) / 2 + np.abs(shift))
    heights = []
    for axis in range(3):
        first, second = np.delete(linear, axis, axis=1).T
        longest = max(np.linalg.norm(edge) for edge in (first, second, first + second, first - second))
        heights.append(np.linalg.norm(np.cross(first, second)) / longest)
    # The inverse transpose transforms the side's axis to its normal: the transpose inverts that.
    side = np.abs(normals @ linear).argmax(axis=1) if isinstance(shape, Cube) else np.full(len(normals), 2)
    return corner / np.array(heights)[side]


def _carried(shape: Shape, start: np.ndarray, end: np.ndarray) -> np.ndarray:
    """Return the error per roundoff [m] (n, 3) of hits `end` of rays from `start`, computed in object space."""
    linear, shift = placed(shape)
    moved = (np.abs(start) + np.abs(shift) + np.abs(end)) @ np.abs(np.linalg.inv(linear)).T
    own = np.abs(np.asarray(shape.center)) + shape.radius if isinstance(shape, Sphere) else np.full(3, 0.5)
    return (moved + own) @ np.abs(linear).T + np.abs(shift) + np.abs(end)


def surface_error(shape: Shape, start: np.ndarray, end: np.ndarray, *, face: int | None = None) -> np.ndarray:
    """Return the apparent error [m per roundoff] (...) of a shape's surface for rays from `start` with hits at `end`.

    Both are (..., 3) [m]. For a mesh it is the error of `face`, or if that is None of the median triangle.
    """
    if isinstance(shape, Triangle | Mesh):
        corners = world_triangles(shape).astype(np.float64)
        faces = corners if face is None else corners[face : face + 1]
        edge, aspect = float(np.median(_longest_edge(faces))), float(np.median(_aspect(faces)))
        return length(np.abs(start) + np.abs(end)) + (length(end - start) + edge) * aspect
    return length(_carried(shape, start, end))


def error_at_eye(shape: Shape, eye: np.ndarray) -> float:
    """Return the apparent error [m per roundoff] of a shape's surface near the eye (3,) [m]; 0 if it has no area.

    A triangle's plane turns about its corners by their rounding over its height, and no point of the triangle is
    farther from them than that height: so the error of even a thin triangle is at most that of its corners.
    """
    if isinstance(shape, Triangle | Mesh):
        faces = world_triangles(shape).astype(np.float64)
        faces = faces[_least_height(faces) > 0]
        return float(2 * np.linalg.norm(eye) + np.median(_longest_edge(faces))) if len(faces) else 0.0
    return float(surface_error(shape, eye, eye))


def facing(shape: Shape, eye: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return the planes of a shape's faces: unit normals (n, 3), distances [m] from the eye (3,), curvatures [1/m].

    For a sphere it is the tangent plane at the surface point between its centre and the eye.
    """
    if isinstance(shape, Triangle | Mesh):
        faces = world_triangles(shape).astype(np.float64)
        faces = faces[_least_height(faces) > 0]
        normals = np.cross(faces[:, 1] - faces[:, 0], faces[:, 2] - faces[:, 0])
        normals = normals / length(normals)[:, np.newaxis]
        return normals, np.abs(dot(eye - faces[:, 0], normals)), np.zeros(len(faces))
    linear, shift = placed(shape)
    inverse = np.linalg.inv(linear)
    local = inverse @ (eye - shift)
    bend = 0.0
    if isinstance(shape, Sphere):
        singular = np.linalg.svd(linear, compute_uv=False)
        bend = singular[0] / (singular[2] ** 2 * shape.radius)
        away = local - np.asarray(shape.center)
        out = float(np.linalg.norm(away))
        axes = away[np.newaxis] / out if out else np.array([[0.0, 0.0, 1.0]])
        heights = np.array([out - shape.radius])
    elif isinstance(shape, Cube):
        axes, heights = np.eye(3), np.abs(local) - 0.5
    else:
        axes, heights = np.array([[0.0, 0.0, 1.0]]), local[2:]
    normals = axes @ inverse
    sizes = length(normals)
    return normals / sizes[:, np.newaxis], np.abs(heights) / sizes, np.full(len(axes), bend)


def _longest_edge(faces: np.ndarray) -> np.ndarray:
    """Return the longest edge of triangles (n, 3, 3) [m]."""
    return largest(length(faces - np.roll(faces, 1, axis=1)))


def _least_height(faces: np.ndarray) -> np.ndarray:
    """Return the least height of triangles (n, 3, 3) [m], 0 for those without area."""
    twice_area = crossed(faces[:, 1] - faces[:, 0], faces[:, 2] - faces[:, 0])
    longest = _longest_edge(faces)
    return np.divide(twice_area, longest, out=np.zeros_like(longest), where=longest > 0)


def _aspect(faces: np.ndarray) -> np.ndarray:
    """Return |E1||E2| / |E1 x E2| of triangles (n, 3, 3), the largest of the three corners'."""
    first, second = np.roll(faces, -1, axis=1) - faces, np.roll(faces, 1, axis=1) - faces
    products = length(first) * length(second)
    twice_area = crossed(first, second)
    with np.errstate(divide="ignore", invalid="ignore"):
        return largest(np.nan_to_num(products / twice_area, nan=np.inf))
