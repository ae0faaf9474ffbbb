"""Planted mistakes in the intersections with spheres, cubes, squares, planes and triangles, and in the nearest hit."""

from typing import Any

import drjit as dr

from rayproof.tracer.rays import Interval, Ray


def fault_behind_is_hit(ray: Ray, cube: Any, interval: Interval) -> Any:
    """Return the smaller of |entry| and |exit| inside the interval.

    A cube behind the eye hit from its far side, distances made positive.
    """
    t_near, t_far = -dr.inf, dr.inf
    for origin, direction in zip(ray.origin, ray.direction, strict=True):
        parallel = direction == 0
        inside = abs(origin) <= cube.half
        t0 = (-cube.half - origin) / direction
        t1 = (cube.half - origin) / direction
        swap = t0 > t1
        enter, leave = dr.select(swap, t1, t0), dr.select(swap, t0, t1)
        enter = dr.select(parallel, dr.select(inside, -dr.inf, dr.inf), enter)
        leave = dr.select(parallel, dr.inf, leave)
        t_near = dr.select(enter > t_near, enter, t_near)
        t_far = dr.select(leave < t_far, leave, t_far)
    return dr.select(t_near <= t_far, interval.smallest(abs(t_near), abs(t_far)), dr.inf)


def fault_entry_alone(ray: Ray, cube: Any, interval: Interval) -> Any:
    """Return the entry's t, if inside the interval, or inf.

    Only the entry looked at: from inside the cube nothing is met.
    """
    t_near, t_far = -dr.inf, dr.inf
    for origin, direction in zip(ray.origin, ray.direction, strict=True):
        parallel = direction == 0
        inside = abs(origin) <= cube.half
        t0 = (-cube.half - origin) / direction
        t1 = (cube.half - origin) / direction
        swap = t0 > t1
        enter, leave = dr.select(swap, t1, t0), dr.select(swap, t0, t1)
        enter = dr.select(parallel, dr.select(inside, -dr.inf, dr.inf), enter)
        leave = dr.select(parallel, dr.inf, leave)
        t_near = dr.select(enter > t_near, enter, t_near)
        t_far = dr.select(leave < t_far, leave, t_far)
    return dr.select((t_near <= t_far) & interval.contains(t_near), t_near, dr.inf)


def fault_nan_kept(ray: Ray, cube: Any, interval: Interval) -> Any:
    """Return the slab test's t, lost where a ray runs in a face's plane.

    0 / 0 in a face's plane kept by the comparisons (erratum E15); the right form never divides it.
    """
    t_near, t_far = -dr.inf, dr.inf
    for origin, direction in zip(ray.origin, ray.direction, strict=True):
        t0 = (-cube.half - origin) / direction
        t1 = (cube.half - origin) / direction
        swap = t0 > t1
        enter, leave = dr.select(swap, t1, t0), dr.select(swap, t0, t1)
        t_near = dr.select(t_near >= enter, t_near, enter)
        t_far = dr.select(t_far <= leave, t_far, leave)
    return dr.select(t_near > t_far, dr.inf, interval.smallest(t_near, t_far))


def fault_negative_zero(ray: Ray, cube: Any, interval: Interval) -> Any:
    """Return the slab test's t where no component of the direction is -0, else inf.

    A slab that a ray runs parallel to counts as missed where the component is -0.
    """
    t_near, t_far = -dr.inf, dr.inf
    for origin, direction in zip(ray.origin, ray.direction, strict=True):
        parallel = direction == 0
        inside = (abs(origin) <= cube.half) & ~(parallel & (1 / direction < 0))
        t0 = (-cube.half - origin) / direction
        t1 = (cube.half - origin) / direction
        swap = t0 > t1
        enter, leave = dr.select(swap, t1, t0), dr.select(swap, t0, t1)
        enter = dr.select(parallel, dr.select(inside, -dr.inf, dr.inf), enter)
        leave = dr.select(parallel, dr.inf, leave)
        t_near = dr.select(enter > t_near, enter, t_near)
        t_far = dr.select(leave < t_far, leave, t_far)
    return dr.select(t_near <= t_far, interval.smallest(t_near, t_far), dr.inf)


