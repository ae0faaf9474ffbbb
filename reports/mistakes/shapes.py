"""Mistakes of shapes: a wrong placement, size, clipping or intersection."""

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from rayproof.cases.scene import Cube, Matrix, Mesh, Plane, Scene, SceneError, Shape, Sphere, Square, Triangle
from rayproof.reference.analytic import Analytic, Freedom, Hits, RaysFromEye, RaysToLight
from rayproof.reference.analytic.surfaces import Crossing, Meetings, Polygons, Surface, bundles, surface_of
from rayproof.reference.analytic.vectors import dot, ends_of, length, units
from rayproof.reports.mistakes import Family, Mistake, family, known, variant

OWN = 1e-7  # as a share of the shadow ray's length: a nearer crossing with the same shape is the start itself
TRIANGLES = (Triangle, Mesh)


def _scene(name: str, sentence: str, items: tuple[str, ...], changed: Callable[[Scene], Scene]) -> None:
    """Register a mistake that renders a changed scene; if the change is no valid scene, it renders the right one."""

    def scene(_: Mistake, right: Scene) -> Scene:
        try:
            return changed(right)
        except (SceneError, ValueError, OverflowError):
            return right

    known(name, sentence, *items)(type(name, (Mistake,), {"scene": scene}))


def _each(change: Callable[[Shape], Shape], *kinds: type[Shape]) -> Callable[[Scene], Scene]:
    """Return the function that changes all shapes of a scene, or only the shapes of the given kinds."""
    return lambda scene: replace(
        scene, shapes=tuple(change(shape) if not kinds or isinstance(shape, kinds) else shape for shape in scene.shapes)
    )


def _by_matrix(linear: Callable[[np.ndarray], np.ndarray], *, moved: bool = True) -> Callable[[Shape], Shape]:
    def change(shape: Shape) -> Shape:
        matrix = np.asarray(shape.to_world, dtype=np.float64).copy()
        matrix[:3, :3] = linear(matrix[:3, :3])
        matrix[:3, 3] *= moved
        rows: Matrix = tuple(map(tuple, matrix.tolist()))  # type: ignore[assignment]
        return replace(shape, to_world=rows)

    return change


def _larger(times: float) -> Callable[[Shape], Shape]:
    return _by_matrix(lambda linear: times * linear)


SOLIDS = (Sphere, Cube, Square, Plane)
for _name, _sentence, _change in (
    ("transposed_matrix", "transposes the model matrix, as if it acted on row vectors", _by_matrix(np.transpose)),
    ("no_translation", "leaves out the translation of the model matrix", _by_matrix(lambda m: m, moved=False)),
    ("no_matrix", "leaves out the model matrix", _by_matrix(lambda _: np.eye(3), moved=False)),
    ("inverse_matrix", "takes the inverse of the model matrix's linear part", _by_matrix(np.linalg.inv)),
):
    _scene(_name, _sentence, ("XF-1", "XF-2"), _each(_change))
    # The renderer may transform triangles and meshes to world space in another part, which is right.
    _parts = _each(_change, *SOLIDS)
    variant(_name)(type(f"{_name}_of_solids", (Mistake,), {"scene": lambda _, scene, parts=_parts: parts(scene)}))


def _sphere(name: str, sentence: str, change: Callable[[Sphere], Sphere]) -> None:
    _scene(name, sentence, ("HIT-1",), _each(change, Sphere))  # type: ignore[arg-type]


