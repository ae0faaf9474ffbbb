"""What is fuzzed: everything that reads what somebody else wrote, the seeds of it, and how it may refuse."""

import base64
import json
import linecache
import struct
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

import numpy as np

from rayproof.cases.scene import Camera, PointLight, Scene, SceneError, Sphere
from rayproof.cases.scene_json import load_scene, scene_to_json
from rayproof.cases.stages import Stage
from rayproof.reports.results.case_records import CaseRecord
from rayproof.reports.results.files import SCHEMA
from rayproof.reports.results.outcomes import LEDGER
from rayproof.reports.results.records import RunRecord


@dataclass(frozen=True, kw_only=True)
class Target:
    """A reader of files."""

    name: str  # of the file to write
    seeds: tuple[bytes, ...]
    read: Callable[[Path], Any]
    refusals: tuple[type[Exception], ...]
    memory: int = 4 * 2**30  # bytes of address space beyond what the process has when it begins


SCENE = Scene(
    camera=Camera(eye=(0, 0, 4), target=(0, 0, 0), up=(0, 1, 0), fovy=40, width=4, height=3, near=1, far=9),
    shapes=(Sphere(albedo=(0.5, 0.5, 0.5)),),
    lights=(PointLight(position=(1, 2, 3), flux=(1, 1, 1)),),
)
CORNERS = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], dtype="<f4")
FACES = np.array([[0, 1, 2], [0, 1, 3], [1, 2, 3]], dtype="<i4")
OBJ = b"# a mesh\nv 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\nvt 0 0\nusemtl red\nf 1/1/1 2/1/1 3/1/1\nf -3 -2 -1\n"
PLY_HEAD = (
    b"ply\nformat %s 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
    b"element face 3\nproperty list uchar int vertex_indices\nend_header\n"
)
XML = b"""<scene version="3.0.0"><default name="spp" value="4"/><default name="two" value="$spp$spp"/>
<sensor type="perspective"><float name="fov" value="$two"/>
<transform name="to_world"><lookat origin="0,0,5" target="0,0,0" up="0,1,0"/></transform>
<film type="hdrfilm"><integer name="width" value="40"/><integer name="height" value="20"/></film></sensor>
<bsdf type="twosided" id="m"><bsdf type="diffuse"><rgb name="reflectance" value="0.1, 0.2, 0.3"/></bsdf></bsdf>
<shape type="shapegroup" id="g"><shape type="cube"><ref id="m"/></shape></shape>
<shape type="instance"><ref id="g"/><transform name="to_world"><rotate x="1" angle="30"/></transform></shape>
<shape type="sphere"><point name="center" x="1" y="2" z="3"/><float name="radius" value="2"/></shape>
<emitter type="point"><point name="position" x="1" y="2" z="3"/><rgb name="intensity" value="2, 3, 4"/></emitter>
</scene>
"""


def _imported(path: Path) -> Any:
    from rayproof.reports.interchange import import_scene

    return import_scene(path)


def _ply(kind: bytes) -> bytes:
    if kind == b"ascii":
        rows = [" ".join(map(str, row)) for row in CORNERS.tolist()]
        rows += [" ".join(map(str, (3, *row))) for row in FACES.tolist()]
        return PLY_HEAD % kind + "\n".join(rows).encode() + b"\n"
    return PLY_HEAD % kind + CORNERS.tobytes() + b"".join(b"\x03" + row.tobytes() for row in FACES)


