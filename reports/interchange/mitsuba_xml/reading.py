"""Read a Mitsuba XML file."""

from collections.abc import Callable, Iterator
from math import pi
from pathlib import Path

import numpy as np

from rayproof.cases.scene import PointLight, Scene, SceneError
from rayproof.reports.interchange import IMPORTERS, Folders, Imported, Size
from rayproof.reports.interchange.framing import camera_for, light_for
from rayproof.reports.interchange.mitsuba_xml.materials import rgb
from rayproof.reports.interchange.mitsuba_xml.sensors import camera_of
from rayproof.reports.interchange.mitsuba_xml.shapes import count_shapes, shapes_of
from rayproof.reports.interchange.mitsuba_xml.tree import Element, read_tree
from rayproof.reports.interchange.numbers import vector

PINHOLES = ("perspective", "thinlens")
# What renders a scene and is no part of it; a film is the sensor's.
OF_THE_RENDERER = ("Integrator", "Sampler", "ReconstructionFilter")


def lights_of(scene: Element, drop: Callable[[str], None]) -> Iterator[PointLight]:
    """Yield the point lights of a scene; every other emitter is dropped, and told.

    Mitsuba gives intensity I [W/sr] per channel; the flux is 4 pi I [W].

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


@IMPORTERS.register(".xml")
def import_mitsuba(path: Path, size: Size, allowed: Folders) -> Imported:
    """Return the scene in a Mitsuba XML file; direct light only, whatever its integrator would add.

    Raises:
        SceneError: the file cannot be understood, or holds what the specification refuses.

    """
    try:
        return _scene(path, size, allowed)
    except SceneError:
        raise
    except (TypeError, AttributeError, KeyError, ValueError, OverflowError) as error:
        # Properties of other types than the plug-ins': Mitsuba's parser leaves that to them.
        raise SceneError(f"{path}: is no scene for Mitsuba: {' '.join(str(error).split())}") from None


def _scene(path: Path, size: Size, allowed: Folders) -> Imported:
    try:
        root = read_tree(path, allowed)
        root.budget.spend("shapes", count_shapes(root), by="it with its instances")
    except SceneError as error:
        raise SceneError(f"{path}: {error}") from None
    if root.kind != "Scene":
        raise SceneError(f"{path}: must hold a scene, got a {root.kind.lower()}")
    dropped: dict[str, None] = {}

    def drop(sentence: str) -> None:
        dropped[sentence] = None

    try:
        shapes = tuple(shapes_of(root, path.parent, drop))
    except SceneError as error:
        raise SceneError(f"{path}: {error}") from None
    sensors = [sensor for _, sensor in root.children("Sensor")]
    usable = [sensor for sensor in sensors if sensor.plugin in PINHOLES]
    for sensor in sensors:
        if not usable or sensor is not usable[0]:
            drop(f"{sensor.place}: the sensor {sensor.plugin}{'; the first one counts' if usable else ''}")
    if not usable:
        drop(f"{path.name}: it has no perspective sensor; a camera was made that shows every shape")
    camera = camera_of(usable[0], size, drop) if usable else camera_for(shapes, size, up=(0.0, 1.0, 0.0))
    lights = tuple(lights_of(root, drop))
    if not lights:
        drop(f"{path.name}: it has no point light; one was made")
        lights = (light_for(camera),)
    for name, child in root.children():
        if child.kind == "Integrator" and child.plugin != "direct":
            drop(f"{child.place}: the integrator {child.plugin}; direct light is all that is computed")
        elif child.kind not in ("Shape", "Sensor", "Emitter", "BSDF", "Texture", *OF_THE_RENDERER):
            drop(f"{child.place}: the {child.kind.lower()} {child.plugin} ({name})")
    for element in root.everything():
        if element.kind not in ("Scene", "Film", *OF_THE_RENDERER):
            for name in element.unread():
                drop(f"{element.place}: the {name} of the {element.plugin}")
    return Imported(scene=Scene(camera=camera, shapes=shapes, lights=lights), dropped=tuple(dropped))
