"""POV-Ray: the reference's class, and which scenes it refuses."""

import itertools
from collections.abc import Collection

import numpy as np

from rayproof.cases.placement import world_triangles
from rayproof.cases.rounding import gamma
from rayproof.cases.scene import Camera, Cube, Mesh, Plane, Scene, Shape, Sphere, Square, Triangle
from rayproof.cases.stages import IMAGE_STAGES, Resolution, Stage, StageImages
from rayproof.reference.povray import program
from rayproof.reference.povray.program import DEPTH_TOLERANCE, FARTHEST, LIT_SCALE, SHADOW_TOLERANCE, missing, scale_of

# A shape that measures less than this many of POV-Ray's tolerances no longer tests it.
SMALLEST = 100
CORNERS = np.array(list(itertools.product((-0.5, 0.5), repeat=3)))


def refusal(scene: Scene, stage: Stage) -> str | None:
    """Return why POV-Ray cannot answer `stage` of `scene`, or None if it can."""
    if stage is Stage.CAMERA:
        return "POV-Ray has a camera but no clip space, so no matrices to show."
    return missing() or (None if stage is Stage.RAY else _size(scene))


def _size(scene: Scene) -> str | None:
    scale, eye = scale_of(scene), np.asarray(scene.camera.eye)
    tolerance = (SHADOW_TOLERANCE if scene.lights else DEPTH_TOLERANCE) / scale
    points = [np.asarray([light.position for light in scene.lights]).reshape(-1, 3)]
    for index, shape in enumerate(scene.shapes):
        if isinstance(shape, Plane):
            farthest = _farthest_of(shape, scene)
        else:
            points.append(_corners(shape))
            farthest = 0.0
            size = float(np.ptp(points[-1], axis=0).max())
            if 0 < size < SMALLEST * tolerance:
                return f"POV-Ray's tolerance is {tolerance:.1g} m here, and shapes[{index}] measures only {size:g} m."
        if farthest * scale > FARTHEST:
            return f"POV-Ray sees {FARTHEST / scale:g} m far here, and shapes[{index}] is hit at {farthest:g} m."
    every = np.concatenate(points)
    # From any point to any other, feelers included.
    reach = float(np.linalg.norm(every - eye, axis=1).max(initial=0)) * 2
    if reach * scale > FARTHEST:
        return f"POV-Ray sees {FARTHEST / scale:g} m far here, and the scene reaches {reach:g} m."
    return None


def _farthest_of(plane: Plane, scene: Scene) -> float:
    """Return the largest distance [m] at which a pixel's centre sees the plane inside the clip interval, 0 if none."""
    camera = scene.camera
    matrix = np.asarray(plane.to_world)
    normal = np.linalg.inv(matrix[:3, :3])[2]
    forward = np.subtract(camera.target, camera.eye, dtype=np.float64)
    forward /= np.linalg.norm(forward)
    directions = _directions(camera, forward)
    with np.errstate(all="ignore"):
        distance = (normal @ (matrix[:3, 3] - camera.eye)) / (directions @ normal)
        limit = np.inf if scene.clip == "none" else camera.far
        depth = distance * (directions @ forward) if scene.clip == "depth" else distance
    seen = distance[(distance > 0) & np.isfinite(distance) & (depth < limit)]
    return float(seen.max(initial=0))


def _directions(camera: Camera, forward: np.ndarray) -> np.ndarray:
    """Return unit directions (n, 3) through the pixel centres."""
    right = np.cross(forward, np.asarray(camera.up, dtype=np.float64))
    right /= np.linalg.norm(right)
    rows, columns = np.mgrid[: camera.height, : camera.width] + 0.5
    tangent = np.tan(camera.alpha)
    across = (2 * columns / camera.width - 1)[..., np.newaxis] * tangent * camera.aspect * right
    along = (1 - 2 * rows / camera.height)[..., np.newaxis] * tangent * np.cross(right, forward)
    directions = (forward + across + along).reshape(-1, 3)
    return directions / np.linalg.norm(directions, axis=1, keepdims=True)


def _corners(shape: Shape) -> np.ndarray:
    """Return points (n, 3) [m] whose box holds a finite shape."""
    if isinstance(shape, Triangle | Mesh):
        return world_triangles(shape).reshape(-1, 3).astype(np.float64)
    matrix = np.asarray(shape.to_world)
    if isinstance(shape, Sphere):
        local = np.asarray(shape.center) + 2 * shape.radius * CORNERS
    elif isinstance(shape, Cube | Square):
        local = CORNERS if isinstance(shape, Cube) else CORNERS * (1, 1, 0)
    else:
        raise LookupError(f"POV-Ray has not been taught the shape {type(shape).__name__}")
    return local @ matrix[:3, :3].T + matrix[:3, 3]


