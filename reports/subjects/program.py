"""Rendering with a user's program: its capabilities, its images, and sentences on its refusals and failures."""

import json
import os
import shlex
import shutil
import tempfile
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import reduce
from pathlib import Path
from typing import Any

import numpy as np

from rayproof.cases.case import ITEMS_OF_OTHERS
from rayproof.cases.scene import Scene
from rayproof.cases.stages import IMAGE_STAGES, Resolution, Stage, exr_channels
from rayproof.reference import REFERENCES
from rayproof.reference.analytic import Analytic
from rayproof.reports.interchange.stand_ins import rebuilt
from rayproof.reports.judge.answers import Answers
from rayproof.reports.judge.box_filter import box_mean, finer
from rayproof.reports.judge.noise import averaged
from rayproof.reports.judge.oracle import stages_of
from rayproof.reports.subjects import FUNCTION, Subject
from rayproof.reports.subjects.calls import Ended, call, filled, keep_call, keep_output
from rayproof.reports.subjects.image_files import CLIPPED, FLOAT, Taken, take_back
from rayproof.reports.subjects.protocol import (
    STAYS,
    Capabilities,
    capabilities_from,
    capabilities_of,
    hand_over,
    scene_name,
)
from rayproof.reports.subjects.serving import Server

CAMERA = "The camera stage is no image, so that no program is asked about it."
ROOM = 64 * 2**20  # bytes that a program may write besides its image, such as logs
GENEROUS = 16  # times the bytes of an image with every channel: other channels, other formats, drafts
UNSAID = "It wrote no channel of it."
SAMPLES = 16  # per pixel in each render of a program that draws random numbers
ASKING = "--capabilities"


class ProgramError(Exception):
    """A failure of a program, so that there is no image to judge; the message is a sentence."""

    stopped = False  # whether it exceeded its time
    lost = False  # whether it is a program that stays alive, and died or exceeded a limit


class Refused(Exception):  # noqa: N818  an answer, not an error
    """A program's statement that it cannot draw a scene; the message is its reason."""


def ask_capabilities(subject: Subject, *, seconds: float, server: Server | None = None) -> Capabilities:
    """Return the program's declared capabilities; the default if it does not support the request.

    `server` is required for a program that stays alive.

    Raises:
        ValueError: the answer is against the protocol, or a function cannot be loaded.

    """
    if server is not None:
        ended = server.ask({"capabilities": True}, seconds=subject.seconds, output=ROOM)
        unknown = ended.lost or ended.reported or ended.refusal is not None  # programs need not support the request
        if ended.problem is not None and (subject.transport == FUNCTION or not unknown):
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
    """Return the limit of a program's output in one call [bytes]."""
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
    """Return the program's images of a scene, or its error; a program's failure raises no exception.

    The call is stored in the folder `keep`, if there is one: its scene, command, output and image. `server` is required
    for a program that stays alive.
    """
    asking = _Asking(subject=subject, server=server)
    able, stages = subject.capabilities, stages_of(scene)
    blank = Answers(
        name=subject.name,
        precision="float32",  # the precision of the file, even if the program computes in float64
        items=ITEMS_OF_OTHERS,
        shadow_epsilon=able.shadow_epsilon,
        ray_epsilon=able.ray_epsilon,
        sample_radius=0.0 if able.random and able.within_pixel else able.sample_offset[2],
        chained=able.chained,
        world_normals=able.world_normals,
    )
    why = able.refusal(scene)
    if why is None:
        blank = replace(blank, **_tolerances(able, scene))
    try:
        if why is not None:
            raise Refused(why)
        taken, pooled = _image(asking, scene, keep=keep), None
        if able.random and Stage.RADIANCE in taken.images:
            taken, pooled = _averaged(asking, scene, taken)
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
        # The oracle continues from the rounded values in the file, the program continued from its own values.
        resolutions = dict.fromkeys(answers, FLOAT) | resolutions
    result = replace(blank, answers=answers, unsupported=unsupported, resolutions=resolutions, mean=mean)
    result = replace(result, pooled_error=pooled)
    return replace(result, lacking=taken.lacking)


def _tolerances(able: Capabilities, scene: Scene) -> dict[str, Any]:
    """Return the tolerances of the program whose scene format is used, unless the subject declares its own."""
    says = able.says
    if says is None or not says.program or able.shadow_epsilon or able.ray_epsilon:
        return {}
    program: Any = REFERENCES[says.program]()
    above = program.epsilon_at(Analytic().render(scene, [Stage.OBJECT, Stage.POSITION]))
    return {"shadow_epsilon": above, "light_epsilon": program.light_epsilon}


