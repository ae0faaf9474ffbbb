"""Scene files and streams of scenes as cases; estimates of a case's time and memory.

Of a stream only the scenes' names and positions stay in memory, so that a run of a hundred thousand scenes needs little
more than a run of a thousand. All scenes are read once before anything starts, so that a wrong scene is reported then.
The constants of time and memory are measured: docs/using.md has the machine and the errors.
"""

import hashlib
import json
import os
import re
import time
import zlib
from array import array
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from errno import EIO
from pathlib import Path
from typing import Any, overload

import psutil

from rayproof.cases.case import Case, covering
from rayproof.cases.scene import Mesh, Scene, SceneError
from rayproof.cases.scene_json import LARGEST, load_scene, scene_from_bytes
from rayproof.reports.results.files import legible
from rayproof.reports.subjects import THE_TRACER, Subject

# Seconds of one processor: of the slowest renderer, and of the judge for one configuration.
RENDER_A_PIXEL, JUDGE_A_PIXEL = 17e-6, 30e-6
RENDER_A_PIXEL_AND_LIGHT, JUDGE_A_PIXEL_AND_LIGHT = 35e-6, 16e-6  # more, for each light
RENDER_A_TRIANGLE, JUDGE_A_TRIANGLE = 25e-6, 40e-6
USUAL_SHARE = 0.5  # of the slowest renderer's time: the average of the panel
# Bytes of the judge's process, which is the largest: at its start, and per pixel, light and triangle.
BEGINNING = 300e6
BYTES_A_PIXEL, BYTES_A_PIXEL_AND_LIGHT, BYTES_A_TRIANGLE = 5000, 400, 700
BYTES_AN_IMAGE = 330  # per pixel, if only the tracer renders
# Bytes of the results folder per pixel and renderer; an eighth of them for a case that passed.
KEPT_A_PIXEL, KEPT_A_PIXEL_AND_LIGHT = 90, 4

MOST_PIXELS = 2**22  # of an image that is judged
USUAL_LIMIT = 120.0  # s, for one render or one judgement
SLACK = 10.0  # times the estimate: this machine may be slower or busy
LARGE = 2**30  # bytes of a process; larger ones run one at a time
LONGEST = 7 * 86400.0  # s of one processor that a run may be estimated to take


@dataclass(frozen=True, kw_only=True)
class Estimate:
    """The cost of a case."""

    seconds: float  # of one processor, for all renders and the judgement
    longest: float  # s, of the longest render or judgement
    memory: float  # bytes of the largest process
    disk: float  # bytes of the results folder, at most


def triangles_of(scene: Scene) -> int:
    """Return the number of triangles of a scene's meshes."""
    return sum(len(shape.faces) for shape in scene.shapes if isinstance(shape, Mesh))


def estimate(case: Case, *, configurations: int, references: int) -> Estimate:
    """Estimate a case's cost for this number of the subject's configurations and this number of references."""
    scene, camera = case.scene, case.scene.camera
    pixels, lights, triangles = camera.width * camera.height, len(scene.lights), triangles_of(scene)
    lit = pixels * max(0, lights - 1)  # the cost per pixel includes the first light
    finer = case.samples**2 if case.samples > 1 else 0
    render = RENDER_A_PIXEL * pixels * (1 + finer) + RENDER_A_PIXEL_AND_LIGHT * lit + RENDER_A_TRIANGLE * triangles
    judge = configurations * (JUDGE_A_PIXEL * pixels + JUDGE_A_PIXEL_AND_LIGHT * lit + JUDGE_A_TRIANGLE * triangles)
    kept = (configurations + references) * (KEPT_A_PIXEL * pixels + KEPT_A_PIXEL_AND_LIGHT * lit)
    return Estimate(
        seconds=judge + USUAL_SHARE * render * (configurations + references),
        longest=max(render, judge),
        memory=memory_of(scene),
        disk=kept,
    )


def memory_of(scene: Scene) -> float:
    """Estimate the memory [bytes] of the largest process for a scene."""
    pixels = scene.camera.width * scene.camera.height
    return BEGINNING + pixels * _bytes_a_pixel(scene) + triangles_of(scene) * BYTES_A_TRIANGLE


def _bytes_a_pixel(scene: Scene) -> float:
    return BYTES_A_PIXEL + BYTES_A_PIXEL_AND_LIGHT * max(0, len(scene.lights) - 1)


def is_large(scene: Scene) -> bool:
    """Return whether a scene's renders and judgement are to run one at a time."""
    return memory_of(scene) > LARGE


def deadline(case: Case, *, configurations: int, references: int) -> float:
    """Return the time limit [s] of one render of a case, or of its judgement, unless an option sets another."""
    cost = estimate(case, configurations=configurations, references=references)
    return max(USUAL_LIMIT, SLACK * cost.longest)


