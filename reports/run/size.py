"""What a scene takes in memory, told before anything is started: what cannot fit is refused, in one line."""

import psutil

from cases.scene import Mesh, Scene, SceneError

# Of one process at least: 5.5 GB for one sphere under one light on 4096 x 4096 pixels, 6.5 GB for a mesh of 2 million
# triangles on 64 x 48. With the whole panel 1024 x 768 pixels took 3.0 GB and 512 x 384 took 0.9 GB, ten times as
# much a pixel; but only what cannot fit at all is refused.
BYTES_A_PIXEL, BYTES_A_TRIANGLE = 330, 3200
BYTES_A_LIGHT = 24  # more a pixel: the visibility of one light, in float64, of three renderers


def needed(scene: Scene) -> int:
    """Return about how much memory the largest process takes for a scene, at least [bytes]."""
    pixels = scene.camera.width * scene.camera.height
    triangles = sum(len(shape.faces) for shape in scene.shapes if isinstance(shape, Mesh))
    return pixels * (BYTES_A_PIXEL + BYTES_A_LIGHT * max(0, len(scene.lights) - 1)) + triangles * BYTES_A_TRIANGLE


def refuse_too_large(scene: Scene, name: str) -> None:
    """Raise SceneError if this machine has not half of the memory that a scene is estimated to take.

    Half, since the estimate is rough: a scene that might do is tried.
    """
    takes, there = needed(scene), psutil.virtual_memory().total
    if takes > 2 * there:
        camera = scene.camera
        raise SceneError(
            f"{name}: {camera.width} x {camera.height} px and its meshes take {takes / 1e9:.0f} GB of memory at least, "
            f"and this machine has {there / 1e9:.0f} GB; make the image smaller"
        )
