"""Formulas of ray and sphere: the quadratic formula and its stable forms.

Unless stated otherwise, every function returns the smallest t inside the interval at which the ray meets the sphere, or
inf. f = origin - center, A = d . d, B = 2 d . f, C = f . f - r^2 (lecture), and h = -B / 2.
"""

from typing import Any

import drjit as dr

from rayproof.tracer.kernel.arithmetic import difference_of_products, in_float64, ordered, stable_roots
from rayproof.tracer.rays import Interval, Ray


def textbook(ray: Ray, sphere: Any, interval: Interval) -> Any:
    """Return the smallest of (-B -+ sqrt(B^2 - 4 A C)) / 2 A inside the interval, or inf.

    The quadratic formula as the lecture prints it, with the right choice of the root.
    """
    f = ray.origin - sphere.center
    A = dr.squared_norm(ray.direction)
    B = 2 * dr.dot(ray.direction, f)
    C = dr.squared_norm(f) - dr.square(sphere.radius)
    discriminant = B * B - 4 * A * C
    real = discriminant >= 0
    root = dr.sqrt(dr.select(real, discriminant, 0))
    t = interval.smallest((-B - root) / (2 * A), (-B + root) / (2 * A))
    return dr.select(real, t, dr.inf)


def first_positive(ray: Ray, sphere: Any, interval: Interval) -> Any:
    """Return t0 if positive, else t1 whatever it is: a sphere behind the eye is hit, and clipping is ignored.

    Control for erratum E3: "if t0 is positive, then we're done. If not, then compute t1".
    """
    f = ray.origin - sphere.center
    A = dr.squared_norm(ray.direction)
    B = 2 * dr.dot(ray.direction, f)
    C = dr.squared_norm(f) - dr.square(sphere.radius)
    discriminant = B * B - 4 * A * C
    root = dr.sqrt(dr.select(discriminant >= 0, discriminant, 0))
    t0, t1 = (-B - root) / (2 * A), (-B + root) / (2 * A)
    return dr.select(discriminant >= 0, dr.select(t0 > 0, t0, t1), dr.inf)


def kahan(ray: Ray, sphere: Any, interval: Interval) -> Any:
    """Return the smallest t inside the interval, with h h - A C rounded as if once, or inf.

    The discriminant is rounded as if once: a difference of products by fused operations.
    This removes the rounding error of the discriminant, but not those of its coefficients.
    Source: Kahan, "On the Cost of Floating-Point Computation Without Extra-Precise Arithmetic" (2004).
    """
    f = ray.origin - sphere.center
    A = dr.squared_norm(ray.direction)
    h = -dr.dot(f, ray.direction)
    C = dr.squared_norm(f) - dr.square(sphere.radius)
    quarter_discriminant = difference_of_products(h, h, A, C)
    real = quarter_discriminant >= 0
    root = dr.sqrt(dr.select(real, quarter_discriminant, 0))
    return dr.select(real, interval.smallest(*stable_roots(A, h, C, root)), dr.inf)


def stable_quadratic(ray: Ray, sphere: Any, interval: Interval) -> Any:
    """Return the smallest of q / A and C / q inside the interval, with q = h +- sqrt(h^2 - A C), or inf.

    The quadratic's usual discriminant, and roots that do not cancel.
    Sources: Blinn, "How to Solve a Quadratic Equation", IEEE Computer Graphics and Applications (2005 and 2006); Press
    et al., "Numerical Recipes", section 5.6.
    """
    f = ray.origin - sphere.center
    A = dr.squared_norm(ray.direction)
    h = -dr.dot(f, ray.direction)
    C = dr.squared_norm(f) - dr.square(sphere.radius)
    quarter_discriminant = h * h - A * C
    real = quarter_discriminant >= 0
    root = dr.sqrt(dr.select(real, quarter_discriminant, 0))
    return dr.select(real, interval.smallest(*stable_roots(A, h, C, root)), dr.inf)


def half_b(ray: Ray, sphere: Any, interval: Interval) -> Any:
    """Return the smallest of (h -+ sqrt(h^2 - A C)) / A with h = -B / 2 inside the interval, or inf.

    The quadratic formula with half of B, which cancels every 2 and 4.
    Source: Shirley, "Ray Tracing in One Weekend" (2016 and later), section on simplifying the intersection code.
    """
    f = ray.origin - sphere.center
    A = dr.squared_norm(ray.direction)
    h = -dr.dot(f, ray.direction)
    C = dr.squared_norm(f) - dr.square(sphere.radius)
    quarter_discriminant = h * h - A * C
    real = quarter_discriminant >= 0
    root = dr.sqrt(dr.select(real, quarter_discriminant, 0))
    return dr.select(real, interval.smallest((h - root) / A, (h + root) / A), dr.inf)


