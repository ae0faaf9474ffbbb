"""Family `sidedness`: one-sided and two-sided surfaces, seen and lit from the front and from behind.

Back faces are hit and block light; a one-sided surface seen from behind is black; a two-sided one turns its normal
towards the viewer, and is dark only if the light is on its other side.
"""

from collections.abc import Iterator

import numpy as np

from rayproof.cases.case import Case, UniformValue, covering
from rayproof.cases.placement import camera_around, compose, mapped, rotation, scaling, translation
from rayproof.cases.scene import Matrix, Mesh, Plane, PointLight, Scene, Shape, Square, Triangle
from rayproof.cases.stages import Stage

ALBEDO = (0.7, 0.5, 0.6)
FLUX = (380.0, 260.0, 450.0)  # W
# The frame of the scenes: the viewer looks down from its +z.
FRAME = compose(translation(0.3, 0.2, 0.5), rotation((0.5, -0.8, 0.3), 31))
ROOF = np.array(((-0.6, -0.6, 0.0), (0.6, -0.6, 0.0), (0.6, 0.6, 0.1), (-0.6, 0.6, 0.1)))
HALVES = np.array(((0, 1, 2), (0, 2, 3)))
CORNERS = ((-0.7, -0.6, 0.0), (0.7, -0.5, 0.05), (0.0, 0.7, 0.1))


def facing(row: int, column: int, *, away: bool) -> Matrix:
    """Return the place of a patch in a 2 x 2 grid, tilted a little, turned over if it faces `away`."""
    tilt = rotation((1.0, 0.4 + row, 0.2), 14 + (180 if away else 0))
    return compose(FRAME, translation(1.6 * column - 0.8, 1.5 * row - 0.75, 0.1 * row - 0.2 * column), tilt)


def patch(kind: str, to_world: Matrix, *, two_sided: bool) -> Shape:
    """Return a flat patch of that kind."""
    if kind == "square":
        to_world = compose(to_world, scaling(1.2, 1.1, 1.0))
        return Square(albedo=ALBEDO, to_world=to_world, two_sided=two_sided)
    if kind == "triangle":
        return Triangle(albedo=ALBEDO, vertices=CORNERS, to_world=to_world, two_sided=two_sided)
    return Mesh(albedo=ALBEDO, vertices=ROOF, faces=HALVES, to_world=to_world, two_sided=two_sided)


def black(shape: int, because: str) -> Iterator[UniformValue]:
    """Yield the expectation that `shape` sends no light to the camera in any channel."""
    for channel in range(3):
        yield UniformValue(
            stage=Stage.RADIANCE, shape=shape, channel=channel, value=0.0, relative=0.0, because=because
        )  # fmt: skip


def patches(kind: str, light_side: float, least_interior: int) -> Case:
    """Return the four patches of a kind with a light on the viewer's side (+1) or on the other (-1)."""
    combinations = [(away, two_sided) for away in (False, True) for two_sided in (False, True)]
    shapes = tuple(
        patch(kind, facing(row=int(two_sided), column=int(away), away=away), two_sided=two_sided)
        for away, two_sided in combinations
    )
    lit = light_side > 0
    dark = [index for index, (away, two_sided) in enumerate(combinations) if not lit or (away and not two_sided)]
    eye, target = mapped(FRAME, (0.8, -1.0, 5.5)), mapped(FRAME, (0.0, 0.0, 0.0))
    toward = np.subtract(eye, target)
    camera = camera_around(
        target,
        distance=float(np.linalg.norm(toward)),
        azimuth=float(np.degrees(np.arctan2(toward[1], toward[0]))),
        elevation=float(np.degrees(np.arcsin(toward[2] / np.linalg.norm(toward)))),
        width=96,
        height=80,
        fovy=36,
    )
    place = mapped(FRAME, (0.4, 0.3, 3.0 * light_side))
    scene = Scene(camera=camera, shapes=shapes, lights=(PointLight(position=place, flux=FLUX),))
    alternative = {"square": ("HIT-8",), "triangle": ("HIT-5",), "mesh": ("HIT-5",)}[kind]
    return Case(
        name=f"sidedness/{kind}_lit_from_{'the_viewer' if lit else 'behind'}",
        scene=scene,
        stresses=f"One- and two-sided {kind} patches, facing the viewer and away, lit from "
        f"{'the viewer' if lit else 'the other'}{chr(39) + 's' if lit else ''} side.",
        covers=covering(scene, *alternative, "LIT-4"),
        least_interior=least_interior,
        expectations=tuple(
            expectation
            for index in dark
            for expectation in black(index, "seen from behind and one-sided, or lit from the side that is not seen")
        ),
    )


def sidedness() -> Iterator[Case]:
    """Yield the patches of every kind, lit from either side; then a plane seen from below."""
    for kind, least_interior in (("square", 1800), ("triangle", 900), ("mesh", 1900)):
        yield patches(kind, 1.0, least_interior)
        yield patches(kind, -1.0, least_interior)
    camera = camera_around((0.1, 0.3, 0.2), distance=4.0, azimuth=48, elevation=-44, width=80, height=64, fovy=40)
    light = PointLight(position=(0.6, 0.9, -1.8), flux=FLUX)
    tilted = compose(translation(0.1, 0.2, 0.3), rotation((0.7, -0.5, 0.3), 12))
    for two_sided in (False, True):
        plane = Plane(albedo=ALBEDO, to_world=tilted, two_sided=two_sided)
        scene = Scene(camera=camera, shapes=(plane,), lights=(light,))
        sides = "two" if two_sided else "one"
        yield Case(
            name=f"sidedness/plane_from_below_{sides}_sided",
            scene=scene,
            stresses=f"A {sides}-sided plane seen and lit from below: {'bright' if two_sided else 'black'}.",
            covers=covering(scene),
            least_interior=4000,
            expectations=() if two_sided else tuple(black(0, "one-sided and seen from behind")),
        )
