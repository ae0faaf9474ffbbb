"""`rayproof certify`: proven bounds, two float64 numbers, of the exact value of every stage at pixels."""

from collections import Counter
from pathlib import Path
from typing import TYPE_CHECKING

from rayproof.reports.commands.lookup import scene_named, stages_named
from rayproof.reports.commands.output import say, show_table, write_json
from rayproof.reports.commands.usage import UsageError, told_in_one_line, writable_folder
from rayproof.reports.results.files import plain

if TYPE_CHECKING:
    from rayproof.cases.scene import Camera
    from rayproof.reference.certified import EnclosedPixel

ALL = "ray,object,distance,position,normal,visibility,irradiance,exitance,radiance"
MOST_PIXELS = 100_000  # some ten seconds of work, and half a gigabyte of JSON


def certify(case: str, *, pixels: str | None = None, stages: str = ALL, json: Path | None = None) -> int:
    """Compute proven lower and upper bounds, in float64, of the exact value of every stage.

    For example: rayproof certify primitives/sphere --pixels 48,36

    Parameters
    ----------
    case
        The name of a case, family/case, or a scene file ending in .json.
    pixels
        A pixel, x,y, or a rectangle x0,y0,x1,y1: its first and last column and row, all included; 0,0 is the top left
        pixel. Default: the whole image.
    stages
        Comma-separated stages, such as distance,normal,radiance.
    json
        Also write to this file, for every pixel: [low, high] per channel, the precision in bits, and the undecided
        stages.

    """
    chosen_stages = stages_named(stages)
    loaded = scene_named(case)
    if json is not None:
        with told_in_one_line():
            writable_folder(json.parent)
    box = rectangle(pixels, loaded.camera)
    from rayproof.cases.stages import exr_channels
    from rayproof.reference.certified import (
        Certified,  # without the registry, which would load all references
    )

    certified = Certified()
    left, top, right, bottom = box
    chosen = [(x, y) for y in range(top, bottom + 1) for x in range(left, right + 1)]
    records = certified.enclose(loaded, chosen_stages, chosen)
    undecided = [{"pixel": record["pixel"], "what": record["undecided"]} for record in records if record["undecided"]]
    names = {str(stage): list(exr_channels(stage, lights=len(loaded.lights))) for stage in chosen_stages}
    content = {
        "scene": case,
        "reference": certified.version(),
        "rectangle": list(box),
        "channels": names,
        "pixels": records,
        "undecided": undecided,
    }
    write_json(json, content)
    if len(records) == 1:
        _show_pixel(case, names, records[0])
    else:
        bits = ", ".join(
            f"{count} with {bits} bits" for bits, count in sorted(Counter(r["bits"] for r in records).items())
        )
        ties = sum(record["exact"] for record in records)
        say(f"{case}: {len(records)} pixels enclosed, {bits}; {ties} decided by exact numbers")
    say(f"undecided: {len(undecided) or 'none'}")
    for record in undecided[:10]:
        say(f"  pixel ({record['pixel'][0]}, {record['pixel'][1]}): {', '.join(record['what'])}")
    return 0


def rectangle(pixels: str | None, camera: "Camera") -> tuple[int, int, int, int]:
    """Return (left, top, right, bottom) of the named rectangle, all included; by default of the whole image.

    Raises:
        UsageError: not two or four whole numbers, a corner outside the image, an empty rectangle, or too many pixels.

    """
    left, top, right, bottom = 0, 0, camera.width - 1, camera.height - 1
    if pixels is not None:
        try:
            numbers = [int(part) for part in pixels.split(",")]
            left, top, right, bottom = numbers * 2 if len(numbers) == 2 else numbers
        except ValueError:
            raise UsageError(f"--pixels must read x,y or x0,y0,x1,y1 in whole numbers, got {pixels!r}") from None
        for x, y in ((left, top), (right, bottom)):
            if not (0 <= x < camera.width and 0 <= y < camera.height):
                raise UsageError(
                    f"--pixels: ({x}, {y}) lies outside the image: "
                    f"x from 0 to {camera.width - 1}, y from 0 to {camera.height - 1}"
                )
        if left > right or top > bottom:
            raise UsageError(f"--pixels: x0 must not exceed x1, nor y0 y1, got {pixels}")
    count = (right - left + 1) * (bottom - top + 1)
    if count > MOST_PIXELS:
        raise UsageError(f"--pixels: at most {MOST_PIXELS} pixels at once, got {count}")
    return left, top, right, bottom


def _show_pixel(case: str, names: dict[str, list[str]], record: "EnclosedPixel") -> None:
    rows = [
        [channel, repr(plain(low)), repr(plain(high))]
        for stage, channels in names.items()
        for channel, (low, high) in zip(channels, record["stages"][stage], strict=True)
    ]
    x, y = record["pixel"]
    show_table(f"{case}, pixel ({x}, {y}), {record['bits']} bits", ["channel", "low", "high"], rows)
