"""A narrower camera sees the middle of what a wider one sees."""

from collections.abc import Iterator
from math import atan, degrees, radians, tan

from rayproof.cases.changes import with_camera
from rayproof.cases.laws import LAWS
from rayproof.cases.relations import Ask, Relation, everywhere, related
from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage

WIDE, TALL = 10, 6  # px on either side
WIDTH, HEIGHT = 21, 17


@LAWS.register("crop", stage=Stage.RAY, implicates=("CAM-2", "CAM-3", "CAM-4"))
def crop(scene: Scene, ask: Ask) -> Iterator[Relation]:
    """Add columns on both sides, then rows above and below with the wider angle that they need: the middle stays.

    Proof: tan(alpha) / H is the height of a pixel at distance 1, and its width too; both are kept, and with them the
    direction of each pixel counted from the middle. Source: specification, CAM-4.
    """
    middle = with_camera(scene, width=WIDTH, height=HEIGHT)
    wide = with_camera(middle, width=WIDTH + 2 * WIDE)
    after = everywhere(lambda image: image[:, WIDE:-WIDE])
    yield from related(ask, middle, wide, what="more columns on both sides", after=after)
    height = HEIGHT + 2 * TALL
    angle = degrees(2 * atan(tan(radians(scene.camera.fovy) / 2) * height / HEIGHT))
    tall = with_camera(middle, height=height, fovy=angle)
    after = everywhere(lambda image: image[TALL:-TALL])
    yield from related(ask, middle, tall, what="more rows above and below", after=after)
