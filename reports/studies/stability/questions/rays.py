"""Questions of view rays (the angle to the exact direction), hit points, sphere and facing normals, and trees.

Every view ray has a camera of its own, so that no orientation is special. Inputs: eye, target, up, sx, sy, fovy
[degrees], aspect, near, far. K = 1 + 1 / sin(F, up), where 1 / sin(F, up) is the amplification of roundings by the
camera's basis. The eye's coordinates do not enter, because a direction depends only on target - eye.
"""

from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from types import SimpleNamespace
from typing import Any

import numpy as np
from flint import arb

from rayproof.cases.ladders import Inputs, Ladder
from rayproof.cases.placement import camera_around
from rayproof.cases.rounding import UNIT_ROUNDOFF
from rayproof.cases.scene import Mesh, Scene
from rayproof.reference.certified.bundles import floats
from rayproof.reference.certified.columns import Columns, decided, evaluated, parts, witnessed
from rayproof.reference.certified.fields import precision as bits
from rayproof.reference.certified.numbers import cross, dot, minus, plus, scaled, unit
from rayproof.reports.studies.stability.device import downloaded, number, uploaded
from rayproof.reports.studies.stability.questions import (
    QUESTIONS,
    Answer,
    ExactAnswers,
    Grades,
    Witness,
    nothing,
    sample,
)
from rayproof.reports.studies.stability.questions.placed import Distance, angles
from rayproof.reports.studies.stability.shapes import ahead, ray_of, record
from rayproof.tracer.configuration import Configuration
from rayproof.tracer.formulas import FORMULAS, Formula
from rayproof.tracer.kernel.arrays import array_types
from rayproof.tracer.kernel.parameters import LITERALS, DeviceBuffers
from rayproof.tracer.light_path.camera_stage import camera_frame
from rayproof.tracer.light_path.surfaces import DeviceScene
from rayproof.tracer.plan import Context, Plan
from rayproof.tracer.rays import Ray

TANGENT_BITS = 300


