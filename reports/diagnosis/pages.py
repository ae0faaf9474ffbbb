"""docs/mistakes.md, made of what is declared: each known mistake, the right formula, and a picture where one tells."""

import io
import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from rayproof import ROOT
from rayproof.cases.case import BLAMABLE
from rayproof.cases.families import select
from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage
from rayproof.reference.analytic import Analytic
from rayproof.reports.diagnosis import MISTAKES, Fit, Mistake
from rayproof.reports.diagnosis.answering import Answered, Unanswerable, answer, changed, right_answer
from rayproof.reports.diagnosis.hypotheses import bound
from rayproof.reports.results.outcomes import TITLES

SPECIFICATION = ROOT / "docs" / "specification.md"
# Scenes that between them show most mistakes, the richest first.
SHOWN_BY = (
    "random_scenes/seed_1", "random_scenes/seed_2", "several_lights/simplified", "normals/turned_to_the_viewer",
    "sidedness/square_lit_from_behind", "shadows/behind_the_light", "inside/sphere_in_cube", "inside/one_sided_sphere",
    "clipping/sphere_depth", "clipping/sphere_shell", "transforms/triangle_mirrored", "cameras/banked",
)  # fmt: skip
STAGES = (Stage.RADIANCE, Stage.NORMAL, Stage.DISTANCE)  # what is drawn: the first of these in which it shows
ENOUGH = 0.02  # of the pixels: so many show a mistake
LEAST = 30  # pixels: fewer show nothing to a reader
GAP, LARGER = 8, 2  # px between the two pictures, and how many times as large they are drawn
BRIGHT = 99.0  # percentile of the right values that is drawn white
HEAD = """# Known mistakes

`rayproof list mistakes --pages FOLDER` writes this page with a picture of each mistake where a picture tells
something: on the left what is right, on the right what a renderer draws that makes it. [diagnosis.md](diagnosis.md)
explains how a mistake is told. `x` stands for a number that is estimated.
"""


def page(pictures: dict[str, str] | None = None) -> str:
    """Return the page; `pictures` are the files that show a mistake, by its name.

    Raises:
        OSError: the specification is not there, as outside of a checkout.

    """
    right = formulas(SPECIFICATION.read_text(encoding="utf-8"))
    parts = [HEAD]
    for item in BLAMABLE:
        names = [name for name in MISTAKES if MISTAKES[name].items[0] == item]
        if names:
            parts.append(f"## {item}, {TITLES[item]}\n\n{right[item]}\n")
            parts.append("\n".join(_entry(name, pictures or {}) for name in names) + "\n")
    return "\n".join(parts)


def _entry(name: str, pictures: dict[str, str]) -> str:
    mistake = MISTAKES[name]
    beside = f" Concerns {', '.join(mistake.items[1:])}, too." if mistake.items[1:] else ""
    picture = f"\n\n  ![{name}]({pictures[name]})\n" if name in pictures else ""
    return f"* `{name}`: the renderer {mistake.says.format('x')}.{beside}{picture}"


def formulas(specification: str) -> dict[str, str]:
    """Return each item's right formula, from the specification's text."""
    found = re.findall(
        r"^\*\*((?:CAM|XF|HIT|NRM|LIT|RAD|IMG)-\d)(?:, [^*]*)?\*\*(.*?)(?=\n\n|\n\*\*|\Z)", specification, re.M | re.S
    )
    return {item: "Right: " + " ".join(text.split()) for item, text in found}


def pictures() -> Iterator[tuple[str, bytes | None]]:
    """Yield each mistake with its picture, as PNG; None where no scene shows it to a reader."""
    oracle = Analytic()
    scenes = {case.name: case.scene for case in select(SHOWN_BY)}
    right = [right_answer(scenes[name], oracle) for name in SHOWN_BY]
    for name in MISTAKES:
        yield name, picture(MISTAKES[name], right, oracle)


def picture(mistake: Mistake, right: list[Answered], oracle: Analytic) -> bytes | None:
    """Return the right answer and the mistake's side by side, in the first scene that shows it well; None without."""
    way = bound(mistake.ways[0], example(mistake.fit))
    best: tuple[int, Answered, Stage] | None = None
    for one in right:
        try:
            pixels = changed(way, one, oracle)
        except Unanswerable:
            continue
        for stage in STAGES:
            count = int(np.count_nonzero(pixels[stage])) if stage in pixels else 0
            if count >= LEAST and (best is None or count > best[0]):
                best = count, one, stage
                break
        if best is not None and best[0] >= ENOUGH * one.edge.size:
            break
    if best is None:
        return None
    _, one, stage = best
    return _side_by_side(one.scene, one.answers[stage], answer(way, one, oracle).answers[stage], stage)


def example(fit: Fit | None) -> float:
    """Return a parameter that shows a mistake which has one."""
    if fit is None:
        return 0.0
    return fit.grid[len(fit.grid) // 2] if fit.grid else 2 * fit.nothing


def _side_by_side(scene: Scene, right: np.ndarray, wrong: np.ndarray, stage: Stage) -> bytes:
    from PIL import Image

    finite = right[np.isfinite(right)]
    white = float(np.percentile(finite, BRIGHT)) if finite.size else 1.0
    panels = []
    for image in (right, wrong):
        with np.errstate(invalid="ignore"):
            value = (image + 1) / 2 if stage is Stage.NORMAL else np.clip(image / (white or 1.0), 0, 1)
        if stage is Stage.RADIANCE:
            value = value ** (1 / 2.2)
        eight = np.round(255 * np.nan_to_num(np.clip(value, 0, 1), posinf=0.0)).astype(np.uint8)
        panels.append(np.broadcast_to(eight, (*eight.shape[:2], 3)))
    gap = np.full((scene.camera.height, GAP // LARGER, 3), 255, dtype=np.uint8)
    whole = np.concatenate([panels[0], gap, panels[1]], axis=1).repeat(LARGER, axis=0).repeat(LARGER, axis=1)
    packed = io.BytesIO()
    Image.fromarray(whole).save(packed, "PNG", optimize=True)
    return packed.getvalue()


def write(folder: Path) -> int:
    """Write the page with its pictures into a folder and return how many there are."""
    folder.mkdir(parents=True, exist_ok=True)
    written = {}
    for name, image in pictures():
        if image is not None:
            written[name] = f"{name.replace('/', '-')}.png"
            (folder / written[name]).write_bytes(image)
    (folder / "mistakes.md").write_text(page(written), encoding="utf-8")
    return len(written)