def fault_not_swapped(ray: Ray, cube: Any, interval: Interval) -> Any:
    """Return the slab test's t for rays of one octant.

    Entry and exit of a slab not swapped for rays that run towards -x, -y or -z.
    """
    t_near, t_far = -dr.inf, dr.inf
    for origin, direction in zip(ray.origin, ray.direction, strict=True):
        parallel = direction == 0
        inside = abs(origin) <= cube.half
        enter = dr.select(parallel, dr.select(inside, -dr.inf, dr.inf), (-cube.half - origin) / direction)
        leave = dr.select(parallel, dr.inf, (cube.half - origin) / direction)
        t_near = dr.select(enter > t_near, enter, t_near)
        t_far = dr.select(leave < t_far, leave, t_far)
    return dr.select(t_near <= t_far, interval.smallest(t_near, t_far), dr.inf)


def fault_parallel_ignored(ray: Ray, cube: Any, interval: Interval) -> Any:
    """Return the slab test's t without containment in parallel slabs.

    A slab that the ray runs parallel to is passed over, whether the ray is inside it or not.
    """
    t_near, t_far = -dr.inf, dr.inf
    for origin, direction in zip(ray.origin, ray.direction, strict=True):
        parallel = direction == 0
        t0 = (-cube.half - origin) / direction
        t1 = (cube.half - origin) / direction
        swap = t0 > t1
        enter, leave = dr.select(swap, t1, t0), dr.select(swap, t0, t1)
        enter = dr.select(parallel, -dr.inf, enter)
        leave = dr.select(parallel, dr.inf, leave)
        t_near = dr.select(enter > t_near, enter, t_near)
        t_far = dr.select(leave < t_far, leave, t_far)
    return dr.select(t_near <= t_far, interval.smallest(t_near, t_far), dr.inf)


def fault_first(distance: Any, best: Any) -> Any:
    """Return the mask of first hits: there was no hit before.

    The first hit kept in place of the nearest.
    """
    return (best == dr.inf) & (distance < dr.inf)


def fault_last(distance: Any, best: Any) -> Any:
    """Return the mask of all hits.

    The last hit kept in place of the nearest.
    """
    return (distance < dr.inf) & (best >= 0)


def fault_one_sided(ray: Ray, plane: Any, interval: Interval) -> Any:
    """Return t where the ray runs against the plane's normal, or inf.

    The plane's back not hit.
    """
    t = -ray.origin.z / dr.select(ray.direction.z == 0, 1, ray.direction.z)
    return dr.select(interval.contains(t) & (ray.direction.z < 0), t, dr.inf)


def fault_sign(ray: Ray, plane: Any, interval: Interval) -> Any:
    """Return the t of the plane's mirror image behind the eye.

    The sign of the plane's equation turned round.
    """
    parallel = ray.direction.z == 0
    t = ray.origin.z / dr.select(parallel, 1, ray.direction.z)
    return dr.select(interval.contains(t) & ~parallel, t, dr.inf)


def fault_center_ignored(ray: Ray, sphere: Any, interval: Interval) -> Any:
    """Return the t of a sphere around the origin.

    The centre left at the origin.
    """
    A = dr.squared_norm(ray.direction)
    B = 2 * dr.dot(ray.direction, ray.origin)
    C = dr.squared_norm(ray.origin) - dr.square(sphere.radius)
    discriminant = B * B - 4 * A * C
    root = dr.sqrt(dr.select(discriminant >= 0, discriminant, 0))
    t = interval.smallest((-B - root) / (2 * A), (-B + root) / (2 * A))
    return dr.select(discriminant >= 0, t, dr.inf)


def fault_discriminant_sign(ray: Ray, sphere: Any, interval: Interval) -> Any:
    """Return the roots of another quadratic, real far outside the sphere.

    B^2 + 4 A C for the discriminant.
    """
    f = ray.origin - sphere.center
    A = dr.squared_norm(ray.direction)
    B = 2 * dr.dot(ray.direction, f)
    C = dr.squared_norm(f) - dr.square(sphere.radius)

    discriminant = B * B + 4 * A * C
    root = dr.sqrt(dr.select(discriminant >= 0, discriminant, 0))
    t = interval.smallest((-B - root) / (2 * A), (-B + root) / (2 * A))
    return dr.select(discriminant >= 0, t, dr.inf)


def fault_far_root(ray: Ray, sphere: Any, interval: Interval) -> Any:
    """Return the larger root, if inside the interval, or inf.

    The far root taken.
    """
    f = ray.origin - sphere.center
    A = dr.squared_norm(ray.direction)
    B = 2 * dr.dot(ray.direction, f)
    C = dr.squared_norm(f) - dr.square(sphere.radius)

    discriminant = B * B - 4 * A * C
    root = dr.sqrt(dr.select(discriminant >= 0, discriminant, 0))
    t = (-B + root) / (2 * A)
    return dr.select((discriminant >= 0) & interval.contains(t), t, dr.inf)


