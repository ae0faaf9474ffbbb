"""Any two images (EXR, PFM, PNG) in the report's viewer, as one file.

The page is the report's viewer without a run: no limits, no verdicts. Channels are grouped into layers by the page's
script, which treats images in the file and images that a user drops into the page in the same way.
"""

import html
import re
from collections.abc import Mapping, Sequence
from importlib.resources import files
from pathlib import Path

import numpy as np
import OpenEXR
from PIL import Image, UnidentifiedImageError

from rayproof.reports.publish.page.page import digest, policy
from rayproof.reports.results.files import write_text
from rayproof.reports.results.float_codec import EncodedImage, encode
from rayproof.reports.results.images import inert

# Scripts of the report, and the page's own; each depends only on earlier ones.
SCRIPTS = (
    "elements", "address", "floats", "paint", "metrics", "pane", "viewer", "stage_view",
    "images",
)  # fmt: skip
STYLES = ("style", "viewer", "images")
LARGEST = 2**26  # pixels of an image, the same as for a scene in `reports.run.scenes`
PFM = re.compile(rb"(P[Ff])\s+(\d{1,9})\s+(\d{1,9})\s+([+-]?[0-9.]{1,20}(?:[eE][+-]?\d{1,3})?)\s")
Channels = dict[str, np.ndarray]  # by name, (height, width)

_PAGE = """<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="{policy}">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="light dark">
<link rel="icon" href="data:,">
<title>{title}</title>
<style>{style}</style>
</head>
<body>
<div id="app"></div>
<script type="application/json" id="images">{data}</script>
<script>{script}</script>
</body>
</html>
"""


def read_image(path: Path) -> Channels:
    """Return the channels of an EXR, PFM or PNG file, float32 (height, width); for a PNG, linear light from 0 to 1.

    Raises:
        OSError: there is no such file.
        ValueError: the file has another format or cannot be read; the message contains its path.

    """
    with path.open("rb") as file:
        magic = file.read(8)
    try:
        if magic[:4] == b"\x76\x2f\x31\x01":
            with OpenEXR.File(str(path), separate_channels=True) as opened:
                channels = {name: channel.pixels for name, channel in opened.channels().items()}
        elif magic[:2] in (b"PF", b"Pf"):
            channels = _of_pfm(path.read_bytes())
        elif magic == b"\x89PNG\r\n\x1a\n":
            channels = _of_png(path)
        else:
            raise ValueError("is neither OpenEXR nor PFM nor PNG")
    except (RuntimeError, ValueError, SyntaxError, UnidentifiedImageError, Image.DecompressionBombError) as error:
        raise ValueError(f"{path}: {' '.join(str(error).split())}") from None
    flat = {name: np.asarray(pixels) for name, pixels in channels.items()}
    if (
        not flat
        or any(pixels.ndim != 2 for pixels in flat.values())
        or len({pixels.shape for pixels in flat.values()}) != 1
    ):
        raise ValueError(f"{path}: its channels must be images of one size")
    if next(iter(flat.values())).size > LARGEST:
        raise ValueError(f"{path}: has more than {LARGEST} pixels")
    with np.errstate(over="ignore"):
        return {name: np.ascontiguousarray(pixels, dtype=np.float32) for name, pixels in flat.items()}


def _of_pfm(content: bytes) -> Channels:
    """Return the channels, colour or grey, of a PFM with any scale (Debevec 2001); its lowest row comes first."""
    header = PFM.match(content)
    if header is None:
        raise ValueError("begins like a PFM and has no header of one")
    names, width, height = "RGB" if header[1] == b"PF" else "Y", int(header[2]), int(header[3])
    kind, count = "<f4" if float(header[4]) < 0 else ">f4", width * height * len(names)
    if len(content) - header.end() < 4 * count or not count:
        raise ValueError(f"holds less than {width} x {height} pixels")
    image = np.frombuffer(content, kind, count, header.end()).reshape(height, width, len(names))[::-1]
    return {name: image[..., at] for at, name in enumerate(names)}


def _of_png(path: Path) -> Channels:
    """Return a PNG's channels: colours as linear light by the sRGB curve (IEC 61966-2-1), alpha unchanged."""
    with Image.open(path) as image:
        if image.mode.startswith("I;16") or image.mode == "I":
            codes, names = np.asarray(image, dtype=np.float64)[..., None] / 65535, "Y"
        else:
            has_alpha = "A" in image.getbands() or "transparency" in image.info
            codes, names = np.asarray(image.convert("RGBA" if has_alpha else "RGB")) / 255.0, "RGBA"[: 3 + has_alpha]
    linear = np.where(codes <= 0.04045, codes / 12.92, ((codes + 0.055) / 1.055) ** 2.4)
    return {name: codes[..., at] if name == "A" else linear[..., at] for at, name in enumerate(names)}


def write_page(path: Path, images: Sequence[tuple[str, Mapping[str, np.ndarray]]]) -> Path:
    """Write the page with `images`, pairs of a name and its channels; return `path`."""
    data = [
        {
            "name": name,
            "height": next(iter(channels.values())).shape[0],
            "width": next(iter(channels.values())).shape[1],
            "channels": {
                channel: encode(pixels[..., None], _of_nothing(pixels)) for channel, pixels in channels.items()
            },
        }
        for name, channels in images
    ]
    style, script = ("\n".join(map(_asset, names)) for names in (_ended(STYLES, "css"), _ended(SCRIPTS, "js")))
    page = _PAGE.format(
        policy=html.escape(policy([digest(script)], [digest(style)], alone=True)),
        title=html.escape(" and ".join(name for name, _ in images) or "images"),
        style=style,
        script=script,
        data=inert(data),
    )
    return write_text(path, page)


def _of_nothing(pixels: np.ndarray) -> list[tuple[EncodedImage, np.ndarray]]:
    return [({"by": "nothing"}, np.zeros((*pixels.shape, 1), dtype=np.float32))]


def _ended(names: Sequence[str], suffix: str) -> list[str]:
    return [f"{name}.{suffix}" for name in names]


def _asset(name: str) -> str:
    return files("rayproof.reports.publish.page").joinpath("html", name).read_text(encoding="utf-8")
