"""Planted mistakes of camera matrices, frustum corners, pixels and view rays."""

import math
from typing import Any

import drjit as dr

from rayproof.tracer.kernel.arithmetic import matrix


def fault_left_handed(eye: Any, target: Any, up: Any) -> tuple[Any, Any, Any]:
    """Return a left-handed frame: right U x F, up and forward.

    The right axis as U x F, which mirrors the image.
    """
    forward = dr.normalize(target - eye)
    right = dr.normalize(dr.cross(dr.normalize(up), forward))
    return right, dr.cross(forward, right), forward


def fault_up_as_given(eye: Any, target: Any, up: Any) -> tuple[Any, Any, Any]:
    """Return a frame whose up is not orthogonal to forward.

    The given up vector used as it is, not at right angles to forward.
    """
    forward = dr.normalize(target - eye)
    right = dr.normalize(dr.cross(forward, dr.normalize(up)))
    return right, dr.normalize(up), forward


def fault_far_by_near(frame: Any) -> list[Any]:
    """Return the corners of a box instead of a frustum.

    The far plane's corners no farther from the axis than the near plane's.
    """
    return [
        frame.eye
        + depth * frame.forward
        + frame.near * (sx * frame.horizontal * frame.right + sy * frame.vertical * frame.up)
        for depth in (frame.near, frame.far)
        for sx, sy in ((-1, -1), (1, -1), (1, 1), (-1, 1))
    ]


def fault_horizontal_angle(Float: Any, fovy: float, aspect: float) -> tuple[Any, Any]:
    """Return half-sizes whose horizontal angle is fovy.

    Fovy taken for the horizontal angle.
    """
    tangent = dr.tan(Float(math.radians(fovy) / 2))
    return tangent, tangent / aspect


def fault_no_aspect(Float: Any, fovy: float, aspect: float) -> tuple[Any, Any]:
    """Return tan(alpha) twice.

    The image's aspect dropped, so that circles become ellipses.
    """
    tangent = dr.tan(Float(math.radians(fovy) / 2))
    return tangent, tangent


def fault_whole_angle(Float: Any, fovy: float, aspect: float) -> tuple[Any, Any]:
    """Return the half-sizes for alpha = fovy.

    Fovy taken for half the vertical angle.
    """
    tangent = dr.tan(Float(math.radians(fovy)))
    return tangent * aspect, tangent


def fault_transposed(matrix: Any) -> Any:
    """Return the transpose of a 4x4 matrix.

    The transpose taken for the inverse, as if every matrix were a rotation.
    """
    return type(matrix)([[matrix[j, i] for j in range(4)] for i in range(4)])


def fault_not_flipped(px: Any, py: Any, width: int, height: int) -> tuple[Any, Any]:
    """Return sy = 2 py / H - 1, growing downwards.

    Rows counted upwards, so the image is upside down.
    """
    return 2 * px / width - 1, 2 * py / height - 1


def fault_swapped_sizes(px: Any, py: Any, width: int, height: int) -> tuple[Any, Any]:
    """Return sx = 2 px / H - 1 and sy = 1 - 2 py / W.

    Width and height exchanged in the pixel's coordinates.
    """
    return 2 * px / height - 1, 1 - 2 * py / width


def fault_upwards(sx: Any, sy: Any, width: int, height: int) -> tuple[Any, Any]:
    """Return py = (1 + sy) H / 2.

    The way back from NDC forgets that rows count downwards.
    """
    return (sx + 1) * width / 2, (1 + sy) * height / 2


def fault_minus_one(horizontal: Any, vertical: Any, near: Any, far: Any) -> Any:
    """Return camera -> clip with near -> -1 and far -> 1.

    Depth from -1 at the near plane, as OpenGL has it.
    """
    stretch = (far + near) / (far - near)
    return matrix(
        [
            [1 / horizontal, 0, 0, 0],
            [0, 1 / vertical, 0, 0],
            [0, 0, stretch, -2 * near * far / (far - near)],
            [0, 0, 1, 0],
        ],
        like=near,
    )


def fault_depends_on_t(frame: Any, sx: Any, sy: Any) -> Any:
    """Return a ray that is right only for a target 1 m away.

    H and V without the length of the reference vector, so that the ray depends on t.
    """
    t = dr.norm(frame.target - frame.eye)
    ref = dr.fma(frame.forward, t, frame.eye)
    p = ref + sx * frame.right * frame.horizontal + sy * frame.up * frame.vertical
    return dr.normalize(p - frame.eye)


def fault_not_normalised(frame: Any, sx: Any, sy: Any) -> Any:
    """Return p - eye, not a unit vector.

    The direction left as long as it comes.
    """
    return frame.forward + sx * frame.right * frame.horizontal + sy * frame.up * frame.vertical


def fault_not_moved(eye: Any, right: Any, up: Any, forward: Any) -> Any:
    """Return world -> camera without the eye's translation.

    A view matrix that turns and does not move.
    """
    rows = [[*axis, 0] for axis in (right, up, forward)]
    return matrix([*rows, [0, 0, 0, 1]], like=right.x)
