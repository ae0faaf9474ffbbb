"""POV-Ray's `trace()` as an oracle in double precision: the loop over the pixels, and its numbers back.

The scene description language computes in double, asks `trace()` for the first hit along a ray and writes what it
found as text. So nothing is rounded to a picture's steps.
"""

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from rayproof.cases.scene import Scene
from rayproof.reference.povray.program import DEPTH_TOLERANCE
from rayproof.reference.povray.shapes import vector
from rayproof.reference.povray.worlds import scale_of

NUMBERS = "numbers.txt"
# Fixed-point text: 17 digits after the point resolve 1e-17 of POV-Ray's units.
LOOP = f"""#macro Put(V) concat(str(V.x,0,17), " ", str(V.y,0,17), " ", str(V.z,0,17)) #end
#fopen Numbers "{NUMBERS}" write
#for (Row, 0, HEIGHT - 1)
#for (Column, 0, WIDTH - 1)
  #declare Ray = vnormalize(Forward + ((2 * Column + 1) / WIDTH - 1) * Across + (1 - (2 * Row + 1) / HEIGHT) * Along);
  #write (Numbers, Put(Ray))
  HITS
  #write (Numbers, "\\n")
#end
#end
#fclose Numbers
"""
HITS = """#ifdef (Seen)
    #declare Facing = <0,0,0>;
    #declare Place = trace(Seen, Eye, Ray, Facing);
    #if (vdot(Facing, Facing) > 0)
      #write (Numbers, " ", Put(Place), " ", Put(Facing))
      FEELERS
    #end
  #end"""
FEELER = """#declare Other = <0,0,0>;
    #declare Stop = trace(World, Place, LIGHT - Place, Other);
    #if (vdot(Other, Other) > 0 & vlength(Stop - Place) < vlength(LIGHT - Place) - TOLERANCE)
      #write (Numbers, " 0")
    #else
      #write (Numbers, " 1")
    #end"""


@dataclass(frozen=True, kw_only=True)
class Probe:
    """What `trace()` found along the rays through the pixel centres, row by row."""

    direction: np.ndarray  # (n, 3), unit
    hit: np.ndarray  # (n,) bool
    position: np.ndarray  # (n, 3) m, 0 on a miss
    normal: np.ndarray  # (n, 3), unit, outward, 0 on a miss
    free: np.ndarray  # (n, lights) bool: nothing between hit and light, wherever the surface faces


def loop(scene: Scene, *, feelers: bool) -> str:
    """Return the SDL that writes the numbers; it follows the world in the scene file."""
    lights = [vector(np.multiply(light.position, scale_of(scene))) for light in scene.lights] if feelers else []
    # A light on a blocker's surface is not behind it: the tolerance that POV-Ray has at a ray's start, at its end too.
    feeler = FEELER.replace("TOLERANCE", f"{DEPTH_TOLERANCE}")
    hits = HITS.replace("FEELERS", "\n    ".join(feeler.replace("LIGHT", light) for light in lights))
    size = LOOP.replace("WIDTH", str(scene.camera.width)).replace("HEIGHT", str(scene.camera.height))
    return size.replace("HITS", hits)


def read(folder: Path, scene: Scene) -> Probe:
    """Return the numbers that the loop left in `folder`."""
    lines = [line.split() for line in (folder / NUMBERS).read_text(encoding="ascii").splitlines()]
    count = scene.camera.width * scene.camera.height
    if len(lines) != count:
        raise RuntimeError(f"POV-Ray wrote {len(lines)} lines for {count} pixels")
    # Where nothing is hit no line is long, whatever lights there are.
    table = np.zeros((count, 9 + len(scene.lights)))
    for row, words in enumerate(lines):
        table[row, : len(words)] = [float(word) for word in words]
    hit = np.array([len(words) > 3 for words in lines])
    length = np.linalg.norm(table[:, 6:9], axis=1, keepdims=True)
    return Probe(
        direction=table[:, :3],
        hit=hit,
        position=table[:, 3:6] / scale_of(scene),
        normal=np.divide(table[:, 6:9], length, out=np.zeros((count, 3)), where=hit[:, np.newaxis]),
        free=table[:, 9:] > 0,
    )
