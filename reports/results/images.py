"""A case's images in the results folder: OpenEXR files, or one script where the case passed.

An EXR file is one multichannel float32 file for each render, its channels named by the specification (Academy Software
Foundation, `OpenEXR.File`). A script has every bit of every float, stored against the renderer that the others should
be close to. Browsers refuse fetch() on file://, so it is a call with JSON in it: the first line is the call, the second
the JSON.
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

    `comments` go into the header's attribute of that name, which image viewers show. With `double` each channel X has
    another, X.low, beside it: what the rounding took, rounded to float32 itself; 0 where X is not finite.

    `Stage.CAMERA` is no image and is left out, as is `visibility` where there is no light.

    Raises:
        ValueError: a stage has the wrong number of channels, the stages differ in size, or there is no image.

    """
    channels: dict[str, np.ndarray] = {}
    for stage in (stage for stage in IMAGE_STAGES if stage in answers):
        image, names = np.asarray(answers[stage]), exr_channels(stage, lights=lights)
        if image.ndim != 3 or image.shape[-1] != len(names):
            raise ValueError(f"{stage} must have shape (height, width, {len(names)}), got {image.shape}")
        # An answer that overflows float32 is written as an infinity, which every reader counts.
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
    """Write the image stages of `answers` as NumPy's archive of float64 arrays, by the stages' names; return `path`."""
    arrays: dict[str, Any] = {
        stage.value: np.asarray(answers[stage], np.float64) for stage in IMAGE_STAGES if stage in answers
    }
    with replacing(path) as draft, draft.open("wb") as file:
        np.savez_compressed(file, comments=np.array(comments), **arrays)
    return path


def read_answers(path: Path) -> dict[Stage, np.ndarray]:
    """Return the image stages of an EXR that `write_answers` wrote, float32 (height, width, channels) each.

    Raises:
        FileNotFoundError: there is no such file.
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


# The renderer against which the others are stored: the one they should all be close to.
BASE = "analytic"

Renders = dict[str, dict[Stage, np.ndarray]]  # by renderer: float32 (height, width, channels) of each stage


def write_pixels(
    path: Path, name: str, renders: Mapping[str, Mapping[Stage, np.ndarray]], scene: Mapping[str, Any] | None
) -> Path:
    """Write the script that hands `renders`, rounded to float32 once, to the page as `name`; return `path`.

    `scene` is what a scene file says of camera, lights and shading: rays, hit points and light are foretold from it;
    without, the file is larger.
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
    """Return what `write_pixels` wrote, of all renderers or only of some.

    Raises:
        OSError: there is no such file.
        ValueError: it is no such script.

    """
    try:
        stored = json.loads(path.read_text(encoding="utf-8").splitlines()[1])
        base, renderers = stored["base"], stored["renderers"]
        wanted = [name for name in renderers if only is None or name in only]
        # What the others are foretold from comes first.
        order = sorted({*wanted, base} & {*renderers}, key=lambda name: name != base)
        renders: Renders = {}
        for name in order:
            own = renders[name] = {}
            # In the order of the stages, which is that of the predictions.
            for stage in IMAGE_STAGES:
                if (one := renderers[name].get(stage.value)) is not None:
                    foretold = predicted(one, stage, own, renders.get(base))
                    own[stage] = decode(one, one["height"], one["width"], foretold)
    except (IndexError, KeyError, TypeError, AttributeError, UnicodeDecodeError, ValueError) as error:
        raise ValueError(f"{path} holds no images: {error!r}") from error
    return {name: renders[name] for name in wanted}


def script(name: str, content: Any) -> str:
    """Return a script that hands `content` to the page under `name`, inert wherever it may be put."""
    return _handing_over(name, inert(content))


def renamed(text: str, name: str) -> str:
    """Return a script's text so that it hands over the same under another name."""
    return _handing_over(name, handed_over(text))


def handed_over(text: str) -> str:
    """Return the JSON in a script's text; whoever wrote it, it ends no element."""
    return text.split("\n")[1].replace("<", "\\u003c")


def _handing_over(name: str, content: str) -> str:
    return f"rayproof.receive({inert(name)},\n{content}\n);\n"


def inert(content: Any) -> str:
    """Return JSON on one line that can stand inside a script element whatever strings it holds."""
    return legible_json(as_json(content)).replace("<", "\\u003c")


def kept_images(
    folder: Path, case: CaseRecord, *, only: Collection[str | None] | None = None
) -> tuple[Renders, list[str]]:
    """Return a case's images by renderer, float32 (height, width, channels), a note for each unreadable.

    With `only`, no more than what those renderers answered is read.
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
    """Return whether a run kept any image of a case, as its record says."""
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
