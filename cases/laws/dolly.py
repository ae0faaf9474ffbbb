"""Radiance does not change along a ray."""

from collections.abc import Iterator

from rayproof.cases.changes import vector, view, with_camera
from rayproof.cases.laws import LAWS
from rayproof.cases.relations import Ask, Relation, everywhere, related
from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage

SIDE = 5


@LAWS.register("dolly", stage=Stage.RADIANCE, implicates=("RAD-5", "HIT-2", "CAM-4"))
def dolly(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Move the camera ahead by less than what its near plane left out: the central pixel stays, but for its distance.

    Proof: the central ray is the same line, and light is invariant along it; nothing is nearer than the near plane was.
    Source: specification, RAD-5.
    """
    axes, camera = view(scene.camera), scene.camera
    step = 0.5 * camera.near
    still = with_camera(scene, width=SIDE, height=SIDE)
    # Where the planes stand stays the same.
    ahead = with_camera(
        still,
        eye=vector(axes.eye + step * axes.forward),
        target=vector(axes.eye + (step + axes.distance) * axes.forward),
        near=camera.near - step,
        far=camera.far - step,
    )
    middle = slice(SIDE // 2, SIDE // 2 + 1)
    central = everywhere(lambda image: image[middle, middle])
    nearer = {Stage.DISTANCE: lambda image: image[middle, middle] - step}
    yield from related(
        ask, still, ahead, what=f"the camera moved {step:g} m ahead", before=central | nearer, after=central
    )