def _gltf(*, uri: str | None) -> bytes:
    buffer = {"byteLength": 84} | ({"uri": uri} if uri is not None else {})
    lights = {"KHR_lights_punctual": {"lights": [{"type": "point", "intensity": 5.0, "color": [1, 0.5, 0.25]}]}}
    document = {
        "asset": {"version": "2.0"},
        "extensions": lights,
        "scene": 0,
        "scenes": [{"nodes": [0, 2]}],
        "nodes": [
            {"mesh": 0, "scale": [2, 3, 1], "rotation": [0, 0, 0, 1], "children": [1]},
            {"camera": 0, "translation": [0, 0, 4]},
            {"extensions": {"KHR_lights_punctual": {"light": 0}}, "translation": [0, 0, 3]},
        ],
        "cameras": [
            {"type": "perspective", "perspective": {"yfov": 0.8, "znear": 0.5, "zfar": 20, "aspectRatio": 1.5}}
        ],
        "meshes": [{"name": "m", "primitives": [{"attributes": {"POSITION": 0}, "indices": 1, "material": 0}]}],
        "materials": [{"pbrMetallicRoughness": {"baseColorFactor": [0.1, 0.2, 0.3, 1], "metallicFactor": 0}}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5125, "count": 9, "type": "SCALAR"},
        ],
        "bufferViews": [{"buffer": 0, "byteLength": 48}, {"buffer": 0, "byteOffset": 48, "byteLength": 36}],
        "buffers": [buffer],
    }
    return json.dumps(document).encode()


def glb(text: bytes, data: bytes) -> bytes:
    """Return a GLB of two chunks."""
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<2I", len(text), 0x4E4F534A) + text + struct.pack("<2I", len(data), 0x004E4942) + data
    return struct.pack("<3I", 0x46546C67, 2, 12 + len(chunks)) + chunks


def scene() -> Target:
    """Return scene files."""
    whole = scene_to_json(SCENE)
    mesh = {"type": "mesh", "albedo": [0.5] * 3, "vertices": CORNERS.tolist(), "faces": FACES.tolist()}
    more = whole | {"shapes": [mesh, {"type": "cube", "albedo": [1, 1, 1], "to_world": np.eye(4).tolist()}]}
    seeds = tuple(json.dumps(one).encode() for one in (whole, more))
    return Target(name="scene.json", seeds=seeds, read=load_scene, refusals=(SceneError,))


def obj() -> Target:
    """Return OBJ meshes."""
    return Target(name="mesh.obj", seeds=(OBJ,), read=_imported, refusals=(SceneError,))


def ply() -> Target:
    """Return PLY meshes, text and binary."""
    seeds = (_ply(b"ascii"), _ply(b"binary_little_endian"))
    return Target(name="mesh.ply", seeds=seeds, read=_imported, refusals=(SceneError,))


def _polygons(kind: str) -> Callable[[Path], Any]:
    """Return the project's reader of OBJ, PLY or STL; a refusal must be one that it words itself."""
    from rayproof.cases.mesh_files import READERS

    def read(path: Path) -> Any:
        try:
            return READERS[kind](path.read_bytes())
        except ValueError as error:
            at = error.__traceback__
            while at is not None and at.tb_next is not None:
                at = at.tb_next
            if at is None or not linecache.getline(at.tb_frame.f_code.co_filename, at.tb_lineno).strip().startswith(
                "raise"
            ):
                raise RuntimeError(f"a library refused it: {error}") from error
            raise

    return read


def obj_reader() -> Target:
    """Return our reader of OBJ files alone: polygons, holes, negative indices, continued lines."""
    concave = (
        b"v 0 0 0\nv 2 0 0\nv 2 1 0\nv 1 1 0\nv 1 2 0\nv 0 2 0\nf -6 -5 -4 -3 \\\n -2 -1\nf 1//1 2//1 3//1\nl 1 2\n"
    )
    window = b"v 0 0\t0\rv 3 0 0\rv 3 3 0\rv 0 3 0\rv 1 1 0\rv 1 2 0\rv 2 2 0\rv 2 1 0\rf 1 2 3 4 1 5 6 7 8 5 # hole\r"
    return Target(
        name="mesh.obj", seeds=(OBJ, concave, window), read=_polygons("obj"), refusals=(ValueError,), memory=2**30
    )


