"""Any two images in the viewer: read by Python or dropped into the page they are the same floats."""

from pathlib import Path
from typing import Any

import numpy as np
import OpenEXR
import pytest
from PIL import Image

from rayproof.reports.cli import main
from rayproof.reports.publish.page.image_page import read_image

RANDOM = np.random.default_rng(5)
COLOUR = RANDOM.normal(size=(19, 23, 3)).astype(np.float32)
COLOUR[3, 4] = [np.inf, np.nan, 0]
DEPTH = RANDOM.uniform(1, 9, (19, 23)).astype(np.float32)


def exr(path: Path, compression: Any, kind: Any = np.float32) -> Path:
    channels = {name: np.ascontiguousarray(COLOUR[..., at], dtype=kind) for at, name in enumerate("RGB")}
    OpenEXR.File({"compression": compression, "type": OpenEXR.scanlineimage}, {**channels, "distance.V": DEPTH}).write(
        str(path)
    )
    return path


def pfm(path: Path) -> Path:
    path.write_bytes(b"PF\n23 19\n-2.5\n" + COLOUR[::-1].astype("<f4").tobytes())
    return path


def png(path: Path) -> Path:
    Image.fromarray(RANDOM.integers(0, 255, (19, 23, 3), dtype=np.uint8)).save(path)
    return path


def test_every_bit_is_read(tmp_path: Path) -> None:
    found = read_image(exr(tmp_path / "a.exr", OpenEXR.PIZ_COMPRESSION))
    flat = read_image(pfm(tmp_path / "a.pfm"))

    for at, name in enumerate("RGB"):
        assert np.array_equal(found[name], COLOUR[..., at], equal_nan=True)
        assert np.array_equal(flat[name], COLOUR[..., at], equal_nan=True)
    assert np.array_equal(found["distance.V"], DEPTH)
    assert read_image(png(tmp_path / "a.png"))["R"].max() <= 1


@pytest.mark.parametrize(
    "content", [b"GIF89a", b"PF\n2 2\n", b"PF\n2 2\n-1\nxx", b"\x76\x2f\x31\x01", b"\x89PNG\r\n\x1a\nxx"]
)
def test_what_is_no_image_ends_in_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str], content: bytes) -> None:
    (tmp_path / "a.exr").write_bytes(content)

    assert main(["report", "view", str(tmp_path / "a.exr"), "--out", str(tmp_path / "v.html")]) == 2

    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert "a.exr" in said
    assert not (tmp_path / "v.html").exists()


DROP = """bytes => {
    const data = new DataTransfer();
    data.items.add(new File([new Uint8Array(bytes)], "fallen.pfm"));
    window.dispatchEvent(new DragEvent("drop", { dataTransfer: data, cancelable: true }));
}"""


@pytest.mark.browser
def test_the_page_shows_the_floats_and_takes_others_that_are_dropped(browser: Any, tmp_path: Path) -> None:
    first, second = exr(tmp_path / "a.exr", OpenEXR.ZIP_COMPRESSION), pfm(tmp_path / "b.pfm")
    assert main(["report", "view", str(first), str(second), "--out", str(tmp_path / "view.html")]) == 0
    page = browser.new_page()
    complaints: list[str] = []
    page.on("console", lambda message: complaints.append(message.text))
    page.on("pageerror", lambda error: complaints.append(str(error)))
    page.goto((tmp_path / "view.html").as_uri())
    page.wait_for_selector("#app[data-shown] .pane .frame > canvas")

    # The same floats by two formats; of the one pixel with an infinity and a NaN nothing can be said.
    assert " 1 of 437 pixels differ" in page.inner_text("main")
    for number, (compression, kind) in enumerate(
        [
            (OpenEXR.NO_COMPRESSION, np.float32),
            (OpenEXR.ZIPS_COMPRESSION, np.float16),
            (OpenEXR.PIZ_COMPRESSION, np.float32),
        ]
    ):
        dropped = exr(tmp_path / f"dropped{number}.exr", compression, kind)
        page.set_input_files("input[type=file]", str(dropped))
        page.wait_for_function(
            "name => document.querySelector('p[role=status]').textContent.startsWith(name)", arg=dropped.name
        )
    assert "compression is not read here" in page.inner_text("p[role=status]")
    dropped = page.evaluate(
        "() => [...document.querySelectorAll('select')].flatMap(s => [...s.options].map(o => o.textContent))"
    )
    assert {"dropped0.exr", "dropped1.exr"} <= set(dropped)
    page.evaluate(DROP, [*pfm(tmp_path / "c.pfm").read_bytes()])
    page.wait_for_function("() => document.querySelector('p[role=status]').textContent === 'fallen.pfm: opened'")
    assert "fallen.pfm" in page.inner_text("main .panes")
    page.get_by_role("button", name="distance").click()
    assert "distance" in page.url
    assert complaints == []
    page.close()
