"""A stranger's program as a candidate: called once per image, and whatever becomes of it is one sentence."""

import os
import shutil
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np

from rayproof.cases.case import ITEMS_OF_OTHERS
from rayproof.cases.scene import Scene
from rayproof.cases.stages import IMAGE_STAGES, Stage, exr_channels
from rayproof.reports.judge.answers import Candidate
from rayproof.reports.judge.box_filter import box_mean, finer
from rayproof.reports.judge.oracle import stages_of
from rayproof.reports.subjects import Subject
from rayproof.reports.subjects.calls import Ended, call
from rayproof.reports.subjects.capabilities import Capabilities, capabilities_from
from rayproof.reports.subjects.image_reading import FLOAT, Taken, take_back
from rayproof.reports.subjects.keeping import Keep, filled, image_name, keep_call, keep_output
from rayproof.reports.subjects.request import hand_over, rebuilt

CAMERA = "The protocol has no channel for matrices."
ROOM = 64 * 2**20  # bytes that a program may write beside its image, for logs and the like
GENEROUS = 16  # times the bytes of an image with every channel: other channels, other formats, drafts
UNSAID = "It wrote no channel of it."
ASKING = "--capabilities"


class ProgramError(Exception):
    """A program that gave nothing that could be judged; the message is one sentence."""

    stopped = False  # its time was over


class Refused(Exception):  # noqa: N818  an answer, not a mishap
    """A program that says it cannot draw a scene, in its own words."""


def ask_capabilities(subject: Subject, *, seconds: float) -> Capabilities:
    """Return what the program declares; nothing if it does not know the question.

    Raises:
        ValueError: its answer is not as the protocol asks.

    """
    with _Place("capabilities") as place:
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
        surroundings=subject.surroundings,
    )


def allowance(scene: Scene) -> int:
    """Return how many bytes a program may write in one call."""
    channels = sum(len(exr_channels(stage, lights=len(scene.lights))) for stage in IMAGE_STAGES)
    return ROOM + GENEROUS * channels * scene.camera.width * scene.camera.height * 4


def candidate(subject: Subject, scene: Scene, *, case: str, samples: int, keep: Keep | None = None) -> Candidate:
    """Return the program's answers to a scene, or the error that it ended in; never raises for what it does.

    `keep` says where to leave the call itself, to be looked at: what it was handed, and what it said.
    """
    able, stages = subject.capabilities, stages_of(scene)
    blank = Candidate(
        name=subject.name,
        precision="float32",  # never better than what the file holds, whatever it computes in
        items=ITEMS_OF_OTHERS,
        shadow_epsilon=able.shadow_epsilon,
        ray_epsilon=able.ray_epsilon,
        answers=None,
        chained=able.chained,
    )
    why = able.refusal(scene)
    try:
        if why is not None:
            raise Refused(why)
        taken = _image(subject, scene, case, keep=keep)
        mean = _mean(subject, scene, case, samples) if samples > 1 and Stage.RADIANCE in taken.images else None
    except Refused as cannot:
        return replace(blank, answers={}, unsupported=dict.fromkeys(stages, str(cannot)))
    except ProgramError as wrong:
        return replace(blank, error=str(wrong), stopped=wrong.stopped)
    unsupported = {stage: UNSAID for stage in stages if stage not in taken.images and stage not in taken.lacking}
    unsupported[Stage.CAMERA] = CAMERA
    answers = {stage: image for stage, image in taken.images.items() if stage in stages}
    resolutions = dict(taken.resolutions)
    if able.chained:
        # The oracle continues from what was written, the program went on from what it had before.
        resolutions = dict.fromkeys(answers, FLOAT) | resolutions
    found = replace(blank, answers=answers, unsupported=unsupported, resolutions=resolutions, mean=mean)
    return replace(found, lacking=taken.lacking)


def _image(subject: Subject, scene: Scene, case: str, *, samples: int = 1, keep: Keep | None = None) -> Taken:
    """Return one image of the program.

    Raises:
        ProgramError: it gave none that can be used.
        Refused: it says that it cannot.

    """
    able = subject.capabilities
    with _Place(case) as place:
        given = rebuilt(scene, able.stand_ins)
        path = hand_over(given.scene, place.folder)
        arguments = filled(subject.command, path.parent, samples=samples)
        most = allowance(scene)
        ended = _called(subject, arguments, place, seconds=subject.seconds, output=most)
        if keep is not None:
            words = filled(subject.command, Path(), samples=samples)
            keep_call(keep.folder, given.scene, words, ended, notes=able.told(scene))
        _conclude(ended, place)
        image = place.folder / image_name(subject.command)
        try:
            taken = take_back(image, scene, most=most)
        except ValueError as wrong:
            if keep is not None:
                keep_output(keep.folder, image)
            raise ProgramError(f"the program ended well, but {wrong}") from None
        if keep is not None and keep.image:
            keep_output(keep.folder, image)
    wanted = IMAGE_STAGES if able.stages is None else able.stages
    missing = [stage for stage in able.stages or () if stage in stages_of(scene) and stage not in taken.images]
    return Taken(
        images=given.named_as_asked({stage: image for stage, image in taken.images.items() if stage in wanted}),
        resolutions=taken.resolutions,
        lacking=dict.fromkeys(missing, "it declares this stage and wrote no channel of it")
        | {stage: why for stage, why in taken.lacking.items() if stage in wanted},
    )


def _conclude(ended: Ended, place: "_Place") -> None:
    """Raise what the call came to, if it came to no image."""
    if ended.refusal is not None:
        raise Refused(ended.refusal)
    if ended.problem is not None:
        error = ProgramError(f"the program gave no image: {ended.problem}")
        error.stopped = ended.stopped
        raise error
    if strays := place.strays():
        raise ProgramError(f"the program wrote outside of its folder: {strays[0]}")


def _mean(subject: Subject, scene: Scene, case: str, samples: int) -> np.ndarray:
    """Return radiance box-filtered over samples x samples points a pixel: its own mean, or ours of a finer image."""
    averages = any("{samples}" in word for word in subject.command)
    taken = _image(subject, scene, case, samples=samples) if averages else _image(subject, finer(scene, samples), case)
    if Stage.RADIANCE not in taken.images:
        raise ProgramError("the program wrote no channel of the radiance that is to be averaged")
    return taken.images[Stage.RADIANCE] if averages else box_mean(taken.images[Stage.RADIANCE], samples)


class _Place:
    """A folder for one call, with nothing beside it: what appears there was written outside of the folder."""

    def __init__(self, case: str) -> None:
        self._case = case

    def __enter__(self) -> "_Place":
        self._above = Path(tempfile.mkdtemp(prefix="rayproof-"))
        self.folder = Path(tempfile.mkdtemp(prefix=self._case.replace("/", "-") + "-", dir=self._above))
        return self

    def strays(self) -> list[str]:
        """Return what lies beside the folder."""
        return sorted(name for name in os.listdir(self._above) if name != self.folder.name)  # noqa: PTH208

    def __exit__(self, *_: object) -> None:
        shutil.rmtree(self._above, ignore_errors=True)
