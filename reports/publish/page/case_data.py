"""The scripts of one case for the page: record, pixels (checked and cleaned), and the 3-D view.

A browser runs the scripts of a results folder, and the folder may come from an untrusted person. Therefore a script
that is already in the folder is rewritten: its JSON is extracted and validated, and the code around it is rayproof's
own. The page of the 3-D views has its own security policy, which allows its script and style by hash, the vendored
viewer, and nothing else. Many cases are written in parallel, because most of the time is spent on the compression of
images.
"""

import base64
import hashlib
import html
import json
import math
import os
import shlex
from collections.abc import Callable, Iterable, Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from contextlib import contextmanager
from importlib.resources import files
from itertools import islice
from multiprocessing import get_context
from pathlib import Path, PurePath
from typing import Any, TypeVar

import numpy as np
from msgspec import structs

from rayproof.cases.scene_json import pack, unpack
from rayproof.cases.stages import IMAGE_STAGES, Stage, exr_channels
from rayproof.reports.program_name import NAME
from rayproof.reports.publish.page.previews import preview_of
from rayproof.reports.publish.scene3d.parts import look, thinned
from rayproof.reports.publish.scene3d.stills import compared, picture_path
from rayproof.reports.results.case_records import CaseRecord
from rayproof.reports.results.case_table import briefs
from rayproof.reports.results.compact import compact_case
from rayproof.reports.results.files import write_text
from rayproof.reports.results.float_codec import inflated, pack_json
from rayproof.reports.results.images import handed_over, inside, keeps_images, kept_images, script, write_pixels
from rayproof.reports.results.outcomes import Outcome
from rayproof.reports.results.records import RunRecord
from rayproof.reports.results.wrong_pixels import plain_reason

SCENES = "scenes"  # the folder of scene files in a results folder
FEW = 16  # cases with images to compress per process; a process for fewer would not be worth its start
AT_ONCE = 32  # cases in memory at a time

Answer = TypeVar("Answer")
Job = tuple[Any, ...]
Write = Callable[[Callable[..., Answer], Iterable[Job]], Iterator[Answer]]


