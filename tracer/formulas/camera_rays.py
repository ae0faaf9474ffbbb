"""Formulas of the ray through an image point: by a reference point, or by the inverse of the camera's matrices."""

from typing import Any

import drjit as dr

from rayproof.tracer.kernel.arithmetic import matrix, normalized, quad


def reference_point(frame: Any, sx: Any, sy: Any) -> Any:
    """Return normalize(p - eye) with p = ref + sx H + sy V.

    By the reference point: a point of the image plane through it, minus the eye.
    """
    # Any t > 0 gives the same ray. One as large as the eye's coordinates keeps p - eye from cancelling.
    t = dr.maximum(dr.norm(frame.target - frame.eye), dr.maximum(dr.max(abs(frame.eye)), 2.0**-50))
    ref = dr.fma(frame.forward, t, frame.eye)
    length = dr.norm(ref - frame.eye)
    V = frame.up * (length * frame.vertical)
    H = frame.right * (length * frame.horizontal)
    p = dr.fma(sx, H, dr.fma(sy, V, ref))
    return normalized(p - frame.eye)


def reference_point_at_target(frame: Any, sx: Any, sy: Any) -> Any:
    """Return normalize(p - eye) with p = ref + sx H + sy V and ref = eye + abs(target - eye) F.

    By the reference point at the target, which the eye is added to and taken off again.
    Digits go with the eye's distance from the world's origin over its distance from the target.
    """
    ref = frame.eye + frame.forward * dr.norm(frame.target - frame.eye)
    length = dr.norm(ref - frame.eye)
    V = frame.up * (length * frame.vertical)
    H = frame.right * (length * frame.horizontal)
    p = ref + sx * H + sy * V
    return dr.normalize(p - frame.eye)


def reference_free(frame: Any, sx: Any, sy: Any) -> Any:
    """Return normalize(F + sx R aspect tan(alpha) + sy U tan(alpha)).

    By the reference point without the eye, which is neither added nor subtracted.
    The rounding error is relative to the direction and does not depend on the position of the eye.
    """
    H, V = frame.right * frame.horizontal, frame.up * frame.vertical
    return dr.normalize(frame.forward + sx * H + sy * V)


def inverse_matrices(frame: Any, sx: Any, sy: Any) -> Any:
    """Return normalize(P - eye) with P = View^-1 Proj^-1 ((sx, sy, 1, 1) far).

    By the inverse matrices: a point of the far plane taken back to world space, minus the eye.
    """
    far = frame.far
    camera = frame.projection_inverse @ quad(sx * far, sy * far, far, far)
    # On the far plane w is 1 but for far / near roundings, which would multiply the eye's coordinates: set w to 1.
    P = frame.view_inverse @ quad(camera.x, camera.y, camera.z, 1)
    return dr.normalize(P.xyz - frame.eye)


def half_depth(frame: Any, sx: Any, sy: Any) -> Any:
    """Return normalize(P - eye) with P = View^-1 Proj^-1 ((sx, sy, 0.5, 1) far), whose w is not 1.

    Control for erratum E14: pixel Z "arbitrary in (0, 1]", without a division by w.
    """
    far = frame.far
    P = frame.view_inverse @ (frame.projection_inverse @ quad(sx * far, sy * far, far * 0.5, far))
    return dr.normalize(P.xyz - frame.eye)


def rotated(frame: Any, sx: Any, sy: Any) -> Any:
    """Return normalize(R P) with P = Proj^-1 (sx, sy, 1, 1) and R the rotation in View^-1.

    By the inverse projection, turned by the 3x3 part of the inverse view: the eye is never added, and w not used.
    In camera space a wrong w only makes the ray longer or shorter.
    """
    P = frame.projection_inverse @ quad(sx, sy, 1, 1)
    return dr.normalize((frame.view_inverse @ quad(P.x, P.y, P.z, 0)).xyz)


def w_divided_in_view(frame: Any, sx: Any, sy: Any) -> Any:
    """Return normalize(View^-1 (P / w) - eye) with (P, w) = Proj^-1 (sx, sy, 1, 1).

    By the inverse matrices one after the other, divided by w between them, where a wrong w does no harm.
    From far / near = 2 / u on w is 0 and no ray is left.
    """
    P = frame.projection_inverse @ quad(sx, sy, 1, 1)
    world = frame.view_inverse @ quad(P.x / P.w, P.y / P.w, P.z / P.w, 1)
    return dr.normalize(world.xyz - frame.eye)


def by_matrix(frame: Any, sx: Any, sy: Any) -> Any:
    """Return normalize(P - eye) with P = (View^-1 Proj^-1) ((sx, sy, 1, 1) far).

    Control: a ray by the product of both inverse matrices, multiplied out first and without a division by w.
    The product's last row takes 1 / (2 near) twice and off again, so that w is 1 up to far / near roundings; in world
    space w multiplies the eye, and the ray turns by about u abs(eye) / near.
    """
    far = frame.far
    P = (frame.view_inverse @ frame.projection_inverse) @ quad(sx * far, sy * far, far, far)
    return dr.normalize(P.xyz - frame.eye)


def matrix_w_divide(frame: Any, sx: Any, sy: Any) -> Any:
    """Return normalize(P / w - eye) with (P, w) = (View^-1 Proj^-1) (sx, sy, 1, 1).

    Control: a ray by the product of both inverse matrices, multiplied out first and divided by w.
    The ray turns by about u abs(eye) / near, and from far / near = 2 / u on w is 0 and no ray is left.
    """
    P = (frame.view_inverse @ frame.projection_inverse) @ quad(sx, sy, 1, 1)
    return dr.normalize(P.xyz / P.w - frame.eye)


def analytic_inverse(frame: Any, sx: Any, sy: Any) -> Any:
    """Return normalize(P / w - eye) with (P, w) = (View^-1 Proj^-1) (sx, sy, 1, 1).

    Control: a ray by the product of both inverse matrices with the projection's inverse in closed form, divided by w.
    The closed form changes nothing: the digits go in the product (see `ray/matrix_w_divide`).
    """
    near, far = frame.near, frame.far
    projection_inverse = matrix(
        [
            [frame.horizontal, 0, 0, 0],
            [0, frame.vertical, 0, 0],
            [0, 0, 0, 1],
            [0, 0, (near - far) / (near * far), 1 / near],
        ],
        like=near,
    )
    P = (frame.view_inverse @ projection_inverse) @ quad(sx, sy, 1, 1)
    return dr.normalize(P.xyz / P.w - frame.eye)