def refuse_beyond_all(case: Case, name: str) -> None:
    """Raise SceneError if a case is too large to be judged: by its pixels, its memory, or its processor time."""
    camera = case.scene.camera
    size = f"{name}: {camera.width} x {camera.height} px"
    if camera.width * camera.height > MOST_PIXELS:
        raise SceneError(f"{size} are more than the {MOST_PIXELS} that are judged; make the image smaller")
    cost = estimate(case, configurations=2, references=5)
    available = psutil.virtual_memory().total
    if cost.memory > available:
        raise SceneError(
            f"{size} and its meshes take about {cost.memory / 1e9:.0f} GB of memory to judge, and this machine has "
            f"{available / 1e9:.0f} GB; make the image smaller"
        )
    if cost.seconds > LONGEST:
        raise SceneError(
            f"{size} take about {cost.seconds / 86400:.0f} days of processor time, and at most "
            f"{LONGEST / 86400:.0f} are tried; make the image smaller"
        )


def refuse_too_large(scene: Scene, name: str) -> None:
    """Raise SceneError if this machine has less than half of the estimated memory for the tracer's image of a scene.

    Half, since the estimate is rough: a scene that may fit is tried.
    """
    camera, available = scene.camera, psutil.virtual_memory().total
    needed = camera.width * camera.height * BYTES_AN_IMAGE + triangles_of(scene) * BYTES_A_TRIANGLE
    if needed > 2 * available:
        raise SceneError(
            f"{name}: {camera.width} x {camera.height} px and its meshes take about {needed / 1e9:.0f} GB of memory, "
            f"and this machine has {available / 1e9:.0f} GB; make the image smaller"
        )


# Largest share of pixels that nearby problems may explain in a user's scene, whose view was not chosen for this.
MOST_EXPLAINED = 0.5


FAMILY = "file"
SCENES = "scenes"  # the folder of scene files in a results folder


def scene_path(name: str) -> Path:
    """Return the path of a scene file; a file of a results folder is also found from inside that folder.

    A report shows a command such as `rayproof run report/scenes/file/mine.json`, with a path relative to the folder in
    which the run was started. Inside the report's folder the command names the same scene.
    """
    path = Path(name)
    if SCENES in path.parts and not path.exists():
        place = len(path.parts) - 1 - path.parts[::-1].index(SCENES)
        within = Path(*path.parts[place:])
        if within.is_file() and Path("results.json").is_file():
            return within
    return path


def place_of(name: str) -> str:
    """Return the path of a case's files below `scenes` and `images` of a results folder: the case's name.

    There may be any number of scene files, so that they are spread over 256 folders by a digest: with a hundred
    thousand files no folder has more than some 500 entries.
    """
    family, _, rest = name.partition("/")
    if family != FAMILY:
        return name
    digest = hashlib.sha256(rest.partition("/rows-")[0].encode(errors="replace")).hexdigest()
    return f"{family}/{digest[:2]}/{rest}"


def cases_of_files(paths: Sequence[Path]) -> tuple[Case, ...]:
    """Return a case for each scene file, named by its stem; a file that is given twice makes one case.

    Results are stored by name: files of several folders with the same stem get different numbers.

    Raises:
        SceneError, OSError: a file cannot be read.

    """
    cases: list[Case] = []
    names: set[str] = set()
    for path in {path.resolve(): path for path in paths}.values():
        # A stem of only dots would name this folder or its parent.
        stem = legible(path.stem.strip(".") or "scene")
        name = next(name for name in (stem, *(f"{stem}-{n}" for n in range(2, len(paths) + 2))) if name not in names)
        names.add(name)
        cases.append(case_of_file(path, name=name))
    return tuple(cases)


def case_of_file(path: Path, *, name: str | None = None) -> Case:
    """Return the case of a scene file; raise SceneError or OSError if it cannot be read."""
    words = f"The scene that {legible(path.name)} describes."
    return case_of_scene(load_scene(path), name=f"{FAMILY}/{name or legible(path.stem)}", stresses=words)


def case_of_scene(scene: Scene, *, name: str, stresses: str) -> Case:
    """Return the case of a user's scene, which is not tuned."""
    return Case(
        name=name,
        scene=scene,
        stresses=stresses,
        covers=covering(scene),
        least_interior=0,
        most_explained=MOST_EXPLAINED,
        tuned=False,
    )


LINES = ".jsonl"
A_FOLDER = 1000  # scenes without a name in one folder of the results
LONGEST_NAME = 200  # characters
NOW_AND_THEN = 5.0  # s between messages about the number of scenes that are read
_NAME = re.compile(r"(?!\.+(/|$))[\w+=,@ -][\w.+=,@ -]*(/(?!\.+(/|$))[\w+=,@ .-]+)*", re.ASCII)


