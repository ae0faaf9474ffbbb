"""OBJ, PLY and STL: the triangles as one mesh, with a camera that sees all of it and a light behind the shoulder."""

from pathlib import Path

from rayproof.cases.mesh_file import read_mesh
from rayproof.cases.scene import Mesh, Scene, SceneError
from rayproof.reports.interchange import IMPORTERS, Imported, Size
from rayproof.reports.interchange.framing import camera_for, light_for

ALBEDO = (0.5, 0.5, 0.5)


@IMPORTERS.register(".obj")
@IMPORTERS.register(".ply")
@IMPORTERS.register(".stl")
def import_mesh(path: Path, size: Size) -> Imported:
    """Return a scene with the mesh in `path`, two-sided, since such files often have their windings mixed up."""
    try:
        vertices, faces = read_mesh(path.name, path.parent)
        mesh = Mesh(albedo=ALBEDO, two_sided=True, vertices=vertices, faces=faces)
    except SceneError as error:
        raise SceneError(f"{path}: {error}") from None
    camera = camera_for((mesh,), size)
    scene = Scene(camera=camera, shapes=(mesh,), lights=(light_for(camera),))
    dropped = (
        f"{path.name}: materials, textures, vertex normals; the mesh is grey (0.5), two-sided and shaded by faces",
        f"{path.name}: it has no camera and no light; one of each was made that shows the whole mesh",
    )
    return Imported(scene=scene, dropped=dropped)
