"""Formulas of ray and triangle: signed areas, Moeller-Trumbore, Pluecker, Woop, Baldwin-Weber.

Every function returns the t at which the ray meets the triangle, if inside the interval, or inf. The lecture's
barycentric areas and Cramer's rule come first, then the others by year.
"""

from typing import Any

import drjit as dr

from rayproof.tracer.kernel.arithmetic import difference_of_products, distance, edge_functions, in_float64, shear
from rayproof.tracer.rays import Interval, Ray

EPSILON = 1e-8  # m^2, of `moeller_trumbore_epsilon`


def signed_areas(ray: Ray, triangle: Any, interval: Interval) -> Any:
    """Return the t of the plane's hit if S1, S2 and S3 lie in [0, 1] and t inside the interval, or inf.

    By barycentric areas with a sign, which decides without any equality (erratum E5).
    """
    E1, E2 = triangle.second - triangle.first, triangle.third - triangle.first
    N = dr.cross(E1, E2)
    from_first = ray.origin - triangle.first
    slope = dr.dot(N, ray.direction)
    parallel = slope == 0
    t = -dr.dot(N, from_first) / dr.select(parallel, 1, slope)
    P = dr.fma(ray.direction, t, from_first)  # relative to the first corner, so that far triangles lose no digits
    area = dr.squared_norm(N)
    S1 = dr.dot(N, dr.cross(E1 - P, E2 - P))
    S2 = dr.dot(N, dr.cross(P, E2))
    S3 = dr.dot(N, dr.cross(E1, P))
    # The three add up to `area`: none negative implies none above it.
    inside = (S1 >= 0) & (S2 >= 0) & (S3 >= 0) & (area > 0)
    return dr.select(interval.contains(t) & inside & ~parallel, t, dr.inf)


def unsigned_areas(ray: Ray, triangle: Any, interval: Interval) -> Any:
    """Return the t of the plane's hit where S1 + S2 + S3 = 1, which rounding makes false almost everywhere.

    Control for erratum E5: unsigned areas whose ratios must add up to 1 exactly.
    """
    P1, P2, P3 = triangle.first, triangle.second, triangle.third
    N = dr.cross(P2 - P1, P3 - P1)
    slope = dr.dot(N, ray.direction)
    t = dr.dot(N, P1 - ray.origin) / slope
    P = ray.at(t)
    S = dr.norm(N)
    S1 = dr.norm(dr.cross(P2 - P, P3 - P)) / S
    S2 = dr.norm(dr.cross(P3 - P, P1 - P)) / S
    S3 = dr.norm(dr.cross(P1 - P, P2 - P)) / S
    return dr.select(interval.contains(t) & (S1 + S2 + S3 == 1), t, dr.inf)


def moeller_trumbore(ray: Ray, triangle: Any, interval: Interval) -> Any:
    """Return the t at which u >= 0, v >= 0 and u + v <= 1, if inside the interval, or inf.

    By Cramer's rule, with the lecture's third row corrected (erratum E6).
    Source: Möller and Trumbore, "Fast, Minimum Storage Ray/Triangle Intersection", Journal of Graphics Tools 2 (1997).
    """
    D = ray.direction
    E1, E2 = triangle.second - triangle.first, triangle.third - triangle.first
    T = ray.origin - triangle.first
    DxE2, TxE1 = dr.cross(D, E2), dr.cross(T, E1)
    # The determinant has the unit of an area: only 0 itself means parallel, whatever the triangle's size.
    determinant = dr.dot(DxE2, E1)
    parallel = determinant == 0
    scale = 1 / dr.select(parallel, 1, determinant)
    t = dr.dot(TxE1, E2) * scale
    u = dr.dot(DxE2, T) * scale
    v = dr.dot(TxE1, D) * scale
    inside = (u >= 0) & (v >= 0) & (u + v <= 1)
    return dr.select(interval.contains(t) & inside & ~parallel, t, dr.inf)


def printed_third_row(ray: Ray, triangle: Any, interval: Interval) -> Any:
    """Return the t of a strip instead of a triangle: v never bounds it.

    Control for erratum E6: the third component of Cramer's rule as printed, (D x E1) . D, which is always 0.
    """
    D = ray.direction
    E1, E2 = triangle.second - triangle.first, triangle.third - triangle.first
    T = ray.origin - triangle.first
    DxE2 = dr.cross(D, E2)
    determinant = dr.dot(DxE2, E1)
    t = dr.dot(dr.cross(T, E1), E2) / determinant
    u = dr.dot(DxE2, T) / determinant
    v = dr.dot(dr.cross(D, E1), D) / determinant
    return dr.select(interval.contains(t) & (u >= 0) & (v >= 0) & (u + v <= 1), t, dr.inf)


