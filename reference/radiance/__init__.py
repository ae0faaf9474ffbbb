"""Radiance's rtrace: the reference's class, and which scenes it refuses."""

from collections.abc import Collection
from functools import lru_cache

from rayproof.cases.rounding import gamma
from rayproof.cases.scene import Plane, Scene, Sphere, is_similarity
from rayproof.cases.stages import IMAGE_STAGES, Resolution, Stage, StageImages
from rayproof.reference.radiance import program
from rayproof.reference.radiance.scene import FTINY, box, extent, height, reach, scale

# Among the images; the ray itself needs no shape.
HIT = IMAGE_STAGES[IMAGE_STAGES.index(Stage.OBJECT) :]
LIT = IMAGE_STAGES[IMAGE_STAGES.index(Stage.VISIBILITY) :]
# The length at a ray's start within which rtrace ignores hits may be at most this fraction of a shape.
COARSEST = 0.01
# Coordinates beyond lose their unit's power of two or overflow where they are squared.
LARGEST, SMALLEST = 1e140, 1e-140


def refusal(scene: Scene, stage: Stage) -> str | None:
    """Return the reason why Radiance cannot render `stage` of `scene`, or None if it can."""
    if stage is Stage.CAMERA:
        return "rtrace has no camera: it is handed rays."
    size = extent(scene)
    if not SMALLEST < size < LARGEST:
        return f"Squares of lengths of {size:g} m leave the range of rtrace's numbers."
    if stage in HIT:
        reason = _shapes(scene)
        if reason is not None:
            return reason
    if stage in LIT and stage is not Stage.VISIBILITY and scene.shading == "simplified":
        return "Radiance has no light without the inverse square law."
    return _horizon(scene) if stage in LIT else None


def _horizon(scene: Scene) -> str | None:
    """Return the reason for no answer about light if a plane is visible so far away that a light is too low over it."""
    planes = [(index, shape) for index, shape in enumerate(scene.shapes) if isinstance(shape, Plane)]
    for index, plane in planes:
        for number, light in enumerate(scene.lights):
            above = abs(height(plane, light.position)[0])
            if 0 < above <= 2 * FTINY * reach(scene):
                return (
                    f"rtrace takes cosines below 1e-6 for 0; light {number} has such on far parts of shapes[{index}]."
                )
    return None


@lru_cache(maxsize=4)
def _shapes(scene: Scene) -> str | None:
    least = FTINY / COARSEST / scale(scene)
    for index, shape in enumerate(scene.shapes):
        if isinstance(shape, Sphere) and not is_similarity(shape.to_world):
            return f"Radiance has no ellipsoids, and shapes[{index}] is one."
        if isinstance(shape, Plane):
            continue
        low, high = box(shape)
        if float((high - low).max()) < least:
            return f"rtrace resolves {least:g} m in a scene of this size, and shapes[{index}] is smaller."
    return None


# Radiance's rtrace as a reference: its input are rays, its output their hits and the radiance along them, in doubles.


# Roundings to float32 in the computation of a radiance (normal.c, source.c): a material's colour and a light's, the
# product of cosine and solid angle, its product with the material, and that with the light. White, the colour for
# irradiance, is exact, and so is a product with it.
PAINTED, WHITENED = 5, 2


class Radiance:
    """Ward's lighting simulator by its own programs: it shares no code, compiler or camera with the others.

    It intersects in float64 (1e-13 of the scene) and adds light in float32. The rays are built here, in float64; hits,
    positions and normals are those of rtrace; visibility and irradiance are its radiance of the whitened scene under
    one light, seen from just above each hit; radiance is its radiance of the scene, light by light. Polygons and their
    shadows extend a millionth of the scene beyond their edges.
    """

    precision = "float64"
    takes_sample_offset = True

    @staticmethod
    def missing() -> str | None:
        """Return a sentence with the reason why it cannot run here and the remedy, or None."""
        return program.missing()

    def version(self) -> str:
        """Return program and version, for the report."""
        return program.version()

    def unsupported(self, scene: Scene, stage: Stage) -> str | None:
        """Return a sentence with the reason why it cannot answer here, or None if it can."""
        return refusal(scene, stage)

    def settings(self, scene: Scene) -> dict[str, str]:
        """Return the settings on which its answer depends in addition to the scene."""
        from rayproof.reference.radiance.scene import LIGHT_RADIUS, scale

        units = scale(scene)
        return {
            "rtrace": " ".join(program.OPTIONS),
            "unit": f"{1 / units:g} m",
            "light": f"illum, sphere of radius {LIGHT_RADIUS / units:g} m, one at a time",
        }

    def resolution(self, scene: Scene, stage: Stage) -> Resolution | None:
        """Return the resolution of light, which rtrace computes in float32; None for its float64 geometry."""
        if stage not in (Stage.IRRADIANCE, Stage.EXITANCE, Stage.RADIANCE):
            return None
        roundings = PAINTED if stage is Stage.RADIANCE else WHITENED
        return Resolution(
            relative=gamma(roundings, precision="float32"),
            absolute=0.0,
            because=f"rtrace multiplies colours in float32, {roundings} roundings from a light to the eye",
        )

    def epsilon_in(self, scene: Scene, answers: StageImages) -> float:
        """Return the distance [m] outside its edges at which a polygon may block, more than the offset of shadow rays.

        A point counts as on a polygon's edge if two coordinates, or two products of coordinates, differ by FTINY:
        absolutely in rtrace 6.0a, relatively in later versions (common/face.c, `inface`). Either is below this if the
        sides are longer than a 500 000th of the scene.
        """
        from rayproof.reference.radiance.scene import FTINY, extent

        return FTINY * extent(scene)

    def edge_epsilon(self, scene: Scene) -> float:
        """Return the distance [m] outside a polygon's edge at which a point may count as inside, as in `epsilon_in`."""
        from rayproof.reference.radiance.scene import FTINY, extent

        return FTINY * extent(scene)

    def tie_epsilon(self, scene: Scene) -> float:
        """Return the distance [m] along a ray below which two hits coincide: FTINY (rt/raytrace.c, `rayreject`)."""
        from rayproof.reference.radiance.scene import FTINY, scale

        return FTINY / scale(scene)

    def notes(self, scene: Scene) -> list[str]:
        """Return sentences about the differences between the given scene and the scene that rtrace renders."""
        from rayproof.reference.radiance.scene import LIGHT_RADIUS, reach, scale

        notes = []
        planes = [str(index) for index, shape in enumerate(scene.shapes) if isinstance(shape, Plane)]
        if planes:
            notes.append(f"Infinite plane shapes[{', '.join(planes)}] is a disc of radius {reach(scene):.4g} m.")
        if scene.lights:
            radius = LIGHT_RADIUS / scale(scene)
            notes.append(f"Every light is a sphere of radius {radius:.2g} m; what is nearer to it does not block it.")
        return notes

    def render(self, scene: Scene, stages: Collection[Stage], *, samples: int = 1) -> StageImages:
        """Answer `stages`; with samples > 1, radiance only, the mean over samples x samples points per pixel.

        Raises:
            RuntimeError: a program ended with an error, or wrote fewer numbers than requested.

        """
        from rayproof.reference.radiance.program import RtraceScene, image, single

        with RtraceScene(scene) as world:
            images = single(scene, world, stages) if samples == 1 and set(stages) - {Stage.RADIANCE} else {}
            if Stage.RADIANCE in stages:
                images[Stage.RADIANCE] = image(scene, world, samples)
        return images
