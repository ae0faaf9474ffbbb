"""Nearest hit, visibility, irradiance, exitance and radiance of one pixel in any field (`Path`)."""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

from rayproof.cases.stages import IMAGE_STAGES, Stage
from rayproof.reference.certified.fields import Number, UndecidedError, Vector
from rayproof.reference.certified.numbers import Window, dot, minus, scaled
from rayproof.reference.certified.shapes import SeenCube
from rayproof.reference.certified.worlds import EYE, ExactWorld, Surface


def looks_at_viewer(world: ExactWorld, surface: Surface, facing: int) -> bool:
    """Return whether the shading normal faces the viewer; `facing` is the sign of n.d, with n outward."""
    return facing < 0 or (facing > 0 and world.scene.shapes[surface[0]].two_sided)


def irradiance(world: ExactWorld, lights: Sequence[int], position: Vector, normal: Vector) -> list[Any]:
    """Return E [W/m^2] per channel from visible lights, which are above the horizon (RAD-1 to RAD-3)."""
    total: list[Any] = [0, 0, 0]
    simplified = world.scene.shading == "simplified"
    for light in lights:
        segment = minus(world.points[light], position)
        inverse = world.field.rsqrt(dot(segment, segment))
        factor = dot(normal, segment) * inverse
        if not simplified:
            factor = factor * inverse * inverse
        for channel, strength in enumerate(world.strengths[light]):
            if strength is not None:
                total[channel] = strength * factor + total[channel]
    return total


def leaving(world: ExactWorld, surface: Surface, arriving: list[Any], *, seen: bool) -> tuple[list[Any], list[Any]]:
    """Return M = albedo E [W/m^2], and L = M / pi [W/(m^2 sr)], or M where shading is simplified (RAD-4)."""
    exitance = [value * factor for value, factor in zip(arriving, world.albedos[surface[0]], strict=True)]
    if not seen:
        return exitance, [0, 0, 0]
    return exitance, exitance if world.scene.shading == "simplified" else [
        value * world.inverse_pi for value in exitance
    ]


# The discrete decisions, in any field: the surface that is hit, its side, and the lights that are not blocked.
#
# An undecided sign raises `UndecidedError`; nothing here rounds.


Branch = Any  # the root of a surface's equation, in the form that the surface's class uses
Hit = tuple[Surface, Branch]
CubeFace = tuple[int, int] | None  # axis and sign; None for other shapes


def clip_window(world: ExactWorld, length: Number | None, depth: Number | None) -> Window:
    """Return the clip interval for t along a direction of this length and depth [m], each 1 if None."""
    if world.scene.clip == "none":
        return Window(field=world.field, low=None, high=None, speed=None)
    speed = depth if world.scene.clip == "depth" else length
    return Window(field=world.field, low=world.near, high=world.far, speed=speed)


def nearest(
    world: ExactWorld, direction: Vector, window: Window, surfaces: Iterable[Surface]
) -> tuple[Hit, Number] | None:
    """Return the hit of smallest t among surfaces in the scene's order, and t, or None. Equal t: the first."""
    first: dict[Any, Surface] = {}  # of identical surfaces only the first can be the hit
    for surface in surfaces:
        first.setdefault(world.seen(surface, EYE), surface)
    best = None
    for seen_shape, surface in first.items():
        crossing = seen_shape.crossing(direction, window)
        if crossing is not None and (best is None or world.field.sign(crossing[0] - best[1]) < 0):
            best = ((surface, crossing[1]), crossing[0])
    return best


def cube_face(world: ExactWorld, surface: Surface, segment: Vector) -> CubeFace:
    """Return the face of a cube that contains the point eye + segment, None for other shapes."""
    seen_shape = world.seen(surface, EYE)
    return seen_shape.face(segment) if isinstance(seen_shape, SeenCube) else None


def outward(world: ExactWorld, surface: Surface, face: CubeFace, segment: Vector) -> Vector:
    """Return the outward world normal, of any length, at the point eye + segment (NRM-3)."""
    seen_shape = world.seen(surface, EYE)
    if isinstance(seen_shape, SeenCube):
        assert face is not None
        return seen_shape.normals[face]
    return seen_shape.normal(segment)


def turned(world: ExactWorld, surface: Surface, normal: Vector, facing: int) -> Vector:
    """Return the shading normal, turned towards the viewer on a two-sided shape; `facing` is the sign of n.d."""
    if facing > 0 and world.scene.shapes[surface[0]].two_sided:
        return (-normal[0], -normal[1], -normal[2])
    return normal


def is_lit(
    world: ExactWorld,
    light: int,
    surface: Surface,
    face: CubeFace,
    position: Vector,
    normal: Vector,
    blockers: Iterable[Surface],
) -> bool:
    """Return whether a light is above the horizon and the open segment to it is free (LIT-1).

    The intersection at the segment's end is divided out of the surface's equation. Other faces of the same mesh can
    block.
    """
    segment = minus(position, world.points[light])
    if world.field.sign(dot(normal, segment)) >= 0:
        return False
    own = world.seen(surface, light)
    itself = own.blocks_itself(face) if isinstance(own, SeenCube) else own.blocks_itself(segment)  # pyright: ignore[reportArgumentType]
    if itself:
        return False
    between = Window(field=world.field, low=None, high=world.one, speed=None)
    others = dict.fromkeys(world.seen(blocker, light) for blocker in blockers if blocker != surface)
    return all(blocker.crossing(segment, between) is None for blocker in others)


# End-to-end truth of one image point: the decisions along the light path, and the value of every stage.


