"""The 3-D view of a case as a script beside its picture: PyVista's scene for vtk.js, packed, and what it means."""

import base64
import zlib
from pathlib import Path
from typing import Any, TypedDict

import numpy as np

from rayproof.cases.scene import Scene
from rayproof.cases.stages import FACTS, Stage
from rayproof.reports.publish.scene3d.picture_hits import (
    Hits,
    absolute_error,
    chosen_hits,
    colored_stage,
    comparable,
    correct_digits,
)
from rayproof.reports.publish.scene3d.picture_lines import add_lines
from rayproof.reports.publish.scene3d.picture_places import framing
from rayproof.reports.publish.scene3d.picture_scene import aim
from rayproof.reports.publish.scene3d.view_parts import Frame, parts
from rayproof.reports.publish.scene3d.view_state import Instance, state
from rayproof.reports.results.atomic import write_text
from rayproof.reports.results.image_script import script
from rayproof.reports.results.json_numbers import as_json

LEVEL = 6  # the highest takes three times as long for half a percent
# Hundredths of a decade tell any two colours apart, and small whole numbers compress.
HUNDREDTHS = 100
STAGES = tuple(stage for stage in Stage if stage not in (Stage.CAMERA, Stage.OBJECT))


class StageValues(TypedDict):
    """How far off the points are at a stage, in hundredths of a decade."""

    unit: str
    error: list[int | str | None]
    digits: list[int | str | None]


class PointValues(TypedDict):
    """The points' pixels [column, row], and their values by stage."""

    pixels: list[list[int]]
    stages: dict[str, StageValues]


def point_values(hits: Hits, ours: Any, theirs: Any) -> PointValues:
    """Return `pixels` [[column, row], ...] and per comparable stage `error` and `digits`, hundredths of a decade.

    `error` is log10 of the largest absolute difference over channels, `digits` -log10 of the relative one; null where
    exact, "nan" where the difference is no finite number.
    """
    with np.errstate(divide="ignore"):
        stages: dict[str, StageValues] = {
            stage.value: {
                "unit": FACTS[stage].unit,
                "error": _hundredths(np.log10(hits.of(absolute_error(ours, theirs, stage))), exact=-np.inf),
                "digits": _hundredths(hits.of(correct_digits(ours, theirs, stage)), exact=np.inf),
            }
            for stage in STAGES
            if comparable(ours, theirs, stage)
        }
    return {"pixels": np.stack([hits.columns, hits.rows], axis=1).tolist(), "stages": stages}


def _hundredths(values: np.ndarray, *, exact: float) -> list[int | str | None]:
    known = np.isfinite(values)
    rounded: list[int | str | None] = np.rint(HUNDREDTHS * np.where(known, values, 0)).astype(int).tolist()
    for place in np.flatnonzero(~known).tolist():
        rounded[place] = None if values[place] == exact else "nan"
    return rounded


class ViewAbout(TypedDict):
    """What a scene's parts mean."""

    parts: list[list[str]]  # name, layer
    middle: list[float]  # m
    size: float  # m
    eye: list[float]  # m
    lights: list[list[float]]  # m
    colored: str | None  # the stage whose errors the points show
    points: PointValues | None


class ViewHeader(TypedDict):
    """A view without its arrays."""

    about: ViewAbout
    scene: Instance


def write_view(
    plotter: Any, folder: Path, view: str, scene: Scene, *, ours: Any, theirs: Any, stage: str | None
) -> Path:
    """Write `folder`/`view` and return its path; `plotter` is one of `new_recorder`, used any number of times."""
    colored = colored_stage(ours, theirs, stage)
    error = None if colored is None else absolute_error(ours, theirs, colored)
    hits = chosen_hits(ours, theirs, error)
    middle, size = framing(scene, np.empty((0, 3)) if hits is None else hits.points)
    frame = Frame(middle=middle, size=size)
    plotter.clear()
    shown = list(parts(scene, hits, ours or theirs, theirs if ours else None, frame))
    for part in shown:
        # The browser draws in float32, and float64 would be stored as such.
        part.mesh.points = part.mesh.points.astype(np.float32)
        if part.plain is not None:
            add_lines(plotter, part.mesh, name=part.name, **part.plain)
        else:
            plotter.add_mesh(part.mesh, name=part.name, render=False, **part.style)
    aim(plotter, scene.camera, np.zeros(3), 1.0)
    recorded, arrays = state(plotter)
    about: ViewAbout = {
        "parts": [[part.name, part.layer] for part in shown],
        "middle": middle.tolist(),
        "size": size,
        "eye": list(scene.camera.eye),
        "lights": [list(light.position) for light in scene.lights],
        "colored": colored,
        "points": None if hits is None else point_values(hits, ours, theirs),
    }
    text = pack({"about": about, "scene": recorded}, arrays)
    return write_text(folder / view, script(view, text))


def pack(header: ViewHeader, arrays: dict[str, np.ndarray]) -> str:
    """Return header and arrays as deflated base64: length of the JSON (4 bytes), the JSON, the arrays' bytes.

    Arrays of four-byte numbers are stored as byte planes, the highest first, which halves what deflate leaves of them.
    `viewer/unpack.js` is the inverse.
    """
    listed = [[name, values.nbytes, values.itemsize == 4] for name, values in arrays.items()]
    head = as_json({**header, "arrays": listed}).encode()
    body = b"".join(_planes(values) for values in arrays.values())
    packed = zlib.compress(len(head).to_bytes(4, "little") + head + body, LEVEL)
    return base64.b64encode(packed).decode("ascii")


def _planes(values: np.ndarray) -> bytes:
    if values.itemsize != 4:
        return values.tobytes()
    return values.view(np.uint32).astype(">u4").view(np.uint8).reshape(-1, 4).T.tobytes()
