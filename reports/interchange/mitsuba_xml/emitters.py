"""Mitsuba's point lights: intensity I [W/sr] per channel, so a flux of 4 pi I [W]."""

from collections.abc import Callable, Iterator
from math import pi

import numpy as np

from rayproof.cases.scene import PointLight, SceneError
from rayproof.reports.interchange.mitsuba_xml.materials import rgb
from rayproof.reports.interchange.mitsuba_xml.tree import Element
from rayproof.reports.interchange.numbers import vector


def lights_of(scene: Element, drop: Callable[[str], None]) -> Iterator[PointLight]:
    """Yield the point lights of a scene; every other emitter is dropped, and told.

    Raises:
        SceneError: a light is one that the specification refuses.

    """
    for _, emitter in scene.children("Emitter"):
        if emitter.plugin != "point":
            drop(f"{emitter.place}: the {emitter.plugin} light")
            continue
        where = emitter.get("position", None)
        position = emitter.matrix()[:3, 3] if where is None else np.asarray(where, dtype=np.float64)
        if any(name == "intensity" for name, _ in emitter.children()):
            drop(f"{emitter.place}: the light's texture; its intensity is 1")
            intensity = (1.0, 1.0, 1.0)
        else:
            intensity = rgb(emitter.get("intensity", 1.0), f"{emitter.place}: intensity", drop)
        try:
            yield PointLight(position=vector(position), flux=vector(4 * pi * np.asarray(intensity)))
        except SceneError as error:
            raise SceneError(f"{emitter.place}: {error}") from None
