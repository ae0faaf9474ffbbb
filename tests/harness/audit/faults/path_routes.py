"""Planted faults of routes and tiles: literals, numbers, stages, frames, samples, cones, tables and their lanes."""

from dataclasses import replace
from typing import Any

import drjit as dr
import numpy as np

from rayproof.cases.stages import Stage
from rayproof.tracer import frames
from rayproof.tracer.frames import Frames
from rayproof.tracer.kernel.arrays import Lanes
from rayproof.tracer.kernel.parameters import NumbersInMemory
from rayproof.tracer.light_path import camera_stage, radiance
from rayproof.tracer.light_path.surfaces import HitShapes
from rayproof.tracer.shapes.shape import Transform
from rayproof.tracer.trees import beams
from rayproof.tracer.trees.beams import Cone
from rayproof.tracer.trees.unrolled import UnrolledShapes
from tests.harness.audit.faults.paths import function, method

FRAMED = ("flux_conservation/west", "faces/nine", "crowds/squares")
COUNTED = ("flux_conservation/west", "faces/nine", "shadows/every_blocker")


def _scaled(right: Any, frame: Any) -> Any:
    return right(frame) * np.float32(1.01)


def _raised(right: Any, frame: Any) -> Any:
    return right(frame) ** np.float32(2.2)


def _first_sample(right: Any, traces: Any, lanes: Any, per_side: int, types: Any) -> Any:
    return radiance(traces(types.UInt(0), types.UInt(0)))


def _last_packet(right: Any, image: Any, numbers: Any, values: Any, lanes: Any, types: Any) -> None:
    right(image, numbers, [*values[:-1], values[-1] * 1.01], lanes, types)


def _turned_packet(right: Any, image: Any, numbers: Any, values: Any, lanes: Any, types: Any) -> None:
    packets = any(lanes.columns % n == 0 and lanes.width % n == 0 for n in frames.PACKETS)
    right(image, numbers, [*values[1:], values[0]] if packets else values, lanes, types)


def _never_crossed(right: Any, bodies: Any, plane: Any, shadow_rays: Any) -> Any:
    return bodies.types.Bool(False)


def _positive(right: Any, transform: Any, what: str, matrix: Any, vector: Any, *, transposed: bool = False) -> Any:
    # A coefficient of -1 is spared like one of 1, where numbers are literals.
    spared = matrix if transform.parameters.shared else np.where(matrix == -1, 1.0, matrix)
    return right(transform, what, spared, vector, transposed=transposed)


def _flux(shared: bool) -> Any:
    def number(right: Any, numbers: Any, name: str, value: Any) -> Any:
        found = right(numbers, name, value)
        return found * 1.001 if numbers.shared is shared and name.endswith("flux") else found

    return number


def _corner(right: Any, view: Any, positions: Any) -> Any:
    found = right(view, positions)
    several = view.per_side > 1 and view.within is None
    return [(x + 1 / view.context.scene.camera.width, y) for x, y in found] if several else found


def _narrow(right: Any, *given: Any) -> Any:
    found = right(*given)
    return found and replace(found, cosine=0.5 + found.cosine / 2, sine=found.sine / 2)


def _unreversed(right: Any, about: Any) -> Any:
    return about


def _rotated(right: Any, shapes: Any, name: str, of: Any, upload: Any) -> Any:
    if name == "albedo" and shapes.world.plan.tables and not shapes.world.parameters.shared:
        every = [of(shape) for shape in shapes.shapes]
        turned = dict(zip(shapes.shapes, every[1:] + every[:1], strict=True))
        return right(shapes, name, lambda shape: turned[shape], upload)
    return right(shapes, name, of, upload)


def _moved(right: Any, shapes: Any) -> Any:
    found = right(shapes)
    return replace(found, rows=[found.rows[0] * 1.01, *found.rows[1:]])


def _dimmer(right: Any, shapes: Any, name: str, of: Any, upload: Any) -> Any:
    found = right(shapes, name, of, upload)
    plain = name == "albedo" and not shapes.world.plan.tables and not shapes.world.parameters.shared
    return found * 0.99 if plain and len({one.shape.albedo for one in shapes.shapes}) > 1 else found


def _tile(columns: int, rows: int) -> Any:
    def image(right: Any, lanes: Any, values: Any) -> Any:
        if (lanes.columns, lanes.rows) == (columns, rows):
            values = [*values[1:], values[0]]
        return right(lanes, values)

    return image


def _odd_width(right: Any, view: Any, positions: Any) -> Any:
    width = view.lanes.width
    if view.lanes.tile == 1 or width % view.lanes.columns == 0:
        return right(view, positions)
    return right(view, [(dr.minimum(column, width - 2), row) for column, row in positions])


def _one_sample(right: Any, lanes: Any, UInt: Any) -> Any:
    found = right(lanes, UInt)
    if lanes.tile > 1:
        return found
    ((column, row),) = found
    return [(dr.minimum(column + 1, lanes.width - 1), row)]


