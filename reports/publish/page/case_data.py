"""One case as scripts: its record of results.json, and its pixels, each loaded when it is looked at."""

import json
from pathlib import Path
from typing import Any, TypedDict

import numpy as np

from rayproof.cases.scene_json import pack, unpack
from rayproof.cases.stages import Stage, exr_channels
from rayproof.reports.judge.edge_classes import NAMES
from rayproof.reports.publish.page.cleaning import clean_pixels
from rayproof.reports.publish.scene3d.parts import look
from rayproof.reports.publish.scene3d.stills import compared, picture_path
from rayproof.reports.publish.scene3d.surfaces import thinned
from rayproof.reports.results.atomic import write_text
from rayproof.reports.results.compact import compact_case
from rayproof.reports.results.float_codec import pack_json
from rayproof.reports.results.image_script import script, write_pixels
from rayproof.reports.results.images import inside, keeps_images, kept_images
from rayproof.reports.results.outcomes import Outcome
from rayproof.reports.results.records import CaseRecord


def write_case_data(folder: Path, path: Path, case: CaseRecord) -> list[Path]:
    """Write the script that hands `case` to the page and, where the run did not, one with its pixels; return paths."""
    written, notes = [], []
    pixels, scene = case.get("pixels"), scene_of(folder, case)
    if isinstance(pixels, str) and (why := clean_pixels(folder, pixels)) is not None:
        pixels = None
        notes.append(why)
    if pixels is None:
        renders, unread = kept_images(folder, case)
        notes += unread
        images = path.with_name(f"{path.stem}.pixels.js")
        pixels = images.relative_to(folder).as_posix() if renders else None
        if pixels is not None:
            written.append(write_pixels(images, pixels, renders, scene))
    if pixels is None and not keeps_images(case) and case["verdict"] == Outcome.PASS:
        notes.append("It passed, and this run keeps no images of such a case; its command makes them again.")
    if pixels is not None and pixels == case.get("pixels") and case["verdict"] == Outcome.PASS:
        command = f"`{case['reproduce']} --keep-images all`" if case.get("reproduce") else "--keep-images all"
        notes.append(f"Of a case that passed a run keeps the images of two renderers; {command} keeps everybody's.")
    lights = case.get("lights")
    lights = lights if isinstance(lights, int) and 0 <= lights < 1000 else 0
    record = {
        **case,
        "pixels": pixels,
        "picture": picture_of(folder, case),
        "view": None if scene is None else view_of(scene, case),
        "call": call_of(folder, case),
        "small": small_of(folder, case),
        "notes": [f"{note.get('reference')}: {note.get('note')}" for note in case.get("notes", [])] + notes,
        "channels": {stage.value: [_short(name) for name in exr_channels(stage, lights=lights)] for stage in Stage},
        "mask_names": {str(bit): name for bit, name in NAMES.items()},
    }
    text = pack_json(compact_case(record))
    return [write_text(path, script(path.relative_to(folder).as_posix(), text)), *written]


def picture_of(folder: Path, case: CaseRecord) -> str | None:
    """Return the case's still relative to `folder`, if it was drawn."""
    picture = case.get("picture") or picture_path(case)
    return picture if picture and inside(folder, picture) else None


def thumbnail_of(folder: Path, case: CaseRecord) -> str | None:
    """Return the case's small picture of what differs, relative to `folder`, if it was drawn."""
    picture = case.get("thumbnail")
    return picture if picture and inside(folder, picture) else None


def has_view(folder: Path, case: CaseRecord) -> bool:
    """Return whether the page can show a case in 3-D, which it makes of the scene file and the images."""
    scene = case.get("scene")
    return isinstance(scene, str) and inside(folder, scene)


class ViewData(TypedDict):
    """What the page makes a case's 3-D view of, beside the images."""

    scene: dict[str, Any]  # as docs/scene.md describes it
    ours: str | None  # whose answers are shown
    theirs: str | None
    stage: str | None  # that is blamed


def view_of(scene: dict[str, Any], case: CaseRecord) -> ViewData | None:
    """Return what the page makes the 3-D view of a case of, or None where its meshes are none."""
    ours, theirs = compared(case)
    try:
        shapes = [_drawn(shape) if shape.get("type") == "mesh" else shape for shape in scene["shapes"]]
    except (ValueError, TypeError, LookupError, OverflowError):  # the scene file of a stranger's folder
        return None
    return {"scene": {**scene, "shapes": shapes}, "ours": ours, "theirs": theirs, "stage": case.get("stage")}


def _drawn(mesh: dict[str, Any]) -> dict[str, Any]:
    """Return a mesh as it is drawn: thinned where it has very many triangles, and packed."""
    vertices, faces = mesh["vertices"], mesh["faces"]
    with np.errstate(over="ignore"):  # infinite is refused below
        vertices = unpack(vertices, "<f4") if isinstance(vertices, str) else np.asarray(vertices, np.float32)
        faces = unpack(faces, "<i4") if isinstance(faces, str) else np.asarray(faces, np.int64)
    if vertices.shape != (len(vertices), 3) or faces.shape != (len(faces), 3) or not np.isfinite(vertices).all():
        raise ValueError("a mesh has rows of three numbers")
    if len(faces) > look().triangles:
        vertices = thinned(vertices[faces], look().triangles).reshape(-1, 3)
        faces = np.arange(len(vertices)).reshape(-1, 3)
    return {**mesh, "vertices": pack(vertices), "faces": pack(faces)}


def small_of(folder: Path, case: CaseRecord) -> str | None:
    """Return where `rayproof shrink` put the smallest scene of a case, relative to `folder`, if it did."""
    place = str(case.get("scene") or "").removeprefix("scenes/").removesuffix(".json")
    files = ("issue.md", "picture.png", "scene.json")
    return f"small/{place}" if place and all(inside(folder, f"small/{place}/{file}") for file in files) else None


def call_of(folder: Path, case: CaseRecord) -> str | None:
    """Return where the call of a program under test is kept, relative to `folder`, if it is."""
    call = case.get("call")
    return call if isinstance(call, str) and inside(folder, call) and (folder / call).is_file() else None


def scene_of(folder: Path, case: CaseRecord) -> dict[str, Any] | None:
    """Return what a case's scene file says, or None where it cannot be read or holds no scene."""
    if not has_view(folder, case):
        return None
    try:
        scene = json.loads((folder / str(case["scene"])).read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return None
    known = isinstance(scene, dict) and isinstance(scene.get("camera"), dict) and isinstance(scene.get("shapes"), list)
    return scene if known and all(isinstance(shape, dict) for shape in scene["shapes"]) else None


def _short(channel: str) -> str:
    """Return the last part of a channel's name, or the first where the last says nothing."""
    first, _, last = channel.rpartition(".")
    return first if last == "V" else last
