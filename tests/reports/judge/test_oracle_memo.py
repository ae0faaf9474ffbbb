"""The oracle with a memory says what the oracle would, of scenes that come and go as well."""

from dataclasses import replace
from typing import Any

import numpy as np

from rayproof.cases.scene import CLIPS
from rayproof.cases.stages import Stage
from rayproof.reports.judge.oracle_memo import Remembering
from tests.reports.judge.scenes import ORACLE, SCENE, truth


class Counting:
    """An oracle that counts and tells which clip it was asked about."""

    def __init__(self) -> None:
        self.asked = 0

    def continue_from(self, scene: Any, stage: Stage, given: Any) -> Any:
        """Return the number of the scene's clip."""
        self.asked += 1
        return CLIPS.index(scene.clip)

    def edges(self, scene: Any) -> Any:
        """Return the number of the scene's clip."""
        return self.continue_from(scene, Stage.OBJECT, {})


def test_scenes_that_come_and_go_are_not_taken_for_each_other():
    # Of conventions each is a scene that is made, asked about and dropped: the next may lie where it lay.
    oracle, given = Remembering(Counting()), truth()  # type: ignore[arg-type]

    for number in 10 * list(range(len(CLIPS))):
        assert oracle.continue_from(replace(SCENE, clip=CLIPS[number]), Stage.DISTANCE, given) == number
    for number in 10 * list(range(len(CLIPS))):
        assert oracle.edges(replace(SCENE, clip=CLIPS[number])) == number


def test_what_was_continued_from_the_same_stages_is_not_computed_again():
    counting = Counting()
    oracle, given = Remembering(counting), truth()  # type: ignore[arg-type]

    for _ in range(3):
        oracle.continue_from(SCENE, Stage.DISTANCE, given)
        oracle.continue_from(SCENE, Stage.DISTANCE, {stage: np.copy(image) for stage, image in given.items()})
    assert counting.asked == 1

    nudged = given[Stage.RAY].copy()
    nudged[0, 0, 0] = np.nextafter(nudged[0, 0, 0], 2)
    oracle.continue_from(SCENE, Stage.DISTANCE, given | {Stage.RAY: nudged})
    oracle.continue_from(SCENE, Stage.POSITION, given)
    assert counting.asked == 3


def test_it_answers_what_the_oracle_answers():
    oracle, given = Remembering(ORACLE), truth()

    for stage in (Stage.OBJECT, Stage.NORMAL, Stage.RADIANCE):
        assert np.array_equal(oracle.continue_from(SCENE, stage, given), ORACLE.continue_from(SCENE, stage, given))
