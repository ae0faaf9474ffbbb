"""Triangles a thousand and a hundred thousand times longer than high, across the view and off all axes."""

from collections.abc import Iterator

import numpy as np

from rayproof.cases.scene import Camera, PointLight, Scene, Triangle
from rayproof.cases.stresses import HEIGHT, STRESSES, VIEWS, WIDTH

ALBEDO = (0.75, 0.5, 0.3)
LIGHT = PointLight(position=(3.0, -2.0, 4.0), flux=(300.0, 200.0, 400.0))
DISTANCE = 4.0  # m


def slivers(aspect: float) -> Iterator[tuple[str, Scene]]:
    """Yield slivers of length 2 m and height 2 m / aspect in random planes, in images as high as they are."""
    generator = np.random.default_rng(20261)
    for number, _ in enumerate(VIEWS, start=1):
        along, across, outward = np.linalg.qr(generator.normal(size=(3, 3)))[0].T
        corners = (-along, along, 0.25 * along + 2 * across / aspect)
        middle = across * 2 / 3 / aspect
        eye = middle + outward * DISTANCE + along * 0.5
        camera = Camera(
            eye=(float(eye[0]), float(eye[1]), float(eye[2])),
            target=(float(middle[0]), float(middle[1]), float(middle[2])),
            up=(float(across[0]), float(across[1]), float(across[2])),
            # As high as the sliver: most rays hit it or pass within its height.
            fovy=float(np.degrees(1.5 * 2 / aspect / DISTANCE)),
            width=WIDTH,
            height=HEIGHT,
            near=0.125,
            far=1024.0,
        )
        vertices = tuple((float(x), float(y), float(z)) for x, y, z in corners)
        shape = Triangle(albedo=ALBEDO, vertices=(vertices[0], vertices[1], vertices[2]), two_sided=True)
        yield f"sliver_{number}", Scene(camera=camera, shapes=(shape,), lights=(LIGHT,))


@STRESSES.register("sliver_1e3", slots=("triangle",))
def sliver_1e3() -> Iterator[tuple[str, Scene]]:
    """Yield slivers of aspect 1e3."""
    yield from slivers(1e3)


@STRESSES.register("sliver_1e5", slots=("triangle",))
def sliver_1e5() -> Iterator[tuple[str, Scene]]:
    """Yield slivers of aspect 1e5."""
    yield from slivers(1e5)