# Indices in the list of image stages; comparing them takes a tenth of the time of comparing enumeration members.
OBJECT, NORMAL, VISIBILITY, IRRADIANCE = (
    IMAGE_STAGES.index(stage) for stage in (Stage.OBJECT, Stage.NORMAL, Stage.VISIBILITY, Stage.IRRADIANCE)
)
NAN, INFINITY = float("nan"), float("inf")
NOTHING, BLACK, UNKNOWN = [-1.0, -1.0], [0.0, 0.0, 0.0], [NAN, NAN, NAN]

Values = list[list[Any]]  # per image stage, in order, a ball or an exact plain number per channel


@dataclass(frozen=True, kw_only=True)
class Suspects:
    """The surfaces that may be hit or may block at one image point: all, or those that a filter did not rule out."""

    surfaces: Sequence[Surface]
    blockers: Sequence[Sequence[Surface] | None]  # per light; None: surely blocked


@dataclass(frozen=True, kw_only=True)
class Decisions:
    """The discrete part of an answer. `open` has the names of undecided decisions."""

    hit: Hit | None = None
    face: CubeFace = None
    facing: int = 0  # sign of n.d, n outward
    lit: tuple[bool | None, ...] = ()
    open: tuple[str, ...] = ()


class Path:
    """The light path along a direction of depth 1, up to the image stage of index `last`."""

    def __init__(self, world: ExactWorld, direction: Vector, last: int) -> None:
        self.world = world
        self.direction = direction
        self.last = last
        self.t: Any = None
        self.segment: Any = None
        self.outward: Any = None

    def decide(self, suspects: Suspects, *, leave_open: bool) -> Decisions:
        """Return every decision; with `leave_open` undecided ones are named, else UndecidedError is raised."""
        if self.last < OBJECT:
            return Decisions()
        world, direction = self.world, self.direction
        try:
            length = world.field.sqrt(dot(direction, direction)) if world.scene.clip == "shell" else None
            first_hit = nearest(world, direction, clip_window(world, length, None), suspects.surfaces)
            if first_hit is None:
                return Decisions(lit=(False,) * len(world.scene.lights))
            hit, t = first_hit
            self._reach(t)
            face, facing = None, 0
            if self.last >= NORMAL:
                face = cube_face(world, hit[0], self.segment)
                self.outward = outward(world, hit[0], face, self.segment)
                facing = world.field.sign(dot(self.outward, direction))
        except UndecidedError:
            if not leave_open:
                raise
            return Decisions(open=("object",))
        lit: list[bool | None] = []
        for light, blockers in enumerate(suspects.blockers if self.last >= VISIBILITY else ()):
            try:
                lit.append(blockers is not None and self._lit(light, hit[0], face, facing, blockers))
            except UndecidedError:
                if not leave_open:
                    raise
                lit.append(None)
        doubts = tuple(f"visibility.{light}" for light, answer in enumerate(lit) if answer is None)
        return Decisions(hit=hit, face=face, facing=facing, lit=tuple(lit), open=doubts)

    def follow(self, decisions: Decisions) -> None:
        """Follow the path of existing decisions without deciding anything."""
        if decisions.hit is not None:
            surface, branch = decisions.hit
            self._reach(self.world.seen(surface, EYE).at(self.direction, branch))
            if self.last >= NORMAL:
                self.outward = outward(self.world, surface, decisions.face, self.segment)

    def _reach(self, t: Number) -> None:
        self.t = t
        self.segment = scaled(self.direction, t)

    def _lit(self, light: int, surface: Surface, face: CubeFace, facing: int, blockers: Sequence[Surface]) -> bool:
        normal = turned(self.world, surface, self.outward, facing)
        return is_lit(self.world, light, surface, face, self._position(), normal, blockers)

    def _position(self) -> Vector:
        eye = self.world.points[EYE]
        return (eye[0] + self.segment[0], eye[1] + self.segment[1], eye[2] + self.segment[2])

    def values(self, decisions: Decisions) -> Values:
        """Return the values of all stages up to the last, in balls; call it after `decide` in balls, or `follow`."""
        world = self.world
        inverse_length = dot(self.direction, self.direction).rsqrt()
        values: Values = [list(scaled(self.direction, inverse_length))]
        if self.last < OBJECT:
            return values
        if decisions.hit is None:
            lights = len(world.scene.lights)
            if "object" in decisions.open:
                values += [UNKNOWN[:2], UNKNOWN[:1], UNKNOWN, UNKNOWN, [NAN] * lights, UNKNOWN, UNKNOWN, UNKNOWN]
            else:
                values += [NOTHING, [INFINITY], BLACK, BLACK, [0.0] * lights, BLACK, BLACK, BLACK]
            return values
        surface = decisions.hit[0]
        position = self._position()
        values += [[float(surface[0]), float(surface[1])], [self.t / inverse_length], list(position)]
        if self.last < NORMAL:
            return values
        normal = turned(world, surface, self.outward, decisions.facing)
        normal = scaled(normal, dot(normal, normal).rsqrt())
        values.append(list(normal))
        if self.last < VISIBILITY:
            return values
        values.append([NAN if lit is None else float(lit) for lit in decisions.lit])
        if None in decisions.lit:
            values += [UNKNOWN, UNKNOWN, UNKNOWN]
        elif self.last >= IRRADIANCE:
            lights = [index for index, lit in enumerate(decisions.lit) if lit]
            arriving = irradiance(world, lights, position, normal)
            faces_viewer = looks_at_viewer(world, surface, decisions.facing)
            values += [arriving, *leaving(world, surface, arriving, seen=faces_viewer)]
        return values
