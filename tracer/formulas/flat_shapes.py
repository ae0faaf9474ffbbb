"""Formulas of ray and plane, and of ray and square.

A square is known by its place in object space, or by half-vectors in world space (specification, HIT-7
and HIT-8).
"""

from typing import Any

import drjit as dr

from rayproof.tracer.rays import Interval, Ray


def dot_products(ray: Ray, plane: Any, interval: Interval) -> Any:
    """Return dot(N, S - R0) / dot(N, Rd) with N = (0, 0, 1) and S = 0, if inside the interval, or inf.

    The plane z = 0 of object space.
    """
    parallel = ray.direction.z == 0
    t = -ray.origin.z / dr.select(parallel, 1, ray.direction.z)
    return dr.select(interval.contains(t) & ~parallel, t, dr.inf)


def unguarded(ray: Ray, plane: Any, interval: Interval) -> Any:
    """Return -z / z_d even where z_d = 0.

    Control for erratum E11: the plane's division without a test for parallel rays.
    """
    t = -ray.origin.z / ray.direction.z
    return dr.select(interval.contains(t), t, dr.inf)


def local(ray: Ray, square: Any, interval: Interval) -> Any:
    """Return the t of the plane's hit if it lies in the square and inside the interval, or inf.

    In the square's local space: the plane z = 0, then abs(x) < 0.5 and abs(y) < 0.5.
    """
    parallel = ray.direction.z == 0
    t = -ray.origin.z / dr.select(parallel, 1, ray.direction.z)
    P = ray.at(t)
    inside = (abs(P.x) < square.half) & (abs(P.y) < square.half)
    return dr.select(interval.contains(t) & inside & ~parallel, t, dr.inf)


def half_vectors(ray: Ray, square: Any, interval: Interval) -> Any:
    """Return the t of the plane's hit if it lies in the square and inside the interval, or inf.

    By its half-width and half-height vectors, in world space and without a transform.
    The lecture's two dot tests hold for orthogonal vectors; under shear the 2x2 Gram system gives the coordinates.
    """
    w, h = square.half_width, square.half_height
    N = dr.cross(w, h)
    from_center = ray.origin - square.center
    slope = dr.dot(N, ray.direction)
    parallel = slope == 0
    t = -dr.dot(N, from_center) / dr.select(parallel, 1, slope)
    P = dr.fma(ray.direction, t, from_center)
    along_w, along_h = dr.dot(P, w), dr.dot(P, h)
    ww, hh = dr.squared_norm(w), dr.squared_norm(h)
    if square.orthogonal:
        inside = (abs(along_w) < ww) & (abs(along_h) < hh)
    else:
        wh = dr.dot(w, h)
        determinant = ww * hh - wh * wh
        x = hh * along_w - wh * along_h
        y = ww * along_h - wh * along_w
        inside = (abs(x) < determinant) & (abs(y) < determinant)
    return dr.select(interval.contains(t) & inside & ~parallel, t, dr.inf)


def full_vectors(ray: Ray, square: Any, interval: Interval) -> Any:
    """Return the t of a square of twice the size, right only in its plane.

    Control for erratum E7: the two dot tests with full width and height vectors.
    """
    width, height = 2 * square.half_width, 2 * square.half_height
    N = dr.cross(width, height)
    from_center = ray.origin - square.center
    slope = dr.dot(N, ray.direction)
    parallel = slope == 0
    t = -dr.dot(N, from_center) / dr.select(parallel, 1, slope)
    P = dr.fma(ray.direction, t, from_center)
    inside = (abs(dr.dot(P, width)) < dr.squared_norm(width)) & (abs(dr.dot(P, height)) < dr.squared_norm(height))
    return dr.select(interval.contains(t) & inside & ~parallel, t, dr.inf)
