"""Every question with a discrete answer, asked once in any field: what is hit, which side, which lights are free.

An answer that cannot be had raises `UndecidedError`; nothing here rounds.
"""

from collections.abc import Iterable
from typing import Any

from rayproof.reference.certified.cubes import SeenCube
from rayproof.reference.certified.fields import Number, Vector
from rayproof.reference.certified.intervals import Window
from rayproof.reference.certified.vectors import dot, minus
from rayproof.reference.certified.worlds import EYE, Surface, World

Branch = Any  # which of a surface's roots: its own affair
Hit = tuple[Surface, Branch]
CubeFace = tuple[int, int] | None  # axis and sign; None for what is no cube


def clip_window(world: World, length: Number | None, depth: Number | None) -> Window:
    """Return the clip interval for t along a direction of this length and depth [m]; None: 1."""
    if world.scene.clip == "none":
        return Window(field=world.field, low=None, high=None, speed=None)
    speed = depth if world.scene.clip == "depth" else length
    return Window(field=world.field, low=world.near, high=world.far, speed=speed)


def nearest(world: World, direction: Vector, window: Window, surfaces: Iterable[Surface]) -> tuple[Hit, Number] | None:
    """Return the hit of smallest t among surfaces in the scene's order, and t, or None. Equal t: the first."""
    best = None
    for surface in surfaces:
        found = world.seen(surface, EYE).crossing(direction, window)
        if found is not None and (best is None or world.field.sign(found[0] - best[1]) < 0):
            best = ((surface, found[1]), found[0])
    return best


def cube_face(world: World, surface: Surface, segment: Vector) -> CubeFace:
    """Return which face of a cube holds the eye + segment, None for other shapes."""
    seen = world.seen(surface, EYE)
    return seen.face(segment) if isinstance(seen, SeenCube) else None


def outward(world: World, surface: Surface, face: CubeFace, segment: Vector) -> Vector:
    """Return the outward world normal, of any length, at the eye + segment (NRM-3)."""
    seen = world.seen(surface, EYE)
    if isinstance(seen, SeenCube):
        assert face is not None
        return seen.normals[face]
    return seen.normal(segment)


def turned(world: World, surface: Surface, normal: Vector, facing: int) -> Vector:
    """Return the shading normal: turned towards the viewer on a two-sided shape; `facing` is the sign of n.d."""
    if facing > 0 and world.scene.shapes[surface[0]].two_sided:
        return (-normal[0], -normal[1], -normal[2])
    return normal


def is_lit(
    world: World,
    light: int,
    surface: Surface,
    face: CubeFace,
    position: Vector,
    normal: Vector,
    blockers: Iterable[Surface],
) -> bool:
    """Return whether a light is above the horizon and the open segment to it is free (LIT-1).

    The surface at the segment's end is divided out by algebra; the other faces of a mesh are not its own.
    """
    segment = minus(position, world.points[light])
    if world.field.sign(dot(normal, segment)) >= 0:
        return False
    own = world.seen(surface, light)
    itself = own.blocks_itself(face) if isinstance(own, SeenCube) else own.blocks_itself(segment)  # pyright: ignore[reportArgumentType]
    if itself:
        return False
    between = Window(field=world.field, low=None, high=world.one, speed=None)
    return all(
        blocker == surface or world.seen(blocker, light).crossing(segment, between) is None for blocker in blockers
    )
