"""Answer sphere.csv, triangle.csv and box.csv in FOLDER, by python answers.py LIBRARY FOLDER, into LIBRARY-FILE.csv."""

import csv
import math
import sys
from pathlib import Path

import numpy as np


def vector(row, name, kind: type = np.float32):
    """Return three numbers of a row."""
    return np.array([row[f"{name}_{axis}"] for axis in "xyz"], dtype=float).astype(kind)


def corners(row):
    """Return a triangle's corners."""
    return np.array([vector(row, name) for name in "abc"])


def along(row, point):
    """Return t of a point by its way along the ray."""
    origin, direction = vector(row, "o", float), vector(row, "d", float)
    return float((np.asarray(point, dtype=float) - origin) @ direction / (direction @ direction))


def trimesh():
    """Return the answers of trimesh's own rays, in float64."""
    import trimesh as library
    from trimesh.ray.ray_triangle import RayMeshIntersector

    def triangle(row):
        mesh = library.Trimesh(corners(row).astype(float), [[0, 1, 2]], process=False)
        rays = vector(row, "o", float)[None], vector(row, "d", float)[None]
        points, _, _ = RayMeshIntersector(mesh).intersects_location(*rays, multiple_hits=False)
        return along(row, points[0]) if len(points) else None

    return {"triangle": triangle}


def embreex():
    """Return the answers of Embree."""
    from embreex.mesh_construction import TriangleMesh
    from embreex.rtcore_scene import EmbreeScene

    def triangle(row):
        scene = EmbreeScene(robust=True)
        TriangleMesh(scene, corners(row)[None])
        found = scene.run(vector(row, "o")[None], vector(row, "d")[None], query="INTERSECT", output=True)
        return float(found["tfar"][0]) if found["primID"][0] >= 0 else None

    return {"triangle": triangle}


def warp():
    """Return the answers of Warp on the processor."""
    import warp as library  # pyright: ignore[reportMissingImports]

    library.config.quiet = True

    @library.kernel
    def cast(
        mesh: library.uint64,
        o: library.vec3,
        d: library.vec3,
        out: library.array(dtype=float),  # pyright: ignore[reportInvalidTypeForm]
    ):
        found = library.mesh_query_ray(mesh, o, d, 3.0e38)
        out[0] = library.where(found.result, found.t, -1.0)

    def triangle(row):
        points = library.array(corners(row), dtype=library.vec3, device="cpu")
        mesh = library.Mesh(points, library.array([0, 1, 2], dtype=int, device="cpu"))
        out = library.zeros(1, dtype=float, device="cpu")
        rays = [library.vec3(*vector(row, name)) for name in "od"]
        library.launch(cast, dim=1, inputs=[mesh.id, *rays, out], device="cpu")
        t = float(out.numpy()[0])
        return t if t >= 0 else None

    return {"triangle": triangle}


def fcpw():
    """Return the answers of FCPW; its distances are lengths."""
    import fcpw as library  # pyright: ignore[reportMissingImports]

    def triangle(row):
        scene = library.scene_3D()
        scene.set_object_count(1)
        scene.set_object_vertices(np.asfortranarray(corners(row)), 0)
        scene.set_object_triangles(np.asfortranarray([[0, 1, 2]], dtype=np.int32), 0)
        scene.build(library.aggregate_type.baseline, False)
        length = float(np.linalg.norm(vector(row, "d", float)))
        found = library.interaction_3D()
        unit = np.float32(vector(row, "d", float) / length)
        return found.d / length if scene.intersect(library.ray_3D(vector(row, "o"), unit), found) else None

    return {"triangle": triangle}


def mujoco():
    """Return the answers of MuJoCo's rays, in float64."""
    import mujoco as library  # pyright: ignore[reportMissingImports]

    def cast(center, size, kind, row):
        direction = vector(row, "d", float)
        t = library.mju_rayGeom(center, np.eye(3).ravel(), size, vector(row, "o", float), direction, kind)
        return t if t >= 0 else None

    def sphere(row):
        size = np.array([float(row["radius"]), 0, 0])
        return cast(vector(row, "center", float), size, library.mjtGeom.mjGEOM_SPHERE, row)

    def box(row):
        low, high = vector(row, "min", float), vector(row, "max", float)
        return cast((low + high) / 2, (high - low) / 2, library.mjtGeom.mjGEOM_BOX, row)

    return {"sphere": sphere, "box": box}


def mitsuba():
    """Return the answers of Mitsuba's scalar variant."""
    import mitsuba as library

    library.set_variant("scalar_rgb")

    def cast(shape, row):
        ray = library.Ray3f(library.Point3f(vector(row, "o")), library.Vector3f(vector(row, "d")))
        found = library.load_dict({"type": "scene", "shape": shape}).ray_intersect_preliminary(ray)
        return float(found.t) if found.is_valid() else None

    def sphere(row):
        center = [float(x) for x in vector(row, "center")]
        return cast({"type": "sphere", "center": center, "radius": float(row["radius"])}, row)

    def triangle(row):
        mesh = library.Mesh("triangle", 3, 1)
        values = library.traverse(mesh)
        values["vertex_positions"] = corners(row).ravel()
        values["faces"] = [0, 1, 2]
        values.update()
        return cast(mesh, row)

    return {"sphere": sphere, "triangle": triangle}


if __name__ == "__main__":
    library, folder = sys.argv[1], Path(sys.argv[2])
    for file, answer in globals()[library]().items():
        lines = [f"# name {library}", "# inside exit", "id,hit,t"]
        with (folder / f"{file}.csv").open(newline="") as rows:
            for row in csv.DictReader(rows):
                t = math.nan if row["length"] == "0" else answer(row)  # each of them asks for a direction
                cells = ("0", "") if t is None else ("skip", "") if math.isnan(t) else ("1", f"{t:.17g}")
                lines.append(",".join((row["id"], *cells)))
        (folder / f"{library}-{file}.csv").write_text("\n".join(lines) + "\n")
