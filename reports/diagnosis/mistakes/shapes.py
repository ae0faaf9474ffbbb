"""Mistakes of shapes, roots, clipping and which hit counts (`Counting`): XF-1, HIT-1 to HIT-9.

For HIT-9, which hit counts: the last, first or farthest of a mesh's faces or of all shapes, or near ones alone.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np

from rayproof.cases.placement import placed
from rayproof.cases.scene import Cube, Mesh, Scene, Shape, Sphere, Square, Triangle
from rayproof.cases.stages import Stage
from rayproof.reference.analytic.surfaces import Polygons, surface_of
from rayproof.reports.diagnosis import MISTAKES, Given, Mistake, Way, Wrong
from rayproof.reports.diagnosis.answering import above, hits_by
from rayproof.reports.diagnosis.fits import Fitting, rounded

FAR = 1e12  # m: as good as no far end
NEAR = 1e-12  # m
ON_IT = 1e-6  # of a sphere's radius: a point so near to its surface is on it


def _each(change: Callable[[Shape], Shape]) -> Callable[[Scene], Scene]:
    return lambda scene: replace(scene, shapes=tuple(map(change, scene.shapes)))


def _linear(shape: Shape, linear: np.ndarray, *, moved: bool = True) -> Shape:
    matrix = np.eye(4)
    matrix[:3, :3] = linear
    if moved:
        matrix[:3, 3] = np.asarray(shape.to_world)[:3, 3]
    return replace(shape, to_world=tuple(map(tuple, matrix.tolist())))


def _spheres(change: Callable[[Sphere], Sphere]) -> Callable[[Scene], Scene]:
    return _each(lambda shape: change(shape) if isinstance(shape, Sphere) else shape)


def _doubled(kind: type[Shape]) -> Callable[[Scene], Scene]:
    def change(shape: Shape) -> Shape:
        if not isinstance(shape, kind):
            return shape
        return _linear(shape, placed(shape)[0] @ np.diag([2.0, 2.0, 2.0 if kind is Cube else 1.0]))

    return _each(change)


def _halved(kind: type[Shape]) -> Callable[[Scene], Scene]:
    def change(shape: Shape) -> Shape:
        if not isinstance(shape, kind):
            return shape
        return _linear(shape, placed(shape)[0] @ np.diag([0.5, 0.5, 0.5 if kind is Cube else 1.0]))

    return _each(change)


def _but_triangles(asked: Callable[[Scene], Scene]) -> Callable[[Scene], Scene]:
    def change(scene: Scene) -> Scene:
        pairs = zip(scene.shapes, asked(scene).shapes, strict=True)
        return replace(scene, shapes=tuple(old if isinstance(old, Triangle | Mesh) else new for old, new in pairs))

    return change


def _clipped(clip: str) -> Callable[[Scene], Scene]:
    return lambda scene: replace(scene, clip=clip)  # type: ignore[arg-type]


def _without(end: str) -> Callable[[Scene], Scene]:
    def asked(scene: Scene) -> Scene:
        if scene.clip == "none":
            return scene
        return replace(scene, camera=replace(scene.camera, **({"near": NEAR} if end == "near" else {"far": FAR})))

    return asked


RULES = ("nearest", "first", "last", "farthest")
MOST_DISTANCES = 9  # that are tried
LEAST_HIDDEN = 30  # pixels whose hits are missing, from which a greatest distance is estimated


@dataclass(frozen=True, kw_only=True)
class Counting:
    """Which hit counts."""

    of_faces: str = "nearest"  # one of RULES, among the faces of one mesh
    of_shapes: str = "nearest"
    below: float = np.inf  # m: hits this far away or farther do not count

    def met(
        self, shape: Shape, eye: np.ndarray, rays: np.ndarray, low: np.ndarray, high: np.ndarray
    ) -> tuple[np.ndarray, np.ndarray]:
        """Return the crossing (N,) of one shape that counts, inside an open interval, or inf, and its face."""
        surface, high = surface_of(shape), np.minimum(high, self.below)
        # A cube is six faces to the oracle; to others it is one shape.
        if self.of_faces == "nearest" or not isinstance(surface, Polygons) or not surface.numbers.any():
            return surface.first(eye, rays, low, high)[:2]
        found, number = np.full(len(rays), np.inf), np.zeros(len(rays))
        for some, faces, crossing in surface.meetings(eye, rays):
            inside = (crossing > low[some, np.newaxis]) & (crossing < high[some, np.newaxis])
            order = {"first": -faces, "last": faces}.get(self.of_faces, crossing)  # the greatest counts
            best = np.argmax(np.where(inside, order, -np.inf), axis=1)
            here = inside[np.arange(len(some)), best]
            some, best, crossing = some[here], best[here], crossing[here]
            value, face = crossing[np.arange(len(some)), best], surface.numbers[faces[best]]
            # Later faces of the same ray come later.
            taken = _goes_before(self.of_faces, value, found[some])
            found[some[taken]], number[some[taken]] = value[taken], face[taken]
        return found, number

    @property
    def stages(self) -> dict[Stage, Wrong]:
        """Return the stages of a renderer for which this hit counts."""
        return hits_by(self.met, lambda crossing, kept: _goes_before(self.of_shapes, crossing, kept))

    @property
    def way(self) -> Way:
        """Return the way of a renderer for which this hit counts."""
        return Way(stages=self.stages, says=self.phrase)

    @property
    def phrase(self) -> str:
        """Return what a renderer does, as a verb phrase."""
        if np.isfinite(self.below):
            return f"sees nothing that is {self.below:.4g} m away or farther"
        of_shapes = f"the {self.of_shapes} of all shapes" if self.of_shapes != "nearest" else ""
        of_faces = f"the {self.of_faces} face that a ray meets in a mesh" if self.of_faces != "nearest" else ""
        return f"takes {' and '.join(filter(None, (of_faces, of_shapes)))}, not the nearest"


def _goes_before(rule: str, new: np.ndarray, kept: np.ndarray) -> np.ndarray:
    """Return whether a hit that is met later takes the place of one met before; an infinite one is none."""
    if rule == "nearest":
        return new < kept
    if rule == "farthest":
        return ~np.isfinite(kept) | (new > kept)
    return np.full(new.shape, True) if rule == "last" else ~np.isfinite(kept)


def _on_the_line(
    shape: Shape, eye: np.ndarray, rays: np.ndarray, low: np.ndarray, high: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the hit of the line that a ray lies on, the farthest behind the eye first."""
    surface, behind = surface_of(shape), np.full_like(low, np.inf)
    crossing, face = surface.first(eye, rays, -behind, high)[:2]
    if isinstance(shape, Mesh):  # of its many faces those before the eye alone are asked: look the other way, too
        there, number = Counting(of_faces="farthest").met(shape, eye, -rays, np.zeros_like(low), behind)
        crossing, face = np.where(np.isfinite(there), -there, crossing), np.where(np.isfinite(there), number, face)
    return crossing, face


