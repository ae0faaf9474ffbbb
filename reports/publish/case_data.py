"""One case as a script: its record of results.json and the floats of its EXR images, loaded when it is opened."""

import json
from pathlib import Path
from typing import Any

import numpy as np

from cases.stages import Stage, exr_channels
from reports.publish.atomic import write_text
from reports.publish.encoding import encode, pack_text
from reports.publish.exr import read_answers
from reports.publish.pictures import inside, picture_path
from reports.publish.results import plain

# The renderer against which the others are stored: the one they should all be close to.
BASE = "analytic"


def write_case_data(folder: Path, path: Path, number: int, case: dict[str, Any]) -> Path:
    """Write the script that hands case `number` to the page, and return its path."""
    images, notes = _images(folder, case)
    base = BASE if BASE in images else next(iter(images), None)
    lights = max(
        (image[Stage.VISIBILITY].shape[-1] for image in images.values() if Stage.VISIBILITY in image), default=0
    )
    record = {
        **case,
        "picture": picture_of(folder, case),
        "notes": [f"{note.get('reference')}: {note.get('note')}" for note in case.get("notes", [])] + notes,
        "base": base,
        "channels": {stage.value: [_short(name) for name in exr_channels(stage, lights=lights)] for stage in Stage},
    }
    encoded = {
        renderer: {stage.value: _encode(image, images, base, renderer, stage) for stage, image in stages.items()}
        for renderer, stages in images.items()
    }
    text = pack_text(json.dumps(plain(record), allow_nan=False))
    # Renderers are named by the user's plug-ins too, so they go in as JSON strings; the rest is base64.
    return write_text(path, f"rayproof.receive({number},{json.dumps(text)},{json.dumps(encoded)});\n")


def picture_of(folder: Path, case: dict[str, Any]) -> str | None:
    """Return the case's PyVista picture relative to `folder`, if it was drawn."""
    picture = case.get("picture") or picture_path(case)
    return picture if picture and inside(folder, picture) else None


def _images(folder: Path, case: dict[str, Any]) -> tuple[dict[str, dict[Stage, np.ndarray]], list[str]]:
    """Return the images by renderer, and a note for each that cannot be shown."""
    images: dict[str, dict[Stage, np.ndarray]] = {}
    notes = []
    for render in case.get("renders", []):
        name, image = str(render.get("renderer")), render.get("image")
        if not image:
            continue
        if not inside(folder, image):
            notes.append(f"{name}: {image} is not in the results folder")
            continue
        try:
            images[name] = read_answers(folder / image)
        except ValueError as error:
            notes.append(f"{name}: {error}")
    return images, notes


def _encode(
    image: np.ndarray, images: dict[str, dict[Stage, np.ndarray]], base: str | None, renderer: str, stage: Stage
) -> dict[str, Any]:
    against = images[base].get(stage) if base is not None and base != renderer else None
    if against is not None and against.shape != image.shape:
        against = None
    height, width, _ = image.shape
    return {"width": width, "height": height, **encode(image, against)}


def _short(channel: str) -> str:
    """Return the last part of a channel's name, or the first where the last says nothing."""
    first, _, last = channel.rpartition(".")
    return first if last == "V" else last
