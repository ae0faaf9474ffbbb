"""Answer sphere.csv with a sphere formula in Python: python sphere.py sphere.csv > answers.csv."""

import csv
import math
import sys
from pathlib import Path


def dot(a, b):
    """Return the dot product."""
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def sphere(o, d, center, radius):
    """Return the smallest t > 0, or inf. Haines, Guenther, Akenine-Moeller, Ray Tracing Gems (2019), chapter 7."""
    f = [x - c for x, c in zip(o, center, strict=True)]
    a, b = dot(d, d), -dot(f, d)
    if a == 0:
        return math.inf
    closest = [x + b / a * y for x, y in zip(f, d, strict=True)]
    discriminant = radius * radius - dot(closest, closest)
    if discriminant < 0:
        return math.inf
    q = b + math.copysign(math.sqrt(a * discriminant), b)
    near, far = sorted(((dot(f, f) - radius * radius) / q if q else 0.0, q / a))
    return near if near > 0 else far if far > 0 else math.inf


sys.stdout.write("# name sphere.py\nid,hit,t\n")
with Path(sys.argv[1]).open(newline="") as file:
    for row in csv.DictReader(file):
        o, d, c = ([float(row[f"{name}_{axis}"]) for axis in "xyz"] for name in ("o", "d", "center"))
        t = sphere(o, d, c, float(row["radius"]))
        sys.stdout.write(f"{row['id']},{int(t < math.inf)},{t:.17g}\n")