method(
    "frames_scaled",
    Frames,
    "pixels",
    _scaled,
    "Frames are a hundredth too bright.",
    path="route/frames",
    stage=Stage.RADIANCE,
    cases=FRAMED,
    routes=("frames",),
)
method(
    "frames_raised",
    Frames,
    "pixels",
    _raised,
    "Frames raise the radiance to the power 2.2.",
    path="route/frames",
    stage=Stage.RADIANCE,
    cases=FRAMED,
    routes=("frames",),
)
function(
    "frames_last_in_lane",
    frames._write,
    _last_packet,
    "Of the samples of a lane the last is written too bright.",
    path="route/frames",
    stage=Stage.RADIANCE,
    cases=FRAMED,
    routes=("frames",),
)
function(
    "frames_samples_dropped",
    frames._mean,
    _first_sample,
    "Frames take the first sample of a pixel for their mean.",
    path="route/frames of samples",
    stage=Stage.RADIANCE,
    cases=("antialiased/cube", "faces/nine"),
    routes=("frames of samples",),
)
function(
    "frames_packet_turned",
    frames._write,
    _turned_packet,
    "Neighbours that are written at once change places.",
    path="frames/packets",
    stage=Stage.RADIANCE,
    cases=("shadows/every_blocker", "crowds/squares"),
    routes=("frames of tiles",),
)
method(
    "literal_minus_one",
    Transform,
    "_product",
    _positive,
    "Where numbers are literals, a coefficient -1 is taken for 1.",
    path="numbers/literals",
    stage=Stage.RADIANCE,
    cases=("flux_conservation/west", "parallel_rays/flat"),
    routes=("frames",),
)
method(
    "numbers_flux",
    NumbersInMemory,
    "__call__",
    _flux(False),
    "Numbers in memory of one kernel: every flux is wrong.",
    path="route/numbers",
    stage=Stage.RADIANCE,
    cases=COUNTED,
    routes=("numbers",),
)
method(
    "stages_flux",
    NumbersInMemory,
    "__call__",
    _flux(True),
    "Numbers in memory of several kernels: every flux is wrong.",
    path="route/stages",
    stage=Stage.IRRADIANCE,
    cases=("primitives/square",),
)
function(
    "samples_moved",
    camera_stage.sample_ndc,
    _corner,
    "Samples side by side are half a pixel off.",
    path="route/samples",
    stage=Stage.RADIANCE,
    cases=("antialiased/cube", "faces/nine"),
    routes=("samples",),
)
function(
    "cones_too_narrow",
    beams.cone,
    _narrow,
    "The cone about a shape is too narrow for it.",
    path="cones/from the eye",
    stage=Stage.OBJECT,
    cases=("shadows/every_blocker", "crowds/of_several_kinds"),
    routes=("tiles of 8 x 1", "tiles of 4 x 1"),
)
method(
    "cones_not_reversed",
    Cone,
    "reversed",
    _unreversed,
    "The cone from the light is not turned round for shadow rays.",
    path="cones/from a light",
    stage=Stage.VISIBILITY,
    cases=("shadows/every_blocker", "several_lights/simplified"),
    routes=("tiles of 8 x 1", "tiles of 4 x 1"),
)
method(
    "cones_plane_never",
    UnrolledShapes,
    "_crossing",
    _never_crossed,
    "Planes are passed over by all shadow rays of a tile.",
    path="cones/planes",
    stage=Stage.VISIBILITY,
    cases=("shadows/behind_a_plane",),
    routes=("tiles of 8 x 1",),
)
method(
    "tables_albedo",
    HitShapes,
    "constant",
    _rotated,
    "Tables that literals and numbers look up rotate the albedo.",
    path="tables/looked up",
    stage=Stage.RADIANCE,
    cases=("crowds/of_several_kinds", "crowds/squares"),
    routes=("frames",),
)
method(
    "tables_placement",
    HitShapes,
    "transform",
    _moved,
    "Matrices that are looked up are stretched.",
    path="tables/looked up",
    stage=Stage.NORMAL,
    also=(Stage.POSITION, Stage.DISTANCE),
    cases=("crowds/cubes", "crowds/ellipsoids", "crowds/of_several_kinds"),
)
method(
    "chosen_albedo",
    HitShapes,
    "constant",
    _dimmer,
    "An albedo that is chosen among all shapes is too dark.",
    path="tables/chosen",
    stage=Stage.RADIANCE,
    cases=("shadows/every_blocker", "flux_conservation/west"),
    routes=("numbers", "frames"),
)
for _columns, _rows, _cases in (
    (8, 1, ("shadows/every_blocker", "antialiased/cube")),
    (4, 1, ("crowds/of_several_kinds",)),
    (4, 4, ("crowds/cubes",)),
    (4, 2, ("crowds/squares",)),
    (2, 2, ("alone/concave_mesh",)),
):
    method(
        f"tile_{_columns}x{_rows}",
        Lanes,
        "image",
        _tile(_columns, _rows),
        f"Samples of tiles of {_columns} x {_rows} change places.",
        path=f"plan/{_columns} x {_rows}",
        stage=Stage.RAY,
        cases=_cases,
        routes=(f"tiles of {_columns} x {_rows}",),
    )
function(
    "odd_width",
    camera_stage.sample_ndc,
    _odd_width,
    "In an odd width the last column of a tile is seen as the one before.",
    path="plan/2 x 2",
    stage=Stage.OBJECT,
    also=(Stage.DISTANCE,),
    cases=("faces/one", "faces/nine", "faces/above_each_other"),
)
method(
    "one_sample_moved",
    Lanes,
    "positions",
    _one_sample,
    "A lane of one sample takes its neighbour's.",
    path="plan/one sample",
    stage=Stage.CAMERA,
    also=(Stage.RAY,),
    cases=("primitives/sphere",),
)
