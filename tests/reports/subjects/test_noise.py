"""A program that draws random numbers is judged by the mean of its renders: right ones pass, a small bias fails."""

import sys
from collections.abc import Iterator
from functools import lru_cache
from pathlib import Path

import numpy as np
import pytest

from rayproof.cases.case import ITEMS_OF_OTHERS, Case
from rayproof.cases.families import select
from rayproof.cases.stages import Stage
from rayproof.reference.analytic import Analytic
from rayproof.reference.analytic.camera import pixel_centers
from rayproof.reports.judge.answers import Answers
from rayproof.reports.judge.box_filter import box_mean, finer
from rayproof.reports.judge.case import judge_case
from rayproof.reports.judge.noise import averaged
from rayproof.reports.judge.oracle import stages_of
from rayproof.reports.judge.verdict import Judged, of_what_is_supported
from rayproof.reports.results.outcomes import Outcome
from rayproof.reports.run.plan import within_reach
from rayproof.reports.subjects.program import ask_program
from rayproof.reports.subjects.protocol import Capabilities, capabilities_of
from tests.reports.subjects.conftest import SCENE
from tests.reports.subjects.test_other_files import put_to_test, said

ORACLE = Analytic()
(EIGHT,) = select(["several_lights/eight"])
DECLARED = {"random": 64}
ABLE = capabilities_of(DECLARED, 1, by_user=True)
ACROSS = 8  # places in a pixel, along either side, at which the renderer samples
NOT_ANSWERED = {stage: "It writes radiance alone." for stage in Stage if stage is not Stage.RADIANCE}


@lru_cache(maxsize=1)
def by_light() -> np.ndarray:
    """Return the radiance (pixels, places, lights, 3) that each light adds."""
    fine = finer(EIGHT.scene, ACROSS)
    samples = ORACLE.samples(fine, pixel_centers(fine.camera), Stage.RADIANCE, by_light=True)
    assert samples.shares is not None
    visible = samples.rows[Stage.VISIBILITY][..., np.newaxis]
    each = samples.shares * visible * samples.factors[Stage.RADIANCE][:, np.newaxis]
    height, width = EIGHT.scene.camera.height, EIGHT.scene.camera.width
    parts = each.reshape(height, ACROSS, width, ACROSS, -1, 3).swapaxes(1, 2)
    return parts.reshape(height * width, ACROSS**2, -1, 3)


def renders(count: int, *, samples: int, factor: float = 1.0) -> Iterator[np.ndarray]:
    """Yield the images of a renderer that takes a place in the pixel and a light at random for each sample."""
    values = by_light()
    pixels, places, lights, _ = values.shape
    size = EIGHT.scene.camera.height, EIGHT.scene.camera.width
    for seed in range(count):
        draw = np.random.default_rng(seed)
        total = np.zeros((pixels, 3))
        for _ in range(samples):
            total += values[np.arange(pixels), draw.integers(places, size=pixels), draw.integers(lights, size=pixels)]
        image = factor * lights * total / samples
        yield image.reshape(*size, 3).astype(np.float32).astype(np.float64)


def judged(count: int = 64, *, samples: int, factor: float = 1.0) -> Judged:
    case: Case = within_reach(EIGHT, ABLE)
    image, noise, pooled = averaged(renders(count, samples=samples, factor=factor), case.scene, within_pixel=True)
    subject = Answers(
        name="monte_carlo",
        precision="float32",
        items=ITEMS_OF_OTHERS,
        answers={Stage.RADIANCE: image},
        resolutions={Stage.RADIANCE: noise},
        unsupported=NOT_ANSWERED,
        pooled_error=pooled,
        chained=False,
    )
    truth = ORACLE.render(case.scene, stages_of(case.scene))
    analytic = Answers(name="analytic", precision="float64", independent=True, answers=truth)
    return of_what_is_supported(judge_case(case, [subject], [analytic], ORACLE, {}), [subject])


# With one sample in each render pixels that a single light reaches are black in most renders.
@pytest.mark.parametrize(("count", "samples"), [(32, 1), (64, 16)])
def test_a_right_renderer_passes_with_all_its_noise(count: int, samples: int) -> None:
    found = judged(count, samples=samples)

    assert (found.outcome, found.reason) == (Outcome.PASS, "")


def test_a_factor_that_no_pixel_shows_fails_by_the_mean_of_all() -> None:
    found = judged(samples=16, factor=1.01)

    (check,) = (check for check in found.checks if check.stage is Stage.RADIANCE)
    assert found.outcome is Outcome.FAIL
    assert check.examined is not None
    assert check.examined.wrong == 0
    assert "smooth pixels and all renders is" in check.reason


def test_the_oracles_own_mean_over_a_pixel_is_within_the_error_that_it_states() -> None:
    expected = box_mean(ORACLE.render(finer(EIGHT.scene, 16), [Stage.RADIANCE])[Stage.RADIANCE], 16)
    centre = ORACLE.render(EIGHT.scene, [Stage.RADIANCE])[Stage.RADIANCE]

    # Without any noise the image is that of the centres, but for the error of the oracle's mean.
    image, noise, pooled = averaged([expected] * 32, EIGHT.scene, within_pixel=True)

    assert noise.steps is not None
    assert (np.abs(image - centre) <= noise.steps + 1e-12).mean() > 0.999
    assert pooled is not None
    smooth = np.isfinite(pooled[..., 0])
    assert (np.abs((image - centre)[smooth].mean(axis=0)) <= pooled[smooth][0]).all()
    assert (pooled[smooth][0] < 1e-3 * centre[smooth].mean(axis=0)).all()


SEEDED = """
import json, sys
import numpy as np
from pathlib import Path
Path(sys.argv[2]).write_bytes(b"PF\\n6 4\\n-1.0\\n" + np.full((4, 6, 3), float(sys.argv[1]), "<f4").tobytes())
with open(sys.argv[3], "a") as log:
    print(sys.argv[1], sys.argv[4], file=log)
"""


@pytest.mark.process
def test_a_random_program_is_rendered_with_different_seeds(tmp_path: Path) -> None:
    program, log = tmp_path / "seeded.py", tmp_path / "log"
    program.write_text(SEEDED)
    subject = put_to_test(
        f"exec:{sys.executable} {program} {{seed}} {{output.pfm}} {log} {{spp}}",
        said(tmp_path, random=True, sample_offset=[0, 0, 0]),
    )

    answers = ask_program(subject, SCENE, samples=1)

    assert answers.error is None
    assert log.read_text().splitlines() == [f"{seed} 16" for seed in range(32)]
    assert np.allclose(answers.answers[Stage.RADIANCE], np.mean(range(32)))


@pytest.mark.process
def test_a_random_program_writes_radiance_and_takes_a_seed(tmp_path: Path) -> None:
    with pytest.raises(ValueError, match="radiance alone"):
        capabilities_of({"protocol": 1, "random": True, "stages": ["normal"]}, 1)
    with pytest.raises(ValueError, match="the number of renders, 32 to 4096, got 8"):
        capabilities_of({"protocol": 1, "random": 8}, 1)
    with pytest.raises(ValueError, match=r"the command needs \{seed\}"):
        put_to_test("exec:true {scene} {output}", said(tmp_path, random=True))
    assert Capabilities(random=32).told(EIGHT.scene) == ("Rendered 32 times with different seeds; the mean is judged.",)