def ply_reader() -> Target:
    """Return our reader of PLY files alone: text, both binary layouts, faces of several lengths, strips."""
    head = PLY_HEAD.replace(b"face 3", b"face 2").replace(b"uchar int vertex_indices", b"uchar ushort vertex_index")
    mixed = head % b"binary_big_endian" + CORNERS.astype(">f4").tobytes()
    mixed += struct.pack(">B3HB4H", 3, 0, 1, 2, 4, 0, 1, 3, 2)
    strips = _ply(b"ascii").replace(b"face 3", b"tristrips 1").replace(b"uchar", b"int").split(b"end_header\n")[0]
    strips += b"comment x\nend_header\n" + b"0 0 0\n1 0 0\n1 1 0\n0 1 0\n7 0 1 3 2 -1 0 1\n"
    seeds = (_ply(b"ascii"), _ply(b"binary_little_endian"), mixed, strips)
    return Target(name="mesh.ply", seeds=seeds, read=_polygons("ply"), refusals=(ValueError,), memory=2**30)


def lecture() -> Target:
    """Return scenes of the lecture's course."""
    transform = {"translate": [0, 1, 0], "rotate": [10, 20, 30], "scale": [1, 2, 1]}
    whole = {
        "camera": {"target": [0, 1, 0], "eye": [0, 3, 9], "worldUp": [0, 1, 0], "fov": 40, "width": 4, "height": 3},
        "primitives": [
            {"shape": "Sphere", "name": "a", "material": "m", "transform": transform},
            {"shape": "Mesh", "name": "b", "filename": "b.obj", "material": "m"},
        ],
        "lights": [{"type": "PointLight", "lightColor": [1, 2, 3], "intensity": 4, "transform": transform}],
        "materials": [{"type": "MatteMaterial", "name": "m", "Kd": [0.1, 0.2, 0.3], "sigma": 0}],
    }
    seeds = tuple(
        json.dumps(
            {"frames": [{"frameNumber": 0, "scene": whole | {"primitives": whole["primitives"][:count]}}]}
        ).encode()
        for count in (1, 2)
    )
    return Target(name="lecture.json", seeds=seeds, read=_imported, refusals=(SceneError,))


def _stl() -> tuple[bytes, bytes]:
    """Return an STL file in binary, and one in text."""
    corners = CORNERS[FACES]
    facets = b"".join(bytes(12) + face.tobytes() + b"\0\0" for face in corners)
    points = "\n".join("vertex {} {} {}".format(*point) for point in corners[0].tolist())
    text = f"solid a\nfacet normal 0 0 1\nouter loop\n{points}\nendloop\nendfacet\nendsolid a\n".encode()
    return bytes(80) + struct.pack("<I", len(corners)) + facets, text


def stl() -> Target:
    """Return STL meshes, text and binary."""
    return Target(name="mesh.stl", seeds=_stl(), read=_imported, refusals=(SceneError,))


def stl_reader() -> Target:
    """Return the reader of STL files without the import: text, with several solids, and binary."""
    binary, text = _stl()
    seeds = (binary, text, text.replace(b"\n", b"\r\n") + text.upper())
    return Target(name="mesh.stl", seeds=seeds, read=_polygons("stl"), refusals=(ValueError,), memory=2**30)


def gltf() -> Target:
    """Return the JSON form of glTF."""
    data = base64.b64encode(CORNERS.tobytes() + FACES.tobytes()).decode()
    whole = _gltf(uri=f"data:application/octet-stream;base64,{data}")
    return Target(name="scene.gltf", seeds=(whole,), read=_imported, refusals=(SceneError,))


def glb_scene() -> Target:
    """Return the binary form of glTF, imported."""
    seeds = (glb(_gltf(uri=None), CORNERS.tobytes() + FACES.tobytes()),)
    return Target(name="scene.glb", seeds=seeds, read=_imported, refusals=(SceneError,))


