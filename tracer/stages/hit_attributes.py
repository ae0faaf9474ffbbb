"""What belongs to the shape that a ray hit: chosen per pixel among the shapes, or looked up where there are many."""

import hashlib
from collections.abc import Callable, Hashable, Iterable, Sequence
from functools import cached_property
from typing import Any, TypeVar

import drjit as dr
import numpy as np

from rayproof.cases.scene import Shape
from rayproof.tracer.rays import NearestHit
from rayproof.tracer.shapes.gathered_transforms import GatheredTransform
from rayproof.tracer.shapes.transforms import Transform
from rayproof.tracer.stages.intersector import World

Value = TypeVar("Value", bound=Hashable)


class HitShapes:
    """The shapes at the nearest hits of one bundle of rays."""

    def __init__(self, world: World, hit: NearestHit) -> None:
        self.world, self.hit = world, hit
        self.shapes, self.types = world.scene.shapes, world.types

    @cached_property
    def mask(self) -> Any:
        """Return which rays hit anything."""
        return self.hit.distance < dr.inf

    def shows(self, index: int) -> Any:
        """Return which pixels show a shape."""
        return self.hit.shape == self.world.parameter(index, "number", self.types.Int(index))

    def choose(self, values: Iterable[Any], otherwise: Any) -> Any:
        """Return, per pixel, the value of the shape that was hit."""
        parameters = self.world.parameters
        chosen = parameters.per_lane(otherwise, dr.width(self.hit.shape))
        for index, value in enumerate(values):
            chosen = dr.select(self.shows(index), value, chosen)
            parameters.store(chosen)
        return chosen

    def constant(self, name: str, of: Callable[[Shape], Value], upload: Callable[[Value], Any]) -> Any:
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
        numbers = self.world.buffers.floats(f"table {name}", self.types, lambda: table)
        found = self.hit.shape >= first
        kind = self.types.Float if dr.is_mask_v(like) else type(like)
        value = dr.gather(kind, numbers, self.types.UInt(self.hit.shape - first), found)
        return value > 0 if dr.is_mask_v(like) else value

    def kind(self, *kinds: type[Shape]) -> Any:
        """Return where a shape of one of these kinds was hit."""
        return self.constant("kind", lambda shape: isinstance(shape, kinds), self.types.Bool) & self.mask

    @cached_property
    def transform(self) -> GatheredTransform:
        """Return the model matrix of the shape that was hit, from tables."""
        transforms = [Transform(to_world=shape.to_world) for shape in self.shapes]
        Vector = self.types.Vector
        rows = [self._look_up([p.inverse[k] for p in transforms], Vector(0)) for k in range(3)]
        columns = [self._look_up([p.linear[:, k] for p in transforms], Vector(0)) for k in range(3)]
        translation = self._look_up([p.translation for p in transforms], Vector(0))
        return GatheredTransform(rows=rows, columns=columns, translation=translation)
