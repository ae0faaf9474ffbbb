"""The picture of two disputed pixels in docs/judging.md: python -m tests.harness.nearby_picture.

It shows what the judge does. A renderer is given that has, in the disputed pixel, the mean of two surfaces' radiances:
no nearby problem has that value, so that the judge asks all its problems. The picture has the answers to these.
"""

import sys
from dataclasses import dataclass, replace
from pathlib import Path

import matplotlib as mpl
import numpy as np
from PIL import Image

from rayproof.cases.families import select
from rayproof.cases.stages import Stage
from rayproof.reference.analytic import Analytic
from rayproof.reference.analytic.camera import view_of
from rayproof.reports.commands.probe import tracer_answers
from rayproof.reports.judge.against_oracle import AgainstOracle
from rayproof.reports.judge.measurement import Kind
from rayproof.reports.judge.nearby.clouds import Cloud, joined
from rayproof.reports.judge.oracle import stages_of
from rayproof.reports.judge.scene_truth import scene_truth
from rayproof.tracer.configuration import Configuration
from tests.command_line import call

mpl.use("Agg")
import matplotlib.pyplot as plt
from matplotlib.axes import Axes

CHECKOUT = Path(__file__).parents[2]
PICTURE = CHECKOUT / "docs" / "pictures" / "nearby.png"
OUTLINE = ("cie_isotropic_source/turned", 19, 0)
VERTEX = ("watertight/vertices", 10, 0)
COLOURS = ("#0072b2", "#e69f00", "#009e73", "#cc79a7", "#56b4e9", "#d55e00", "#8a7a00", "#555555")
CHANNEL = 0  # of the radiance that is drawn
SIZE = (10.5, 8.2)  # inches
DOTS_PER_INCH = 90
PALETTE = 128  # colours of the file


@dataclass(frozen=True, kw_only=True)
class Disputed:
    """A pixel that is over its limit in the tracer's answer, with the answers of nearby problems there."""

    name: str
    tracer: AgainstOracle
    pixel: tuple[int, int]  # column, row
    cloud: Cloud  # at this pixel alone
    mean: float  # of the least and the greatest radiance

    @property
    def value(self) -> float:
        """Return the tracer's radiance."""
        column, row = self.pixel
        return float(self.tracer.renderer.answers[Stage.RADIANCE][row, column, CHANNEL])

    @property
    def oracle(self) -> float:
        """Return the oracle's radiance."""
        column, row = self.pixel
        return float(self.tracer.base.truth[Stage.RADIANCE][row, column, CHANNEL])

    @property
    def limit(self) -> float:
        """Return the forward limit of the radiance."""
        column, row = self.pixel
        return float(self.tracer.end_to_end[Stage.RADIANCE].limit[row, column, CHANNEL])

    @property
    def points(self) -> np.ndarray:
        """Return where the problems' rays go, (K, 2) [millionths of a pixel] from the pixel's centre."""
        view = view_of(self.tracer.base.scene.camera)
        points = view.image_points(view.eye + self.cloud.rows[Stage.RAY][:, 0])
        return 1e6 * (points - (np.asarray(self.pixel) + 0.5))

    @property
    def objects(self) -> dict[tuple[int, int], np.ndarray]:
        """Return (shape, face) -> which problems (K,) hit it."""
        hit = self.cloud.rows[Stage.OBJECT][:, 0].astype(int)
        return {(int(shape), int(face)): (hit == (shape, face)).all(axis=1) for shape, face in np.unique(hit, axis=0)}


def disputed(name: str, column: int, row: int) -> Disputed:
    """Ask the judge about a pixel of the tracer in float32, and of a renderer that has a mean of two surfaces there.

    Raises:
        ValueError: the judge does not say that the tracer is explained by rounding and the mean is wrong.

    """
    scene = select([name])[0].scene
    base = scene_truth(scene, stages_of(scene), Analytic())
    tracer = AgainstOracle(base, tracer_answers(Configuration(), scene))
    first = _radiances(tracer, column, row)
    values = first.rows[Stage.RADIANCE][:, 0]
    mean = (values.min(axis=0) + values.max(axis=0)) / 2
    # By radiance alone, so that any object that a nearby problem hits may be meant.
    image = np.array(tracer.renderer.answers[Stage.RADIANCE], dtype=np.float64)
    image[row, column] = mean
    mixing = AgainstOracle(base, replace(tracer.renderer, answers={Stage.RADIANCE: image}))
    kinds = tuple(Kind(each.end_to_end[Stage.RADIANCE].kinds[row, column]) for each in (tracer, mixing))
    if kinds != (Kind.ROUNDING, Kind.WRONG):
        raise ValueError(
            f"{name}, pixel ({column}, {row}): the tracer's value is {kinds[0].name}, the mean {kinds[1].name}"
        )
    return Disputed(
        name=name, tracer=tracer, pixel=(column, row), cloud=_radiances(mixing, column, row), mean=float(mean[CHANNEL])
    )


