"""A case's images in the results folder: OpenEXR files, or a script if the case passed.

There is one multichannel float32 EXR file per render, with the channel names of the specification (Academy Software
Foundation, `OpenEXR.File`). A script contains every bit of every float, predicted from the images of a base renderer.
Browsers refuse fetch() on file://, so the script is a function call with JSON as its argument: the first line is the
call, the second line is the JSON.
"""

import json
import re
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR

from rayproof.cases.stages import IMAGE_STAGES, Stage, StageImages, exr_channels
from rayproof.reports.results.case_records import CaseRecord
from rayproof.reports.results.files import as_json, legible_json, replacing, write_text
from rayproof.reports.results.float_codec import Factors, decode, encode, intensities, pinhole, predicted, predictions

_VISIBILITY = re.compile(r"visibility\.\d+")


def write_answers(path: Path, answers: StageImages, lights: int, *, comments: str = "", double: bool = False) -> Path:
    """Write the image stages of `answers`, rounded once to float32, and return `path`.

    `comments` are written to the header's attribute of that name, which image viewers show. With `double` each channel
    X is accompanied by a channel X.low: the rounding error of X, rounded to float32; 0 where X is not finite.

    `Stage.CAMERA` is no image and is left out, as is `visibility` if there is no light.

    Raises:
        ValueError: a stage has the wrong number of channels, the stages differ in size, or there is no image.

    """
    channels: dict[str, np.ndarray] = {}
    for stage in (stage for stage in IMAGE_STAGES if stage in answers):
        image, names = np.asarray(answers[stage]), exr_channels(stage, lights=lights)
        if image.ndim != 3 or image.shape[-1] != len(names):
            raise ValueError(f"{stage} must have shape (height, width, {len(names)}), got {image.shape}")
        # A value that overflows float32 is written as an infinity, which is counted on reading.
        with np.errstate(over="ignore", invalid="ignore"):
            rounded = image.astype(np.float32)
            lost = np.where(np.isfinite(rounded), image - rounded, 0).astype(np.float32) if double else None
        channels |= {name: np.ascontiguousarray(rounded[..., index]) for index, name in enumerate(names)}
        if lost is not None:
            channels |= {f"{name}.low": np.ascontiguousarray(lost[..., index]) for index, name in enumerate(names)}
    sizes = {channel.shape for channel in channels.values()}
    if len(sizes) != 1:
        raise ValueError(f"an EXR needs stages of one size, got {sorted(sizes) or 'none'}")
    header = {"compression": OpenEXR.ZIP_COMPRESSION, "type": OpenEXR.scanlineimage}
    if comments:
        header["comments"] = comments
    with replacing(path) as draft:
        OpenEXR.File(header, channels).write(str(draft))
    return path


def write_arrays(path: Path, answers: StageImages, *, comments: str = "") -> Path:
    """Write the image stages of `answers` to an NPZ file, as float64 arrays with the stages' names; return `path`."""
    arrays: dict[str, Any] = {
        stage.value: np.asarray(answers[stage], np.float64) for stage in IMAGE_STAGES if stage in answers
    }
    with replacing(path) as draft, draft.open("wb") as file:
        np.savez_compressed(file, comments=np.array(comments), **arrays)
    return path


def read_answers(path: Path) -> dict[Stage, np.ndarray]:
    """Return the image stages of an EXR that `write_answers` wrote, float32 (height, width, channels) each.

    Raises:
        FileNotFoundError: the file does not exist.
        ValueError: the file is no OpenEXR image.

    """
    if not path.is_file():
        raise FileNotFoundError(f"no such image: {path}")
    try:
        with OpenEXR.File(str(path), separate_channels=True) as file:
            images: dict[str, np.ndarray] = {name: channel.pixels for name, channel in file.channels().items()}
    except RuntimeError as error:
        raise ValueError(f"{path} is no OpenEXR image: {error}") from error
    lights = sum(1 for name in images if _VISIBILITY.fullmatch(name))
    answers: dict[Stage, np.ndarray] = {}
    for stage in IMAGE_STAGES:
        names = exr_channels(stage, lights=lights)
        if names and all(name in images for name in names):
            answers[stage] = np.stack([images[name] for name in names], axis=-1).astype(np.float32, copy=False)
    return answers


# The base renderer, from whose images the others are predicted, since all should be close to them.
BASE = "analytic"

Renders = dict[str, dict[Stage, np.ndarray]]  # renderer -> stage -> float32 (height, width, channels)