def glb_mesh() -> Target:
    """Return GLB files as meshes of scene files."""
    from rayproof.cases.mesh_files import read_mesh

    seeds = (glb(_gltf(uri=None), CORNERS.tobytes() + FACES.tobytes()),)
    return Target(
        name="mesh.glb", seeds=seeds, read=lambda path: read_mesh(path.name, path.parent), refusals=(SceneError,)
    )


def mitsuba() -> Target:
    """Return Mitsuba's XML."""
    return Target(name="scene.xml", seeds=(XML,), read=_imported, refusals=(SceneError,))


def image() -> Target:
    """Return images of programs under test: OpenEXR and PFM."""
    import tempfile

    from rayproof.reports.results.images import write_answers
    from rayproof.reports.subjects.image_files import take_back

    pixels = np.linspace(0, 1, 36).reshape(3, 4, 3)
    with tempfile.TemporaryDirectory() as folder:
        exr = write_answers(Path(folder, "a.exr"), {Stage.RADIANCE: pixels}, 1).read_bytes()
    pfm = b"PF\n4 3\n-1.0\n" + pixels.astype("<f4").tobytes()
    return Target(
        name="image.exr",
        seeds=(exr, pfm),
        read=lambda path: take_back(path, SCENE, most=2**26),
        refusals=(ValueError,),
    )


def capabilities() -> Target:
    """Return a program's answer to --capabilities."""
    from rayproof.reports.subjects.protocol import capabilities_from

    whole = {
        "protocol": 1,
        "name": "a",
        "version": "1",
        "precision": "float32",
        "stages": ["distance", "radiance"],
        "shapes": ["sphere", "mesh"],
        "shading": ["simplified"],
        "clip": ["depth"],
        "two_sided": False,
        "affine": True,
        "triangulated": True,
        "epsilons": {"shadow": 1e-4, "ray": 0},
    }
    return Target(
        name="said.json",
        seeds=(json.dumps(whole).encode(),),
        read=lambda path: capabilities_from(path.read_bytes().decode(errors="replace")),
        refusals=(ValueError,),
    )


def _results() -> RunRecord:
    from rayproof.reports.results.outcomes import Outcome

    measured = {
        "worst_ratio": 2.0,
        "worst_error": 1e-3,
        "limit": 5e-4,
        "pixel": [1, 2],
        "ours": [1.0],
        "theirs": [2.0],
        "interior": 9,
    }
    check = {
        "verdict": "fail",
        "ratio": 2.0,
        "reason": "",
        "because": 0,
        "end_to_end": measured,
        "continued": measured,
        "evidence": {"with": {"radiance": "normal"}, "against": {}},
    }
    case = {
        "name": "a/b",
        "planned": 1,
        "ran": {"float32": ["NRM-1"]},
        "family": "a",
        "verdict": "fail",
        "stage": "normal",
        "item": "NRM-1",
        "reason": "why",
        "seconds": 1.5,
        "judge_seconds": 0.5,
        "stresses": "It.",
        "covers": ["NRM-1"],
        "width": 4,
        "height": 3,
        "lights": 1,
        "shapes": ["sphere"],
        "checks": [{"configuration": "float32", "reference": "analytic", "stages": {"normal": check}}],
        "pixels": None,
        "picture": None,
        "scene": "scenes/a/b.json",
        "renders": [
            {"renderer": "tracer-float32", "configuration": "float32", "seconds": 1, "image": None, "error": None}
        ],
        "unsupported": [{"reference": "radiance", "stage": "ray", "why": "It cannot."}],
        "expectations": [],
        "notes": [{"reference": "radiance", "note": "a disc"}],
        "settings": {"radiance": {"a": "b"}},
        "reproduce": "rayproof run a/b",
        "masks": {"configuration": "float32", "height": 3, "width": 4, "data": ""},
        "adjudication": {
            "normal": {
                "baseline": "analytic",
                "renderers": ["a", "b"],
                "ratio": [[None, 1], [1, None]],
                "differing": [[None, 1], [1, None]],
                "alone": None,
                "why": "All.",
            }
        },
    }
    ledger = dict.fromkeys(LEDGER, 0) | {"planned": 1, Outcome.FAIL.value: 1}
    results: Any = {
        "schema": SCHEMA,
        "rayproof": "0.1",
        "command": "rayproof run",
        "started": "2026-01-02T03:04:05+00:00",
        "seconds": 2.0,
        "verdict": "fail",
        "finished": True,
        "faults": [],
        "environment": {"python": "3"},
        "subject": "tracer",
        "configurations": ["float32"],
        "references": {"analytic": {"version": "1", "precision": "float64", "independent": True}},
        "absent": {"pov": "why"},
        "summary": ledger,
        "checks": ledger,
        "coverage": {"NRM-1": 1},
        "derivations": ["by gamma"],
        "coverage_detail": {
            "NRM-1": {"cases": 1, "failed": 1, "worst_ratio": 2.0, "worst_check": "a", "references": ["analytic"]}
        },
        "findings": [],
        "review": [{"check": "a/b", "ratio": 0.9, "why": "above"}],
        "cases": [case, case | {"name": "a/c"}],
        "history": {
            "file": "h",
            "run": 1,
            "worse": [],
            "cases": {"a/b": [[1, "c0ffee", "fail", 2.0, 1.5]]},
        },
    }
    return results


