"""Export of a scene in POV-Ray's scene description language (SDL), with every digit of float64.

POV-Ray applies any affine matrix to any primitive and transforms normals by the inverse transpose, also under mirrors.
Its meshes store float32 normals, so triangles are written separately, in nested unions with bounding boxes. POV-Ray's
tolerances are lengths, so a lit scene is written up to 1024 times as large, object space included: the factor is a
power of two, and M' = S M S^-1 keeps the linear part of M, so that no digit is lost. Facts about POV-Ray are those of
version 3.7: render/trace.cpp for the shadow tolerance, configbackend.h for the largest distance.
"""

from pathlib import Path

import numpy as np

from rayproof.cases.placement import world_triangles
from rayproof.cases.scene import Cube, Mesh, Plane, Scene, SceneError, Shape, Sphere, Square, Triangle
from rayproof.reports.interchange import EXPORTERS, SceneFormat
from rayproof.reports.results.files import write_text

LIT_SCALE = 10  # log2 of POV-Ray's units per metre in a scene with lights, at most; 0 in a scene without
SHADOW_TOLERANCE = 1e-3  # units; POV-Ray ignores blockers nearer to either end of a shadow ray
FARTHEST = 1e7  # units beyond which POV-Ray finds no hit
# 2 / (1 + (d / FADE)^2) is 2 FADE^2 / d^2 to (FADE / d)^2: to 1e-12 at a metre from the light, at 1024 units per metre.
FADE = 2.0**-10  # units
TRIANGLES = 16  # in an innermost union: POV-Ray tests each member of a union
# Without antialiasing POV-Ray takes one sample at the pixel's centre. It would remove the bounds of unions as useless.
HEAD = """// povray Input_File_Name={name} Output_File_Type=E Width={width} Height={height} File_Gamma=1.0 Dither=off \
Antialias=off Display=off Remove_Bounds=off Split_Unions=off
#version 3.7;
global_settings {{ assumed_gamma 1.0 adc_bailout 0 max_trace_level 1 ambient_light 0 }}
"""


SAYS = SceneFormat(
    title="POV-Ray 3.7's scene description language",
    world_normals=True,
    half=True,
    cannot_say={
        "blockers within 1e-3 units of a surface or a light": "the scene, up to 1024 times as large: within 1e-6 m",
        "hits farther than 1e7 units": "the scene; POV-Ray sees the background there",
        "an inverse square up to the light": "a falloff of 2 / (1 + (d / f)^2) with f = 1e-6 m",
    },
)


@EXPORTERS.register(".pov", says=SAYS)
def export_povray(scene: Scene, path: Path) -> tuple[str, ...]:
    """Write `scene` to `path`, whose first line is the command for rendering it; return POV-Ray's differences.

    Raises:
        OSError: the file cannot be written.

    """
    camera = scene.camera
    scale = _scale(scene)
    head = HEAD.format(name=path.name, width=camera.width, height=camera.height)
    write_text(path, "\n".join([head + _camera(scene, scale), *_objects(scene, scale), *_lights(scene, scale)]) + "\n")
    differences = []
    if scene.lights:
        distance = f"{SHADOW_TOLERANCE / scale:.1e} m"
        differences.append(f"what blocks a light within {distance} of the surface or of the light does not count")
    if (scene.clip == "none" or camera.far * scale > FARTHEST) and not _within_reach(scene, FARTHEST / scale):
        differences.append(f"POV-Ray finds no hit farther than {FARTHEST / scale:g} m along a ray")
    return tuple(differences)


def _scale(scene: Scene) -> float:
    """Return POV-Ray's units per metre; no finite shape is then beyond POV-Ray's largest distance from the eye."""
    farthest = _farthest(scene)
    most = np.floor(np.log2(FARTHEST / farthest)) if farthest else LIT_SCALE
    return float(2.0 ** np.clip(most, 0, LIT_SCALE)) if scene.lights else 1.0


def _farthest(scene: Scene) -> float:
    """Return the distance [m] from the eye to the farthest corner of a finite shape."""
    eye = np.asarray(scene.camera.eye)
    shapes = (shape for shape in scene.shapes if not isinstance(shape, Plane))
    return max((float(np.linalg.norm(_corners(shape) - eye, axis=1).max(initial=0)) for shape in shapes), default=0.0)


