"""`Analytic`: the oracle in float64 NumPy, for every stage and its edges."""

from collections.abc import Collection
from typing import TYPE_CHECKING

import numpy as np

from rayproof.cases.scene import Scene
from rayproof.cases.stages import IMAGE_STAGES, Stage, StageImages

if TYPE_CHECKING:
    from rayproof.reference.analytic.edges import Edges
    from rayproof.reference.analytic.edges.surroundings import Near, Surroundings


class Analytic:
    """Closed-form geometry in float64; shares neither code, algebra nor compiler with the tracer.

    Its rounding error is a few units of 2^-53 relative to the scene's coordinates, times the condition of the shapes'
    matrices and of grazing incidence: nine digits below float32 wherever a float32 tracer can be judged.
    """

    precision = "float64"

    def version(self) -> str:
        """Return program and version, for the report."""
        return f"analytic 1 (numpy {np.__version__})"

    def unsupported(self, scene: Scene, stage: Stage) -> str | None:
        """Return None: every valid scene and stage is answered."""
        return None

    def render(self, scene: Scene, stages: Collection[Stage], *, samples: int = 1) -> StageImages:
        """Answer `stages`; with samples > 1, radiance only, the mean over samples x samples points per pixel.

        Raises:
            ValueError: samples < 1, or samples > 1 for a stage other than radiance.

        """
        from rayproof.reference.analytic.camera import camera_answer, pixel_centers

        if samples < 1 or (samples > 1 and set(stages) != {Stage.RADIANCE}):
            raise ValueError(f"samples must be 1, or more for radiance alone, got {samples} for {sorted(stages)}")
        camera = scene.camera
        centers = pixel_centers(camera)
        answers: StageImages = {}
        if Stage.CAMERA in stages:
            answers[Stage.CAMERA] = camera_answer(camera)
        if samples == 1:
            images = self.at(scene, [stage for stage in stages if stage is not Stage.CAMERA], centers)
        else:
            offsets = (np.arange(samples) + 0.5) / samples - 0.5
            total = np.zeros((len(centers), 3))
            for down in offsets:
                points = centers + np.stack(np.broadcast_arrays(offsets, down), axis=1)[:, np.newaxis]
                found = self.at(scene, [Stage.RADIANCE], points.reshape(-1, 2))[Stage.RADIANCE]
                total += found.reshape(samples, -1, 3).sum(axis=0)
            images = {Stage.RADIANCE: total / samples**2}
        for stage, rows in images.items():
            answers[stage] = rows.reshape(camera.height, camera.width, rows.shape[1])
        return answers

    def at(self, scene: Scene, stages: Collection[Stage], points: np.ndarray) -> StageImages:
        """Answer image stages at image points (N, 2) = (px, py) [px]; each answer has shape (N, channels).

        Raises:
            ValueError: the camera stage, which is no image.

        """
        from rayproof.reference.analytic.stages import chain

        if Stage.CAMERA in stages:
            raise ValueError("the camera stage has no value at an image point")
        if not stages:
            return {}
        found = chain(scene, np.asarray(points, dtype=np.float64), max(stages, key=IMAGE_STAGES.index))
        return {stage: found[stage] for stage in IMAGE_STAGES if stage in stages}

    def continue_from(self, scene: Scene, stage: Stage, given: StageImages) -> np.ndarray:
        """Return an image stage computed from the `given` earlier ones, exact mathematics on the numbers received.

        `given` holds (height, width, channels) arrays of the stages that this one reads:

            ray <- nothing             object <- ray                    distance <- ray, object
            position <- ray, object, distance                           normal <- ray, object, position
            visibility <- object, position, normal                      irradiance <- those and visibility
            exitance <- object, irradiance                              radiance <- ray, object, normal, exitance

        Directions are taken as they are, of whatever length: t is along them. Positions are taken to lie on the
        surface of their object, whatever rounding moved them off it.

        Raises:
            ValueError: the camera stage, which continues from nothing and is no image.

        """
        from rayproof.reference.analytic.camera import pixel_centers
        from rayproof.reference.analytic.stages import NEXT, rays

        camera = scene.camera
        if stage is Stage.CAMERA:
            raise ValueError("the camera stage continues from nothing; ask render")
        if stage is Stage.RAY:
            rows = rays(scene, pixel_centers(camera))
        else:
            flat = {
                name: np.asarray(image, dtype=np.float64).reshape(camera.height * camera.width, np.shape(image)[-1])
                for name, image in given.items()
                if name is not Stage.CAMERA
            }
            rows = NEXT[stage](scene, flat)
        return rows.reshape(camera.height, camera.width, rows.shape[1])

    def edges(self, scene: Scene) -> "Edges":
        """Return for every pixel lower bounds [px] of the distance to silhouettes, shadow edges and terminators."""
        from rayproof.reference.analytic.edges import edges_of

        return edges_of(scene)

    def surroundings(self, scene: Scene, points: np.ndarray, radius: np.ndarray) -> "Surroundings":
        """Return which faces come within a radius (n,) [px] of image points (n, 2), and whether one mesh fills it."""
        from rayproof.reference.analytic.edges.surroundings import surroundings

        return surroundings(scene, points, radius)

    def near(self, scene: Scene, points: np.ndarray) -> "Near":
        """Return how near to image points (n, 2) shadows' edges, inner edges of blockers and other surfaces are."""
        from rayproof.reference.analytic.edges.surroundings import near

        return near(scene, points)
