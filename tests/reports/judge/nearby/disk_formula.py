"""The intersection of a ray and a disk, as a formula of a user's own."""

import drjit as dr


def disk(ray, square, interval):
    """Return the t of the hit of z = 0 if it lies within 1 of the origin and inside the interval, or inf."""
    parallel = ray.direction.z == 0
    t = -ray.origin.z / dr.select(parallel, 1, ray.direction.z)
    point = ray.at(t)
    inside = dr.fma(point.x, point.x, point.y * point.y) < 1
    return dr.select(interval.contains(t) & inside & ~parallel, t, dr.inf)
