"""A user's program asked for a scene's images: EXR and PFM read, capabilities, refusals and failures as sentences.

Its image is OpenEXR with named channels, or PFM for radiance: three float32 channels, rows from the bottom up (Debevec,
"PFM Portable FloatMap Image Format", 2001).
"""

import ctypes
import io
import json
import os
import re
import shlex
import shutil
import stat
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from rayproof.cases.case import ITEMS_OF_OTHERS
from rayproof.cases.scene import Scene
from rayproof.cases.stages import IMAGE_STAGES, Resolution, Stage, exr_channels
from rayproof.reports.judge.answers import Answers
from rayproof.reports.judge.box_filter import box_mean, finer
from rayproof.reports.judge.oracle import stages_of
from rayproof.reports.subjects import FUNCTION, Subject
from rayproof.reports.subjects.calls import Ended, call, filled, keep_call, keep_output
from rayproof.reports.subjects.protocol import (
    NAME,
    STAYS,
    Capabilities,
    capabilities_from,
    capabilities_of,
    hand_over,
    rebuilt,
)
from rayproof.reports.subjects.serving import Server

MAGIC = b"PF"
_HEADER = re.compile(rb"PF\s+(\d{1,9})\s+(\d{1,9})\s+([+-]?[0-9.eE+-]{1,20})\s")


def read_pfm(content: bytes, *, width: int, height: int) -> np.ndarray:
    """Return the image (height, width, 3), row 0 at the top.

    Raises:
        ValueError: it is no colour PFM of this size, or holds more or less than its header says.

    """
    header = _HEADER.match(content)
    if header is None:
        raise ValueError("it begins like a PFM but has no header of one: PF, width and height, scale")
    size = (int(header[1]), int(header[2]))
    if size != (width, height):
        raise ValueError(f"it is {size[0]} x {size[1]} px, not {width} x {height}")
    try:
        scale = float(header[3])
    except ValueError:
        scale = 0.0
    if scale not in (1.0, -1.0):
        raise ValueError(f"its scale must be -1.0 (little-endian) or 1.0, got {header[3].decode(errors='replace')}")
    pixels = content[header.end() :]
    if len(pixels) != width * height * 12:
        raise ValueError(f"it holds {len(pixels)} bytes of pixels, not {width * height * 12}")
    image = np.frombuffer(pixels, dtype="<f4" if scale < 0 else ">f4").reshape(height, width, 3)
    with np.errstate(invalid="ignore"):  # a signalling NaN is a NaN like others
        return image[::-1].astype(np.float64)


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
    if magic[:2] == MAGIC:
        image = read_pfm(path.read_bytes(), width=width, height=height)
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


CAMERA = "The protocol has no channel for matrices."
ROOM = 64 * 2**20  # bytes that a program may write beside its image, for logs and the like
GENEROUS = 16  # times the bytes of an image with every channel: other channels, other formats, drafts
UNSAID = "It wrote no channel of it."
ASKING = "--capabilities"


class ProgramError(Exception):
    """A program that gave nothing that could be judged; the message is one sentence."""

    stopped = False  # its time was over
    lost = False  # it stays alive, and died or exceeded a limit


class Refused(Exception):  # noqa: N818  an answer, not a mishap
    """A program that says it cannot draw a scene, in its own words."""


def ask_capabilities(subject: Subject, *, seconds: float, server: Server | None = None) -> Capabilities:
    """Return what the program declares; nothing if it does not know the question. One that stays alive has a `server`.

    Raises:
        ValueError: its answer is not as the protocol asks, or a function cannot be loaded.

    """
    if server is not None:
        ended = server.ask({"capabilities": True}, seconds=subject.seconds, output=ROOM)
        unknown = ended.lost or ended.reported or ended.refusal is not None  # a program need not know the question
        if ended.problem is not None and (subject.name == FUNCTION or not unknown):
            raise ValueError(ended.problem)
        return Capabilities(protocol=STAYS) if ended.declared is None else capabilities_of(ended.declared, STAYS)
    with _Place() as place:
        arguments = [word for word in subject.command if "{" not in word] + [ASKING]
        ended = _called(subject, arguments, place, seconds=seconds, output=ROOM)
    declared = capabilities_from(ended.said) if ended.problem is None else None
    return declared or Capabilities()


def _called(subject: Subject, arguments: list[str], place: "_Place", *, seconds: float, output: int) -> Ended:
    return call(
        arguments,
        place.folder,
        seconds=seconds,
        memory=subject.memory,
        output=output,
        variables=subject.variables,
    )


def allowance(scene: Scene) -> int:
    """Return how many bytes a program may write in one call."""
    channels = sum(len(exr_channels(stage, lights=len(scene.lights))) for stage in IMAGE_STAGES)
    return ROOM + GENEROUS * channels * scene.camera.width * scene.camera.height * 4