def haines(ray: Ray, sphere: Any, interval: Interval) -> Any:
    """Return the smallest t inside the interval at which the ray meets the sphere, or inf.

    The quadratic, arranged so that nothing large cancels.
    Source: Haines, Günther and Akenine-Möller, "Precision Improvements for Ray/Sphere Intersection", Ray Tracing Gems
    (2019), chapter 7: the discriminant after Hearn and Baker, the roots after Press et al. and Blinn.
    """
    f = ray.origin - sphere.center
    A = dr.squared_norm(ray.direction)
    h = -dr.dot(f, ray.direction)
    # The ray's closest point to the centre; comparing it with the radius loses (distance / radius)^2 fewer digits
    # than B^2 - 4 A C does.
    inverse_A = 1 / A
    closest = dr.fma(ray.direction, h * inverse_A, f)
    quarter_discriminant = A * (dr.square(sphere.radius) - dr.squared_norm(closest))
    # Without real roots, or with q = 0, a root is NaN, infinite or 0: no interval contains these.
    q = h + dr.copysign(dr.sqrt(quarter_discriminant), h)
    C = dr.squared_norm(f) - dr.square(sphere.radius)
    return interval.smallest(*ordered(C / q, q * inverse_A))


def shift(ray: Ray, sphere: Any, interval: Interval) -> Any:
    """Return the smallest t inside the interval: that of the closest point, less or plus half the chord; or inf.

    Start from the ray's closest point to the centre, where the quadratic is well scaled.
    The near root of an eye close to the surface is the sum of two large numbers.
    Source: Mitsuba 3, src/shapes/sphere.cpp (which does this in float64 on the CPU).
    """
    f = ray.origin - sphere.center
    A = dr.squared_norm(ray.direction)
    moved = -dr.dot(f, ray.direction) / A
    closest = dr.fma(ray.direction, moved, f)
    # The remaining distance to the exact foot of the perpendicular.
    left = -dr.dot(closest, ray.direction) / A
    closest = dr.fma(ray.direction, left, closest)
    half_chord_squared = (dr.square(sphere.radius) - dr.squared_norm(closest)) / A
    real = half_chord_squared >= 0
    half_chord = dr.sqrt(dr.select(real, half_chord_squared, 0))
    t = interval.smallest(moved + (left - half_chord), moved + (left + half_chord))
    return dr.select(real, t, dr.inf)


def pbrt4(ray: Ray, sphere: Any, interval: Interval) -> Any:
    """Return the smallest t inside the interval, by D = A (r - abs(l)) (r + abs(l)), or inf.

    As PBRT-4 does: the discriminant by the closest point's distance, as a product of sum and difference.
    Source: Pharr, Jakob and Humphreys, "Physically Based Rendering", 4th ed. (2023), section 6.8.3, and pbrt-v4's
    shapes.h, Sphere::BasicIntersect.
    """
    f = ray.origin - sphere.center
    A = dr.squared_norm(ray.direction)
    h = -dr.dot(f, ray.direction)
    closest = dr.norm(dr.fma(ray.direction, h / A, f))
    quarter_discriminant = A * (sphere.radius - closest) * (sphere.radius + closest)
    real = quarter_discriminant >= 0
    root = dr.sqrt(dr.select(real, quarter_discriminant, 0))
    C = dr.squared_norm(f) - dr.square(sphere.radius)
    return dr.select(real, interval.smallest(*stable_roots(A, h, C, root)), dr.inf)


def float64(ray: Ray, sphere: Any, interval: Interval) -> Any:
    """Return the smallest t inside the interval, rounded once to the working precision, or inf.

    Solve in float64, for rays and hits in the working precision.
    Products of float32 numbers are exact in float64, so that only the discriminant's few sums are rounded at all.
    """
    Float = type(ray.direction.x)
    direction, f = in_float64(ray.direction), in_float64(ray.origin) - in_float64(sphere.center)
    A = dr.squared_norm(direction)
    h = -dr.dot(f, direction)
    C = dr.squared_norm(f) - dr.square(in_float64(sphere.radius))
    quarter_discriminant = h * h - A * C
    real = quarter_discriminant >= 0
    root = dr.sqrt(dr.select(real, quarter_discriminant, 0))
    near, far = stable_roots(A, h, C, root)
    return dr.select(real, interval.smallest(Float(near), Float(far)), dr.inf)
