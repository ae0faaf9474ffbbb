"""`Certified` proves every stage: signs by balls or exact numbers, values by balls or pairs of floats with radii."""

from collections.abc import Collection, Iterator
from importlib.metadata import version
from typing import TypedDict

import flint
import numpy as np

from rayproof.cases.scene import Scene
from rayproof.cases.stages import IMAGE_STAGES, Stage, StageImages, exr_channels
from rayproof.reference.certified.bundles import walked
from rayproof.reference.certified.camera import camera_answer
from rayproof.reference.certified.filters import everything, surfaces_of, suspects
from rayproof.reference.certified.light_paths import Suspects
from rayproof.reference.certified.stages import continued
from rayproof.reference.certified.truths import Truth, enclosed, truths

MOST_SURFACES = 200  # triangles and other shapes in a whole image; `at` and `enclose` take more


class EnclosedPixel(TypedDict):
    """The certain values at a pixel's centre."""

    pixel: list[int]
    bits: int  # the precision that sufficed
    exact: bool  # whether a tie was decided by exact numbers
    undecided: list[str]  # names of decisions
    stages: dict[str, list[list[float]]]  # by stage [low, high] of each channel, the float64 next to the enclosure


class Certified:
    """Enclosures of the exact values: answers are float64 numbers within one ulp of the truth, every branch is proved.

    An undecided value, which is a tie of numbers that are not recognised as equal, is NaN and is listed by `enclose`.
    A component of a vector that is about zero has an error of at most 2^-100 of the vector's length. The class shares
    neither code nor compiler with the tracer.
    """

    precision = "float64"

    def version(self) -> str:
        """Return the program's name and version, for the report."""
        return f"certified 1 (python-flint {version('python-flint')}, FLINT {flint.__FLINT_VERSION__})"

    def unsupported(self, scene: Scene, stage: Stage) -> str | None:
        """Return the reason if the scene has too many triangles for a whole image, else None."""
        surfaces = sum(1 for _ in surfaces_of(scene))
        if surfaces > MOST_SURFACES and stage is not Stage.CAMERA:
            return (
                f"whole images of {surfaces} triangles and shapes take too long to certify; "
                f"at most {MOST_SURFACES}, or single pixels by `rayproof certify`"
            )
        return None

    def render(self, scene: Scene, stages: Collection[Stage], *, samples: int = 1) -> StageImages:
        """Render `stages`; with samples > 1, radiance only, the mean over samples x samples points per pixel.

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

    def at(self, scene: Scene, stages: Collection[Stage], points: np.ndarray, *, exactly: bool = True) -> StageImages:
        """Return image stages at image points (N, 2) = (px, py) [px]; each array has shape (N, channels).

        Without `exactly` a tie is NaN: for coincident surfaces exact numbers take minutes per image.

        Raises:
            ValueError: the camera stage, which is no image.

        """
        if Stage.CAMERA in stages:
            raise ValueError("the camera stage has no value at an image point")
        if not stages:
            return {}
        reached = IMAGE_STAGES[: max(IMAGE_STAGES.index(stage) for stage in stages) + 1]
        points, last = np.asarray(points, dtype=np.float64), reached[-1]
        widths = [len(exr_channels(stage, lights=len(scene.lights))) for stage in reached]
        ends = np.cumsum(widths).tolist()
        # All stages of a pixel are in one row: numpy splits them faster than Python.
        suspected = list(_suspects(scene, stages, points))
        table, certain = walked(scene, points, suspected, last, widths)
        rest = np.flatnonzero(~certain)
        uncertain = ((x, y) for x, y in points[rest].tolist())
        proved = truths(scene, uncertain, (suspected[i] for i in rest), last, exactly=exactly)
        for row, truth in zip(rest, proved, strict=True):
            table[row] = [float(value) for balls in truth.values[: len(reached)] for value in balls]
        return {
            stage: table[:, end - width : end]
            for stage, end, width in zip(reached, ends, widths, strict=True)
            if stage in stages
        }

    def continue_from(self, scene: Scene, stage: Stage, earlier: StageImages) -> np.ndarray:
        """Return an image stage computed exactly from the numbers of the earlier stages.

        `earlier` contains (height, width, channels) arrays of the stages that this one reads:

            ray <- nothing             object <- ray                    distance <- ray, object
            position <- ray, object, distance                           normal <- ray, object, position
            visibility <- object, position, normal                      irradiance <- those and visibility
            exitance <- object, irradiance                              radiance <- ray, object, normal, exitance

        Directions are not normalized: t is measured in units of their length. Positions are treated as points on the
        surface of their object, although rounding may have moved them off it.

        Raises:
            ValueError: the camera stage, which continues from nothing and is no image.

        """
        camera = scene.camera
        if stage is Stage.CAMERA:
            raise ValueError("the camera stage continues from nothing; ask render")
        if stage is Stage.RAY:
            return self.render(scene, [stage])[stage]
        flat = {
            name: np.asarray(image, dtype=np.float64).reshape(camera.height * camera.width, np.shape(image)[-1])
            for name, image in earlier.items()
            if name is not Stage.CAMERA
        }
        rows = continued(scene, stage, flat)
        return rows.reshape(camera.height, camera.width, rows.shape[1])

    def enclose(
        self,
        scene: Scene,
        stages: Collection[Stage],
        pixels: Collection[tuple[int, int]],
        *,
        filtered: bool = True,
        exactly: bool = True,
    ) -> list[EnclosedPixel]:
        """Return the certain values at the centre of each pixel (column, row), as plain data.

        `filtered=False` tests every surface in balls, as a check of the filter; without `exactly` a tie is left
        undecided.

        Raises:
            ValueError: the camera stage, which is no image, or no stage.

        """
        chosen = _image_stages(stages)
        points = np.array(list(pixels), dtype=np.float64).reshape(-1, 2) + 0.5
        return [
            {
                "pixel": [int(pixel[0]), int(pixel[1])],
                "bits": truth.bits,
                "exact": truth.exactly,
                "undecided": list(truth.undecided),
                "stages": {
                    str(stage): [list(enclosed(value)) for value in truth.values[IMAGE_STAGES.index(stage)]]
                    for stage in chosen
                },
            }
            for pixel, truth in zip(
                pixels, _truths(scene, chosen, points, filtered=filtered, exactly=exactly), strict=True
            )
        ]


def _image_stages(stages: Collection[Stage]) -> list[Stage]:
    chosen = [stage for stage in IMAGE_STAGES if stage in stages]
    if Stage.CAMERA in stages or not chosen:
        raise ValueError(f"image stages are needed, and no others, got {sorted(stages)}")
    return chosen


def _truths(
    scene: Scene,
    stages: Collection[Stage],
    points: np.ndarray,
    *,
    filtered: bool = True,
    exactly: bool = True,
) -> Iterator[Truth]:
    points = np.asarray(points, dtype=np.float64)
    chosen = _suspects(scene, stages, points) if filtered else iter([everything(scene)] * len(points))
    last = max(stages, key=IMAGE_STAGES.index)
    return truths(scene, ((x, y) for x, y in points.tolist()), chosen, last, exactly=exactly)


def _suspects(scene: Scene, stages: Collection[Stage], points: np.ndarray) -> Iterator[Suspects]:
    lights = any(IMAGE_STAGES.index(stage) >= IMAGE_STAGES.index(Stage.VISIBILITY) for stage in stages)
    return suspects(scene, points, lights=lights)