@dataclass(frozen=True, kw_only=True)
class _Asking:
    """A program that renders a case; `server` is set for a program that stays alive."""

    subject: Subject
    server: Server | None
    seed: int = 0  # of this render, for programs that draw random numbers

    def spp(self, samples: int) -> int:
        """Return the number of samples per pixel in the request, for an average over samples x samples points."""
        return SAMPLES if self.subject.capabilities.random else samples**2

    def ended(self, place: "_Place", path: Path, scene: Scene, *, samples: int, output: int) -> Ended:
        """Call the program for the scene at `path` and return the result; its image goes to the folder of `place`."""
        subject = self.subject
        if self.server is None:
            arguments = self._filled(place.folder, scene, samples)
            return _called(subject, arguments, place, seconds=subject.seconds, output=output)
        request = self._request(path, place.folder / subject.image_name, scene, samples)
        return self.server.ask(request, seconds=subject.seconds, output=output)

    def line(self, scene: Scene, *, samples: int) -> str:
        """Return a shell command that repeats the call in a folder with the scene."""
        command = shlex.join(self._filled(Path(), scene, samples))
        if self.server is None:
            return command
        name = scene_name(self.subject.capabilities.scene_format)
        request = {"id": 0, **self._request(Path(name), Path(self.subject.image_name), scene, samples)}
        return f"echo {shlex.quote(json.dumps(request))} | {command}"

    def _filled(self, folder: Path, scene: Scene, samples: int) -> list[str]:
        return filled(self.subject.command, folder, scene, samples=samples, seed=self.seed, spp=self.spp(samples))

    def _request(self, path: Path, image: Path, scene: Scene, samples: int) -> dict[str, str | int]:
        camera = scene.camera
        about = {"width": camera.width, "height": camera.height, "seed": self.seed, "spp": self.spp(samples)}
        return {"scene": str(path), "output": str(image), "samples": samples, **about}


def _averaged(asking: _Asking, scene: Scene, first: Taken) -> tuple[Taken, np.ndarray | None]:
    """Return the mean of renders with different seeds, including `first`, with its resolution; and its pooled error.

    Raises:
        ProgramError: a render failed.
        Refused: the program refused the scene.

    """
    able = asking.subject.capabilities

    def renders() -> Iterator[np.ndarray]:
        yield first.images[Stage.RADIANCE]
        for seed in range(1, able.random):
            taken = _image(replace(asking, seed=seed), scene)
            if Stage.RADIANCE not in taken.images:
                raise ProgramError(f"the program wrote no radiance with seed {seed}")
            yield taken.images[Stage.RADIANCE]

    image, noise, pooled = averaged(renders(), scene, within_pixel=able.within_pixel)
    return replace(first, images={Stage.RADIANCE: image}, resolutions={Stage.RADIANCE: noise}), pooled


def _image(asking: _Asking, scene: Scene, *, samples: int = 1, keep: Path | None = None) -> Taken:
    """Return the program's image, or, if it supports only one light, the sum of its images of each light.

    Raises:
        ProgramError: the program failed or its image is invalid.
        Refused: the program refused the scene.

    """
    able = asking.subject.capabilities
    if (why := able.refusal(scene)) is not None:  # possible for a finer image of the case
        raise Refused(why)
    handed, power = able.handed(scene), _power(asking.subject, scene)
    if power:
        handed = _brightened(handed, power)
    if able.lights != 1 or len(scene.lights) < 2:
        return _dimmed(_rendered(asking, scene, handed, samples, keep), power)
    parts = [
        _rendered(asking, scene, replace(handed, lights=(light,)), samples, keep and keep / f"light-{index}")
        for index, light in enumerate(handed.lights)
    ]
    return _dimmed(reduce(_added, parts), power)


def _rendered(asking: _Asking, scene: Scene, handed: Scene, samples: int, keep: Path | None) -> Taken:
    """Return the program's image of the scene `handed`, with the object indices of `scene`."""
    able = asking.subject.capabilities
    with _Place(within=asking.server.folder if asking.server is not None else None) as place:
        rebuild = rebuilt(handed, able.stand_ins)
        path = hand_over(rebuild.scene, place.folder, able.scene_format)
        most = allowance(scene)
        ended = asking.ended(place, path, rebuild.scene, samples=samples, output=most)
        if keep is not None:
            line = asking.line(rebuild.scene, samples=samples)
            keep_call(keep, rebuild.scene, line, ended, notes=able.told(scene), scene_format=able.scene_format)
        _conclude(ended, place, asking.subject)
        image = place.folder / asking.subject.image_name
        if keep is not None:
            keep_output(keep, image)
        try:
            taken = take_back(image, handed, most=most, transfer=able.transfer)
        except ValueError as wrong:
            raise ProgramError(f"the program ended well, but {wrong}") from None
    wanted = IMAGE_STAGES if able.stages is None else able.stages
    missing = [stage for stage in able.stages or () if stage in stages_of(scene) and stage not in taken.images]
    return Taken(
        images=rebuild.named_as_asked({stage: image for stage, image in taken.images.items() if stage in wanted}),
        resolutions=taken.resolutions,
        lacking=dict.fromkeys(missing, "it declares this stage and wrote no channel of it")
        | {stage: why for stage, why in taken.lacking.items() if stage in wanted},
    )


# Sums over lights, and images in formats whose largest value is 1: the lights are scaled by a power of two, and the
# images are scaled back; both are exact.