def _radiances(against: AgainstOracle, column: int, row: int) -> Cloud:
    """Return the answers of all problems that the judge asks about the radiance of a pixel."""
    over = np.zeros_like(against.base.conditioning.hit)
    over[row, column] = True
    asking = against.asking({Stage.RADIANCE: over}, keep=True)
    asking.explain()
    return joined([cloud for cloud, _, _ in asking.clouds])


def draw() -> int:
    """Draw the picture of docs/judging.md anew."""
    figure, axes = plt.subplots(2, 2, figsize=SIZE, dpi=DOTS_PER_INCH, layout="constrained", height_ratios=(1.25, 1))
    for (above, below), pixel, title in zip(
        axes.T,
        (disputed(*OUTLINE), disputed(*VERTEX)),
        ("an outline through a pixel's centre", "a mesh's vertex at a pixel's centre"),
        strict=True,
    ):
        above.set_title(f"{title}\n{pixel.name}, pixel {pixel.pixel}, {len(pixel.points)} problems", fontsize=10)
        _draw_points(above, pixel)
        _draw_values(below, pixel)
    figure.canvas.draw()
    pixels = np.asarray(figure.canvas.buffer_rgba())[..., :3]  # pyright: ignore[reportAttributeAccessIssue]
    Image.fromarray(pixels).quantize(PALETTE).save(PICTURE, optimize=True)
    return 0


def _name(shape: int, face: int) -> str:
    return "nothing" if shape < 0 else f"shape {shape}\nface {face}"


def _draw_points(axes: Axes, pixel: Disputed) -> None:
    """Draw where the problems' rays go, coloured by what they hit."""
    colours = np.empty(len(pixel.points), dtype=object)
    for colour, hits in zip(COLOURS, pixel.objects.values(), strict=False):
        colours[hits] = colour
    # In a random order, so that no object's points hide those of the others.
    order = np.random.default_rng(1).permutation(len(colours))
    axes.scatter(*pixel.points[order].T, c=colours[order].tolist(), s=1.5)
    axes.plot(0, 0, "k+", markersize=14)
    axes.set_xlabel("image point - pixel's centre [1e-6 px]")
    axes.set_ylabel("[1e-6 px]")
    axes.set_aspect("equal")
    axes.invert_yaxis()


def _draw_values(axes: Axes, pixel: Disputed) -> None:
    """Draw the radiances of the problems by what they hit, the tracer's, the oracle's and the wrong one."""
    radiances = pixel.cloud.rows[Stage.RADIANCE][:, 0, CHANNEL]
    for place, (colour, hits) in enumerate(zip(COLOURS, pixel.objects.values(), strict=False)):
        some = radiances[hits]
        spread = np.linspace(-0.25, 0.25, len(some)) if len(some) > 1 else np.zeros(1)
        axes.plot(place + spread, some, ".", color=colour, markersize=3)
        span = f"{some.min():.7g}" if some.min() == some.max() else f"{some.min():.7g}\nto {some.max():.7g}"
        axes.annotate(span, (place, some.max()), xytext=(0, 5), textcoords="offset points", ha="center", fontsize=6.5)
    limit = pixel.limit
    axes.axhline(
        pixel.value, color="black", linewidth=1, label=f"tracer, float32: {pixel.value:.7g}, limit {limit:.2g}"
    )
    axes.axhline(pixel.oracle, color="black", linewidth=1, linestyle=":", label=f"oracle: {pixel.oracle:.7g}")
    axes.axhline(pixel.mean, color="#c00000", linewidth=1, linestyle="--", label=f"a mean, wrong: {pixel.mean:.7g}")
    names = [f"{_name(*thing)}\n{np.count_nonzero(hits)}" for thing, hits in pixel.objects.items()]
    axes.set_xticks(range(len(names)), names, fontsize=7)
    low, high = radiances.min(), radiances.max()
    axes.set_ylim(low - 0.12 * (high - low), high + 0.55 * (high - low))
    axes.set_ylabel("radiance [W/(m² sr)]")
    axes.legend(fontsize=7.5, loc="upper left", framealpha=0.9)


if __name__ == "__main__":
    sys.exit(call(draw))
