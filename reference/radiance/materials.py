"""Materials and lights in Radiance's scene language (refman, "Materials"), and what their radiances mean in watts.

A point light is a sphere of radius r and radiance C: it sends the intensity pi r^2 C into every direction, and rtrace
aims one ray at its centre. It is an `illum` with the alternate material `void`, which a camera's ray passes through.
"""

from collections.abc import Sequence
from math import pi

from rayproof.cases.scene import PointLight, Rgb, Scene

# In rtrace's units, where the scene measures up to 1024: some roundings of those above FTINY, below which it refuses
# a sphere, and so small that its half solid angle at the far end of the scene is 1e-5.
LIGHT_RADIUS = 2.0**-7
# W/(m^2 sr): exact in float32, like the light's radius, so that neither costs a rounding.
LIGHT_RADIANCE = 2.0**34
# The intensity [W/sr] of that light, in rtrace's unit of length.
INTENSITY = pi * LIGHT_RADIUS**2 * LIGHT_RADIANCE
WHITE: Rgb = (1.0, 1.0, 1.0)
WHITE_PAINT = "void plastic white 0 0 5 1 1 1 0 0"
# Two-sided is how Radiance's plastic is made (-bv+). This pattern blackens what is seen from behind: Rdot, the cosine
# between the ray turned around and the normal, is negative there.
ONE_SIDED = 'void brightfunc one_sided 2 "if(Rdot,1,0)" . 0 0'


def painted(scene: Scene) -> list[str]:
    """Return a material `m<n>` for each shape: its albedo, and black from behind unless it is two-sided."""
    shapes = enumerate(scene.shapes)
    return [ONE_SIDED, *(_plastic(i, s.albedo, "void" if s.two_sided else "one_sided") for i, s in shapes)]


def light(source: PointLight, color: Sequence[float], scale: float) -> list[str]:
    """Return the light `source` in units of 1/scale m, with radiances LIGHT_RADIANCE times `color`."""
    place = " ".join(repr(coordinate * scale) for coordinate in source.position)
    radiance = " ".join(repr(LIGHT_RADIANCE * channel) for channel in color)
    return [f"void illum glow 1 void 0 3 {radiance}", f"glow sphere light 0 0 4 {place} {LIGHT_RADIUS!r}"]


def _plastic(index: int, albedo: Rgb, modifier: str) -> str:
    # The fourth and fifth number: no specular reflection, no roughness.
    return f"{modifier} plastic m{index} 0 0 5 {' '.join(map(repr, albedo))} 0 0"
