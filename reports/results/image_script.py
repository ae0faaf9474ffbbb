"""A case's images of every renderer in one script, every bit of every float: what a browser loads from disk.

Browsers refuse fetch() on file://, so this is a call with JSON in it: the first line is the call, the second the JSON.
"""

import json
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from rayproof.cases.stages import IMAGE_STAGES, Stage
from rayproof.reports.results.atomic import write_text
from rayproof.reports.results.float_codec import decode, encode
from rayproof.reports.results.json_numbers import as_json, legible_json
from rayproof.reports.results.prediction import Factors, intensities, pinhole, predicted, predictions

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