def write_pixels(
    path: Path, name: str, renders: Mapping[str, Mapping[Stage, np.ndarray]], scene: Mapping[str, Any] | None
) -> Path:
    """Write the script that passes `renders`, rounded once to float32, to the page under `name`; return `path`.

    `scene` contains the camera, lights and shading of a scene file, from which rays, hit points and light are
    predicted; if it is None, the file is larger.
    """
    with np.errstate(over="ignore"):
        images = {
            str(renderer): {stage: np.asarray(answers[stage], np.float32) for stage in IMAGE_STAGES if stage in answers}
            for renderer, answers in renders.items()
        }
    base = BASE if BASE in images else next(iter(images), None)
    camera = None if scene is None else scene["camera"]
    rays, lights = pinhole(camera), intensities(scene)
    x, y, z = map(float, camera["eye"]) if rays is not None and camera is not None else (0.0, 0.0, 0.0)
    tables: dict[Stage, Factors] = {}
    encoded = {
        renderer: {
            stage.value: {
                "height": image.shape[0],
                "width": image.shape[1],
                **encode(
                    image,
                    predictions(
                        stage, own, images[base] if base and base != renderer else None, (x, y, z), rays, tables, lights
                    ),
                ),
            }
            for stage, image in own.items()
            if image.ndim == 3 and image.size
        }
        for renderer, own in images.items()
    }
    return write_text(path, script(name, {"base": base, "renderers": encoded}))


def read_pixels(path: Path, *, only: Collection[str | None] | None = None) -> Renders:
    """Return the images in a script of `write_pixels`, of all renderers or of those in `only`.

    Raises:
        OSError: the file cannot be read.
        ValueError: the file is no script of `write_pixels`.

    """
    try:
        stored = json.loads(path.read_text(encoding="utf-8").splitlines()[1])
        base, renderers = stored["base"], stored["renderers"]
        wanted = [name for name in renderers if only is None or name in only]
        # The base renderer comes first, since the others are predicted from it.
        order = sorted({*wanted, base} & {*renderers}, key=lambda name: name != base)
        renders: Renders = {}
        for name in order:
            own = renders[name] = {}
            # In the order of the stages, since later stages are predicted from earlier ones.
            for stage in IMAGE_STAGES:
                if (image := renderers[name].get(stage.value)) is not None:
                    foretold = predicted(image, stage, own, renders.get(base))
                    own[stage] = decode(image, image["height"], image["width"], foretold)
    except (IndexError, KeyError, TypeError, AttributeError, UnicodeDecodeError, ValueError) as error:
        raise ValueError(f"{path} holds no images: {error!r}") from error
    return {name: renders[name] for name in wanted}


def script(name: str, content: Any) -> str:
    """Return a script that passes `content` to the page under `name`; it may be put into any script element."""
    return _handing_over(name, inert(content))


def renamed(text: str, name: str) -> str:
    """Return a script's text that passes the same content under another name."""
    return _handing_over(name, handed_over(text))


def handed_over(text: str) -> str:
    """Return the JSON in a script's text, escaped so that it cannot end a script element."""
    return text.split("\n")[1].replace("<", "\\u003c")


def _handing_over(name: str, content: str) -> str:
    return f"rayproof.receive({inert(name)},\n{content}\n);\n"


def inert(content: Any) -> str:
    """Return content as JSON on one line, escaped so that none of its strings can end a script element."""
    return legible_json(as_json(content)).replace("<", "\\u003c")


def kept_images(
    folder: Path, case: CaseRecord, *, only: Collection[str | None] | None = None
) -> tuple[Renders, list[str]]:
    """Return a case's images by renderer, float32 (height, width, channels), and a note for each unreadable file.

    With `only`, only these renderers' images are read.
    """
    renders: Renders = {}
    notes = []
    pixels = case.get("pixels")
    if isinstance(pixels, str):
        try:
            renders |= read_pixels(_within(folder, pixels), only=only)
        except (OSError, ValueError) as error:
            notes.append(str(error))
    for render in case.get("renders", []):
        name, image = str(render.get("renderer")), render.get("image")
        if not image or (only is not None and name not in only):
            continue
        try:
            renders[name] = read_answers(_within(folder, image))
        except (OSError, ValueError) as error:
            notes.append(f"{name}: {error}")
    return renders, notes


def keeps_images(case: CaseRecord) -> bool:
    """Return whether a case's record names any image."""
    return isinstance(case.get("pixels"), str) or any(render.get("image") for render in case.get("renders", []))


def inside(folder: Path, relative: str) -> bool:
    """Return whether `relative` names a file below `folder`; results.json may come from anywhere."""
    try:
        path = (folder / relative).resolve()
        return path.is_relative_to(folder.resolve()) and path.is_file()
    except (OSError, ValueError):
        return False


def _within(folder: Path, relative: str) -> Path:
    if not inside(folder, relative):
        raise ValueError(f"{relative} is not in the results folder")
    return folder / relative