# POV-Ray as a reference: its `trace()` in double precision stage by stage, and radiance as its own pictures.


LIT = IMAGE_STAGES[IMAGE_STAGES.index(Stage.VISIBILITY) :]


class PovRay:
    """A renderer of 1991 with an algebra of its own, in float64, also for sheared ellipsoids.

    Rays, hits, normals and feelers are asked of `trace()` in double; which shape and face, of a picture in which every
    face shines in its own colour. Irradiance and exitance are Lambert's law on those numbers; radiance is what
    POV-Ray's own camera, lights and shadows make of the scene, to 16 bits at several exposures.
    """

    precision = "float64"
    ray_epsilon = DEPTH_TOLERANCE  # m, in an unlit scene; in a lit one 1024 times less

    @classmethod
    def missing(cls) -> str | None:
        """Return how to install POV-Ray, or None if it is there."""
        return program.missing()

    def version(self) -> str:
        """Return program and version."""
        return program.version()

    def unsupported(self, scene: Scene, stage: Stage) -> str | None:
        """Return a sentence that says why it cannot answer here, or None if it can."""
        return refusal(scene, stage)

    def settings(self, scene: Scene) -> dict[str, str]:
        """Return what its answer depends on besides the scene."""
        from rayproof.reference.povray.program import scale_of

        return {"units per metre": f"{scale_of(scene):g}", **program.OPTIONS}

    def resolution(self, scene: Scene, stage: Stage) -> Resolution | None:
        """Return half a step of the pictures, where the answer comes from them."""
        if stage is not Stage.RADIANCE:
            return None
        from rayproof.reference.povray import program

        # A value fills at least a quarter of the range, and POV-Ray's colours are float32.
        steps = program.WHITE / program.LADDER - 1
        return Resolution(
            relative=0.5 / steps + gamma(16, precision="float32"),
            absolute=0.0,
            because="16-bit pictures at exposures that grow fourfold, and colours in float32",
        )

    def epsilon_at(self, seen: StageImages) -> float:
        """Return how near [m] to a feeler's ends POV-Ray's pictures ignore what blocks it."""
        return SHADOW_TOLERANCE / LIT_SCALE

    def notes(self, scene: Scene) -> list[str]:
        """Return in sentences where POV-Ray's answer is to another question than the one asked."""
        if not scene.lights:
            return []
        near = f"{SHADOW_TOLERANCE / LIT_SCALE:.1e} m"
        return [
            "Irradiance and exitance are Lambert's law applied to the hits and the shadows that trace() found.",
            f"In POV-Ray's pictures blockers within {near} of a feeler's ends do not count.",
        ]

    def render(self, scene: Scene, stages: Collection[Stage], *, samples: int = 1) -> StageImages:
        """Answer `stages`; with samples > 1, radiance only, the mean over samples x samples points per pixel."""
        found = self._probed(scene, lit=bool(set(stages) & set(LIT)))
        if Stage.RADIANCE in stages:
            found[Stage.RADIANCE] = _radiance(scene, found, samples)
        return {stage: found[stage] for stage in stages}

    def _probed(self, scene: Scene, *, lit: bool) -> StageImages:
        """Return every stage before radiance; those of light only if `lit`."""
        from rayproof.reference.povray import program
        from rayproof.reference.povray.program import stages_of, world

        camera = scene.camera
        with program.workshop(world(scene, program.faces_look) + program.loop(scene, feelers=lit)) as folder:
            program.trace(folder, width=camera.width, height=camera.height, renders={"faces.ppm": ()})
            probe, objects = program.read_probe(folder, scene), program.faces(program.read(folder / "faces.ppm"))
        rows = stages_of(scene, probe, objects.reshape(-1, 2), lit=lit)
        return {stage: values.reshape(camera.height, camera.width, values.shape[1]) for stage, values in rows.items()}


def _radiance(scene: Scene, found: StageImages, samples: int) -> np.ndarray:
    """Return radiance; the exposures are chosen by what trace() found at the pixel centres."""
    from rayproof.reference.povray import program

    expected = found[Stage.EXITANCE] / (np.pi if scene.shading == "inverse_square" else 1.0)
    channels = expected.reshape(-1, 3)
    bright = np.where(channels > 0, channels, -np.inf).max(axis=0)
    dark = np.where(channels > 0, channels, np.inf).min(axis=0)
    black = np.isinf(bright)
    if black.all():
        return np.zeros_like(expected)
    # Between pixel centres it may get darker still: a mean's small parts matter little.
    return program.radiance(scene, samples, np.where(black, 1.0, bright), np.where(black, 1.0, dark))
