"""Export of a scene for pbrt, version 3: Pharr, Jakob, Humphreys, Physically Based Rendering, third edition, 2016.

The format is described in "pbrt-v3 Input File Format". Its `matte` material is Lambertian on both sides of a surface,
its world is left-handed, so that the camera mirrors, and the angle `fov` is that of the image's shorter side.
"""

from collections.abc import Iterator
from math import atan, degrees, pi, tan
from pathlib import Path
from typing import Any

import numpy as np

from rayproof.cases.placement import world_triangles
from rayproof.cases.scene import Camera, Mesh, Scene, SceneError, Shape, Sphere
from rayproof.reports.interchange import EXPORTERS, SceneFormat
from rayproof.reports.results.files import write_text

SAYS = SceneFormat(
    title="pbrt, version 3",
    shapes=("sphere", "mesh"),
    shading=("inverse_square",),
    clip=("none",),
    two_sided="always",
    world_normals=True,
    cannot_say={
        "near and far plane": "clip `none`, if the planes touch nothing; else `unsupported`",
        "one-sided surfaces": "two-sided ones, if no back is seen; else `unsupported`",
        "simplified light": "`inverse_square`",
        "planes": "a square as a mesh, by which the case is judged",
        "cubes, squares and triangles": "meshes that equal them",
    },
)


@EXPORTERS.register(".pbrt", says=SAYS)
def export_pbrt(scene: Scene, path: Path) -> tuple[str, ...]:
    """Write `scene`, of spheres and meshes, to `path`; return sentences about features that pbrt lacks.

    Raises:
        SceneError: a shape is neither sphere nor mesh.
        OSError: the file cannot be written.

    """
    dropped: list[str] = []
    lines = [*_camera(scene.camera, path.with_suffix(".exr").name), "WorldBegin"]
    for light in scene.lights:
        intensity = [flux / (4 * pi) for flux in light.flux]
        lines.append(f'LightSource "point" "point from" {_list(light.position)} "rgb I" {_list(intensity)}')
    for index, shape in enumerate(scene.shapes):
        lines += ["AttributeBegin", f'  Material "matte" "rgb Kd" {_list(shape.albedo)}']
        lines += [f"  {line}" for line in _shape(shape)]
        lines.append("AttributeEnd")
        if not shape.two_sided:
            dropped.append(f"shape {index}: that only one side of it is seen and lit")
    lines.append("WorldEnd")
    if scene.shading != "inverse_square":
        dropped.append("the simplified shading: pbrt's light falls off with the square of the distance")
    if scene.clip != "none":
        dropped.append(f"clip {scene.clip}: pbrt's camera does not clip")
    write_text(path, "\n".join(lines) + "\n")
    return tuple(dropped)


def _list(values: Any) -> str:
    """Return numbers in brackets, with every digit of float64."""
    return "[" + " ".join(map(repr, np.ravel(np.asarray(values, dtype=np.float64)).tolist())) + "]"


def _camera(camera: Camera, image: str) -> Iterator[str]:
    yield 'Integrator "directlighting" "string strategy" "all" "integer maxdepth" 1'
    # Without jitter one sample is the pixel's centre.
    yield 'Sampler "stratified" "bool jitter" "false" "integer xsamples" 1 "integer ysamples" 1'
    yield 'PixelFilter "box" "float xwidth" 0.5 "float ywidth" 0.5'
    size = f'"integer xresolution" {camera.width} "integer yresolution" {camera.height}'
    yield f'Film "image" {size} "string filename" "{image}"'
    yield "Scale -1 1 1"
    places = (camera.eye, camera.target, camera.up)
    yield f"LookAt {'  '.join(_list(place)[1:-1] for place in places)}"
    shorter = tan(camera.alpha) * min(1.0, camera.aspect)
    yield f'Camera "perspective" "float fov" {2 * degrees(atan(shorter))!r}'


def _shape(shape: Shape) -> Iterator[str]:
    if isinstance(shape, Sphere):
        placed = np.asarray(shape.to_world, dtype=np.float64)
        yield f"ConcatTransform {_list(placed.T)}"
        yield f"Translate {_list(shape.center)[1:-1]}"
        yield f'Shape "sphere" "float radius" {shape.radius!r}'
    elif isinstance(shape, Mesh):
        corners = world_triangles(shape)
        numbers = " ".join(map(str, range(3 * len(corners))))
        yield f'Shape "trianglemesh" "integer indices" [{numbers}] "point P" {_list(corners)}'
    else:
        raise SceneError(f"pbrt's format has no word for a {type(shape).__name__}")