def notes_on(subject: Subject, scene: Scene) -> tuple[str, ...]:
    """Return sentences on the parts of a scene that are handed over in another form with the same image."""
    able = subject.capabilities
    power = _power(subject, scene) if able.refusal(scene) is None else 0
    what = f"Handed over with the flux of each light times 2^{power}, to the range of the picture; it is scaled back."
    return (*able.told(scene), *[what] * (power != 0))


LIT = (Stage.IRRADIANCE, Stage.EXITANCE, Stage.RADIANCE)
BRIGHTEST = 0.9  # the largest radiance after scaling, of a format that clips at 1; larger errors are clipped visibly


def _power(subject: Subject, scene: Scene) -> int:
    """Return the exponent of 2 by which the lights are scaled, so that the image fits the format's range."""
    says = subject.capabilities.says
    short = Path(subject.image_name).suffix.removeprefix(".") in CLIPPED or (says is not None and says.half)
    if not short or not scene.lights:
        return 0
    brightest = float(Analytic().render(scene, [Stage.RADIANCE])[Stage.RADIANCE].max())
    return int(np.floor(np.log2(BRIGHTEST / brightest))) if 0 < brightest < np.inf else 0


def _brightened(scene: Scene, power: int) -> Scene:
    def flux(values: tuple[float, float, float]) -> tuple[float, float, float]:
        red, green, blue = np.ldexp(values, power).tolist()
        return red, green, blue

    return replace(scene, lights=tuple(replace(light, flux=flux(light.flux)) for light in scene.lights))


def _dimmed(taken: Taken, power: int) -> Taken:
    """Scale an image back to the lights of the case; its lights were scaled by 2^power."""
    if not power:
        return taken
    images = {stage: np.ldexp(image, -power) if stage in LIT else image for stage, image in taken.images.items()}
    resolutions = {
        stage: _scaled(coarse, 2.0**-power) if stage in LIT else coarse for stage, coarse in taken.resolutions.items()
    }
    return replace(taken, images=images, resolutions=resolutions)


def _scaled(coarse: Resolution, factor: float) -> Resolution:
    steps = None if coarse.steps is None else coarse.steps * factor
    return replace(coarse, absolute=coarse.absolute * factor, steps=steps)


def _added(first: Taken, second: Taken) -> Taken:
    """Return the sum of two images of a scene under different lights; visibility has a channel per light."""
    images = dict(first.images)
    for stage, image in second.images.items():
        if stage in images and stage in LIT:
            images[stage] = images[stage] + image
        elif stage in images and stage is Stage.VISIBILITY:
            images[stage] = np.concatenate([images[stage], image], axis=-1)
    resolutions = dict(first.resolutions)
    for stage, coarse in second.resolutions.items():
        if stage in resolutions and stage in LIT:
            before = resolutions[stage]
            steps = None if before.steps is None or coarse.steps is None else before.steps + coarse.steps
            relative = max(before.relative, coarse.relative)
            about = {"relative": relative, "absolute": before.absolute + coarse.absolute, "steps": steps}
            resolutions[stage] = replace(before, **about)
    return Taken(images=images, resolutions=resolutions, lacking=first.lacking | second.lacking)


def _conclude(ended: Ended, place: "_Place", subject: Subject) -> None:
    """Raise `Refused` or `ProgramError` if the call refused the scene, failed, or wrote outside of its folder."""
    if ended.refusal is not None:
        raise Refused(ended.refusal)
    if ended.problem is not None:
        prefix = "the function fails:" if subject.transport == FUNCTION else "the program answers with an error:"
        error = ProgramError(f"{prefix if ended.reported else 'the program gave no image:'} {ended.problem}")
        error.stopped, error.lost = ended.stopped, ended.lost
        raise error
    if strays := place.strays():
        raise ProgramError(f"the program wrote outside of its folder: {strays[0]}")


def _mean(asking: _Asking, scene: Scene, samples: int) -> np.ndarray:
    """Return radiance averaged over samples x samples points per pixel, by the program or from its finer image."""
    averages = asking.subject.averages
    taken = _image(asking, scene, samples=samples) if averages else _image(asking, finer(scene, samples))
    if Stage.RADIANCE not in taken.images:
        raise ProgramError("the program wrote no channel of the radiance that is to be averaged")
    return taken.images[Stage.RADIANCE] if averages else box_mean(taken.images[Stage.RADIANCE], samples)


class _Place:
    """A folder for one call, in an empty parent folder: further entries in the parent are detected as stray files.

    For a program that stays alive, the parent is its working folder `within`, in which it may write.
    """

    def __init__(self, *, within: Path | None = None) -> None:
        self._within = within

    def __enter__(self) -> "_Place":
        self._above = Path(tempfile.mkdtemp(prefix="rayproof-")) if self._within is None else self._within
        # The name of the case is not in the path, since a program could recognise the case by it.
        self.folder = Path(tempfile.mkdtemp(prefix="call-", dir=self._above))
        return self

    def strays(self) -> list[str]:
        """Return the names of other entries in the parent folder."""
        if self._within is not None:
            return []
        return sorted(name for name in os.listdir(self._above) if name != self.folder.name)  # noqa: PTH208

    def __exit__(self, *_: object) -> None:
        shutil.rmtree(self._above if self._within is None else self.folder, ignore_errors=True)