def _within_reach(scene: Scene, distance: float) -> bool:
    """Return whether every shape is closer to the eye than `distance` [m]; an infinite plane is not."""
    return _farthest(scene) < distance and not any(isinstance(shape, Plane) for shape in scene.shapes)


def _corners(shape: Shape) -> np.ndarray:
    """Return points (n, 3) [m] whose convex hull contains a finite shape."""
    if isinstance(shape, Triangle | Mesh):
        return world_triangles(shape).reshape(-1, 3).astype(np.float64)
    corners = np.stack(np.meshgrid([-1.0, 1.0], [-1.0, 1.0], [-1.0, 1.0]), axis=-1).reshape(-1, 3)
    local = shape.center + corners * shape.radius if isinstance(shape, Sphere) else corners / 2
    matrix = np.asarray(shape.to_world, dtype=np.float64)
    return local @ matrix[:3, :3].T + matrix[:3, 3]


def _vector(values: object) -> str:
    """Return an SDL vector with every digit of float64."""
    return "<" + ",".join(f"{value:.17g}" for value in np.ravel(np.asarray(values, dtype=np.float64)).tolist()) + ">"


def _camera(scene: Scene, scale: float) -> str:
    """Return the camera with explicit direction, right and up vectors, which leave no question of handedness."""
    camera = scene.camera
    return f"""#declare Eye = {_vector(np.multiply(camera.eye, scale))};
#declare Forward = vnormalize({_vector(np.multiply(camera.target, scale))} - Eye);
#declare Rightward = vnormalize(vcross(Forward, vnormalize({_vector(camera.up)})));
#declare Upward = vcross(Rightward, Forward);
#declare Across = Rightward * (tan(radians({camera.fovy:.17g}) / 2) * {camera.width} / {camera.height});
#declare Along = Upward * tan(radians({camera.fovy:.17g}) / 2);
camera {{ perspective location Eye direction Forward right 2 * Across up 2 * Along }}"""


def _objects(scene: Scene, scale: float) -> list[str]:
    """Return the shapes; if the scene clips, once clipped without shadows and once whole but invisible.

    Clipping concerns only camera rays, so that a clipped part still blocks light.
    """
    solids = [text for shape in scene.shapes if (text := _solid(shape, scale)) is not None]
    declared = [f"#declare Solid{number} = {text}" for number, text in enumerate(solids)]
    clip = _clip(scene, scale)
    if not clip:
        return [*declared, *(f"object {{ Solid{number} }}" for number in range(len(solids)))]
    visible = [f"object {{ Solid{number} {clip} no_shadow }}" for number in range(len(solids))]
    return [*declared, *visible, *(f"object {{ Solid{number} no_image }}" for number in range(len(solids)))]


def _clip(scene: Scene, scale: float) -> str:
    near, far = (f"{depth * scale:.17g}" for depth in (scene.camera.near, scene.camera.far))
    if scene.clip == "none":
        return ""
    if scene.clip == "shell":
        return f"clipped_by {{ sphere {{ Eye, {near} inverse }} sphere {{ Eye, {far} }} }}"
    return (
        f"clipped_by {{ plane {{ -Forward, -vdot(Forward, Eye) - {near} }} "
        f"plane {{ Forward, vdot(Forward, Eye) + {far} }} }}"
    )


def _lights(scene: Scene, scale: float) -> list[str]:
    """Return the point lights.

    POV-Ray's Lambertian reflection has no 1 / pi, so it is a factor of each light: with flux F a surface at distance d
    gets F / (4 pi d^2) cos, and its radiance is albedo / pi times that. Light without the inverse square law does not
    fade.
    """
    texts = []
    for light in scene.lights:
        color, fade = np.asarray(light.flux), ""
        if scene.shading == "inverse_square":
            color = color / (4 * np.pi**2) * scale**2 / (2 * FADE**2)
            fade = f" fade_distance {FADE:.17g} fade_power 2"
        place = _vector(np.multiply(light.position, scale))
        texts.append(f"light_source {{ {place} color rgb {_vector(color)}{fade} }}")
    return texts


