"""What belongs to the shape that a ray hit: chosen per pixel among the shapes, or looked up where there are many."""

import hashlib
from collections.abc import Callable, Hashable, Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, TypeVar

import drjit as dr
import numpy as np

from rayproof.tracer.rays import NearestHit, Ray
from rayproof.tracer.shapes.shape import TracedShape
from rayproof.tracer.shapes.transforms import GatheredTransform
from rayproof.tracer.stages.intersector import World

Value = TypeVar("Value", bound=Hashable)


@dataclass(frozen=True, kw_only=True)
class HitShapes:
    """The shapes at the nearest hits of one ray per lane."""

    world: World
    ray: Ray
    hit: NearestHit
    mask: Any  # which rays hit anything

    @property
    def shapes(self) -> tuple[TracedShape, ...]:
        """Return the scene's shapes."""
        return self.world.shapes

    def one(self, index: int) -> "OneShape":
        """Return one of the shapes as if every ray had hit it."""
        return OneShape(world=self.world, ray=self.ray, hit=self.hit, mask=self.mask, index=index)

    @cached_property
    def placed(self) -> bool:
        """Return whether object space is not world space for some shape."""
        return any(not shape.transform.identity for shape in self.shapes)

    def shows(self, index: int) -> Any:
        """Return which pixels show a shape."""
        return self.hit.shape == self.world.parameter(index, "number", self.world.types.Int(index))

    def choose(self, values: Iterable[Any], otherwise: Any) -> Any:
        """Return, per pixel, the value of the shape that was hit; a kernel may end after each shape."""
        parameters = self.world.parameters
        chosen = parameters.per_lane(otherwise, dr.width(self.hit.shape))
        for index, value in enumerate(values):
            chosen = dr.select(self.shows(index), value, chosen)
            parameters.store(chosen)
        return chosen

    def constant(self, name: str, of: Callable[[TracedShape], Value], upload: Callable[[Value], Any]) -> Any:
        """Return a constant of the shape that was hit, without any choice where all shapes share it."""
        values = [of(shape) for shape in self.shapes]
        if self.world.parameters.shared:
            # Where nothing was hit, the last one's, as below.
            return self._look_up([values[-1], *values], upload(values[0]), first=-1)
        if len(set(values)) == 1:
            return self.world.parameter(0, f"constant {name}", upload(values[0]))
        if self.world.plan.tables:
            return self._look_up(values, upload(values[0]))
        named = enumerate(values)
        *others, last = (self.world.parameter(index, f"constant {name}", upload(value)) for index, value in named)
        return self.choose(others, last)

    def _look_up(self, values: Sequence[Any], like: Any, *, first: int = 0) -> Any:
        """Return, per pixel, the value of the shape that was hit, from a table; `like` has the type of one.

        The table begins with the shape `first`, -1 for pixels that show none.
        """
        table = np.asarray(values, dtype=np.float64)
        # Named by what is in it: the same table has the same name in every trace of a scene.
        name = hashlib.sha256(table.tobytes()).hexdigest()[:16]
        numbers = self.world.buffers.floats(f"table {name}", self.world.types, lambda: table)
        found = self.hit.shape >= first
        kind = self.world.types.Float if dr.is_mask_v(like) else type(like)
        value = dr.gather(kind, numbers, self.world.types.UInt(self.hit.shape - first), found)
        return value > 0 if dr.is_mask_v(like) else value

    def kind(self, kind: type[TracedShape]) -> Any:
        """Return where a shape of a kind was hit."""
        return self.constant("kind", lambda shape: type(shape) is kind, self.world.types.Bool) & self.mask

    def either(self, kind: type[TracedShape], value: Any, otherwise: Any) -> Any:
        """Return the value where a shape of that kind was hit."""
        return dr.select(self.kind(kind), value, otherwise)

    def flat_normal(self) -> Any:
        """Return the object-space normal where a flat shape was hit."""
        return self.constant("normal", lambda shape: shape.flat_normal, lambda xyz: self.world.types.Vector(*xyz))

    def object_ray(self) -> Ray:
        """Return the ray in the object space of the shape that was hit."""
        return self.world.configuration["to_object"](self.ray, self.transform) if self.placed else self.ray

    @cached_property
    def transform(self) -> Any:
        """Return the model matrix of the shape that was hit, from tables."""
        transforms = [shape.transform for shape in self.shapes]
        Vector = self.world.types.Vector
        rows = [self._look_up([p.inverse[k] for p in transforms], Vector(0)) for k in range(3)]
        columns = [self._look_up([p.linear[:, k] for p in transforms], Vector(0)) for k in range(3)]
        translation = self._look_up([p.translation for p in transforms], Vector(0))
        return GatheredTransform(rows=rows, columns=columns, translation=translation)


@dataclass(frozen=True, kw_only=True)
class OneShape(HitShapes):
    """One of the shapes that may have been hit, as if every ray had hit it."""

    index: int

    @property
    def shapes(self) -> tuple[TracedShape, ...]:
        """Return the shape alone."""
        return (self.world.shapes[self.index],)

    @cached_property
    def transform(self) -> Any:
        """Return its model matrix."""
        return self.world.transforms[self.index]

    def constant(self, name: str, of: Callable[[TracedShape], Value], upload: Callable[[Value], Any]) -> Any:
        """Return a constant of the shape."""
        return self.world.parameter(self.index, name, upload(of(*self.shapes)))

    def kind(self, kind: type[TracedShape]) -> Any:
        """Return where the shape was hit, which is of that kind."""
        return self.shows(self.index)

    def either(self, kind: type[TracedShape], value: Any, otherwise: Any) -> Any:
        """Return the value: the shape is of that kind."""
        return value

    def flat_normal(self) -> Any:
        """Return its object-space normal, if it is flat; the same number in every kernel if its kind has one."""
        (shape,) = self.shapes
        normal = self.world.types.Vector(*shape.flat_normal)
        return self.world.parameter(self.index, "normal", normal) if shape.own_normal else normal