def tangents(fovy: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return tan(fovy / 2) as the sum of two float64 arrays; fovy [degrees] is taken as exact."""
    table = {}
    with bits(TANGENT_BITS):
        for angle in np.unique(fovy):
            tangent = (arb(float(angle)) / 360).sin_pi() / (arb(float(angle)) / 360).cos_pi()
            high = float(tangent.mid())
            table[angle] = (high, float((tangent - high).mid()))
    return np.array([table[angle][0] for angle in fovy]), np.array([table[angle][1] for angle in fovy])


def looking(x: Columns) -> Columns:
    """Return the components of the unit direction of a view ray; the tangent is the sum of two numbers."""
    forward = unit(minus(x["target"], x["eye"]))
    right = unit(cross(forward, x["up"]))
    up = cross(right, forward)
    tangent = x["tangent"] + x["tangent_rest"]
    across, upwards = x["sx"] * tangent * x["aspect"], x["sy"] * tangent
    direction = unit(plus(plus(forward, scaled(right, across)), scaled(up, upwards)))
    return {f"n{i}": value for i, value in enumerate(direction)}


@QUESTIONS.register("view_ray")
class ViewRay:
    """The unit direction of a view ray, by the slot's variant and the defaults of the camera's other slots."""

    def truth(self, ladder: Ladder, inputs: Inputs, rungs: np.ndarray) -> ExactAnswers:
        """Return the exact direction and K."""
        high, low = tangents(inputs["fovy"])
        numbers = {name: inputs[name] for name in ("eye", "target", "up", "sx", "sy", "aspect")}
        numbers |= {"tangent": high, "tangent_rest": low}
        values = evaluated(looking, numbers)
        witness = Witness(*witnessed(looking, numbers, values, sample(rungs)))
        forward = inputs["target"] - inputs["eye"]
        sine = np.linalg.norm(np.cross(forward, inputs["up"]), axis=1)
        sine = sine / np.linalg.norm(forward, axis=1) / np.linalg.norm(inputs["up"], axis=1)
        finite = np.isfinite(values["n0"].high)
        # One rounding of fovy moves the tangent T of a = fovy / 2 by a (1 + T^2) / T roundings. At the distance rho
        # from the centre of the image plane that turns a ray by rho / (1 + rho^2) times as much: by more than one
        # rounding if fovy is above 100 degrees.
        rho = high * np.hypot(inputs["sx"] * inputs["aspect"], inputs["sy"])
        moved = np.radians(inputs["fovy"]) / 2 * (1 + high**2) / high
        K = np.maximum(1.0, moved * rho / (1 + rho**2)) + 1 / sine
        return ExactAnswers(counted=finite, facts={"n": values, "K": K}, witness=witness)

    def answer(self, ladder: Ladder, formula: Formula, inputs: Inputs, precision: str) -> Answer:
        """Return directions, one camera per ray, all in one kernel."""
        types = array_types(precision)
        configuration = Configuration(precision=precision, formulas={formula.slot: formula.variant})
        columns = uploaded(inputs, types)
        cameras: Any = SimpleNamespace(**{name: columns[name] for name in ("eye", "target", "up", "near", "far")})
        # The half-sizes of the image come from the formula, one angle at a time.
        half_extent = self._half_sizes(configuration, inputs, types)
        frame = camera_frame(cameras, configuration, types, half_extent=half_extent)
        return downloaded({"d": configuration["ray"](frame, columns["sx"], columns["sy"])}, len(inputs["sx"]))

    @staticmethod
    def _half_sizes(configuration: Configuration, inputs: Inputs, types: Any) -> tuple[Any, Any]:
        numbers = np.stack([inputs["fovy"], inputs["aspect"]])
        # Find runs of rays with the same pair first, because sorting the pairs of all rays takes long.
        starts = np.concatenate([[True], np.any(numbers[:, 1:] != numbers[:, :-1], axis=0)])
        pairs, where = np.unique(numbers[:, starts], axis=1, return_inverse=True)
        sizes = np.array(
            [
                [float(size[0]) for size in configuration["half_extent"](types.Float, float(fovy), float(aspect))]
                for fovy, aspect in pairs.T
            ]
        )[where[np.cumsum(starts) - 1]]
        return number(sizes[:, 0], types), number(sizes[:, 1], types)

    def grade(self, ladder: Ladder, inputs: Inputs, truth: ExactAnswers, answer: Answer, precision: str) -> Grades:
        """Return angles in degrees, or in pixels of an image of 1080 rows; a direction with NaN is invalid."""
        angle = angles(answer["d"], truth.facts["n"])
        bad = ~np.isfinite(angle)
        error = np.degrees(angle)
        if ladder.options.get("natural") == "pixels":
            error = error / (inputs["fovy"] / 1080)
        return Grades(
            counted=truth.counted,
            false_hit=nothing(len(bad)),
            false_miss=nothing(len(bad)),
            invalid=bad & truth.counted,
            error=np.where(truth.counted, error, np.nan),
            index=np.where(truth.counted, angle / (truth.facts["K"] * UNIT_ROUNDOFF[precision]), np.nan),
        )


# The point on a shape: its distance from the true surface.
#
# The inputs are the same as for "distance" with that shape. The distance is by the default formula, so only the formula
# of the point differs.


@dataclass(frozen=True, kw_only=True)
class InPlace:
    """The argument `object_ray` of a position formula if object space is world space.

    `everywhere` is the mask of hit spheres, the same for all rays.
    """

    ray: Ray
    center: Any
    radius: Any
    everywhere: Any

    def __call__(self) -> tuple[Ray, Callable[[Any], Any]]:
        """Return the ray in object space, and the transform of points to world space, which is the identity."""
        return self.ray, lambda point: point

    def spheres(self) -> tuple[Any, Any, Any]:
        """Return the mask of hit spheres, their centres and radii [m]."""
        return self.everywhere, self.center, self.radius


def off_surface(shape: str, p: np.ndarray, x: Inputs) -> np.ndarray:
    """Return the distance [m] of points (rays, 3) from the true surface."""
    if shape == "plane":
        return abs(p[:, 2])
    exact = parts({**x, "p": p}, floats)
    if shape == "sphere":
        local = minus(exact["p"], exact["c"])
        return abs((dot(local, local).sqrt() - exact["r"]).high)
    a, b, c = (exact[name] for name in "abc")
    normal = unit(cross(minus(b, a), minus(c, a)))
    return abs(dot(normal, minus(exact["p"], a)).high)


def rounding(shape: str, x: Inputs, t: np.ndarray) -> np.ndarray:
    """Return the length [m] that K u multiplies: |c| + r of a sphere, or the size of the terms along a flat normal.

    The best point on a sphere has the error of its own rounding, which the sphere's numbers bound. The numbers of a
    flat shape may all be zero; its bound has the components of o and t d along the normal, too.
    """
    if shape == "sphere":
        return np.linalg.norm(x["c"], axis=1) + x["r"]
    reach = abs(x["o"]) + abs(t[:, None] * x["d"])
    if shape == "plane":
        return reach[:, 2]
    normal = np.cross(x["b"] - x["a"], x["c"] - x["a"])
    return np.sum(abs(normal) * (reach + abs(x["a"])), axis=1) / np.linalg.norm(normal, axis=1)


@QUESTIONS.register("point")
class PositionQuestion:
    """The slot `position`: the distance of the computed point from the surface, on a sphere in radii."""

    def truth(self, ladder: Ladder, inputs: Inputs, rungs: np.ndarray) -> ExactAnswers:
        """Return the rays that hit as the counted rays."""
        whole = Distance().truth(ladder, inputs, rungs)
        return ExactAnswers(counted=whole.counted & whole.facts["hit"].hit, facts={}, witness=whole.witness)

    def answer(self, ladder: Ladder, formula: Formula, inputs: Inputs, precision: str) -> Answer:
        """Return points [m]."""
        types, shape = array_types(precision), str(ladder.options["shape"])
        columns = uploaded(inputs, types)
        ray = ray_of(columns)
        t = FORMULAS[f"{shape}/{FORMULAS.slots[shape]}"].function(ray, record(shape, columns, types), ahead(types))
        place = InPlace(
            ray=ray,
            center=columns.get("c", types.Vector(0.0)),
            radius=columns.get("r", types.Float(1.0)),
            everywhere=types.Bool(shape == "sphere"),
        )
        return downloaded({"p": formula.function(ray, t, place), "t": t}, len(inputs["o"]))

    def grade(self, ladder: Ladder, inputs: Inputs, truth: ExactAnswers, answer: Answer, precision: str) -> Grades:
        """Return distances from the surface; rays that the default distance formula misses are not counted."""
        shape = str(ladder.options["shape"])
        counted = truth.counted & np.isfinite(answer["t"])
        with np.errstate(all="ignore"):
            off = np.where(counted, off_surface(shape, answer["p"], inputs), np.nan)
            index = off / (UNIT_ROUNDOFF[precision] * rounding(shape, inputs, answer["t"]))
        rays = len(off)
        return Grades(
            counted=counted,
            false_hit=nothing(rays),
            false_miss=nothing(rays),
            invalid=counted & np.isnan(off),
            error=off / inputs["r"] if shape == "sphere" else off,
            index=index,
        )


@QUESTIONS.register("sphere_normal")
class SphereNormal:
    """The slot `sphere_normal`: inputs p and c; the angle to the exact direction from c to p. K = 1."""

    def truth(self, ladder: Ladder, inputs: Inputs, rungs: np.ndarray) -> ExactAnswers:
        """Return the exact unit normal."""

        def outward(x: Columns) -> Columns:
            return {f"n{i}": value for i, value in enumerate(unit(minus(x["p"], x["c"])))}

        exact = evaluated(outward, inputs)
        witness = Witness(*witnessed(outward, inputs, exact, sample(rungs)))
        return ExactAnswers(counted=~nothing(len(rungs)), facts={"n": exact}, witness=witness)

    def answer(self, ladder: Ladder, formula: Formula, inputs: Inputs, precision: str) -> Answer:
        """Return normals."""
        columns = uploaded(inputs, array_types(precision))
        return downloaded({"n": formula.function(columns["p"], columns["c"])}, len(inputs["p"]))

    def grade(self, ladder: Ladder, inputs: Inputs, truth: ExactAnswers, answer: Answer, precision: str) -> Grades:
        """Return angles in degrees."""
        angle = angles(answer["n"], truth.facts["n"])
        none = nothing(len(angle))
        return Grades(
            counted=truth.counted,
            false_hit=none,
            false_miss=none,
            invalid=~np.isfinite(angle),
            error=np.degrees(angle),
            index=angle / UNIT_ROUNDOFF[precision],
        )


@QUESTIONS.register("facing")
class Facing:
    """The slot `facing`: inputs n and d; a normal turned to the wrong side counts as a false hit."""

    def truth(self, ladder: Ladder, inputs: Inputs, rungs: np.ndarray) -> ExactAnswers:
        """Return the sign of n . d; exact right angles are not counted."""
        sign = decided(lambda x: {"side": dot(x["n"], x["d"])}, inputs)["side"]
        return ExactAnswers(counted=sign != 0, facts={"side": sign}, witness=Witness(len(sign), 0.0))

    def answer(self, ladder: Ladder, formula: Formula, inputs: Inputs, precision: str) -> Answer:
        """Return the turned normals."""
        columns = uploaded(inputs, array_types(precision))
        return downloaded({"n": formula.function(columns["n"], columns["d"])}, len(inputs["n"]))

    def grade(self, ladder: Ladder, inputs: Inputs, truth: ExactAnswers, answer: Answer, precision: str) -> Grades:
        """Return normals on the wrong side as false hits."""
        right = np.where((truth.facts["side"] > 0)[:, None], -inputs["n"], inputs["n"])
        wrong = np.any(answer["n"] != right, axis=1) & truth.counted
        unknown = np.full(len(wrong), np.nan)
        return Grades(
            counted=truth.counted,
            false_hit=wrong,
            false_miss=nothing(len(wrong)),
            invalid=np.any(np.isnan(answer["n"]), axis=1),
            error=unknown,
            index=unknown,
        )


# Does a tree lose a triangle that a ray hits? A ray may hit a box of `tracer.trees` without need, but must miss none.
#
# There is one tree per value of the sweep, over the triangles of all its rays. Each ray is aimed at its own triangle,
# and the triangles do not overlap. Rays that the formula misses without a tree are left out, so that every lost
# triangle is lost by the tree. A t that is larger than without the tree counts as lost, too. Option: bundle, the number
# of rays from one point that traverse the tree as one beam. Inputs: o, d, a, b, c.


CAMERA = camera_around((0, 0, 0), distance=4, azimuth=0, elevation=0, width=1, height=1, fovy=30)


@QUESTIONS.register("tree")
class TreeQuestion:
    """The slot `triangle`, in the leaves of a tree."""

    def truth(self, ladder: Ladder, inputs: Inputs, rungs: np.ndarray) -> ExactAnswers:
        """Return the rays that hit their own triangle as the counted rays."""
        own = Distance().truth(ladder, inputs, rungs)
        return ExactAnswers(counted=own.counted & own.facts["hit"].hit, facts=own.facts, witness=own.witness)

    def answer(self, ladder: Ladder, formula: Formula, inputs: Inputs, precision: str) -> Answer:
        """Return t per ray through the tree of its value, and t of its own triangle without a tree."""
        rays = len(inputs["o"])
        per_value = rays // len(ladder.values) if rays % len(ladder.values) == 0 else rays
        edges = range(0, rays + 1, per_value)
        bundle = int(str(ladder.options.get("bundle", 1)))
        parts = [
            _through({name: array[a:b] for name, array in inputs.items()}, formula, precision, bundle)
            for a, b in pairwise(edges)
        ]
        return {"t": np.concatenate(parts)} | {"alone": Distance().answer(ladder, formula, inputs, precision)["t"]}

    def grade(self, ladder: Ladder, inputs: Inputs, truth: ExactAnswers, answer: Answer, precision: str) -> Grades:
        """Return hits that the tree loses as false misses."""
        counted = truth.counted & np.isfinite(answer["alone"])
        none, unknown = nothing(len(counted)), np.full(len(counted), np.nan)
        lost = counted & ~(answer["t"] <= answer["alone"])
        return Grades(counted=counted, false_hit=none, false_miss=lost, invalid=none, error=unknown, index=unknown)


def _through(inputs: Inputs, formula: Formula, precision: str, bundle: int) -> np.ndarray:
    """Return t of rays through the tree over their triangles; `bundle` consecutive rays start from the same point."""
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
    distances = downloaded(
        {str(k): t for k, (t, _) in enumerate(trees.met(hierarchy, rays, [ahead(types)] * bundle))}, len(parts[0]["o"])
    )
    return np.stack([distances[str(k)] for k in range(bundle)], axis=1).ravel()
