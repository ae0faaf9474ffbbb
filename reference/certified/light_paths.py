"""End-to-end truth of one image point: what is decided along the light path, and the value of every stage."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

from rayproof.cases.stages import IMAGE_STAGES, Stage
from rayproof.reference.certified.decisions import (
    CubeFace,
    Hit,
    clip_window,
    cube_face,
    is_lit,
    nearest,
    outward,
    turned,
)
from rayproof.reference.certified.fields import Number, UndecidedError, Vector
from rayproof.reference.certified.light import irradiance, leaving, looks_at_viewer
from rayproof.reference.certified.vectors import dot, scaled
from rayproof.reference.certified.worlds import EYE, Surface, World

# Places in the list of image stages; comparing them is a tenth of the work of comparing enumeration members.
OBJECT, NORMAL, VISIBILITY, IRRADIANCE = (
    IMAGE_STAGES.index(stage) for stage in (Stage.OBJECT, Stage.NORMAL, Stage.VISIBILITY, Stage.IRRADIANCE)
)
NAN, INFINITY = float("nan"), float("inf")
NOTHING, BLACK, UNKNOWN = [-1.0, -1.0], [0.0, 0.0, 0.0], [NAN, NAN, NAN]

Values = list[list[Any]]  # per image stage, in order, a ball or an exact plain number per channel


@dataclass(frozen=True, kw_only=True)
class Suspects:
    """What may matter to one image point: everything, or what a filter could not rule out."""

    surfaces: Sequence[Surface]
    blockers: Sequence[Sequence[Surface] | None]  # per light; None: surely blocked


@dataclass(frozen=True, kw_only=True)
class Decisions:
    """The discrete part of an answer. A name in `open` could not be decided."""

    hit: Hit | None = None
    face: CubeFace = None
    facing: int = 0  # sign of n.d, n outward
    lit: tuple[bool | None, ...] = ()
    open: tuple[str, ...] = ()


class Path:
    """The light path along a direction of depth 1, as far as the image stage of number `last`."""

    def __init__(self, world: World, direction: Vector, last: int) -> None:
        self.world = world
        self.direction = direction
        self.last = last
        self.t: Any = None
        self.segment: Any = None
        self.outward: Any = None

    def decide(self, suspects: Suspects, *, leave_open: bool) -> Decisions:
        """Return every decision; with `leave_open` what cannot be decided is named, else UndecidedError is raised."""
        if self.last < OBJECT:
            return Decisions()
        world, direction = self.world, self.direction
        try:
            length = world.field.sqrt(dot(direction, direction)) if world.scene.clip == "shell" else None
            found = nearest(world, direction, clip_window(world, length, None), suspects.surfaces)
            if found is None:
                return Decisions(lit=(False,) * len(world.scene.lights))
            hit, t = found
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
        """Walk the path that was decided elsewhere, asking nothing."""
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
        """Return the values of all stages up to the last, in balls; after `decide` in balls, or `follow`."""
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
            seen = looks_at_viewer(world, surface, decisions.facing)
            values += [arriving, *leaving(world, surface, arriving, seen=seen)]
        return values
