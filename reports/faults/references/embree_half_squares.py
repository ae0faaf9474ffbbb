"""Planted fault: Embree is given one half of every square."""

from collections.abc import Iterator
from contextlib import contextmanager

from rayproof.cases.stages import Stage
from rayproof.reference.embree import facets
from rayproof.reports.faults import FAULTS
from rayproof.reports.faults.patching import altered


@FAULTS.register(
    "reference/embree_half_squares",
    where="reference",
    stage=Stage.OBJECT,
    who=("embree",),
    cases=(
        "primitives/square",
        "primitives/cube",
        "meshes/*",
    ),
)
@contextmanager
def embree_half_squares() -> Iterator[None]:
    """Leave out the second triangle of each square."""
    with altered(facets, "HALVES", facets.HALVES[:1]):
        yield