def _run() -> RunRecord:
    """Return the same as it is read."""
    from rayproof.reports.results.compact import expand

    expand(read := _results())
    return read


def results() -> Target:
    """Return a results folder, published again."""
    from rayproof.reports.publish import publish_all
    from rayproof.reports.results.compact import TABLE, compact
    from rayproof.reports.results.document import ResultsError, load_results

    def read(path: Path) -> Any:
        load_results(path.parent)
        return publish_all(path.parent)

    places: dict[str, int] = {}
    whole = _results()
    terse = whole | {"cases": [compact(case, places) for case in _run()["cases"]], TABLE: list(places)}
    seeds = (json.dumps(whole).encode(), json.dumps(terse).encode())
    return Target(name="results.json", seeds=seeds, read=read, refusals=(ResultsError,))


def journal() -> Target:
    """Return a journal that a run goes on with."""
    import tempfile

    from rayproof.reports.results.case_table import NAME
    from rayproof.reports.run.workload import Journal

    with tempfile.TemporaryDirectory() as folder:
        with Journal(Path(folder), resume=False) as written:
            for number in range(3):
                written.append(f"key{number}", {"name": f"a/{number}", "family": "a", "verdict": "pass", "checks": []})
        seed = Path(folder, NAME).read_bytes()

    def read(path: Path) -> Any:
        with Journal(path.parent, resume=True) as taken:
            return [taken.finished(f"key{number}") for number in range(3)]

    return Target(name=NAME, seeds=(seed,), read=read, refusals=(ValueError,))


def table() -> Target:
    """Return a results.sqlite that is published."""
    import tempfile

    from rayproof.reports.results.case_table import NAME, CaseTable
    from rayproof.reports.results.document import ResultsError, load_results

    ledger = dict.fromkeys(LEDGER, 0)
    document = {"schema": SCHEMA, "summary": ledger, "checks": ledger, "coverage": {}}
    with tempfile.TemporaryDirectory() as folder:
        written = CaseTable(Path(folder, NAME))
        for number in range(3):
            case = {"name": f"a/{number}", "family": "a", "verdict": "pass", "checks": [], "stage": "ray"}
            written.keep(f"key{number}", cast("CaseRecord", case))
        written.arrange(f"key{number}" for number in range(3))
        written.put_document(json.dumps(document))
        written.close()
        seed = Path(folder, NAME).read_bytes()

    def read(path: Path) -> Any:
        try:
            results = load_results(path.parent)
            return [dict(case) for case in results["cases"]]
        except OSError as error:
            raise ValueError(str(error)) from error  # a page that says that the disk is at fault

    return Target(name=NAME, seeds=(seed,), read=read, refusals=(ResultsError, ValueError))


