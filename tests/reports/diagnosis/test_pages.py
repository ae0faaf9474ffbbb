"""The page of known mistakes says all of them, is what the declarations make of it, and its pictures show them."""

import io
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from rayproof.cases.families import select
from rayproof.cases.stages import Stage
from rayproof.reference.analytic import Analytic
from rayproof.reports.diagnosis.pages import GAP, LARGER, listed, page, picture
from rayproof.reports.mistakes import MISTAKES

STAGES = (Stage.RADIANCE, Stage.NORMAL, Stage.DISTANCE)


def test_the_page_in_the_documents_is_what_is_declared_now() -> None:
    written = (Path(__file__).parents[3] / "docs" / "mistakes.md").read_text(encoding="utf-8")

    assert written == page(), "write it anew: rayproof list mistakes --pages FOLDER, without pictures"
    assert all(f"* `{name}`: " in written for name in listed())


@pytest.mark.parametrize("name", ["left_handed", "no_pi", "depth_for_distance"])
def test_a_picture_has_what_is_right_beside_what_the_mistake_makes_of_it(name: str) -> None:
    (case,) = select(["primitives/cube"])
    right = Analytic().render(case.scene, STAGES)

    drawn = picture(MISTAKES[name], [(case.scene, right)])

    assert drawn is not None
    image = np.asarray(Image.open(io.BytesIO(drawn)))
    width = LARGER * case.scene.camera.width
    assert image.shape == (LARGER * case.scene.camera.height, 2 * width + GAP, 3)
    assert not np.array_equal(image[:, :width], image[:, width + GAP :])


def test_what_no_scene_shows_has_no_picture() -> None:
    (case,) = select(["primitives/cube"])

    right = Analytic().render(case.scene, STAGES)

    assert picture(MISTAKES["radius_ignored"], [(case.scene, right)]) is None
