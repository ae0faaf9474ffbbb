"""`rayproof render` writes the tracer's stages as OpenEXR."""

from pathlib import Path

import numpy as np
import OpenEXR

from rayproof.cases.families import select
from rayproof.cases.scene_json import save_scene
from rayproof.cases.stages import Stage
from rayproof.reports.results.images import read_answers
from rayproof.tracer.configuration import Configuration
from rayproof.tracer.render import render
from tests.reports.commands.conftest import Rayproof


def test_the_stages_asked_for_are_in_the_image(rayproof: Rayproof, tmp_path: Path) -> None:
    scene = select(["primitives/sphere"])[0].scene
    save_scene(scene, tmp_path / "scene.json")

    ended = rayproof("render", tmp_path / "scene.json", tmp_path / "out" / "a.exr", "--stages", "radiance,distance")

    assert ended.code == 0
    found = read_answers(tmp_path / "out" / "a.exr")
    assert set(found) == {Stage.DISTANCE, Stage.RADIANCE}
    own = render(scene, list(found), Configuration(precision="float32"))
    assert all(np.array_equal(found[stage], own[stage].astype(np.float32)) for stage in found)


def test_the_image_says_what_made_it(rayproof: Rayproof, tmp_path: Path) -> None:
    rayproof("render", "primitives/sphere", tmp_path / "a.exr", "--configuration", "float64/sphere=textbook")

    with OpenEXR.File(str(tmp_path / "a.exr")) as file:
        assert file.header()["comments"] == "float64/sphere=textbook"


def test_double_writes_every_digit_of_float64_in_either_format(rayproof: Rayproof, tmp_path: Path) -> None:
    for file in ("a.npz", "a.exr"):
        ended = rayproof("render", "primitives/sphere", tmp_path / file, "--stages", "distance,radiance", "--double")
        assert ended.code == 0, ended.error
    scene = select(["primitives/sphere"])[0].scene
    own = render(scene, [Stage.DISTANCE, Stage.RADIANCE], Configuration(precision="float64"))

    with np.load(tmp_path / "a.npz") as arrays:
        assert arrays["distance"].dtype == np.float64
        assert np.array_equal(arrays["distance"], own[Stage.DISTANCE])
        assert np.array_equal(arrays["radiance"], own[Stage.RADIANCE])
    with OpenEXR.File(str(tmp_path / "a.exr"), separate_channels=True) as file:
        channels = {name: channel.pixels.astype(np.float64) for name, channel in file.channels().items()}
    for name, image in {"distance.V": own[Stage.DISTANCE][..., 0], "R": own[Stage.RADIANCE][..., 0]}.items():
        both = channels[name] + channels[f"{name}.low"]
        assert np.allclose(both, image, rtol=2.0**-47, atol=0)  # twice float32's 24 bits, and one for each sign
        assert not np.array_equal(channels[name][np.isfinite(image)], image[np.isfinite(image)])