def _triple(A: Any, B: Any, C: Any) -> Any:
    """Return -(A x C) . B, the determinant of the matrix with columns A, B, C."""
    return -dr.dot(dr.cross(A, C), B)


def scalar_triple(ray: Ray, triangle: Any, interval: Interval) -> Any:
    """Return t of the solution of E1 u + E2 v - D t = T, every unknown a quotient of two determinants.

    Control for erratum E16: "the length of a vector <A, B, C>" for -(A x C) . B, a determinant and no length.
    """
    D = ray.direction
    E1, E2 = triangle.second - triangle.first, triangle.third - triangle.first
    T = ray.origin - triangle.first
    determinant = _triple(-D, E1, E2)
    parallel = determinant == 0
    scale = 1 / dr.select(parallel, 1, determinant)
    t, u, v = (_triple(*columns) * scale for columns in ((T, E1, E2), (-D, T, E2), (-D, E1, T)))
    inside = (u >= 0) & (v >= 0) & (u + v <= 1)
    return dr.select(interval.contains(t) & inside & ~parallel, t, dr.inf)


def moeller_trumbore_epsilon(ray: Ray, triangle: Any, interval: Interval) -> Any:
    """Return t as Möller and Trumbore do, but call every determinant below 1e-8 m^2 parallel.

    By Cramer's rule with an absolute epsilon, as it is often copied: a control.
    The determinant is an area, so that a fixed epsilon deletes triangles by their size: at 1e-8 every one below about
    0.1 mm, and larger ones that are slender or seen at a glance.
    Source: the epsilon of the first program in Möller and Trumbore, "Fast, Minimum Storage Ray/Triangle Intersection",
    Journal of Graphics Tools 2 (1997).
    """
    D = ray.direction
    E1, E2 = triangle.second - triangle.first, triangle.third - triangle.first
    T = ray.origin - triangle.first
    DxE2, TxE1 = dr.cross(D, E2), dr.cross(T, E1)
    determinant = dr.dot(DxE2, E1)
    parallel = abs(determinant) < EPSILON
    scale = 1 / dr.select(parallel, 1, determinant)
    t = dr.dot(TxE1, E2) * scale
    u = dr.dot(DxE2, T) * scale
    v = dr.dot(TxE1, D) * scale
    inside = (u >= 0) & (v >= 0) & (u + v <= 1)
    return dr.select(interval.contains(t) & inside & ~parallel, t, dr.inf)


def pluecker(ray: Ray, triangle: Any, interval: Interval) -> Any:
    """Return the t of the plane's hit if all edges pass on one side and t is inside the interval, or inf.

    By Plücker coordinates: the side of the ray on which each edge's line passes.
    The two neighbours of an edge compute exact negatives of each other. Edges need not meet exactly in a corner.
    Sources: Jones, "Intersecting a Ray and a Triangle with Plücker Coordinates", Ray Tracing News 13 (2000); the form
    with corners relative to the eye is that of Embree, kernels/geometry/triangle_intersector_pluecker.h.
    """
    D = ray.direction
    A, B, C = triangle.first - ray.origin, triangle.second - ray.origin, triangle.third - ray.origin
    CA, AB, BC = C - A, A - B, B - C
    U = dr.dot(dr.cross(CA, C + A), D)
    V = dr.dot(dr.cross(AB, A + B), D)
    W = dr.dot(dr.cross(BC, B + C), D)
    outside = ((U < 0) | (V < 0) | (W < 0)) & ((U > 0) | (V > 0) | (W > 0))
    N = dr.cross(AB, CA)
    slope = dr.dot(N, D)
    parallel = slope == 0
    t = dr.dot(N, A) / dr.select(parallel, 1, slope)
    return dr.select(interval.contains(t) & ~outside & ~parallel, t, dr.inf)


def woop(ray: Ray, triangle: Any, interval: Interval) -> Any:
    """Return t if the signed areas U, V and W do not differ in sign and t lies inside the interval, or inf.

    By the signs of areas seen along the ray: no leak between triangles that share an edge.
    Two neighbours compute a shared edge's area from the same two products, as x - y and as y - x, which are exact
    negatives, provided that no compiler fuses the subtraction with a product.
    Source: Woop, Benthin and Wald, "Watertight Ray/Triangle Intersection", Journal of Computer Graphics Techniques 2
    (2013), without its culling and without its float64 fallback.
    """
    sheared = shear(ray, triangle)
    return distance(sheared, edge_functions(sheared, lambda a, b, c, d: a * b - c * d), interval)


