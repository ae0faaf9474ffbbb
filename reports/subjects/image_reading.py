"""A program's image: OpenEXR with named channels, or PFM for radiance. Whatever is wrong with it is one sentence."""

import ctypes
import io
import os
import re
import stat
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from rayproof.cases.scene import Scene
from rayproof.cases.stages import IMAGE_STAGES, Resolution, Stage, exr_channels
from rayproof.reports.subjects import pfm

EXR_MAGIC = b"\x76\x2f\x31\x01"
MOST_CHANNELS = 256
HALF = Resolution(relative=2.0**-11, absolute=2.0**-25, because="written as half: 11 bits, at least 2^-24 apart")
# What a file of floats keeps of numbers that a program had as doubles.
FLOAT = Resolution(relative=2.0**-24, absolute=2.0**-150, because="written as float: each value rounded once")
_VISIBILITY = re.compile(r"visibility\.\d+")


@dataclass(frozen=True, kw_only=True)
class Taken:
    """The stages that an image holds, float64 (height, width, channels), and where they were written coarsely."""

    images: dict[Stage, np.ndarray]
    resolutions: dict[Stage, Resolution]
    lacking: dict[Stage, str] = field(default_factory=dict)  # stages of which channels are missing, and which


def take_back(path: Path, scene: Scene, *, most: int) -> Taken:
    """Return what the image at `path` answers about `scene`; it may have `most` bytes.

    Raises:
        ValueError: there is none, or it cannot be used; one sentence says why.

    """
    try:
        facts = os.lstat(path)
    except OSError:
        raise ValueError(f"it wrote no image to {path.name}") from None
    if not stat.S_ISREG(facts.st_mode):
        raise ValueError(f"it made of {path.name} something that is no regular file")
    if facts.st_size > most:
        raise ValueError(f"its image has {facts.st_size} bytes, more than {most}")
    with path.open("rb") as file:
        magic = file.read(4)
    width, height = scene.camera.width, scene.camera.height
    if magic[:2] == pfm.MAGIC:
        image = pfm.read_pfm(path.read_bytes(), width=width, height=height)
        return Taken(images={Stage.RADIANCE: image}, resolutions={})
    if magic != EXR_MAGIC:
        raise ValueError(f"its image is neither OpenEXR nor PFM: it has {facts.st_size} bytes and begins {magic!r}")
    return _sorted(_exr(path, width=width, height=height), lights=len(scene.lights))


def _exr(path: Path, *, width: int, height: int) -> dict[str, np.ndarray]:
    """Return an OpenEXR image's channels; its header is looked at before a pixel is read."""
    import OpenEXR

    try:
        with _silence():
            with OpenEXR.File(str(path), separate_channels=True, header_only=True) as file:
                parts = len(file.parts)
                window = file.header()["dataWindow"]
                named = {channel.name: (channel.xSampling, channel.ySampling) for channel in file.header()["channels"]}
            low, high = (tuple(int(number) for number in corner) for corner in window)
            size = (high[0] - low[0] + 1, high[1] - low[1] + 1)
            if size != (width, height):
                raise UnfitError(f"it is {size[0]} x {size[1]} px, not {width} x {height}")
            if parts != 1 or len(named) > MOST_CHANNELS or any(step != (1, 1) for step in named.values()):
                raise UnfitError(f"it must be one part of at most {MOST_CHANNELS} channels, none of them subsampled")
            with OpenEXR.File(str(path), separate_channels=True) as file:
                return {name: channel.pixels for name, channel in file.channels().items()}
    except UnfitError:
        raise
    except (RuntimeError, ValueError, KeyError, TypeError) as error:
        why = (str(error).splitlines() or [type(error).__name__])[0]
        said = why.replace(f"{path.parent}{os.sep}", "").strip()
        raise ValueError(f"its image is cut short or broken (OpenEXR says: {said})") from None


class UnfitError(ValueError):
    """An image that can be read and must not be used."""


def _sorted(channels: dict[str, np.ndarray], *, lights: int) -> Taken:
    """Return the stages among the channels; others than the specification's are left alone."""
    images: dict[Stage, np.ndarray] = {}
    resolutions: dict[Stage, Resolution] = {}
    lacking: dict[Stage, str] = {}
    for stage in IMAGE_STAGES:
        names = exr_channels(stage, lights=lights)
        present = [name for name in names if name in channels]
        if stage is Stage.VISIBILITY:
            present += [name for name in channels if _VISIBILITY.fullmatch(name) and name not in names]
        if not present:
            continue
        if set(present) != set(names):
            lacking[stage] = f"its {stage} has the channels {', '.join(present)}, not {', '.join(names) or 'none'}"
            continue
        kinds = {channels[name].dtype for name in names}
        with np.errstate(invalid="ignore"):  # a signalling NaN is a NaN like others
            images[stage] = np.stack([channels[name].astype(np.float64) for name in names], axis=-1)
        if np.dtype(np.float16) in kinds:
            resolutions[stage] = HALF
    if not images and lacking:
        raise ValueError(next(iter(lacking.values())))
    if not images:
        raise ValueError(f"its channels are {', '.join(sorted(channels)[:8]) or 'none'}; none of them is a stage's")
    return Taken(images=images, resolutions=resolutions, lacking=lacking)


@contextmanager
def _silence() -> Iterator[None]:
    """Keep what a library prints, by C or by Python, off the terminal; what it raises says enough."""
    flush = ctypes.CDLL(None).fflush  # C keeps its lines until it is asked, and would print them later
    flush(None)
    kept = [(number, os.dup(number)) for number in (1, 2)]
    nowhere = os.open(os.devnull, os.O_WRONLY)
    try:
        for number, _ in kept:
            os.dup2(nowhere, number)
        with redirect_stdout(io.StringIO()), redirect_stderr(io.StringIO()):
            yield
    finally:
        flush(None)
        for number, copy in kept:
            os.dup2(copy, number)
            os.close(copy)
        os.close(nowhere)
