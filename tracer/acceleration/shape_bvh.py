"""Many spheres, cubes or squares in a tree: one kind in each, so that a leaf holds one formula."""

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import drjit as dr
import numpy as np

from rayproof.cases.scene import Shape
from rayproof.tracer.acceleration.builder import tree_over
from rayproof.tracer.acceleration.grid_boxes import on_grid
from rayproof.tracer.acceleration.quantised_boxes import HostNodes, Nodes, quantise
from rayproof.tracer.configuration import Configuration
from rayproof.tracer.kernel.arrays import ArrayTypes
from rayproof.tracer.kernel.parameters import DeviceBuffers, KernelConstants, packets
from rayproof.tracer.rays import Interval, Ray
from rayproof.tracer.shapes.kinds import traced
from rayproof.tracer.shapes.shape import TracedShape
from rayproof.tracer.shapes.transforms import GatheredTransform

Members = tuple[tuple[int, Shape], ...]  # (index into the scene's shapes, shape), ascending


@dataclass(frozen=True, kw_only=True)
class HostShapeHierarchy:
    """Shapes of one kind, numbered by their index in the scene."""

    like: TracedShape  # any of them
    nodes: HostNodes
    records: np.ndarray  # (slots, 4 n) float64
    numbers: np.ndarray  # (slots,) int32
    identity: bool  # whether object space is world space for all of them


@lru_cache(maxsize=16)
def host_crowd(members: Members) -> HostShapeHierarchy:
    """Return the tree over shapes of one kind."""
    shapes = [traced(shape) for _, shape in members]
    boxes = np.array([one.box for one in shapes])
    identity = all(one.transform.identity for one in shapes)
    lower, upper = boxes[:, 0].T, boxes[:, 1].T
    boxes = on_grid(lower, upper)
    tree = tree_over(boxes)
    records = np.array([one.packed(identity=identity) for one in shapes])
    return HostShapeHierarchy(
        like=shapes[0],
        nodes=quantise(tree, boxes),
        records=records[tree.slots],
        numbers=np.array([index for index, _ in members], dtype=np.int32)[tree.slots],
        identity=identity,
    )


class ShapeHierarchy:
    """The tree and its shapes as Dr.Jit arrays."""

    def __init__(
        self,
        host: HostShapeHierarchy,
        types: ArrayTypes,
        buffers: DeviceBuffers,
        *,
        name: str,
        parameters: KernelConstants,
    ) -> None:
        self.host, self.types, self._assets, self._name = host, types, buffers, name
        self.nodes = Nodes(host.nodes, types, buffers, name=name, parameters=parameters)

    def item(self, slot: Any) -> tuple[Any, Any]:
        """Return (placement or None, what the formula is given) of the shape in a slot, and its index in the scene."""
        host, Vector = self.host, self.types.Vector
        records = self._assets.floats(f"{self._name} records", self.types, lambda: host.records)
        numbers = self._assets.upload(f"{self._name} numbers", self.types.Int, lambda: host.numbers)
        x = packets(self.types, records, slot, host.records.shape[1] // 4)
        transform = None
        if not host.identity:
            rows = [Vector(*x[3 * row : 3 * row + 3]) for row in range(3)]
            transform, x = GatheredTransform(rows=rows, translation=Vector(*x[9:12])), x[12:]
        number = dr.gather(self.types.Int, numbers, slot)
        return (transform, host.like.unpacked(x, self.types)), number

    def meet(self, configuration: Configuration, ray: Ray, item: Any, interval: Interval) -> Any:
        """Return the t of one ray and one shape, inf where they do not meet."""
        transform, arrays = item
        formula = configuration.formula(self.host.like.slot)
        if transform is not None and formula.facts.get("space") == "object":
            ray = configuration["to_object"](ray, transform)
        return formula.function(ray, arrays, interval)

    def shape(self, number: Any, active: Any) -> Any:
        """Return the index of the shape."""
        return number

    def face(self, number: Any, active: Any) -> Any:
        """Return the face: these shapes have one."""
        return self.types.Int(0)