def woop_kahan(ray: Ray, triangle: Any, interval: Interval) -> Any:
    """Return t if the signed areas U, V and W do not differ in sign and t lies inside the interval, or inf.

    By Woop's signed areas, each a difference of products in explicit fused operations.
    No compiler can fuse these again. The error of an area is at most 1.5 ulp, so that without underflow its sign is
    right for the sheared corners, and neighbours agree about their common edge.
    Sources: Woop, Benthin and Wald, "Watertight Ray/Triangle Intersection", Journal of Computer Graphics Techniques 2
    (2013); Kahan (see `tracer.kernel.arithmetic`).
    """
    sheared = shear(ray, triangle)
    return distance(sheared, edge_functions(sheared, difference_of_products), interval)


def _in_float64(a: Any, b: Any, c: Any, d: Any) -> Any:
    Float = type(a)
    return Float(in_float64(a) * in_float64(b) - in_float64(c) * in_float64(d))


def woop_float64_fallback(ray: Ray, triangle: Any, interval: Interval) -> Any:
    """Return t if the signed areas U, V and W do not differ in sign and t lies inside the interval, or inf.

    By Woop's signed areas, recomputed in float64 where one of them is 0. In float64 the products of float32 numbers are
    exact, so that only exact ties stay ties. Both precisions are computed for every ray, because all lanes of a kernel
    execute the same instructions.
    Source: Woop, Benthin and Wald, "Watertight Ray/Triangle Intersection", Journal of Computer Graphics Techniques 2
    (2013), appendix.
    """
    sheared = shear(ray, triangle)
    U, V, W = edge_functions(sheared, lambda a, b, c, d: a * b - c * d)
    tie = (U == 0) | (V == 0) | (W == 0)
    exact = edge_functions(sheared, _in_float64)
    U, V, W = (dr.select(tie, better, area) for better, area in zip(exact, (U, V, W), strict=True))
    return distance(sheared, (U, V, W), interval)


def _rows(triangle: Any) -> tuple[tuple[Any, Any], ...]:
    """Return the matrix's three rows, each (3-vector, translation [m]), in float64."""
    first, second, third = (in_float64(corner) for corner in (triangle.first, triangle.second, triangle.third))
    E1, E2 = second - first, third - first
    N = dr.cross(E1, E2)
    size = abs(N)
    x_largest = (size.x >= size.y) & (size.x >= size.z)
    y_largest = ~x_largest & (size.y >= size.z)
    axis = type(N)(
        dr.select(x_largest, 1, 0), dr.select(y_largest, 1, 0), dr.select(x_largest | y_largest, 0, 1)
    )  # the coordinate that the first two rows leave out
    largest = dr.dot(N, axis)
    scale = dr.select(largest == 0, 0, 1 / dr.select(largest == 0, 1, largest))
    rows = (dr.cross(E2, axis) * scale, dr.cross(axis, E1) * scale, N * scale)
    return tuple((row, -dr.dot(row, first)) for row in rows)


def baldwin_weber(ray: Ray, triangle: Any, interval: Interval) -> Any:
    """Return the t at which u >= 0, v >= 0 and u + v <= 1, if inside the interval, or inf.

    By the matrix that takes the triangle to (0, 0), (1, 0), (0, 1) in the plane z = 0.
    The matrix is made in float64 and rounded once, but the translation in it has the size of world coordinates: digits
    go with the distance from the world's origin.
    Source: Baldwin and Weber, "Fast Ray-Triangle Intersections by Coordinate Transformation", Journal of Computer
    Graphics Techniques 5 (2016). They store the matrix with the triangle; here it is made anew from the corners, which
    is slower.
    """
    Float, Vector = type(ray.direction.x), type(ray.direction)
    rows = [(Vector(row), Float(offset)) for row, offset in _rows(triangle)]
    origin = [dr.dot(row, ray.origin) + offset for row, offset in rows]
    direction = [dr.dot(row, ray.direction) for row, _ in rows]
    parallel = direction[2] == 0
    t = -origin[2] / dr.select(parallel, 1, direction[2])
    u, v = (dr.fma(d, t, o) for d, o in zip(direction[:2], origin[:2], strict=True))
    inside = (u >= 0) & (v >= 0) & (u + v <= 1)
    return dr.select(interval.contains(t) & inside & ~parallel, t, dr.inf)
