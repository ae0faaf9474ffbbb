"""Many spheres, cubes or squares in a tree: one kind in each, so that a leaf holds one formula."""

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import drjit as dr
import numpy as np

from rayproof.cases.scene import Shape, Sphere
from rayproof.tracer.acceleration.builder import tree_over
from rayproof.tracer.acceleration.quantised_boxes import HostNodes, Nodes, quantise
from rayproof.tracer.configuration import Configuration
from rayproof.tracer.device.arrays import ArrayTypes
from rayproof.tracer.device.buffers import DeviceBuffers, packets
from rayproof.tracer.device.kernel_constants import KernelConstants
from rayproof.tracer.rays import Interval, Ray
from rayproof.tracer.shapes.gathered_transforms import GatheredTransform
from rayproof.tracer.shapes.records import HALF, SLOTS, CubeArrays, SphereArrays, SquareArrays, square_vectors
from rayproof.tracer.shapes.transforms import Transform

Members = tuple[tuple[int, Shape], ...]  # (index into the scene's shapes, shape), ascending
MATRIX, CENTER, VECTORS = 12, 4, 12  # numbers in a record: inverse and translation; centre and radius; square's own


@dataclass(frozen=True, kw_only=True)
class HostShapeHierarchy:
    """Shapes of one kind, numbered by their index in the scene."""

    slot: str
    nodes: HostNodes
    records: np.ndarray  # (slots, 4 n) float64
    numbers: np.ndarray  # (slots,) int32
    identity: bool  # whether object space is world space for all of them
    orthogonal: bool  # of squares


def _box(shape: Shape) -> tuple[np.ndarray, np.ndarray]:
    """Return the lower and upper corner of a shape's box [m]."""
    transform = Transform(to_world=shape.to_world)
    if isinstance(shape, Sphere):
        center = transform.linear @ np.asarray(shape.center) + transform.translation
        half = np.linalg.norm(transform.linear, axis=1) * shape.radius
    else:
        sides = transform.linear if SLOTS[type(shape)] == "cube" else transform.linear[:, :2]
        center, half = transform.translation, np.abs(sides).sum(axis=1) * HALF
    # The box's own roundings, and those of what it is computed from.
    half = half + (np.abs(center) + half) * 2.0**-48
    return center - half, center + half


def _record(shape: Shape, *, identity: bool) -> np.ndarray:
    transform = Transform(to_world=shape.to_world)
    numbers = [] if identity else [transform.inverse.reshape(-1), transform.translation]
    if isinstance(shape, Sphere):
        numbers.append(np.array([*shape.center, shape.radius]))
    if SLOTS[type(shape)] == "square":
        numbers.append(np.concatenate([*square_vectors(transform)[:3], np.zeros(3)]))
    return np.concatenate(numbers) if numbers else np.zeros(4)


@lru_cache(maxsize=16)
def host_crowd(members: Members) -> HostShapeHierarchy:
    """Return the tree over shapes of one kind."""
    boxes = np.array([_box(shape) for _, shape in members])
    identity = all(Transform(to_world=shape.to_world).identity for _, shape in members)
    lower, upper = boxes[:, 0].T, boxes[:, 1].T
    tree = tree_over(lower, upper)
    records = np.array([_record(shape, identity=identity) for _, shape in members])
    first = members[0][1]
    square = SLOTS[type(first)] == "square"
    return HostShapeHierarchy(
        slot=SLOTS[type(first)],
        nodes=quantise(tree, lower, upper),
        records=records[tree.slots],
        numbers=np.array([index for index, _ in members], dtype=np.int32)[tree.slots],
        identity=identity,
        orthogonal=square and bool(square_vectors(Transform(to_world=first.to_world))[3]),
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
        match host.slot:
            case "sphere":
                return (transform, SphereArrays(center=Vector(*x[:3]), radius=x[3])), number
            case "cube":
                return (transform, CubeArrays()), number
            case _:
                vectors = [Vector(*x[3 * k : 3 * k + 3]) for k in range(3)]
                center, width, height = vectors
                square = SquareArrays(center=center, half_width=width, half_height=height, orthogonal=host.orthogonal)
                return (transform, square), number

    def meet(self, configuration: Configuration, ray: Ray, item: Any, interval: Interval) -> Any:
        """Return the t of one ray and one shape, inf where they do not meet."""
        transform, arrays = item
        formula = configuration.formula(self.host.slot)
        if transform is not None and formula.facts["space"] == "object":
            ray = configuration["to_object"](ray, transform)
        return formula.function(ray, arrays, interval)

    def shape(self, number: Any, active: Any) -> Any:
        """Return the index of the shape."""
        return number

    def face(self, number: Any, active: Any) -> Any:
        """Return the face: these shapes have one."""
        return self.types.Int(0)