def _texture(shape: Shape) -> str:
    """Return a diffuse texture; a one-sided surface is black from behind."""
    front = f"texture {{ pigment {{ rgb {_vector(shape.albedo)} }} finish {{ ambient 0 diffuse 1 }} }}"
    back = " interior_texture { pigment { rgb 0 } finish { ambient 0 diffuse 0 } }"
    return front if shape.two_sided else front + back


def _solid(shape: Shape, scale: float) -> str | None:
    """Return the shape as an SDL object, `scale` times as large, or None if it has no area."""
    if isinstance(shape, Triangle | Mesh):
        return _triangles(shape, scale)
    end = f"{_texture(shape)} {_matrix(shape, scale)} }}"
    if isinstance(shape, Sphere):
        return f"sphere {{ {_vector(np.multiply(shape.center, scale))}, {shape.radius * scale:.17g} {end}"
    if isinstance(shape, Cube):
        half = _vector([scale / 2] * 3)
        return f"box {{ -{half}, {half} {end}"
    if isinstance(shape, Square):
        corners = np.array([(-1, -1, 0), (1, -1, 0), (1, 1, 0), (-1, 1, 0)]) * (scale / 2)
        return f"polygon {{ 4, {', '.join(map(_vector, corners))} {end}"
    if isinstance(shape, Plane):
        return f"plane {{ <0,0,1>, 0 {end}"
    raise SceneError(f"POV-Ray's language has no word for a {type(shape).__name__}")


def _matrix(shape: Shape, scale: float) -> str:
    """Return `to_world` in SDL's order: the columns of the linear part, then the translation."""
    matrix = np.asarray(shape.to_world, dtype=np.float64)
    return f"matrix {_vector([*matrix[:3, :3].T.ravel(), *(matrix[:3, 3] * scale)])}"


def _triangles(shape: Triangle | Mesh, scale: float) -> str | None:
    """Return the triangles that have an area, in object space as in the world."""
    corners = world_triangles(shape).astype(np.float64)
    if isinstance(shape, Triangle):
        local = np.asarray(shape.vertices, dtype=np.float64)[np.newaxis]
    else:
        local = shape.vertices.astype(np.float64)[shape.faces]
    faces = np.flatnonzero(_have_area(corners) & _have_area(local))
    if not len(faces):
        return None
    corners *= scale
    texture = _texture(shape)
    # POV-Ray's normal is (first - second) x (third - second), against the winding: hence the order of the corners.
    texts = {
        face: f"triangle {{ {', '.join(map(_vector, corners[face, [0, 2, 1]]))} {texture} }}" for face in faces.tolist()
    }
    return _union(faces, corners, texts)


def _have_area(corners: np.ndarray) -> np.ndarray:
    """Return the mask (n,) of triangles (n, 3, 3) with an area."""
    return np.any(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]) != 0, axis=1)


def _union(faces: np.ndarray, corners: np.ndarray, texts: dict[int, str]) -> str:
    """Return triangles in nested unions with bounding boxes, halved along the longest side."""
    if len(faces) == 1:
        return texts[int(faces[0])]
    if len(faces) <= TRIANGLES:
        return f"union {{ {' '.join(texts[int(face)] for face in faces)} {_box(corners[faces])} }}"
    centers = corners[faces].mean(axis=1)
    order = np.argsort(centers[:, np.argmax(np.ptp(centers, axis=0))], kind="stable")
    lower, upper = np.array_split(faces[order], 2)
    return f"union {{ {_union(lower, corners, texts)} {_union(upper, corners, texts)} {_box(corners[faces])} }}"


def _box(corners: np.ndarray) -> str:
    """Return a bound that is wider than the corners by more than rounding, since a bound that cuts makes a hole."""
    low, high = corners.min(axis=(0, 1)), corners.max(axis=(0, 1))
    margin = 1e-3 * (high - low).max() + 1e-9 * np.abs([low, high]).max()
    return f"bounded_by {{ box {{ {_vector(low - margin)}, {_vector(high + margin)} }} }}"
