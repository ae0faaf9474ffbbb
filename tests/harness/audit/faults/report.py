"""Planted faults of what a report shows."""

from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import replace
from typing import Any

from rayproof.reports.results import images
from rayproof.reports.run import judge_task
from tests.harness.audit.faults import FAULTS, replaced


# The report shows another renderer's image, or another configuration's classes of pixels.
@FAULTS.register("report/another_renderers_image", where="report", stage=None)
@contextmanager
def another_renderers_image() -> Iterator[None]:
    """Write each renderer's images under the next one's name."""
    right = images.write_pixels

    def wrong(path: Any, name: str, renders: Any, camera: Any) -> Any:
        names = list(renders)
        return right(path, name, dict(zip(names[1:] + names[:1], renders.values(), strict=True)), camera)

    with replaced(right, wrong):
        yield


@FAULTS.register("report/another_renderers_file", where="report", stage=None)
@contextmanager
def another_renderers_file() -> Iterator[None]:
    """Write the first renderer's images into every file."""
    right, first = images.write_answers, []

    def wrong(path: Any, answers: Any, **about: Any) -> Any:
        first.append(answers)
        return right(path, first[0], **about)

    with replaced(right, wrong):
        yield


@FAULTS.register("report/another_configurations_masks", where="report", stage=None)
@contextmanager
def another_configurations_masks() -> Iterator[None]:
    """Show the last configuration's classes as the first one's."""
    right = judge_task.masks

    def wrong(task: Any, oracle: Any) -> Any:
        found = right(replace(task, subjects=task.subjects[::-1]), oracle)
        return found and found | {"configuration": task.subjects[0].name}

    with replaced(right, wrong):
        yield
