"""`DoubleDouble`: the everyday oracle, every stage in pairs of float64 (about 31 digits), vectorised by Dr.Jit."""

from collections.abc import Collection
from dataclasses import dataclass
from importlib.metadata import version

import numpy as np

from rayproof.cases.scene import Scene
from rayproof.cases.stages import IMAGE_STAGES, Stage, StageImages
from rayproof.reference.double_double.arithmetic import fast_math_off, types, unavailable
from rayproof.reference.double_double.stages import camera_answer

LANES = 2**20  # rays in one launch
MOST_TRIANGLES = 20_000  # every ray is held against every triangle


@dataclass(frozen=True, kw_only=True)
class PairAnswers:
    """Answers of shape (N, channels) as high + low, and per ray the smallest margin of its decisions."""

    high: StageImages
    low: StageImages
    margin: np.ndarray  # (N,): below questions.LOW_MARGIN a certified reference should be asked


class DoubleDouble:
    """Exact mathematics in about 31 digits; shares Dr.Jit and LLVM with the tracer, so `certified` is its witness.

    Numbers keep float64's range: where products fall below about 1e-290 the second half of the digits is lost, and
    above 1e308 everything is. A ray whose smallest margin is below 2^-80 may be decided wrongly.
    """

    precision = "float64"

    def version(self) -> str:
        """Return program and version, for the report."""
        return f"double_double 1 (drjit {version('drjit')})"

    def unsupported(self, scene: Scene, stage: Stage) -> str | None:
        """Return a sentence where Dr.Jit has no LLVM, or where a mesh is too large to be searched without a tree."""
        if (reason := unavailable()) is not None:
            return reason
        triangles = sum(len(getattr(shape, "faces", ())) for shape in scene.shapes)
        if triangles > MOST_TRIANGLES and stage not in {Stage.CAMERA, Stage.RAY}:
            return f"{triangles} triangles are too many to hold every ray against; at most {MOST_TRIANGLES}"
        return None

    def render(self, scene: Scene, stages: Collection[Stage], *, samples: int = 1) -> StageImages:
        """Answer `stages`; with samples > 1, radiance only, the mean over samples x samples points per pixel.

        Raises:
            ValueError: samples < 1, or samples > 1 for a stage other than radiance.

        """
        if samples < 1 or (samples > 1 and set(stages) != {Stage.RADIANCE}):
            raise ValueError(f"samples must be 1, or more for radiance alone, got {samples} for {sorted(stages)}")
        camera = scene.camera
        answers: StageImages = {}
        if Stage.CAMERA in stages:
            answers[Stage.CAMERA] = camera_answer(camera)
        offsets = (np.arange(samples) + 0.5) / samples
        rows, columns, down, across = np.ix_(np.arange(camera.height), np.arange(camera.width), offsets, offsets)
        points = np.stack(np.broadcast_arrays(columns + across, rows + down), axis=-1).reshape(-1, 2)
        for stage, values in self.at(scene, [stage for stage in stages if stage is not Stage.CAMERA], points).items():
            shape = (camera.height, camera.width, samples**2, values.shape[1])
            answers[stage] = values.reshape(shape).mean(axis=2) if samples > 1 else values.reshape(*shape[:2], shape[3])
        return answers

    def at(self, scene: Scene, stages: Collection[Stage], points: np.ndarray) -> StageImages:
        """Answer image stages at image points (N, 2) = (px, py) [px]; each answer has shape (N, channels).

        Raises:
            ValueError: the camera stage, which is no image.

        """
        return self._answers(scene, stages, points, pairs=False).high if stages else {}

    def pairs(self, scene: Scene, stages: Collection[Stage], points: np.ndarray) -> PairAnswers:
        """Answer image stages at image points (N, 2) [px] with all digits and with margins.

        Raises:
            ValueError: the camera stage, which is no image, or no stage.

        """
        return self._answers(scene, stages, points, pairs=True)

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
        camera = scene.camera
        if stage is Stage.CAMERA:
            raise ValueError("the camera stage continues from nothing; ask render")
        if stage is Stage.RAY:
            return self.render(scene, [stage])[stage]
        from rayproof.reference.double_double.stages import step

        flat = {
            name: np.asarray(image, dtype=np.float64).reshape(camera.height * camera.width, np.shape(image)[-1])
            for name, image in given.items()
            if name is not Stage.CAMERA
        }
        with fast_math_off():
            answer = step(scene, types(), stage, flat)
        return answer.reshape(camera.height, camera.width, answer.shape[1])

    def _answers(self, scene: Scene, stages: Collection[Stage], points: np.ndarray, *, pairs: bool) -> PairAnswers:
        if Stage.CAMERA in stages or not stages:
            raise ValueError("image stages are answered at image points, the camera stage is none")
        from rayproof.reference.double_double.stages import launch
        from rayproof.reference.double_double.worlds import PairWorld

        chosen = [stage for stage in IMAGE_STAGES if stage in stages]
        points = np.asarray(points, dtype=np.float64)
        with fast_math_off():
            world = PairWorld(scene, types())
            parts = [
                launch(world, chosen, points[start : start + LANES], pairs=pairs)
                for start in range(0, max(1, len(points)), LANES)
            ]
        high, low = (
            {stage: np.concatenate([part[side][stage] for part in parts]) for stage in chosen if parts[0][side]}
            for side in (0, 1)
        )
        return PairAnswers(high=high, low=low, margin=np.concatenate([part[2] for part in parts]))
