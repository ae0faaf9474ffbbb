"""Scripts that a results folder brought along, written anew as the data that they hand over.

A browser runs what it loads from a folder, and the folder may be anybody's. So of each such script nothing is kept but
its JSON, checked to be what the page takes it for and put between the words that rayproof writes itself.
"""

import json
import math
from pathlib import Path
from typing import Any

from rayproof.cases.stages import IMAGE_STAGES, Stage
from rayproof.reports.results.atomic import write_text
from rayproof.reports.results.float_codec import inflated
from rayproof.reports.results.image_script import handed_over, script
from rayproof.reports.results.images import inside

LARGEST = 2**30  # bytes of a script
KINDS = {"data": str, "by": str, "curved": bool, "height": int, "width": int, "channels": int}  # of an image's members
MOST_CHANNELS = 1000


def clean_pixels(folder: Path, name: str) -> str | None:
    """Write a case's images anew where they are not as `write_pixels` writes; return why they are none, or None.

    What is none must not be named to the page, which would run it.
    """
    return _cleaned(folder, name, _images)


def _cleaned(folder: Path, name: str, checked: Any) -> str | None:
    if not name.endswith(".js") or not inside(folder, name):
        return f"{name} is no script of the results folder"
    path = folder / name
    try:
        if path.stat().st_size > LARGEST:
            raise ValueError(f"it has more than {LARGEST} bytes")
        text = path.read_text(encoding="utf-8")
        again = script(name, checked(json.loads(handed_over(text))))
    except (OSError, ValueError, IndexError, RecursionError) as error:
        return f"{name} holds no data of a report: {' '.join(str(error).split())}"
    if again != text:
        write_text(path, again)
    return None


def _images(content: Any) -> Any:
    """Return what a script of pixels hands over, checked; raise ValueError with the place of what is wrong."""
    if not isinstance(content, dict) or set(content) != {"base", "renderers"}:
        raise ValueError("it must be an object of base and renderers")
    renderers = content["renderers"]
    if not isinstance(renderers, dict) or not (content["base"] is None or isinstance(content["base"], str)):
        raise ValueError("base must be a name or null, renderers an object")
    for renderer, stages in renderers.items():
        if not isinstance(stages, dict) or not set(stages) <= {stage.value for stage in IMAGE_STAGES}:
            raise ValueError(f"renderers.{renderer} must be an object of stages")
        for stage, image in stages.items():
            _check_image(image, f"renderers.{renderer}.{stage}")
    return content


def _check_image(image: Any, where: str) -> None:
    if not isinstance(image, dict):
        raise ValueError(f"{where} must be an object")
    for key, kind in KINDS.items():
        value = image.get(key)
        if not isinstance(value, kind) or (kind is int and not _is_count(value)):
            raise ValueError(f"{where}.{key} must be of type {kind.__name__}, got {type(value).__name__}")
    if image["channels"] > MOST_CHANNELS or not all(
        map(_is_numbers, (image[key] for key in set(image) - {*KINDS, "of"}))
    ):
        raise ValueError(f"{where} must hold numbers beside {', '.join(KINDS)}")
    if image.get("of", Stage.RAY) not in set(Stage):
        raise ValueError(f"{where}.of must be a stage")
    try:
        inflated(image["data"], 4 * image["height"] * image["width"] * image["channels"])
    except ValueError as error:
        raise ValueError(f"{where}.data: {error}") from None


def _is_count(value: Any) -> bool:
    return type(value) is int and value >= 1


def _is_numbers(value: Any) -> bool:
    """Say whether a value is a number or a structure of numbers: what predictions are made from."""
    if isinstance(value, dict):
        return all(map(_is_numbers, value.values()))
    if isinstance(value, list):
        return all(map(_is_numbers, value))
    return value is None or (isinstance(value, int | float) and math.isfinite(value)) or value in ("inf", "-inf", "nan")