def _part() -> tuple[RunRecord, bytes]:
    """Return the document of a part of a run, and its results.sqlite."""
    import tempfile

    from rayproof.reports.results.case_table import NAME, CaseTable

    document = _results()
    document["shard"] = {
        "number": 1,
        "of": 2,
        "planned": 4,
        "names": "n",
        "configurations": ["float32"],
        "code": "c",
        "plan": "p",
        "subject": "s",
        "demands": "d",
        "out": "report",
        "require": ["analytic"],
        "diagnose": True,
    }
    with tempfile.TemporaryDirectory() as folder:
        written = CaseTable(Path(folder, NAME))
        for place, case in enumerate(_run()["cases"]):
            written.keep(f"key{place}", {**case, "family": "file"}, place=2 * place)
        written.put_document(json.dumps({**document, "cases": []}))
        written.close()
        return document, Path(folder, NAME).read_bytes()


def _merged(folder: Path) -> Any:
    from rayproof.reports.results.document import save_results
    from rayproof.reports.run.shards import load_shards, merge

    shards = load_shards([folder])
    (folder / "all").mkdir()
    document, _ = merge(shards, folder / "all", tracer=True)
    return save_results(folder / "all", document)


def part() -> Target:
    """Return the document of a part of a run, merged."""
    from rayproof.reports.results.case_table import NAME
    from rayproof.reports.results.document import ResultsError

    document, table = _part()

    def read(path: Path) -> Any:
        (path.parent / NAME).write_bytes(table)
        return _merged(path.parent)

    return Target(name="results.json", seeds=(json.dumps(document).encode(),), read=read, refusals=(ResultsError,))


def part_table() -> Target:
    """Return the results.sqlite of a part of a run, merged."""
    from rayproof.reports.results.case_table import NAME
    from rayproof.reports.results.document import ResultsError

    def read(path: Path) -> Any:
        try:
            return _merged(path.parent)
        except OSError as error:
            raise ResultsError(str(error)) from error  # a page that says that the disk is at fault

    return Target(name=NAME, seeds=(_part()[1],), read=read, refusals=(ResultsError,))


def history() -> Target:
    """Return a history file, shown."""
    import tempfile

    from rayproof.reports.history.database import HistoryError, append, opened, read_series, worse

    with tempfile.TemporaryDirectory() as folder:
        append(Path(folder, "h"), _run(), "r1")
        seed = Path(folder, "h").read_bytes()

    def read(path: Path) -> Any:
        with opened(path) as connection:
            return worse(read_series(connection, "tracer"), 1)

    return Target(name="history.sqlite", seeds=(seed,), read=read, refusals=(HistoryError,))


def cache() -> Target:
    """Return an entry of a cache."""
    from rayproof.reports.run.cache_store import DamagedEntryError, about, decode, encode

    seed = encode({"kind": "a"}, {"x": CORNERS, "y": FACES}, question="q")

    def read(path: Path) -> Any:
        # What a listing reads of an entry, and what a run does once it has found the signature good.
        about(path.read_bytes())
        return decode(path.read_bytes(), question="q")

    return Target(name="entry", seeds=(seed,), read=read, refusals=(DamagedEntryError,))


TARGETS: dict[str, Callable[[], Target]] = {
    "scene": scene,
    "obj": obj,
    "ply": ply,
    "obj reader": obj_reader,
    "ply reader": ply_reader,
    "stl reader": stl_reader,
    "lecture": lecture,
    "stl": stl,
    "gltf": gltf,
    "glb": glb_scene,
    "glb mesh": glb_mesh,
    "mitsuba": mitsuba,
    "image": image,
    "capabilities": capabilities,
    "results": results,
    "journal": journal,
    "table": table,
    "part": part,
    "part table": part_table,
    "history": history,
    "cache": cache,
}
