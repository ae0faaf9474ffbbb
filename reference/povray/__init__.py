"""POV-Ray as a reference: its `trace()` in double precision stage by stage, and radiance as its own pictures."""

from collections.abc import Collection

import numpy as np

from rayproof.cases.rounding import gamma
from rayproof.cases.scene import Scene
from rayproof.cases.stages import IMAGE_STAGES, Resolution, Stage, StageImages
from rayproof.reference.povray import program
from rayproof.reference.povray.program import DEPTH_TOLERANCE, LIT_SCALE, SHADOW_TOLERANCE

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
        from rayproof.reference.povray.refusals import refusal

        return refusal(scene, stage)

    def settings(self, scene: Scene) -> dict[str, str]:
        """Return what its answer depends on besides the scene."""
        from rayproof.reference.povray.worlds import scale_of

        return {"units per metre": f"{scale_of(scene):g}", **program.OPTIONS}

    def resolution(self, scene: Scene, stage: Stage) -> Resolution | None:
        """Return half a step of the pictures, where the answer comes from them."""
        if stage is not Stage.RADIANCE:
            return None
        from rayproof.reference.povray import pictures

        # A value fills at least a quarter of the range, and POV-Ray's colours are float32.
        steps = pictures.WHITE / pictures.LADDER - 1
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
        from rayproof.reference.povray import pictures, probing
        from rayproof.reference.povray.stages import stages_of
        from rayproof.reference.povray.worlds import world

        camera = scene.camera
        with program.workshop(world(scene, pictures.faces_look) + probing.loop(scene, feelers=lit)) as folder:
            program.trace(folder, width=camera.width, height=camera.height, renders={"faces.ppm": ()})
            probe, objects = probing.read(folder, scene), pictures.faces(pictures.read(folder / "faces.ppm"))
        rows = stages_of(scene, probe, objects.reshape(-1, 2), lit=lit)
        return {stage: values.reshape(camera.height, camera.width, values.shape[1]) for stage, values in rows.items()}


def _radiance(scene: Scene, found: StageImages, samples: int) -> np.ndarray:
    """Return radiance; the exposures are chosen by what trace() found at the pixel centres."""
    from rayproof.reference.povray import pictures

    expected = found[Stage.EXITANCE] / (np.pi if scene.shading == "inverse_square" else 1.0)
    channels = expected.reshape(-1, 3)
    bright = np.where(channels > 0, channels, -np.inf).max(axis=0)
    dark = np.where(channels > 0, channels, np.inf).min(axis=0)
    black = np.isinf(bright)
    if black.all():
        return np.zeros_like(expected)
    # Between pixel centres it may get darker still: a mean's small parts matter little.
    return pictures.radiance(scene, samples, np.where(black, 1.0, bright), np.where(black, 1.0, dark))
