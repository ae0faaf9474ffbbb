"""A small image is computed by the worker's thread alone, a large one by as many as there are processors."""

import dataclasses
import os
from collections.abc import Iterator

import drjit as dr
import pytest

from cases.stages import Stage
from reports.run.kinds import TRACING
from reports.run.orders import ReferenceTask, TracerTask
from reports.run.tasks import handler
from reports.run.threads import SMALL, set_threads
from tests.reports.judge.scenes import SCENE

PROCESSORS = os.cpu_count() or 1
LARGE = dataclasses.replace(SCENE, camera=dataclasses.replace(SCENE.camera, width=SMALL // 64, height=64))


@pytest.fixture(autouse=True)
def _as_before() -> Iterator[None]:
    before = dr.thread_count()
    yield
    dr.set_thread_count(before)


def test_threads_are_as_many_as_an_image_is_worth() -> None:
    set_threads(SCENE, 1)
    assert dr.thread_count() == 1

    set_threads(LARGE, 1)
    assert dr.thread_count() == PROCESSORS

    set_threads(SCENE, 1)
    set_threads(SCENE, 128)
    assert dr.thread_count() == PROCESSORS


@pytest.mark.parametrize("kind", [TRACING, "reference:mitsuba_llvm"])
def test_workers_that_use_drjit_render_a_small_image_alone(kind: str) -> None:
    dr.set_thread_count(max(2, PROCESSORS))
    tracer = TracerTask(scene=SCENE, configuration="float32", samples=1)

    answered, _ = handler(kind)(tracer if kind == TRACING else ReferenceTask(scene=SCENE, samples=1))

    assert Stage.RADIANCE in answered.answers
    assert dr.thread_count() == 1