@contextmanager
def writers(heavy: int) -> Iterator[Write]:
    """Provide a function `(write, jobs)` that yields `write(*job)` for each job, in order, on all processors.

    `heavy` is the number of jobs with images to compress. At most `AT_ONCE` jobs are taken from `jobs` at a time.
    """
    workers = min(os.cpu_count() or 1, heavy // FEW)
    if workers < 2:
        yield lambda write, jobs: (write(*job) for job in jobs)
        return
    with ProcessPoolExecutor(workers, mp_context=get_context("spawn")) as pool:

        def answers(write: Callable[..., Answer], jobs: Iterable[Job]) -> Iterator[Answer]:
            waiting = iter(jobs)
            while batch := list(islice(waiting, AT_ONCE)):
                yield from pool.map(write, *zip(*batch, strict=True), chunksize=4)

        yield answers


def all_of(write: Callable[..., Answer], jobs: Sequence[Job], *, heavy: int) -> list[Answer]:
    """Return `write(*job)` for each of `jobs`, in order; `heavy` is the number of jobs with images to compress."""
    with writers(heavy) as written:
        return list(written(write, jobs))


LARGEST = 2**30  # bytes of a script
KINDS = {"data": str, "by": str, "curved": bool, "height": int, "width": int, "channels": int}  # types by image key
MOST_CHANNELS = 1000


def clean_pixels(folder: Path, name: str) -> str | None:
    """Rewrite a case's images unless they have the format of `write_pixels`; return why they are invalid, or None.

    The page must not refer to an invalid script, because it would run it.
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
    """Validate and return the data of a script of pixels; raise ValueError with the path of the invalid value."""
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
        if not isinstance(value, kind) or (kind is int and not (type(value) is int and value >= 1)):
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


def _is_numbers(value: Any) -> bool:
    """Return whether a value is a number or a structure of numbers, such as the parameters of a prediction."""
    if isinstance(value, dict):
        return all(map(_is_numbers, value.values()))
    if isinstance(value, list):
        return all(map(_is_numbers, value))
    return value is None or (isinstance(value, int | float) and math.isfinite(value)) or value in ("inf", "-inf", "nan")


def write_case_data(folder: Path, path: Path, case: CaseRecord) -> list[Path]:
    """Write the script with the record of `case` and, unless the run wrote it, that with its pixels; return paths."""
    written, notes = [], []
    pixels, scene = case.get("pixels"), scene_of(folder, case)
    if isinstance(pixels, str) and (why := clean_pixels(folder, pixels)) is not None:
        pixels = None
        notes.append(why)
    if pixels is None:
        renders, unread = kept_images(folder, case)
        notes += unread
        images = path.with_name(f"{path.stem}.pixels.js")
        pixels = images.relative_to(folder).as_posix() if renders else None
        if pixels is not None:
            written.append(write_pixels(images, pixels, renders, scene))
    if pixels is None and not keeps_images(case) and case["verdict"] == Outcome.PASS:
        notes.append("It passed, and this run keeps no images of such a case; its command makes them again.")
    command, probe = commands_of(case)
    if "preview" in case:
        notes.append(f"The run's images of the worst cases fill its space; `{command} --keep-images all` makes these.")
    if pixels is not None and pixels == case.get("pixels") and case["verdict"] == Outcome.PASS:
        keep_all = f"`{command} --keep-images all`"
        notes.append(f"Of a case that passed a run keeps the images of two renderers; {keep_all} keeps everybody's.")
    lights = case.get("lights")
    lights = lights if isinstance(lights, int) and 0 <= lights < 1000 else 0
    record = {
        **case,
        "pixels": pixels,
        "command": command,
        "probe": probe,
        "picture": picture_of(folder, case),
        "preview": preview_of(folder, case),
        "view": None if scene is None else view_of(scene, case),
        "small": small_of(folder, case),
        "notes": [f"{note.get('reference')}: {note.get('note')}" for note in case.get("notes", [])] + notes,
        "channels": {stage.value: [_short(name) for name in exr_channels(stage, lights=lights)] for stage in Stage},
        "adjudication": {
            stage: {**matrix, "why": plain_reason(matrix.get("why"))}
            for stage, matrix in (case.get("adjudication") or {}).items()
        },
        "checks": [structs.replace(check, reason=plain_reason(check.reason)) for check in case.get("checks", [])],
    }
    text = pack_json(compact_case(record))
    return [write_text(path, script(path.relative_to(folder).as_posix(), text)), *written]


def commands_of(case: CaseRecord) -> tuple[str, tuple[str, str]]:
    """Return the command that runs a case again, and the parts before and after the pixel of the command `probe`.

    The page may be read on another machine, so the paths of the program and the scene are relative: to the folder of
    the run's start, or with the name of the results folder.
    """
    try:
        program, _, file, *options = shlex.split(str(case.get("reproduce") or ""))
    except ValueError:
        program, file, options = NAME, "", []
    name = _scene_file(file, str(case.get("scene"))) if file.endswith(".json") else case["name"]
    head = NAME if PurePath(program).is_absolute() else program
    # For the tracer, the page adds the selected configuration.
    pairs = zip(options[::2], options[1::2], strict=False)
    renderer_options = [word for pair in pairs if pair[0] in ("--subject", "--env") for word in pair]
    tail = f" {shlex.join(renderer_options)}" if renderer_options else ""
    return shlex.join([head, "run", name, *options]), (shlex.join([head, "probe", name]), tail)


def _scene_file(file: str, scene: str) -> str:
    """Return the path of a scene below its results folder as in `file`, or below the folder's name if absolute."""
    path = PurePath(file)
    folder = path.parts[: -1 - path.parts[::-1].index(SCENES)] if SCENES in path.parts else ()
    return PurePath(*(folder[-1:] if path.is_absolute() else folder), scene).as_posix()


def picture_of(folder: Path, case: CaseRecord) -> str | None:
    """Return the case's still relative to `folder`, if it was drawn."""
    picture = case.get("picture") or picture_path(case)
    return picture if picture and inside(folder, picture) else None


def thumbnail_of(folder: Path, case: CaseRecord) -> str | None:
    """Return the case's small picture of the difference, relative to `folder`, if it was drawn."""
    picture = case.get("thumbnail")
    return picture if picture and inside(folder, picture) else None


def has_view(folder: Path, case: CaseRecord) -> bool:
    """Return whether the page can show a case in 3-D, from its scene file and images."""
    scene = case.get("scene")
    return isinstance(scene, str) and inside(folder, scene)


def view_of(scene: dict[str, Any], case: CaseRecord) -> dict[str, Any] | None:
    """Return the data of a case's 3-D view, or None if a mesh is invalid."""
    subject, reference = compared(case)
    try:
        shapes = [_drawn(shape) if shape.get("type") == "mesh" else shape for shape in scene["shapes"]]
    except (ValueError, TypeError, LookupError, OverflowError):  # the scene file may come from an untrusted folder
        return None
    return {"scene": {**scene, "shapes": shapes}, "ours": subject, "theirs": reference, "stage": case.get("stage")}


def _drawn(mesh: dict[str, Any]) -> dict[str, Any]:
    """Return a mesh for drawing: packed, and thinned if it has very many triangles."""
    vertices, faces = mesh["vertices"], mesh["faces"]
    with np.errstate(over="ignore"):  # infinite numbers are refused below
        vertices = unpack(vertices, "<f4") if isinstance(vertices, str) else np.asarray(vertices, np.float32)
        faces = unpack(faces, "<i4") if isinstance(faces, str) else np.asarray(faces, np.int64)
    if vertices.shape != (len(vertices), 3) or faces.shape != (len(faces), 3) or not np.isfinite(vertices).all():
        raise ValueError("a mesh has rows of three numbers")
    if len(faces) > look().triangles:
        vertices = thinned(vertices[faces], look().triangles).reshape(-1, 3)
        faces = np.arange(len(vertices)).reshape(-1, 3)
    return {**mesh, "vertices": pack(vertices), "faces": pack(faces)}


def small_of(folder: Path, case: CaseRecord) -> str | None:
    """Return the folder of a case's smallest scene by `rayproof shrink`, relative to `folder`, if it exists."""
    place = str(case.get("scene") or "").removeprefix("scenes/").removesuffix(".json")
    files = ("issue.md", "picture.png", "scene.json")
    return f"small/{place}" if place and all(inside(folder, f"small/{place}/{file}") for file in files) else None


def scene_of(folder: Path, case: CaseRecord) -> dict[str, Any] | None:
    """Return the content of a case's scene file, or None if it cannot be read or contains no scene."""
    if not has_view(folder, case):
        return None
    try:
        scene = json.loads((folder / str(case["scene"])).read_text(encoding="utf-8"))
    except (OSError, ValueError, RecursionError):
        return None
    is_scene = (
        isinstance(scene, dict) and isinstance(scene.get("camera"), dict) and isinstance(scene.get("shapes"), list)
    )
    return scene if is_scene and all(isinstance(shape, dict) for shape in scene["shapes"]) else None


def _short(channel: str) -> str:
    """Return the last part of a channel's name, or the first part if the last is only "V"."""
    first, _, last = channel.rpartition(".")
    return first if last == "V" else last


# Scripts of the report and of the viewer; each depends only on earlier ones.
SHARED, SCRIPTS = ("elements", "paint"), ("view3d",)
LIBRARY = "vtk-viewer.js"


def publish_viewer(folder: Path, results: RunRecord) -> list[Path]:
    """Write viewer/index.html and the library if the scene of any case was stored."""
    if not any(has_view(folder, case) for case in briefs(results["cases"])):
        return []
    return [
        write_text(folder / "viewer" / "index.html", page()),
        write_text(folder / "viewer" / LIBRARY, vendored(LIBRARY)),
    ]


def page() -> str:
    """Return the page, which loads the library from its own folder."""
    return _page(f'<script src="{LIBRARY}"></script>', "'self' file:")


def page_in_one() -> str:
    """Return the page with the library in it, for a frame of a report that is a single file.

    The report's policy applies to such a frame, too, so it must contain `digests_in_one`.
    """
    library = vendored(LIBRARY)
    return _page(f"<script>{library}</script>", f"'{_digest(library)}'")


def digests_in_one() -> tuple[list[str], list[str]]:
    """Return the hashes of the scripts and of the styles of `page_in_one`, in the format of a policy."""
    return [_digest(vendored(LIBRARY)), _digest(viewer_script())], [_digest(_text("scene3d", "viewer", "style.css"))]


def _page(library: str, sources: str) -> str:
    script, style = viewer_script(), _text("scene3d", "viewer", "style.css")
    policy = (
        f"default-src 'none'; script-src {sources} '{_digest(script)}'; style-src '{_digest(style)}'; "
        "img-src data: blob:; base-uri 'none'; form-action 'none'"
    )
    template = _text("scene3d", "viewer", "page.html")
    return template.format(policy=html.escape(policy), style=style, library=library, script=script)


def viewer_script() -> str:
    """Return the page's own script."""
    shared = (_text("page", "html", f"{name}.js") for name in SHARED)
    return "\n".join([*shared, *(_text("scene3d", "viewer", f"{name}.js") for name in SCRIPTS)])


def vendored(name: str) -> str:
    """Return the text of a vendored library."""
    return _text("vendor", name)


def _digest(text: str) -> str:
    return "sha256-" + base64.b64encode(hashlib.sha256(text.encode()).digest()).decode()


def _text(*path: str) -> str:
    return files("rayproof.reports.publish").joinpath(*path).read_text(encoding="utf-8")