def ask_program(
    subject: Subject,
    scene: Scene,
    *,
    samples: int,
    keep: Path | None = None,
    server: Server | None = None,
) -> Answers:
    """Return the program's answers to a scene, or the error that it ended in; never raises for what it does.

    The call is kept in the folder `keep`, if there is one: its scene, command, output and image. A program that stays
    alive has a `server`.
    """
    asking = _Asking(subject=subject, server=server)
    able, stages = subject.capabilities, stages_of(scene)
    blank = Answers(
        name=subject.name,
        precision="float32",  # never better than what the file holds, whatever it computes in
        items=ITEMS_OF_OTHERS,
        shadow_epsilon=able.shadow_epsilon,
        ray_epsilon=able.ray_epsilon,
        chained=able.chained,
        world_normals=able.world_normals,
    )
    why = able.refusal(scene)
    try:
        if why is not None:
            raise Refused(why)
        taken = _image(asking, scene, keep=keep)
        mean = _mean(asking, scene, samples) if samples > 1 and Stage.RADIANCE in taken.images else None
    except Refused as cannot:
        return replace(blank, answers={}, unsupported=dict.fromkeys(stages, str(cannot)))
    except ProgramError as wrong:
        return replace(blank, error=str(wrong), stopped=wrong.stopped, lost=wrong.lost)
    unsupported = {stage: UNSAID for stage in stages if stage not in taken.images and stage not in taken.lacking}
    unsupported[Stage.CAMERA] = CAMERA
    answers = {stage: image for stage, image in taken.images.items() if stage in stages}
    resolutions = dict(taken.resolutions)
    if able.chained:
        # The oracle continues from what was written, the program went on from what it had before.
        resolutions = dict.fromkeys(answers, FLOAT) | resolutions
    found = replace(blank, answers=answers, unsupported=unsupported, resolutions=resolutions, mean=mean)
    return replace(found, lacking=taken.lacking)


@dataclass(frozen=True, kw_only=True)
class _Asking:
    """A program that is asked about a case; one that stays alive has a `server`."""

    subject: Subject
    server: Server | None

    def ended(self, place: "_Place", scene: Path, *, samples: int, output: int) -> Ended:
        """Return how a call ended of which the scene lies in `place`, and the image is to."""
        subject, image = self.subject, place.folder / self.subject.image_name
        if self.server is None:
            arguments = filled(subject.command, place.folder, samples=samples)
            return _called(subject, arguments, place, seconds=subject.seconds, output=output)
        request = {"scene": str(scene), "output": str(image), "samples": samples}
        return self.server.ask(request, seconds=subject.seconds, output=output)

    def line(self, *, samples: int) -> str:
        """Return what makes the call again, for a shell in a folder with the scene."""
        command = shlex.join(filled(self.subject.command, Path(), samples=samples))
        if self.server is None:
            return command
        request = {"id": 0, "scene": NAME, "output": self.subject.image_name, "samples": samples}
        return f"echo {shlex.quote(json.dumps(request))} | {command}"


def _image(asking: _Asking, scene: Scene, *, samples: int = 1, keep: Path | None = None) -> Taken:
    """Return one image of the program.

    Raises:
        ProgramError: it gave none that can be used.
        Refused: it says that it cannot.

    """
    able = asking.subject.capabilities
    with _Place(within=asking.server.folder if asking.server is not None else None) as place:
        given = rebuilt(scene, able.stand_ins)
        path = hand_over(given.scene, place.folder)
        most = allowance(scene)
        ended = asking.ended(place, path, samples=samples, output=most)
        if keep is not None:
            keep_call(keep, given.scene, asking.line(samples=samples), ended, notes=able.told(scene))
        _conclude(ended, place, asking.subject)
        image = place.folder / asking.subject.image_name
        if keep is not None:
            keep_output(keep, image)
        try:
            taken = take_back(image, scene, most=most)
        except ValueError as wrong:
            raise ProgramError(f"the program ended well, but {wrong}") from None
    wanted = IMAGE_STAGES if able.stages is None else able.stages
    missing = [stage for stage in able.stages or () if stage in stages_of(scene) and stage not in taken.images]
    return Taken(
        images=given.named_as_asked({stage: image for stage, image in taken.images.items() if stage in wanted}),
        resolutions=taken.resolutions,
        lacking=dict.fromkeys(missing, "it declares this stage and wrote no channel of it")
        | {stage: why for stage, why in taken.lacking.items() if stage in wanted},
    )


def _conclude(ended: Ended, place: "_Place", subject: Subject) -> None:
    """Raise what the call came to, if it came to no image."""
    if ended.refusal is not None:
        raise Refused(ended.refusal)
    if ended.problem is not None:
        said = "the function fails:" if subject.name == FUNCTION else "the program answers with an error:"
        error = ProgramError(f"{said if ended.reported else 'the program gave no image:'} {ended.problem}")
        error.stopped, error.lost = ended.stopped, ended.lost
        raise error
    if strays := place.strays():
        raise ProgramError(f"the program wrote outside of its folder: {strays[0]}")


def _mean(asking: _Asking, scene: Scene, samples: int) -> np.ndarray:
    """Return radiance box-filtered over samples x samples points a pixel: its own mean, or ours of a finer image."""
    averages = asking.subject.averages
    taken = _image(asking, scene, samples=samples) if averages else _image(asking, finer(scene, samples))
    if Stage.RADIANCE not in taken.images:
        raise ProgramError("the program wrote no channel of the radiance that is to be averaged")
    return taken.images[Stage.RADIANCE] if averages else box_mean(taken.images[Stage.RADIANCE], samples)


class _Place:
    """A folder for one call, with nothing beside it: what appears there was written outside of the folder.

    One that stays alive has it in the folder `within` which it works, and where it may write.
    """

    def __init__(self, *, within: Path | None = None) -> None:
        self._within = within

    def __enter__(self) -> "_Place":
        self._above = Path(tempfile.mkdtemp(prefix="rayproof-")) if self._within is None else self._within
        # Without the case's name, by which a program could answer.
        self.folder = Path(tempfile.mkdtemp(prefix="call-", dir=self._above))
        return self

    def strays(self) -> list[str]:
        """Return what lies beside the folder."""
        if self._within is not None:
            return []
        return sorted(name for name in os.listdir(self._above) if name != self.folder.name)  # noqa: PTH208

    def __exit__(self, *_: object) -> None:
        shutil.rmtree(self._above if self._within is None else self.folder, ignore_errors=True)
