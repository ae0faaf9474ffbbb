"""Mitsuba's materials as an albedo and a flag: diffuse ones exactly, all others by the diffuse part that they have."""

from collections.abc import Callable
from typing import Any

import numpy as np

from rayproof.cases.scene import Rgb
from rayproof.reports.interchange.mitsuba_xml.tree import Element, Spectrum
from rayproof.reports.interchange.numbers import vector

GREY: Rgb = (0.5, 0.5, 0.5)  # Mitsuba's own default
# Linear sRGB of the equal-energy spectrum, X = Y = Z = 1: the row sums of the matrix from XYZ (IEC 61966-2-1).
EQUAL_ENERGY = (1.2047843, 0.9483008, 0.9088427)


def material_of(shape: Element, drop: Callable[[str], None]) -> tuple[Rgb, bool]:
    """Return the albedo of a shape's material and whether both of its sides are seen."""
    material = next((child for _, child in shape.children("BSDF")), None)
    if material is None:
        return GREY, False
    two_sided = False
    while material.plugin == "twosided":
        two_sided = True
        sides = [child for _, child in material.children("BSDF")]
        if len(sides) != 1:
            drop(f"{material.place}: the second of {len(sides)} sides; both get the first one's material")
        if not sides:
            return GREY, True
        material = sides[0]
    if material.plugin == "diffuse":
        return _reflectance(material, "reflectance", drop), two_sided
    name = next((name for name in ("diffuse_reflectance", "base_color", "reflectance") if material.has(name)), None)
    drop(f"{material.place}: {material.plugin} is taken as diffuse{f', by its {name}' if name else ' and grey'}")
    return (_reflectance(material, name, drop) if name else GREY), two_sided


def _reflectance(material: Element, name: str, drop: Callable[[str], None]) -> Rgb:
    if not material.has(name):
        return GREY
    texture = next((child for known, child in material.children() if known == name), None)
    if texture is not None:
        drop(f"{texture.place}: the texture; the albedo is 0.5")
        return GREY
    return rgb(material.get(name, GREY), f"{material.place}: {name}", drop, white=(1.0, 1.0, 1.0))


def rgb(value: Any, place: str, drop: Callable[[str], None], *, white: Rgb = EQUAL_ENERGY) -> Rgb:
    """Return a colour property as linear RGB; `white` is what a uniform spectrum of 1 looks like in its role."""
    if isinstance(value, Spectrum):
        level = float(np.mean(value.values))
        if not value.uniform:
            drop(f"{place}: the spectrum; its mean {level:g} is taken at all wavelengths")
        return (level * white[0], level * white[1], level * white[2])
    return vector(np.broadcast_to(np.asarray(value, dtype=np.float64), 3))