class SceneStream(Sequence[Case]):
    """The cases of a folder's scene files, in the order of their names, or of a file's lines.

    A line has the content of a scene file and an optional `name`; without it the scene is named by its number. In a
    folder a scene is named by its path.

    Raises:
        SceneError: a scene is wrong, or two have the same name; the message has the file and the line.
        OSError: nothing can be read there.

    """

    def __init__(
        self, path: Path, subject: Subject = THE_TRACER, *, say: Callable[[str], None] = lambda _: None
    ) -> None:
        """Read every scene once; `say` is called from time to time with the progress in words."""
        self._path = path
        last_message = time.monotonic()
        self._files: list[str] = []  # in a folder, relative to it
        self._starts, self._lengths, self._sums = array("Q"), array("Q"), array("L")
        self._names: list[str] = []
        self.covers: dict[tuple[str, ...], int] = {}  # covered items: the number of the first scene with them
        numbers: dict[str, int] = {}
        for number, data in enumerate(self._folder() if path.is_dir() else self._lines()):
            case = self._case(data, number)
            try:
                refuse_beyond_all(case, "")
            except SceneError as error:
                raise SceneError(f"{self._where(number)}{error}") from None
            if case.name in numbers:
                first = self._where(numbers[case.name])
                raise SceneError(f"{self._where(number)}: {case.name} is the name of {first} too")
            self.covers.setdefault(case.covers, number)
            numbers[case.name] = number
            self._sums.append(zlib.crc32(data))
            self._names.append(case.name)
            if time.monotonic() - last_message > NOW_AND_THEN:
                say(f"{number + 1} scenes of {legible(str(path))} are read{self._share(number)}")
                last_message = time.monotonic()
        if not self._names:
            raise SceneError(f"{path}: there are no scenes in it")

    def __len__(self) -> int:
        return len(self._names)

    @overload
    def __getitem__(self, index: int) -> Case: ...
    @overload
    def __getitem__(self, index: slice) -> Sequence[Case]: ...
    def __getitem__(self, index: int | slice) -> Case | Sequence[Case]:
        if isinstance(index, slice):
            return [self[number] for number in range(len(self))[index]]
        number = range(len(self))[index]
        data = self._read(number)
        if zlib.crc32(data) != self._sums[number]:
            raise OSError(EIO, "it changed while it was read", self._where(number))
        return self._case(data, number)

    def _share(self, number: int) -> str:
        """Return in words the share of all scenes that is read after the scene of this number."""
        read, every = number + 1, len(self._files)
        if not self._files:
            read, every = self._starts[number] + self._lengths[number], self._path.stat().st_size
        return f" ({100 * read // max(1, every)} %)"

    def _folder(self) -> Iterator[bytes]:
        self._files = sorted(path.relative_to(self._path).as_posix() for path in self._path.rglob("*.json"))
        for number in range(len(self._files)):
            yield self._read(number)

    def _lines(self) -> Iterator[bytes]:
        with self._path.open("rb") as file:
            while line := file.readline(LARGEST + 1):
                if not line.strip():
                    continue
                self._starts.append(file.tell() - len(line))
                self._lengths.append(len(line))
                if len(line) > LARGEST:
                    raise SceneError(f"{self._where(len(self._starts) - 1)}: has more than {LARGEST} bytes")
                yield line

    def _read(self, number: int) -> bytes:
        if self._files:
            path = self._path / self._files[number]
            if not path.resolve().is_relative_to(self._path.resolve()):
                raise SceneError(f"{legible(str(path))}: is a link that leads out of {legible(str(self._path))}")
            if not path.is_file() or path.stat().st_size > LARGEST:
                raise SceneError(f"{legible(str(path))}: is no file of at most {LARGEST} bytes")
            return path.read_bytes()
        with self._path.open("rb") as file:
            file.seek(self._starts[number])
            return file.read(self._lengths[number])

    def _where(self, number: int) -> str:
        if self._files:
            return legible(os.path.join(self._path, self._files[number]))  # noqa: PTH118  as it is written
        with self._path.open("rb") as file:  # blank lines count, too
            before = sum(block.count(b"\n") for block in _blocks(file, self._starts[number]))
        return f"{legible(str(self._path))}, line {before + 1}"

    def _case(self, data: bytes, number: int) -> Case:
        name: Any = None

        def named(document: Any) -> Any:
            nonlocal name
            if not self._files and isinstance(document, dict) and "name" in document:
                name = document.pop("name")
            return document

        try:
            folder = (self._path / self._files[number]).parent if self._files else self._path.parent
            scene = scene_from_bytes(data, folder=folder, where="", prepared=named)
            if self._files:
                name = self._files[number].removesuffix(".json")
            elif name is None:
                name = f"{self._path.stem}/{number // A_FOLDER}/{number % A_FOLDER}"
            if not isinstance(name, str) or len(name) > LONGEST_NAME or _NAME.fullmatch(name) is None:
                raise SceneError(
                    f": name: must be words of letters, digits and ._+=,@- with / between, got {json.dumps(name)[:80]}"
                )
        except SceneError as error:
            raise SceneError(f"{self._where(number)}{_after(str(error))}") from None
        return case_of_scene(scene, name=f"{FAMILY}/{name}", stresses=f"The scene {name} of {self._path.name}.")


def _after(message: str) -> str:
    return message if message.startswith(":") else f": {message}"


def _blocks(file: Any, length: int) -> Iterator[bytes]:
    while length > 0 and (block := file.read(min(length, 2**20))):
        length -= len(block)
        yield block