def fault_half_b(ray: Ray, sphere: Any, interval: Interval) -> Any:
    """Return the roots of another quadratic.

    The factor 2 of B left out.
    """
    f = ray.origin - sphere.center
    A = dr.squared_norm(ray.direction)
    B = dr.dot(ray.direction, f)
    C = dr.squared_norm(f) - dr.square(sphere.radius)

    discriminant = B * B - 4 * A * C
    root = dr.sqrt(dr.select(discriminant >= 0, discriminant, 0))
    t = interval.smallest((-B - root) / (2 * A), (-B + root) / (2 * A))
    return dr.select(discriminant >= 0, t, dr.inf)


def fault_negative_root(ray: Ray, sphere: Any, interval: Interval) -> Any:
    """Return the smaller root, whatever its sign.

    The smaller root is taken even if it is behind the eye.
    """
    f = ray.origin - sphere.center
    A = dr.squared_norm(ray.direction)
    B = 2 * dr.dot(ray.direction, f)
    C = dr.squared_norm(f) - dr.square(sphere.radius)

    discriminant = B * B - 4 * A * C
    root = dr.sqrt(dr.select(discriminant >= 0, discriminant, 0))
    return dr.select(discriminant >= 0, (-B - root) / (2 * A), dr.inf)


def fault_unit_a(ray: Ray, sphere: Any, interval: Interval) -> Any:
    """Return the roots of t^2 + B t + C.

    A taken as 1, right only for a direction that is a unit vector in object space.
    """
    f = ray.origin - sphere.center
    A = dr.squared_norm(ray.direction)
    B = 2 * dr.dot(ray.direction, f)
    C = dr.squared_norm(f) - dr.square(sphere.radius)

    discriminant = B * B - 4 * C
    root = dr.sqrt(dr.select(discriminant >= 0, discriminant, 0))
    t = interval.smallest((-B - root) / 2, (-B + root) / 2)
    return dr.select((discriminant >= 0) & (A > 0), t, dr.inf)


def fault_disc_local(ray: Ray, square: Any, interval: Interval) -> Any:
    """Return the t of the square's inscribed disc.

    A disc hit in place of the square.
    """
    parallel = ray.direction.z == 0
    t = -ray.origin.z / dr.select(parallel, 1, ray.direction.z)
    P = ray.at(t)
    inside = P.x * P.x + P.y * P.y < square.half * square.half
    return dr.select(interval.contains(t) & inside & ~parallel, t, dr.inf)


def fault_full_size_local(ray: Ray, square: Any, interval: Interval) -> Any:
    """Return the t of a square of twice the size.

    The square's full size taken for half of it.
    """
    parallel = ray.direction.z == 0
    t = -ray.origin.z / dr.select(parallel, 1, ray.direction.z)
    P = ray.at(t)
    inside = (abs(P.x) < 2 * square.half) & (abs(P.y) < 2 * square.half)
    return dr.select(interval.contains(t) & inside & ~parallel, t, dr.inf)


def fault_sheared_half_vectors(ray: Ray, square: Any, interval: Interval) -> Any:
    """Return t inside two strips that bound the square only without shear.

    The two dot tests used under shear, where width and height are not orthogonal (erratum E7).
    """
    w, h = square.half_width, square.half_height
    N = dr.cross(w, h)
    from_center = ray.origin - square.center
    slope = dr.dot(N, ray.direction)
    parallel = slope == 0
    t = -dr.dot(N, from_center) / dr.select(parallel, 1, slope)
    P = dr.fma(ray.direction, t, from_center)
    inside = (abs(dr.dot(P, w)) < dr.squared_norm(w)) & (abs(dr.dot(P, h)) < dr.squared_norm(h))
    return dr.select(interval.contains(t) & inside & ~parallel, t, dr.inf)


def fault_culled(ray: Ray, triangle: Any, interval: Interval) -> Any:
    """Return t where the triangle faces the ray, or inf.

    Back faces culled.
    """
    D = ray.direction
    E1, E2 = triangle.second - triangle.first, triangle.third - triangle.first
    T = ray.origin - triangle.first
    DxE2, TxE1 = dr.cross(D, E2), dr.cross(T, E1)
    determinant = dr.dot(DxE2, E1)
    parallel = determinant == 0
    scale = 1 / dr.select(parallel, 1, determinant)
    t = dr.dot(TxE1, E2) * scale
    u = dr.dot(DxE2, T) * scale
    v = dr.dot(TxE1, D) * scale

    inside = (u >= 0) & (v >= 0) & (u + v <= 1) & (determinant > 0)
    return dr.select(interval.contains(t) & inside & ~parallel, t, dr.inf)


