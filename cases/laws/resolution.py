"""Every third pixel of an image three times as fine is a pixel of the coarse one."""

from collections.abc import Iterator

from rayproof.cases.changes import with_camera
from rayproof.cases.laws import LAWS
from rayproof.cases.relations import Ask, Relation, everywhere, related
from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage

SIZE = (13, 11)


@LAWS.register("resolution", stage=Stage.RAY, implicates=("CAM-3", "CAM-4"))
def resolution(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Ask for W x H and 3 W x 3 H pixels: the centre of a pixel is the centre of its middle ninth.

    Proof: sx = 2 (c + 1/2) / W - 1 = 2 (3 c + 1 + 1/2) / (3 W) - 1, and likewise for rows.
    Source: specification, CAM-3.
    """
    width, height = SIZE
    coarse = with_camera(scene, width=width, height=height)
    fine = with_camera(scene, width=3 * width, height=3 * height)
    after = everywhere(lambda image: image[1::3, 1::3])
    yield from related(ask, coarse, fine, what="three times as many pixels each way", after=after)
