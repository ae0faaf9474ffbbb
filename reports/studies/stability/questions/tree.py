"""Does a tree lose a triangle that a ray meets? Boxes in `tracer.trees` may be met in vain, but never missed.

One tree a value of the sweep, over the triangles of all its rays; each ray is aimed at its own, and the triangles do
not overlap. Only rays count that truly meet their triangle and that its formula, asked about it alone, says so of: what
is left is the tree's own. Found later than alone is lost as well. Options: bundle, how many rays from one point go
through the tree as one beam. Inputs: o, d, a, b, c.
"""

from itertools import pairwise

import numpy as np

from rayproof.cases.ladders import Inputs, Ladder
from rayproof.cases.placement import camera_around
from rayproof.cases.scene import Mesh, Scene
from rayproof.reports.studies.stability.device import downloaded, uploaded
from rayproof.reports.studies.stability.geometry import ahead, ray_of
from rayproof.reports.studies.stability.questions import QUESTIONS, Answer, Grades, Truth, nothing
from rayproof.reports.studies.stability.questions.distance import Distance
from rayproof.tracer.configuration import Configuration
from rayproof.tracer.formulas import Formula
from rayproof.tracer.kernel.arrays import array_types
from rayproof.tracer.kernel.parameters import LITERALS, DeviceBuffers
from rayproof.tracer.light_path.surfaces import DeviceScene
from rayproof.tracer.plan import Context, Plan

CAMERA = camera_around((0, 0, 0), distance=4, azimuth=0, elevation=0, width=1, height=1, fovy=30)


@QUESTIONS.register("tree")
class Tree:
    """The slot `triangle`, in the leaves of a tree."""

    def truth(self, ladder: Ladder, inputs: Inputs, rungs: np.ndarray) -> Truth:
        """Return which rays meet their own triangle."""
        own = Distance().truth(ladder, inputs, rungs)
        return Truth(counted=own.counted & own.facts["hit"].hit, facts=own.facts, witness=own.witness)

    def answer(self, ladder: Ladder, formula: Formula, inputs: Inputs, precision: str) -> Answer:
        """Return t per ray through the tree and of its own triangle alone, one tree a value."""
        rays = len(inputs["o"])
        each = rays // len(ladder.values) if rays % len(ladder.values) == 0 else rays
        edges = range(0, rays + 1, each)
        bundle = int(str(ladder.options.get("bundle", 1)))
        parts = [
            _through({name: array[a:b] for name, array in inputs.items()}, formula, precision, bundle)
            for a, b in pairwise(edges)
        ]
        return {"t": np.concatenate(parts)} | {"alone": Distance().answer(ladder, formula, inputs, precision)["t"]}

    def grade(self, ladder: Ladder, inputs: Inputs, truth: Truth, answer: Answer, precision: str) -> Grades:
        """Return what was lost."""
        counted = truth.counted & np.isfinite(answer["alone"])
        none, unknown = nothing(len(counted)), np.full(len(counted), np.nan)
        lost = counted & ~(answer["t"] <= answer["alone"])
        return Grades(counted=counted, false_hit=none, false_miss=lost, invalid=none, error=unknown, index=unknown)


def _through(inputs: Inputs, formula: Formula, precision: str, bundle: int) -> np.ndarray:
    """Return t of rays through the tree over their triangles; every `bundle` of them in a row start from one point."""
    corners = np.stack([inputs[name] for name in "abc"], axis=1)
    mesh = Mesh(
        vertices=corners.reshape(-1, 3), faces=np.arange(3 * len(corners)).reshape(-1, 3), albedo=(0.5, 0.5, 0.5)
    )
    types = array_types(precision)
    context = Context(
        scene=Scene(camera=CAMERA, shapes=(mesh,), lights=()),
        configuration=Configuration(precision=precision, formulas={"triangle": formula.variant}),
        types=types,
        plan=Plan(trees=frozenset({"triangle"})),
        buffers=DeviceBuffers(),
        parameters=LITERALS,
    )
    trees = DeviceScene(context).trees
    (hierarchy,) = trees.hierarchies
    parts = [{name: inputs[name][k::bundle] for name in "od"} for k in range(bundle)]
    rays = [ray_of(uploaded(part, types)) for part in parts]
    found = downloaded(
        {str(k): t for k, (t, _) in enumerate(trees.met(hierarchy, rays, [ahead(types)] * bundle))}, len(parts[0]["o"])
    )
    return np.stack([found[str(k)] for k in range(bundle)], axis=1).ravel()