_sphere(
    "center_ignored",
    "puts every sphere at the origin of its object space",
    lambda s: replace(s, center=(0.0, 0.0, 0.0)),
)
_sphere("radius_ignored", "gives every sphere radius 1", lambda s: replace(s, radius=1.0))
_sphere("diameter_for_radius", "takes a sphere's radius for its diameter", lambda s: replace(s, radius=s.radius / 2))
_sphere("radius_for_diameter", "makes every sphere twice as large", lambda s: replace(s, radius=s.radius * 2))
_sphere("radius_squared", "squares a sphere's radius", lambda s: replace(s, radius=s.radius**2))
_scene("cube_doubled", "takes the cube from -1 to 1 instead of from -0.5 to 0.5", ("HIT-3",), _each(_larger(2.0), Cube))
_scene("cube_halved", "makes every cube half as large", ("HIT-3",), _each(_larger(0.5), Cube))
SQUARES = ("HIT-7", "HIT-8")
_scene(
    "square_doubled", "takes the square from -1 to 1 instead of from -0.5 to 0.5", SQUARES, _each(_larger(2.0), Square)
)
_scene("square_halved", "makes every square half as large", SQUARES, _each(_larger(0.5), Square))
_scene(
    "last_face_missing",
    "reads meshes without their last face",
    ("HIT-5", "HIT-6"),
    _each(lambda mesh: replace(mesh, faces=mesh.faces[:-1]) if len(mesh.faces) > 1 else mesh, Mesh),  # type: ignore[attr-defined, call-arg]
)
_scene(
    "last_shape_missing", "leaves the scene's last shape out", ("HIT-9",), lambda s: replace(s, shapes=s.shapes[:-1])
)
SIDES = ("NRM-3", "RAD-4")
_scene("all_two_sided", "takes every surface for two-sided", SIDES, _each(lambda shape: replace(shape, two_sided=True)))
_scene(
    "all_one_sided", "takes every surface for one-sided", SIDES, _each(lambda shape: replace(shape, two_sided=False))
)
CLIP = ("HIT-2",)
_scene("clips_nothing", "clips nothing", CLIP, lambda scene: replace(scene, clip="none"))
_scene(
    "clips_always", "clips at the planes even where nothing is to be clipped", CLIP, lambda s: replace(s, clip="depth")
)
_scene(
    "clips_by_shell",
    "clips at spheres around the eye where planes are asked for",
    CLIP,
    lambda s: replace(s, clip="shell") if s.clip == "depth" else s,
)
_scene(
    "clips_by_planes",
    "clips at planes where spheres around the eye are asked for",
    CLIP,
    lambda s: replace(s, clip="depth") if s.clip == "shell" else s,
)