def fault_fixed_epsilon(ray: Ray, triangle: Any, interval: Interval) -> Any:
    """Return t, or inf also where the determinant is small.

    Parallel decided by a fixed size of the determinant, whatever the triangle's size.
    """
    D = ray.direction
    E1, E2 = triangle.second - triangle.first, triangle.third - triangle.first
    T = ray.origin - triangle.first
    DxE2, TxE1 = dr.cross(D, E2), dr.cross(T, E1)
    determinant = dr.dot(DxE2, E1)
    parallel = determinant == 0
    scale = 1 / dr.select(parallel, 1, determinant)
    t = dr.dot(TxE1, E2) * scale
    u = dr.dot(DxE2, T) * scale
    v = dr.dot(TxE1, D) * scale

    inside = (u >= 0) & (v >= 0) & (u + v <= 1)
    return dr.select(interval.contains(t) & inside & ~parallel & (abs(determinant) > 1e-2), t, dr.inf)


def fault_loose_unsigned(ray: Ray, triangle: Any, interval: Interval) -> Any:
    """Return the t of a triangle that is a little too large.

    Unsigned areas whose sum may exceed the whole by a thousandth (erratum E5, patched).
    """
    P1, P2, P3 = triangle.first, triangle.second, triangle.third
    N = dr.cross(P2 - P1, P3 - P1)
    slope = dr.dot(N, ray.direction)
    parallel = slope == 0
    t = dr.dot(N, P1 - ray.origin) / dr.select(parallel, 1, slope)
    P = ray.at(t)
    S1, S2, S3 = (dr.norm(dr.cross(a - P, b - P)) for a, b in ((P2, P3), (P3, P1), (P1, P2)))
    inside = dr.norm(N) * (1 + 1e-3) >= S1 + S2 + S3
    return dr.select(interval.contains(t) & inside & ~parallel, t, dr.inf)


def fault_no_sum(ray: Ray, triangle: Any, interval: Interval) -> Any:
    """Return the t of the parallelogram over the triangle.

    The test u + v <= 1 missing, so that a parallelogram is hit.
    """
    D = ray.direction
    E1, E2 = triangle.second - triangle.first, triangle.third - triangle.first
    T = ray.origin - triangle.first
    DxE2, TxE1 = dr.cross(D, E2), dr.cross(T, E1)
    determinant = dr.dot(DxE2, E1)
    parallel = determinant == 0
    scale = 1 / dr.select(parallel, 1, determinant)
    t = dr.dot(TxE1, E2) * scale
    u = dr.dot(DxE2, T) * scale
    v = dr.dot(TxE1, D) * scale

    inside = (u >= 0) & (v >= 0) & (u <= 1) & (v <= 1)
    return dr.select(interval.contains(t) & inside & ~parallel, t, dr.inf)


def fault_one_area(ray: Ray, triangle: Any, interval: Interval) -> Any:
    """Return the t of an angle without its third side.

    Only two of the three signed areas looked at.
    """
    E1, E2 = triangle.second - triangle.first, triangle.third - triangle.first
    N = dr.cross(E1, E2)
    from_first = ray.origin - triangle.first
    slope = dr.dot(N, ray.direction)
    parallel = slope == 0
    t = -dr.dot(N, from_first) / dr.select(parallel, 1, slope)
    P = dr.fma(ray.direction, t, from_first)
    inside = (dr.dot(N, dr.cross(P, E2)) >= 0) & (dr.dot(N, dr.cross(E1, P)) >= 0) & (dr.squared_norm(N) > 0)
    return dr.select(interval.contains(t) & inside & ~parallel, t, dr.inf)


def fault_strict_edges(ray: Ray, triangle: Any, interval: Interval) -> Any:
    """Return the t of a triangle without its edges.

    u > 0, v > 0 and u + v < 1: a ray at an edge, or off by a rounding, meets neither of two neighbours.
    """
    D = ray.direction
    E1, E2 = triangle.second - triangle.first, triangle.third - triangle.first
    T = ray.origin - triangle.first
    DxE2, TxE1 = dr.cross(D, E2), dr.cross(T, E1)
    determinant = dr.dot(DxE2, E1)
    parallel = determinant == 0
    scale = 1 / dr.select(parallel, 1, determinant)
    t = dr.dot(TxE1, E2) * scale
    u = dr.dot(DxE2, T) * scale
    v = dr.dot(TxE1, D) * scale

    inside = (u > 0) & (v > 0) & (u + v < 1)
    return dr.select(interval.contains(t) & inside & ~parallel, t, dr.inf)
