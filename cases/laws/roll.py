"""A camera upside down sees the image upside down."""

from collections.abc import Iterator

import numpy as np

from rayproof.cases.changes import vector, view, with_camera
from rayproof.cases.laws import LAWS
from rayproof.cases.relations import Ask, Relation, everywhere, related
from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage

SIDE = 29


@LAWS.register("roll", stage=Stage.RAY, implicates=("CAM-1", "CAM-3", "CAM-4"))
def roll(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Turn the camera about its line of sight by half a turn, and a square image by a quarter: the image turns back.

    Proof: right and up turn with the camera, and pixel centres lie symmetrically about the image's middle.
    Source: specification, CAM-1 and CAM-3.
    """
    camera = scene.camera
    over = with_camera(scene, up=vector(-np.asarray(camera.up)))
    turned = everywhere(lambda image: image[::-1, ::-1])
    yield from related(ask, scene, over, what="the camera upside down", before=turned)
    square = with_camera(scene, width=SIDE, height=SIDE)
    beside = with_camera(square, up=vector(view(camera).right))
    # Up is where right was: what stood at the right edge stands at the top.
    quarter = everywhere(lambda image: np.rot90(image, 1))
    yield from related(ask, square, beside, what="the camera turned by a quarter", before=quarter)
