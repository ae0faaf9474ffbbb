"""A mesh file (OBJ, PLY, STL) becomes a scene: one mesh, a camera that sees it, a light."""

import re
from collections import Counter
from collections.abc import Iterator
from pathlib import Path

from rayproof.cases.foreign_files import Budget
from rayproof.cases.mesh_files import read_mesh
from rayproof.cases.polygon_files import CORNERS, ply_header
from rayproof.cases.scene import Mesh, Scene, SceneError
from rayproof.reports.interchange import IMPORTERS, Imported, ImportOptions
from rayproof.reports.interchange.framing import camera_for, light_for

ALBEDO = (0.5, 0.5, 0.5)
STATEMENT = re.compile(rb"^[ \t]*([A-Za-z_]+)\b", re.MULTILINE)
NORMAL = re.compile(rb"(?:^|[\r\n])[ \t]*vn[ \t]")
COLOURED = re.compile(rb"^[ \t]*v(?:[ \t]+[^\s#]+){6}", re.MULTILINE)
OBJ = {
    "vn": "vertex normals",
    "vt": "texture coordinates",
    "mtllib": "material libraries",
    "usemtl": "materials",
    "s": "smoothing groups",
    "l": "lines",
    "p": "points",
}
KNOWN = {*OBJ, "v", "f", "o", "g"}  # the names of objects and groups have no counterpart and no effect
PLY = {"x", "y", "z", *CORNERS}


@IMPORTERS.register(".obj")
@IMPORTERS.register(".ply")
@IMPORTERS.register(".stl")
def import_mesh(path: Path, options: ImportOptions) -> Imported:
    """Return a scene with the mesh in `path`, two-sided, since such files often have inconsistent windings."""
    try:
        budget = Budget()
        vertices, faces = read_mesh(path.name, path.parent, budget)
        mesh = Mesh(albedo=ALBEDO, two_sided=True, vertices=vertices, faces=faces, file=str(path.resolve()))
    except SceneError as error:
        raise SceneError(f"{path}: {error}") from None
    up = options.up or "z"
    camera = camera_for((mesh,), options.size, up=up)
    light, dark = light_for(camera, (mesh,))
    scene = Scene(camera=camera, shapes=(mesh,), lights=(light,))
    turned = "" if options.up else f" (--up {'y' if up == 'z' else 'z'} turns it)"
    dropped = (
        *(f"{path.name}: {sentence}" for sentence in (*_left_out(path), *budget.notes[path.resolve()])),
        f"{path.name}: it says nothing of the surface that is read; it is grey (0.5), two-sided and shaded by faces",
        f"{path.name}: it has no camera and no light; one of each was made that shows it all, with {up} upward{turned}",
        *([f"{path.name}: {dark}"] if dark else []),
    )
    return Imported(scene=scene, dropped=dropped)


def has_normals(path: Path) -> bool:
    """Return whether a mesh file has vertex normals."""
    content = path.read_bytes()
    if path.suffix.lower() == ".ply":
        return any(prop.name == "nx" for element in ply_header(content)[1] for prop in element.properties)
    return path.suffix.lower() == ".obj" and NORMAL.search(content) is not None


def _left_out(path: Path) -> list[str]:
    """Return a sentence for each kind of content of a mesh file other than triangles, in its order."""
    content = path.read_bytes()
    if path.suffix.lower() == ".obj":
        content = content.replace(b"\r", b"\n")
        statements = Counter(word.decode() for word in STATEMENT.findall(content))
        coloured = COLOURED.search(content) is not None
        sentences = [f"{OBJ[word]} ({count} lines)" for word, count in statements.items() if word in OBJ]
        sentences += [f"statements {word!r} ({count} lines)" for word, count in statements.items() if word not in KNOWN]
        return [*sentences, *(["vertex colours"] if coloured else [])]
    if path.suffix.lower() == ".ply":
        return list(_of_ply(content))
    return []


def _of_ply(content: bytes) -> Iterator[str]:
    for element in ply_header(content)[1]:
        if element.name not in ("vertex", "face", "tristrips"):
            yield f"{element.count} elements {element.name!r}"
            continue
        for name in (prop.name for prop in element.properties if prop.name not in PLY):
            yield f"the property {name!r} of each {element.name}"