def _smaller_root(
    shape: Shape, eye: np.ndarray, rays: np.ndarray, low: np.ndarray, high: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the hit where of a sphere's two crossings the first counts or none, wherever the second lies."""
    start = np.full_like(low, -np.inf) if isinstance(shape, Sphere) else low
    crossing, face = surface_of(shape).first(eye, rays, start, high)[:2]
    return np.where(crossing > low, crossing, np.inf), face


def _larger_root(
    shape: Shape, eye: np.ndarray, rays: np.ndarray, low: np.ndarray, high: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Return the hit where of a sphere's crossings inside the clip interval the larger counts."""
    if not isinstance(shape, Sphere):
        return surface_of(shape).first(eye, rays, low, high)[:2]
    crossing, face = surface_of(shape).first(eye, -rays, -high, -low)[:2]  # of the same line the other way, the first
    return np.where(np.isfinite(crossing), -crossing, np.inf), face


LARGER_ROOTS = Way(stages=hits_by(_larger_root))


def _seen_out_of_spheres(given: Given) -> np.ndarray:
    """Return visibility; open is what a sphere that holds the point hides, for its first root is behind the point."""
    found = np.array(given.right, dtype=np.float64)
    positions = given.answers[Stage.POSITION]
    points = positions.reshape(-1, 3)
    inside = np.zeros(len(points), dtype=bool)
    for shape in given.scene.shapes:
        if isinstance(shape, Sphere):
            linear, shift = placed(shape)
            local = (points - shift) @ np.linalg.inv(linear).T - np.asarray(shape.center)
            inside |= np.linalg.norm(local, axis=-1) < (1 + ON_IT) * shape.radius
    own = inside.reshape(positions.shape[:2])[..., np.newaxis]
    return np.where(own & (found == 0) & above(given.scene, given.answers), np.nan, found)


OF_MATRICES = ("transposed_matrix", "no_translation", "no_matrix")
for _name, _says, _items, _asked in (
    (
        "transposed_matrix",
        "transposes the model matrix, as if it acted on row vectors",
        ("XF-1", "XF-2"),
        _each(lambda shape: _linear(shape, placed(shape)[0].T)),
    ),
    (
        "no_translation",
        "leaves out the translation of the model matrix",
        ("XF-1",),
        _each(lambda shape: _linear(shape, placed(shape)[0], moved=False)),
    ),
    (
        "no_matrix",
        "leaves out the model matrix",
        ("XF-1",),
        _each(lambda shape: _linear(shape, np.eye(3), moved=False)),
    ),
    (
        "center_ignored",
        "puts every sphere at the origin of its object space",
        ("HIT-1",),
        _spheres(lambda sphere: replace(sphere, center=(0.0, 0.0, 0.0))),
    ),
    ("radius_ignored", "gives every sphere radius 1", ("HIT-1",), _spheres(lambda sphere: replace(sphere, radius=1.0))),
    (
        "diameter_for_radius",
        "takes a sphere's radius for its diameter",
        ("HIT-1",),
        _spheres(lambda sphere: replace(sphere, radius=sphere.radius / 2)),
    ),
    (
        "radius_for_diameter",
        "makes every sphere twice as large",
        ("HIT-1",),
        _spheres(lambda sphere: replace(sphere, radius=sphere.radius * 2)),
    ),
    ("cube_doubled", "takes the cube from -1 to 1 instead of from -0.5 to 0.5", ("HIT-3",), _doubled(Cube)),
    (
        "square_doubled",
        "takes the square from -1 to 1 instead of from -0.5 to 0.5",
        ("HIT-7", "HIT-8"),
        _doubled(Square),
    ),
    ("cube_halved", "makes every cube half as large", ("HIT-3",), _halved(Cube)),
    ("square_halved", "makes every square half as large", ("HIT-7", "HIT-8"), _halved(Square)),
    ("clips_nothing", "clips nothing", ("HIT-2",), _clipped("none")),
    (
        "clips_by_shell",
        "clips at spheres around the eye where planes are asked for",
        ("HIT-2",),
        lambda scene: replace(scene, clip="shell") if scene.clip == "depth" else scene,
    ),
    (
        "clips_by_planes",
        "clips at planes where spheres around the eye are asked for",
        ("HIT-2",),
        lambda scene: replace(scene, clip="depth") if scene.clip == "shell" else scene,
    ),
    ("clips_always", "clips at the planes even where nothing is to be clipped", ("HIT-2",), _clipped("depth")),
    ("near_ignored", "ignores the near plane", ("HIT-2",), _without("near")),
    ("far_ignored", "ignores the far plane", ("HIT-2",), _without("far")),
    (
        "all_two_sided",
        "takes every surface for two-sided",
        ("NRM-3", "RAD-4"),
        _each(lambda shape: replace(shape, two_sided=True)),
    ),
    (
        "all_one_sided",
        "takes every surface for one-sided",
        ("NRM-3", "RAD-4"),
        _each(lambda shape: replace(shape, two_sided=False)),
    ),
):
    # Triangles and meshes may have been brought into the world by another part of the renderer.
    _ways = (Way(asked=_asked), Way(asked=_but_triangles(_asked))) if _name in OF_MATRICES else (Way(asked=_asked),)
    MISTAKES.register(_name)(Mistake(says=_says, items=_items, ways=_ways))

MISTAKES.register("behind_the_eye")(
    Mistake(
        says="takes hits behind the eye",
        items=("HIT-2",),
        ways=(Way(stages=hits_by(_on_the_line)),),
    )
)

MISTAKES.register("small_root_only")(
    Mistake(
        says="takes the sphere's smaller root or none, though the larger one may be inside the clip interval",
        items=("HIT-1",),
        ways=(Way(stages={**hits_by(_smaller_root), Stage.VISIBILITY: _seen_out_of_spheres}),),
    )
)

for _which in ("first", "last"):
    MISTAKES.register(f"{_which}_hit")(
        Mistake(
            says=f"takes the {_which} shape that a ray meets, not the nearest",
            items=("HIT-9",),
            ways=(
                Way(stages=Counting(of_shapes=_which).stages),
                *(
                    Way(formulas={"nearest": f"fault_{_which}", "square": square})
                    for square in ("local", "half_vectors")
                ),
            ),
        )
    )


def _fitted(cases: Sequence[Fitting]) -> Iterator[Way]:
    known = {("nearest", "nearest"), ("nearest", "first"), ("nearest", "last")}
    for of_shapes in RULES:
        for of_faces in RULES:
            if (of_faces, of_shapes) not in known:
                yield Counting(of_faces=of_faces, of_shapes=of_shapes).way
    for below in _greatest_distances(cases):
        yield Counting(below=below).way


def _greatest_distances(cases: Sequence[Fitting]) -> list[float]:
    """Return distances [m] below which hits may count and beyond which they do not, those of few digits."""
    seen, missed = 0.0, []
    for case in cases:
        stage = Stage.OBJECT if case.staged else Stage.RADIANCE
        if stage not in case.ours:
            continue
        distance = case.evidence.right.answers[Stage.DISTANCE][..., 0]
        there = np.isfinite(distance) & case.plain
        ours, right = case.ours[stage], case.evidence.right.answers[stage]
        same = np.all(np.isclose(ours, right, rtol=1e-4, atol=0), axis=-1)
        gone = np.all(ours <= 0, axis=-1) if stage is Stage.RADIANCE else ours[..., 0] < 0
        shown = there & same & (np.any(right != 0, axis=-1) if stage is Stage.RADIANCE else True)
        seen = max(seen, float(np.max(distance[shown], initial=0.0)))
        missed.append(distance[there & gone & ~same])
    hidden = np.concatenate(missed) if missed else np.zeros(0)
    if len(hidden) < LEAST_HIDDEN or not seen < hidden.min():
        return []
    # Between the farthest hit that is seen and the nearest that is not any distance explains these cases.
    low, high = seen, float(hidden.min())
    for digits in range(6):
        step = 10.0 ** (np.floor(np.log10(high)) - digits)
        numbers = step * np.arange(np.ceil(low / step), np.floor(high / step) + 1)
        numbers = numbers[(numbers > low) & (numbers <= high)]
        if len(numbers):
            return [rounded(float(number)) for number in numbers[:MOST_DISTANCES]]
    return [(low + high) / 2]


MISTAKES.register("another_hit")(
    Mistake(
        says="takes another hit than the nearest",
        items=("HIT-9",),
        ways=(Counting(of_shapes="farthest", of_faces="farthest").way,),
        fitted=_fitted,
    )
)
