"""The page's JavaScript modules in a page without anything else, and images handed over to them."""

from importlib.resources import files
from typing import Any

import numpy as np

from rayproof.reports.publish.page.page import SCRIPTS

# What needs no results: everything but the part that builds the page when it is read.
ALONE = [name for name in SCRIPTS if name != "start"]

REVIVE = """const number = (text) => Number(text.replace('inf', 'Infinity'));
    const revive = (image) => ({ ...image, values: Float32Array.from(image.values, number) });"""


def image(array: np.ndarray) -> dict[str, Any]:
    """Return an image as the page has it, numbers as text where JSON lacks them."""
    height, width, channels = array.shape
    return {"width": width, "height": height, "channels": channels, "values": [str(v) for v in array.reshape(-1)]}


def loaded(browser: Any) -> Any:
    """Return an empty page with the modules in it."""
    page = browser.new_page()
    for name in ALONE:
        page.add_script_tag(content=files("rayproof.reports.publish.page").joinpath("html", f"{name}.js").read_text())
    return page
