"""Camera formulas: from scene description to matrices and to one ray per pixel.

Contract. A file registers one formula as "slot/variant" with the facts covers (specification ids), kind ("right",
"control" or "fault"), stage (the one blamed) and, where it applies, erratum, equivalent, and default=True for the
variant that runs unless another is named. Facts are read from the source, so they are literals. Arguments and results
are Dr.Jit arrays of the configuration's precision (literals for what belongs to the camera, so that they fold away); a
`frame` is `tracer.stages.camera_frame.Frame`.

    half_extent(Float, fovy, aspect)             -> (horizontal, vertical) half-sizes of the image at depth 1, Float;
                                                    fovy in degrees and aspect as Python numbers
    basis(eye, target, up)                       -> (right, up, forward), unit and orthogonal
    view(eye, right, up, forward)                -> 4x4, world -> camera (x right, y up, z forward)
    projection(horizontal, vertical, near, far)  -> 4x4, camera -> clip, w = depth
    inverse(matrix)                              -> 4x4
    corners(frame)                               -> 8 world points [m], near plane first
    sample(column, row, per_side)                -> (px, py), column and row counted in samples, per_side per pixel
    ndc(px, py, width, height)                   -> (sx, sy)
    pixel(sx, sy, width, height)                 -> (px, py)
    ray(frame, sx, sy)                           -> unit world direction
"""

from collections.abc import Callable
from typing import Any

from rayproof.cases.declarations import DeclaredRegistry

CAMERA: DeclaredRegistry[Callable[..., Any]] = DeclaredRegistry(
    "camera formula", package="rayproof.tracer.camera", name="CAMERA"
)
