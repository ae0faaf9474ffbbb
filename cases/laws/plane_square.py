"""As far as one can see, a plane is a large square."""

from collections.abc import Iterator

import numpy as np

from rayproof.cases.changes import matrix, placed, with_shapes
from rayproof.cases.laws import LAWS
from rayproof.cases.placement import compose, scaling, translation
from rayproof.cases.relations import Ask, Conditions, Relation, related
from rayproof.cases.scene import Plane, Scene, Shape, Square
from rayproof.cases.stages import Stage


@LAWS.register("plane_square", stage=Stage.OBJECT, implicates=("HIT-4", "HIT-7"))
def plane_square(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Put a square in every plane's place that reaches beyond the far plane and every light: nothing changes.

    Proof: nothing is seen beyond the far plane, and feelers run between what is seen and the lights, all of it within
    the square. Source: specification, HIT-4 and HIT-7.
    """
    if scene.clip == "none" or not any(isinstance(shape, Plane) for shape in scene.shapes):
        return
    camera = scene.camera
    reach = camera.far * np.hypot(1, np.tan(camera.alpha) * max(1.0, camera.aspect) * 1.5) + max(
        (float(np.linalg.norm(np.subtract(light.position, camera.eye))) for light in scene.lights), default=0.0
    )

    def bounded(shape: Shape) -> Shape:
        if not isinstance(shape, Plane):
            return shape
        inverse = np.linalg.inv(np.asarray(shape.to_world))
        center = inverse[:3, :3] @ np.asarray(camera.eye) + inverse[:3, 3]
        size = float(4 * reach * np.linalg.norm(inverse[:3, :3], ord=2))
        there = compose(translation(float(center[0]), float(center[1]), 0), scaling(size, size, 1))
        square = Square(albedo=shape.albedo, to_world=shape.to_world, two_sided=shape.two_sided)
        return placed(square, matrix(there))

    # Local coordinates are small, but the matrix stretches by the square's size: what is rounded are plane distances.
    yield from related(
        ask,
        scene,
        with_shapes(scene, bounded),
        what="every plane cut to a large square",
        conditions=Conditions(),
    )
