"""One case as scripts: its record of results.json, and its pixels, each loaded when it is looked at."""

import json
from pathlib import Path
from typing import Any

from rayproof.cases.stages import Stage, exr_channels
from rayproof.reports.judge.tolerance.edge_mask import NAMES
from rayproof.reports.publish.page.cleaning import clean_pixels, clean_view
from rayproof.reports.publish.scene3d.pictures import picture_path, view_path
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
    if any(not inside(folder, path) for path in case.get("artifacts", {})):
        case = {**case, "pixels": None, "renders": [{**render, "image": None} for render in case.get("renders", [])]}
        command = f"rayproof report DIR --fetch {case['name']} --artifacts URL"
        notes.append(f"Its images are in the run's store; `{command}` brings them.")
    pixels, view = case.get("pixels"), view_of(folder, case)
    if isinstance(pixels, str) and (why := clean_pixels(folder, pixels)) is not None:
        pixels = None
        notes.append(why)
    if view is not None and (why := clean_view(folder, view)) is not None:
        view = None
        notes.append(why)
    if pixels is None:
        renders, unread = kept_images(folder, case)
        notes += unread
        images = path.with_name(f"{path.stem}.pixels.js")
        pixels = images.relative_to(folder).as_posix() if renders else None
        if pixels is not None:
            written.append(write_pixels(images, pixels, renders, camera_of(folder, case)))
    elsewhere = bool(case.get("artifacts"))
    if pixels is None and not elsewhere and not keeps_images(case) and case["verdict"] == Outcome.PASS:
        notes.append("It passed, and this run keeps no images of such a case; its command makes them again.")
    lights = case.get("lights")
    lights = lights if isinstance(lights, int) and 0 <= lights < 1000 else 0
    record = {
        **case,
        "pixels": pixels,
        "picture": picture_of(folder, case),
        "view": view,
        "call": call_of(folder, case),
        "notes": [f"{note.get('reference')}: {note.get('note')}" for note in case.get("notes", [])] + notes,
        "channels": {stage.value: [_short(name) for name in exr_channels(stage, lights=lights)] for stage in Stage},
        "mask_names": {str(bit): name for bit, name in NAMES.items()},
    }
    text = pack_json(compact_case(record))
    return [write_text(path, script(path.relative_to(folder).as_posix(), text)), *written]


def picture_of(folder: Path, case: CaseRecord) -> str | None:
    """Return the case's PyVista picture relative to `folder`, if it was drawn."""
    picture = case.get("picture") or picture_path(case)
    return picture if picture and inside(folder, picture) else None


def thumbnail_of(folder: Path, case: CaseRecord) -> str | None:
    """Return the case's small picture of what differs, relative to `folder`, if it was drawn."""
    picture = case.get("thumbnail")
    return picture if picture and inside(folder, picture) else None


def view_of(folder: Path, case: CaseRecord) -> str | None:
    """Return the case's 3-D view relative to `folder`, if it was made."""
    view = case.get("view") or view_path(case)
    return view if view and inside(folder, view) else None


def call_of(folder: Path, case: CaseRecord) -> str | None:
    """Return where the call of a program under test is kept, relative to `folder`, if it is."""
    call = case.get("call")
    return call if isinstance(call, str) and inside(folder, call) and (folder / call).is_file() else None


def camera_of(folder: Path, case: CaseRecord) -> dict[str, Any] | None:
    """Return the scene file's camera, or None where it cannot be read: it only helps to store less."""
    scene = case.get("scene")
    if not isinstance(scene, str) or not inside(folder, scene):
        return None
    try:
        camera = json.loads((folder / scene).read_text(encoding="utf-8"))["camera"]
    except (OSError, ValueError, KeyError, TypeError):
        return None
    return camera if isinstance(camera, dict) else None


def _short(channel: str) -> str:
    """Return the last part of a channel's name, or the first where the last says nothing."""
    first, _, last = channel.rpartition(".")
    return first if last == "V" else last
