"""Answers as OpenEXR: one multichannel float32 file per render, channels named by the specification.

Source: OpenEXR's Python module (Academy Software Foundation), `OpenEXR.File`.
"""

import re
from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR

from rayproof.cases.stages import IMAGE_STAGES, Stage, StageImages, exr_channels
from rayproof.reports.results.atomic import replacing

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
            found: dict[str, np.ndarray] = {name: channel.pixels for name, channel in file.channels().items()}
    except RuntimeError as error:
        raise ValueError(f"{path} is no OpenEXR image: {error}") from error
    lights = sum(1 for name in found if _VISIBILITY.fullmatch(name))
    answers: dict[Stage, np.ndarray] = {}
    for stage in IMAGE_STAGES:
        names = exr_channels(stage, lights=lights)
        if names and all(name in found for name in names):
            answers[stage] = np.stack([found[name] for name in names], axis=-1).astype(np.float32, copy=False)
    return answers