def _interval(
    name: str, sentence: str, changed: Callable[[np.ndarray, np.ndarray], tuple[np.ndarray, np.ndarray]]
) -> None:
    def clip_interval(self: Mistake, scene: Scene, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        return changed(*Analytic.clip_interval(self, scene, directions))

    known(name, sentence, *CLIP)(type(name, (Mistake,), {"clip_interval": clip_interval}))


_interval("near_ignored", "ignores the near plane", lambda low, high: (np.zeros_like(low), high))
_interval("far_ignored", "ignores the far plane", lambda low, high: (low, np.full_like(high, np.inf)))
_interval("near_at_1", "sees nothing that is nearer than 1 m", lambda low, high: (np.maximum(low, 1.0), high))


@known("behind_where_unclipped", "takes hits behind the eye where nothing is to be clipped", *CLIP)
class BehindWhereUnclipped(Mistake):
    """Without clipping, hits at any distance count, including negative ones."""

    def clip_interval(self, scene: Scene, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return an interval without a lower end."""
        low, high = super().clip_interval(scene, directions)
        return (np.full_like(low, -np.inf) if scene.clip == "none" else low), high


@family(
    "within",
    "sees nothing that is {0} m away or farther",
    "HIT-9",
    "HIT-2",
    starts=[(1.0, 5.0, 10.0, 20.0, 50.0, 100.0)],
)
class Within(Family):
    """Hits count up to a distance [m], the parameter."""

    jumps = True

    def clip_interval(self, scene: Scene, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return an interval that ends at this distance."""
        low, high = super().clip_interval(scene, directions)
        return low, np.minimum(high, self.numbers[0])


class AnotherOrder(Mistake):
    """A ray hits another shape than the nearest, or another face of a mesh than the nearest."""

    shapes, faces = "nearest", "nearest"

    def nearest(self, scene: Scene, directions: np.ndarray, freedom: Freedom | None = None) -> Hits:
        """Return the hits that these rules select."""
        eye, count = np.asarray(scene.camera.eye, dtype=np.float64), len(directions)
        low, high = self.clip_interval(scene, directions)
        hits = Hits(np.full((count, 2), -1.0), np.full(count, np.inf), np.zeros(count, dtype=int))
        for index in range(len(scene.shapes)):
            crossing = self.crossing(scene, index, RaysFromEye(eye, directions, low, high))
            there, before = np.isfinite(crossing.distance), np.isfinite(hits.distances)
            nearer = crossing.distance < hits.distances
            rules = {"first": ~before, "last": there, "farthest": ~before | ~nearer, "nearest": nearer}
            where = there & rules[self.shapes]
            hits.distances[where], hits.pieces[where] = crossing.distance[where], crossing.piece[where]
            hits.objects[where, 0], hits.objects[where, 1] = index, crossing.face[where]
        return hits

    def crossing(self, scene: Scene, index: int, rays: RaysFromEye) -> Crossing:
        """Return the crossings that these rules select of one shape."""
        surface, (eye, directions, low, high) = surface_of(scene.shapes[index]), rays
        if self.faces == "nearest" or not isinstance(scene.shapes[index], Mesh):
            return surface.first(*rays)
        selected = Crossing(
            np.full(len(directions), np.inf), np.zeros(len(directions)), np.zeros(len(directions), dtype=int)
        )
        best = np.full(len(directions), -np.inf)
        for chunk, pieces, crossing in surface.meetings(eye, directions):
            inside = (crossing > low[chunk, np.newaxis]) & (crossing < high[chunk, np.newaxis])
            order = {"first": -pieces[np.newaxis], "last": pieces[np.newaxis]}.get(self.faces, crossing)
            key = np.where(inside, order, -np.inf)
            place = key.argmax(axis=1)
            every = np.arange(len(chunk))
            better = key[every, place] > best[chunk]
            best[chunk[better]] = key[every, place][better]
            selected.distance[chunk[better]], selected.piece[chunk[better]] = (
                crossing[every, place][better],
                pieces[place[better]],
            )
            selected.face[chunk[better]] = surface.number(pieces[place[better]])
        return selected


for _rule in ("first", "last", "farthest"):
    _words = f"takes the {_rule} shape that a ray meets, not the nearest"
    known(f"{_rule}_hit", _words, "HIT-9")(type(f"{_rule}_hit", (AnotherOrder,), {"shapes": _rule}))
    _words = f"takes the {_rule} face of a mesh that a ray meets, not the nearest"
    known(f"{_rule}_face", _words, "HIT-9")(type(f"{_rule}_face", (AnotherOrder,), {"faces": _rule}))
variant("farthest_hit")(type("farthest_of_all", (AnotherOrder,), {"shapes": "farthest", "faces": "farthest"}))
variant("last_hit")(type("last_of_all", (AnotherOrder,), {"shapes": "last", "faces": "last"}))
variant("first_hit")(type("first_of_all", (AnotherOrder,), {"shapes": "first", "faces": "first"}))


@known("behind_the_eye", "takes hits behind the eye", *CLIP)
class BehindTheEye(Mistake):
    """The interval has no lower end, so that the farthest hit behind the eye is taken for the nearest."""

    def clip_interval(self, scene: Scene, directions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Return an interval without a lower end."""
        low, high = super().clip_interval(scene, directions)
        return np.full_like(low, -np.inf), high

    def crossing(self, scene: Scene, index: int, rays: RaysFromEye) -> Crossing:
        """Return the first crossings (N,) along the whole lines; a mesh is intersected with rays in both directions."""
        ahead = super().crossing(scene, index, rays)
        if not isinstance(scene.shapes[index], Mesh):
            return ahead
        ends = np.zeros_like(rays.low), np.full_like(rays.low, np.inf)
        back = _Farthest().crossing(scene, index, RaysFromEye(rays.eye, -rays.directions, *ends))
        there = np.isfinite(back.distance)
        pairs = zip((-back.distance, back.face, back.piece), ahead, strict=True)
        return Crossing(*(np.where(there, behind, before) for behind, before in pairs))


class _Farthest(AnotherOrder):
    faces = "farthest"


class OtherSurfaces(Mistake):
    """Rays and shadow rays intersect a wrong surface instead of the shape's; the normals stay right."""

    shadow_rays = True  # whether shadow rays intersect it, too

    def surface(self, shape: Shape) -> Surface:
        """Return the wrong surface of a shape."""
        raise NotImplementedError

    def crossing(self, scene: Scene, index: int, rays: RaysFromEye) -> Crossing:
        """Return the first crossings of rays with the wrong surface."""
        return self.surface(scene.shapes[index]).first(*rays)

    def blocked(self, scene: Scene, index: int, rays: RaysToLight) -> np.ndarray:
        """Return a mask (N,) of the shadow rays that the wrong surface blocks."""
        surface = self.surface(scene.shapes[index])
        if not self.shadow_rays or surface is surface_of(scene.shapes[index]):
            return super().blocked(scene, index, rays)
        own, ends = rays.objects[:, 0] == index, ends_of(np.asarray(scene.camera.eye), rays.starts)
        blocked = np.zeros(len(own), dtype=bool)
        blocked[~own] = surface.blocks(rays.source, rays.segments[~own], ends[~own], (0.0, 1.0))
        if own.any():
            blocked[own] = surface.blocks_own(rays.source, rays.segments[own], ends[own], rays.objects[own, 1])
        return blocked


@dataclass(frozen=True, kw_only=True, eq=False)
class WrongTriangles(Polygons):
    """Triangles with wrong bounds of the barycentric coordinates of their inside."""

    least: float = 0.0  # the smallest value of each coordinate
    parallelogram: bool = False  # u + v <= 1 is not tested
    open_side: bool = False  # one of the three coordinates is not tested
    culled: bool = False  # the back is not hit
    smallest: float = 0.0  # |determinant| below which a ray counts as parallel to the triangle

    def meetings(self, apex: np.ndarray, directions: np.ndarray) -> Meetings:
        """Yield the crossings, computed with the method of Moeller and Trumbore (1997)."""
        first = self.corners[:, 0]
        sides = self.corners[:, 1] - first, self.corners[:, 2] - first
        near = self.corners - apex
        if self.least or self.parallelogram or self.open_side:
            chosen = [(np.arange(len(directions)), np.arange(len(first)))]
        else:
            chosen = bundles(directions, near)
        for rays, pieces in chosen:
            for chunk in np.array_split(rays, max(1, len(rays) * len(pieces) // 200_000 + 1)):
                d = directions[chunk, np.newaxis]
                e1, e2, s = sides[0][pieces], sides[1][pieces], apex - first[pieces]
                p, q = np.cross(d, e2), np.cross(s, e1)
                determinant = (p * e1).sum(axis=-1)
                with np.errstate(all="ignore"):
                    u, v = (p * s).sum(axis=-1) / determinant, (d * q).sum(axis=-1) / determinant
                    crossing = (q * e2).sum(axis=-1) / determinant
                    inside = (u >= self.least) & (v >= self.least) & (np.abs(determinant) > self.smallest)
                    if self.parallelogram:
                        inside &= (u <= 1) & (v <= 1)
                    elif not self.open_side:
                        inside &= u + v <= 1 - self.least
                if self.culled:
                    inside &= determinant > 0
                yield chunk, pieces, np.where(inside, crossing, np.nan)


@lru_cache(maxsize=256)
def _wrong_triangles(shape: Shape, wrong: tuple[tuple[str, float], ...]) -> Surface:
    right = surface_of(shape)
    assert isinstance(right, Polygons)
    own = {name: getattr(right, name) for name in ("corners", "numbers", "closed", "face_normals")}
    return WrongTriangles(**own, **dict(wrong))  # type: ignore[arg-type]


class OtherTriangles(OtherSurfaces):
    """Triangles and meshes are intersected with wrong bounds."""

    wrong: tuple[tuple[str, float], ...] = ()

    def surface(self, shape: Shape) -> Surface:
        """Return the triangles with wrong bounds."""
        return _wrong_triangles(shape, self.wrong) if isinstance(shape, TRIANGLES) else surface_of(shape)


def _triangles(name: str, sentence: str, item: str = "HIT-6", *, shadow_rays: bool = True, **wrong: float) -> None:
    known(name, sentence, item, "HIT-5" if item == "HIT-6" else "HIT-6")(
        type(name, (OtherTriangles,), {"wrong": tuple(wrong.items()), "shadow_rays": shadow_rays})
    )


_triangles("triangle_culled", "culls triangles that face away", culled=True)
variant("triangle_culled")(type("seen", (OtherTriangles,), {"wrong": (("culled", True),), "shadow_rays": False}))
_triangles("triangle_no_sum", "leaves out u + v <= 1, so that triangles become parallelograms", parallelogram=True)
_triangles("triangle_one_area", "leaves out the third side of triangles", "HIT-5", open_side=True)
for _number, _least in enumerate((1e-2, 1e-3, 1e-4)):
    _words = f"accepts hits up to {_least:g} of its size outside of a triangle, which makes triangles too large"
    _triangles(f"triangles_widened_{_number + 2}", _words, least=-_least)
    _words = f"leaves out hits within {_least:g} of its size from a triangle's edges, so that rays slip through"
    _triangles(f"triangles_narrowed_{_number + 2}", _words, least=_least)
for _number, _least in enumerate((1e-3, 1e-4, 1e-5, 1e-6, 1e-7, 1e-8)):
    _words = f"takes a determinant below {_least:g} for a ray parallel to the triangle, so that small triangles vanish"
    _triangles(f"small_triangles_vanish_{_number + 3}", _words, smallest=_least)


class BackFacesPass(Mistake):
    """Shadow rays pass through surfaces that face away from their starts."""

    def blocked(self, scene: Scene, index: int, rays: RaysToLight) -> np.ndarray:
        """Return a mask (N,) of the shadow rays that cross the front of a triangle."""
        if not isinstance(scene.shapes[index], TRIANGLES):
            return super().blocked(scene, index, rays)
        surface, blocked = _wrong_triangles(scene.shapes[index], (("culled", True),)), np.zeros(len(rays.starts), bool)
        # Rays are traced from the light here: a triangle that faces the start faces away from the light.
        mirrored = replace(surface, corners=surface.corners[:, ::-1])  # type: ignore[type-var]
        own = np.where(rays.objects[:, 0] == index, rays.objects[:, 1], -1)
        for chunk, pieces, crossing in mirrored.meetings(rays.source, rays.segments):
            inside = (crossing > 0) & (crossing < 1 - OWN) & (surface.number(pieces) != own[chunk, np.newaxis])
            blocked[chunk] |= inside.any(axis=1)
        return blocked


known("shadow_rays_culled", "culls triangles that face away in shadow rays", "LIT-1", "HIT-6")(BackFacesPass)


class InObjectSpace(Mistake):
    """Spheres, cubes, squares and planes are intersected in object space, and one step of that is wrong."""

    local = True  # normals are computed from the hit in object space, not in world space

    def origins(self, matrix: np.ndarray, points: np.ndarray) -> np.ndarray:
        """Return the origins (N, 3) of rays in object space."""
        return (points - matrix[:3, 3]) @ np.linalg.inv(matrix[:3, :3]).T

    def ways(self, matrix: np.ndarray, directions: np.ndarray) -> np.ndarray:
        """Return the directions (N, 3) of rays in object space."""
        return directions @ np.linalg.inv(matrix[:3, :3]).T

    def sphere(self, shape: Sphere, o: np.ndarray, d: np.ndarray, low: np.ndarray) -> np.ndarray:
        """Return the candidate crossings (N, k) with a sphere; NaN for a miss."""
        return roots(o - shape.center, d, shape.radius)

    def cube(self, o: np.ndarray, d: np.ndarray, low: np.ndarray) -> np.ndarray:
        """Return the candidate crossings (N, k) with a cube; NaN for a miss."""
        return slabs(o, d)

    def flat(self, shape: Shape, o: np.ndarray, d: np.ndarray) -> np.ndarray:
        """Return the crossings (N, 1) with a plane or a square; NaN for a miss."""
        with np.errstate(all="ignore"):
            t = -o[:, 2] / d[:, 2]
            x, y = (o + t[:, np.newaxis] * d)[:, :2].T
            inside = np.isfinite(t)
            if isinstance(shape, Square):
                inside &= self.in_square(x, y)
        return np.where(inside, t, np.nan)[:, np.newaxis]

    def in_square(self, x: np.ndarray, y: np.ndarray) -> np.ndarray:
        """Return a mask (N,) of the points of the plane z = 0 that are inside the square."""
        return (np.abs(x) < 0.5) & (np.abs(y) < 0.5)

    def _all(self, shape: Shape, origins: np.ndarray, directions: np.ndarray, low: np.ndarray) -> np.ndarray:
        matrix = np.asarray(shape.to_world, dtype=np.float64)
        o, d = self.origins(matrix, np.broadcast_to(origins, directions.shape)), self.ways(matrix, directions)
        with np.errstate(all="ignore"):
            if isinstance(shape, Sphere):
                return self.sphere(shape, o, d, low)
            return self.cube(o, d, low) if isinstance(shape, Cube) else self.flat(shape, o, d)

    def crossing(self, scene: Scene, index: int, rays: RaysFromEye) -> Crossing:
        """Return the smallest crossing of each ray in the clip interval."""
        shape = scene.shapes[index]
        if isinstance(shape, TRIANGLES):
            return super().crossing(scene, index, rays)
        crossings = self._all(shape, rays.eye, rays.directions, rays.low)
        inside = (crossings > rays.low[:, np.newaxis]) & (crossings < rays.high[:, np.newaxis])
        key = np.where(inside, crossings, np.inf)
        return Crossing(key.min(axis=1), np.zeros(len(crossings)), key.argmin(axis=1))

    def blocked(self, scene: Scene, index: int, rays: RaysToLight) -> np.ndarray:
        """Return a mask (N,) of the shadow rays that cross the shape between their start and the light."""
        shape = scene.shapes[index]
        if isinstance(shape, TRIANGLES):
            return super().blocked(scene, index, rays)
        crossings = self._all(shape, rays.starts, -rays.segments, np.zeros(len(rays.starts)))
        least = np.where(rays.objects[:, 0] == index, OWN, 0.0)[:, np.newaxis]
        return np.asarray(((crossings > least) & (crossings < 1)).any(axis=1))

    def normals(self, scene: Scene, directions: np.ndarray, objects: np.ndarray, positions: np.ndarray) -> np.ndarray:
        """Return normals (N, 3); those of spheres and cubes are computed from the hit in object space."""
        normals = super().normals(scene, directions, objects, positions)
        if not self.local:
            return normals
        eye = np.asarray(scene.camera.eye)
        for index, shape in enumerate(scene.shapes):
            here = objects[:, 0] == index
            if not here.any() or not isinstance(shape, Sphere | Cube):
                continue
            matrix = np.asarray(shape.to_world, dtype=np.float64)
            d = directions[here]
            t = dot(positions[here] - eye, d) / dot(d, d)
            local = self.origins(matrix, np.broadcast_to(eye, d.shape)) + t[:, np.newaxis] * self.ways(matrix, d)
            if isinstance(shape, Sphere):
                local = local - shape.center
            else:
                axis = np.abs(local).argmax(axis=1)
                local = np.sign(np.take_along_axis(local, axis[:, np.newaxis], axis=1)) * np.eye(3)[axis]
            outward = units(local @ np.linalg.inv(matrix[:3, :3]))
            away = dot(outward, d) > 0
            normals[here] = np.where(away[:, np.newaxis] & shape.two_sided, -outward, outward)
        return normals


def roots(o: np.ndarray, d: np.ndarray, radius: float) -> np.ndarray:
    """Return the two crossings (N, 2) with a sphere about the origin, ascending; NaN for a miss."""
    speed = dot(d, d)
    middle = -dot(o, d) / speed
    off = o + middle[:, np.newaxis] * d
    half = np.sqrt((radius - length(off)) * (radius + length(off)) / speed)
    return np.stack([middle - half, middle + half], axis=1)


def slabs(o: np.ndarray, d: np.ndarray) -> np.ndarray:
    """Return the crossings (N, 2) at which rays enter and leave the cube from -0.5 to 0.5; NaN for a miss."""
    ends = np.sort(np.stack([(-0.5 - o) / d, (0.5 - o) / d]), axis=0)
    parallel = d == 0
    outside = (parallel & (np.abs(o) > 0.5)).any(axis=1)
    enter = np.where(parallel, -np.inf, ends[0]).max(axis=1)
    leave = np.where(parallel, np.inf, ends[1]).min(axis=1)
    return np.where((outside | (enter > leave))[:, np.newaxis], np.nan, np.stack([enter, leave], axis=1))


def _into(name: str, sentence: str, **steps: Callable[..., np.ndarray]) -> None:
    known(name, sentence, "XF-1")(type(name, (InObjectSpace,), steps))
    variant(name)(type(f"{name}_in_world", (InObjectSpace,), steps | {"local": False}))


def _inverse(matrix: np.ndarray) -> np.ndarray:
    return np.linalg.inv(matrix[:3, :3])


_into(
    "renormalised_direction",
    "normalises the ray's direction in object space and takes t as it is",
    ways=lambda self, m, d: units(InObjectSpace.ways(self, m, d)),
)
_into(
    "moved_direction",
    "moves a ray's direction like a point when it goes into object space",
    ways=lambda _, m, d: (d - m[:3, 3]) @ _inverse(m).T,
)
_into(
    "forward_matrix",
    "brings rays into object space by the model matrix instead of its inverse",
    origins=lambda _, m, p: p @ m[:3, :3].T + m[:3, 3],
    ways=lambda _, m, d: d @ m[:3, :3].T,
)
_into(
    "direction_by_normal_matrix",
    "brings directions into object space by the inverse transpose of the model matrix",
    ways=lambda _, m, d: d @ _inverse(m),
)
_into(
    "rays_by_inverse_transpose",
    "brings rays into object space by the inverse transpose of the model matrix",
    origins=lambda _, m, p: (p - m[:3, 3]) @ _inverse(m),
    ways=lambda _, m, d: d @ _inverse(m),
)
_into(
    "origin_untranslated",
    "brings origins into object space without the translation",
    origins=lambda _, m, p: p @ _inverse(m).T,
)
_into(
    "direction_unturned",
    "leaves directions in the world where it brings rays into object space",
    ways=lambda _, m, d: d,
)


def _met(name: str, sentence: str, item: str, **steps: Callable[..., np.ndarray]) -> None:
    known(name, sentence, item)(type(name, (InObjectSpace,), steps))


def _first_or_none(crossings: np.ndarray) -> np.ndarray:
    return crossings[:, :1]


def _unit_a(_: Mistake, shape: Sphere, o: np.ndarray, d: np.ndarray, low: np.ndarray) -> np.ndarray:
    o = o - shape.center
    b = dot(o, d)
    half = np.sqrt(b * b - dot(o, o) + shape.radius**2)
    return np.stack([-b - half, -b + half], axis=1)


def _larger_root(_: Mistake, shape: Sphere, o: np.ndarray, d: np.ndarray, low: np.ndarray) -> np.ndarray:
    crossings = roots(o - shape.center, d, shape.radius)
    return np.where(crossings[:, 1:] > low[:, np.newaxis], crossings[:, 1:], crossings[:, :1])


_met("far_root", "takes the larger root of the sphere's quadratic", "HIT-1", sphere=_larger_root)
_met(
    "small_root_only",
    "takes the sphere's smaller root or none, though the larger one may be inside the clip interval",
    "HIT-1",
    sphere=lambda self, s, o, d, low: _first_or_none(InObjectSpace.sphere(self, s, o, d, low)),
)
_met("unit_a", "takes A = 1 in the sphere's quadratic for a direction that is no unit vector", "HIT-1", sphere=_unit_a)
_met(
    "discriminant_sign",
    "has a sign wrong in the discriminant of the sphere's quadratic",
    "HIT-1",
    sphere=lambda _, s, o, d, low: (
        (
            -dot(o - s.center, d)[:, np.newaxis]
            + np.sqrt(dot(o - s.center, d) ** 2 + dot(d, d) * (dot(o - s.center, o - s.center) - s.radius**2))[
                :, np.newaxis
            ]
            * (-1, 1)
        )
        / dot(d, d)[:, np.newaxis]
    ),
)
_met(
    "half_b",
    "mixes B and B/2 in the sphere's quadratic",
    "HIT-1",
    sphere=lambda _, s, o, d, low: (
        (
            -dot(o - s.center, d)[:, np.newaxis]
            + np.sqrt(dot(o - s.center, d) ** 2 - 4 * dot(d, d) * (dot(o - s.center, o - s.center) - s.radius**2))[
                :, np.newaxis
            ]
            * (-1, 1)
        )
        / (2 * dot(d, d)[:, np.newaxis])
    ),
)
_met(
    "cube_entry_only",
    "takes a ray's entry into a cube as the hit, and never its exit",
    "HIT-3",
    cube=lambda self, o, d, low: _first_or_none(InObjectSpace.cube(self, o, d, low)),
)
_met(
    "cube_not_swapped",
    "does not swap the slabs' ends where a ray runs the other way",
    "HIT-3",
    cube=lambda _, o, d, low: np.where((d < 0).any(axis=1)[:, np.newaxis], np.nan, slabs(o, d)),
)
_met("square_disc", "takes a disc for a square", "HIT-7", in_square=lambda _, x, y: x * x + y * y < 0.25)
_met(
    "plane_one_sided",
    "hits planes from the front alone",
    "HIT-4",
    flat=lambda self, s, o, d: np.where(
        isinstance(s, Plane) & (d[:, 2:] > 0), np.nan, InObjectSpace.flat(self, s, o, d)
    ),
)
_met(
    "square_one_sided",
    "hits squares from the front alone",
    "HIT-7",
    flat=lambda self, s, o, d: np.where(
        isinstance(s, Square) & (d[:, 2:] > 0), np.nan, InObjectSpace.flat(self, s, o, d)
    ),
)
_met(
    "plane_sign",
    "has a sign wrong in the plane's intersection",
    "HIT-4",
    flat=lambda self, s, o, d: InObjectSpace.flat(self, s, o, d) * (-1 if isinstance(s, Plane) else 1),
)


@known("position_in_object_space", "leaves hit points in object space", "XF-2")
class PositionInObjectSpace(Mistake):
    """Positions are not transformed back to world space."""

    def continued_positions(self, scene: Scene, positions: np.ndarray, objects: np.ndarray) -> np.ndarray:
        """Return the positions (N, 3), with hits of all shapes but triangles and meshes in object space."""
        local = positions.copy()
        for index, shape in enumerate(scene.shapes):
            here = objects[:, 0] == index
            matrix = np.asarray(shape.to_world, dtype=np.float64)
            if not isinstance(shape, TRIANGLES):
                local[here] = (positions[here] - matrix[:3, 3]) @ np.linalg.inv(matrix[:3, :3]).T
        return local

    def positions(self, scene: Scene, directions: np.ndarray, objects: np.ndarray, distances: np.ndarray) -> np.ndarray:
        """Return the positions (N, 3) of hits in object space."""
        return self.continued_positions(scene, super().positions(scene, directions, objects, distances), objects)
