"""A stranger's program as a candidate: called once per image, and whatever becomes of it is one sentence."""

import os
import shutil
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np

from rayproof.cases.scene import Mesh, Scene
from rayproof.cases.stages import IMAGE_STAGES, Stage, exr_channels
from rayproof.reports.judge.comparison.box_filter import box_mean, finer
from rayproof.reports.judge.oracle import stages_of
from rayproof.reports.judge.renderers import Candidate
from rayproof.reports.subjects import ITEMS_OF_OTHERS, Subject
from rayproof.reports.subjects.calls import Ended, call
from rayproof.reports.subjects.capabilities import Capabilities, capabilities_from
from rayproof.reports.subjects.image_reading import FLOAT, Taken, take_back
from rayproof.reports.subjects.keeping import Keep, filled, image_name, keep_call, keep_output
from rayproof.reports.subjects.request import hand_over, triangulated

CAMERA = "The protocol has no channel for matrices."
ROOM = 64 * 2**20  # bytes that a program may write beside its image, for logs and the like
GENEROUS = 16  # times the bytes of an image with every channel: other channels, other formats, drafts
UNSAID = "It wrote no channel of it."
ASKING = "--capabilities"


class ProgramError(Exception):
    """A program that gave nothing that could be judged; the message is one sentence."""


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
        return replace(blank, error=str(wrong))
    unsupported = {stage: UNSAID for stage in stages if stage not in taken.images} | {Stage.CAMERA: CAMERA}
    answers = {stage: image for stage, image in taken.images.items() if stage in stages}
    resolutions = dict(taken.resolutions)
    if able.chained:
        # The oracle continues from what was written, the program went on from what it had before.
        resolutions = dict.fromkeys(answers, FLOAT) | resolutions
    return replace(blank, answers=answers, unsupported=unsupported, resolutions=resolutions, mean=mean)


def _image(subject: Subject, scene: Scene, case: str, *, samples: int = 1, keep: Keep | None = None) -> Taken:
    """Return one image of the program.

    Raises:
        ProgramError: it gave none that can be used.
        Refused: it says that it cannot.

    """
    able = subject.capabilities
    with _Place(case) as place:
        given = triangulated(scene) if able.triangulated else scene
        path = hand_over(given, place.folder)
        arguments = filled(subject.command, path.parent, samples=samples)
        most = allowance(scene)
        ended = _called(subject, arguments, place, seconds=subject.seconds, output=most)
        if keep is not None:
            keep_call(keep.folder, given, filled(subject.command, Path(), samples=samples), ended)
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
    for stage in able.stages or ():
        if stage not in taken.images and stage in stages_of(scene):
            raise ProgramError(f"the program declares {stage} and wrote no channel of it")
    kept = {stage: image for stage, image in taken.images.items() if able.stages is None or stage in able.stages}
    return Taken(images=_without_faces(kept, scene) if able.triangulated else kept, resolutions=taken.resolutions)


def _conclude(ended: Ended, place: "_Place") -> None:
    """Raise what the call came to, if it came to no image."""
    if ended.refusal is not None:
        raise Refused(ended.refusal)
    if ended.problem is not None:
        raise ProgramError(f"the program gave no image: {ended.problem}")
    if strays := place.strays():
        raise ProgramError(f"the program wrote outside of its folder: {strays[0]}")


def _mean(subject: Subject, scene: Scene, case: str, samples: int) -> np.ndarray:
    """Return radiance box-filtered over samples x samples points a pixel: its own mean, or ours of a finer image."""
    averages = any("{samples}" in word for word in subject.command)
    taken = _image(subject, scene, case, samples=samples) if averages else _image(subject, finer(scene, samples), case)
    if Stage.RADIANCE not in taken.images:
        raise ProgramError("the program wrote no channel of the radiance that is to be averaged")
    return taken.images[Stage.RADIANCE] if averages else box_mean(taken.images[Stage.RADIANCE], samples)


def _without_faces(images: dict[Stage, np.ndarray], scene: Scene) -> dict[Stage, np.ndarray]:
    """Return the images with face 0 on what is a mesh only for the program."""
    if Stage.OBJECT not in images:
        return images
    objects = images[Stage.OBJECT].copy()
    for index, shape in enumerate(scene.shapes):
        if not isinstance(shape, Mesh):
            objects[objects[..., 0] == index, 1] = 0.0
    return images | {Stage.OBJECT: objects}


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
