"""The table of all formulas: each slot's variants and the items that they cover; `Formula` and `Catalogue`.

Contract. A formula is a function in a module of this folder and a line in `TABLE`: "slot/variant", its kind (right,
control, or a mistake), module:function, and the specification's items that it covers. Optional are default=True for the
variant that runs unless another is named, the facts of `Formula`, `says`, and the stage if it is not the slot's.

Arguments and results are Dr.Jit arrays of the configuration's precision.

Camera, of literals, so that they fold away; a frame is `tracer.light_path.camera_stage.Frame`:

    half_extent(Float, fovy, aspect)             -> (horizontal, vertical) half-sizes of the image at depth 1, Float;
                                                    fovy in degrees and aspect as Python numbers
    basis(eye, target, up)                       -> (right, up, forward), unit and orthogonal
    view(eye, right, up, forward)                -> 4x4, world -> camera (x right, y up, z forward)
    projection(horizontal, vertical, near, far)  -> 4x4, camera -> clip, w = depth
    inverse(matrix)                              -> 4x4
    corners(frame)                               -> 8 world points [m], near plane first
    sample(column, row, per_side)                -> (px, py), column and row counted in samples, per_side per pixel
    ndc(px, py, width, height)                   -> (sx, sy)
    pixel(sx, sy, width, height)                 -> (px, py)
    ray(frame, sx, sy)                           -> unit world direction

Clipping; t [m] along the unit direction, both exclusive. The scene's `clip` chooses the slot:

    clip_depth(direction, forward, near, far)    -> (nearest, farthest)
    clip_shell(direction, forward, near, far)    -> (nearest, farthest)
    clip_none(direction, forward, near, far)     -> (nearest, farthest)

Transforms; a transform is `tracer.shapes.shape.Transform`:

    to_object(ray, transform)                    -> the ray in object space with the same parameter t
    position(ray, distance, object_ray)          -> world point [m]; object_ray() returns the ray in the object space
                                                    of the hit shape, and a function that transforms points to world
                                                    space (nothing is computed unless it is called);
                                                    object_ray.spheres() returns the mask of hit spheres, their
                                                    centres and radii [m]

Intersections: the t at which a ray meets a primitive, inf on a miss. With the fact space="object" the ray is in object
space. Its direction need not be a unit vector. Of several intersections the smallest inside `interval` counts. A NaN is
a miss. No later step turns a hit into a miss, so a formula is responsible for its own t:

    sphere(ray, sphere, interval)                -> t; sphere.center, sphere.radius
    cube(ray, cube, interval)                    -> t; cube.half = 0.5
    plane(ray, plane, interval)                  -> t; the plane z = 0
    square(ray, square, interval)                -> t; square.center, .half_width, .half_height (world [m]),
                                                    .orthogonal (bool); in object space .half = 0.5 in z = 0
    triangle(ray, triangle, interval)            -> t; triangle.first, .second, .third, in world space
    nearest(distance, best)                      -> mask: `distance` replaces `best`

Normals:

    sphere_normal(point, center)                 -> unit outward normal in object space
    cube_normal(point)                           -> the same for [-0.5, 0.5]^3; with the fact takes="ray" it gets the
                                                    ray in object space and the distance instead
    world_normal(normal, transform)              -> unit world normal; not called where object space is world space
    facing(normal, direction)                    -> the normal of a two-sided surface, turned against `direction`

Shadow rays (the lecture calls them light feelers); cosine = dot(N, L):

    horizon(cosine)                              -> mask: the light is not above the surface's horizon
    segment(origin, light)                       -> (direction, end): origin + t direction is tested for t < end; with
                                                    the fact bounded=True no farther than the light
    obstructed(distance)                         -> mask: the ray is blocked by its hit at t = distance (inf: no hit)
    shadow_ray(hit, cosine, reach)               -> `tracer.rays.Start`, the strategy against shadow acne. `hit` is
                                                    `tracer.rays.Hit`, reach the distance to the light [m]. Facts:
                                                    doubles=True (compute the shadow ray and its start in float64),
                                                    clearances (blockers nearer to the surface than this many
                                                    clearances may be missed; 1 by default), moved(scale, precision)
                                                    (the additional distance [m]; scale is the largest absolute
                                                    coordinate [m])

Light, per channel; cosine = dot(N, L) may be negative:

    cosine(normal, away)                         -> dot(N, L) for the vector [m] to the light; 0 for a light exactly at
                                                    the point
    falloff(flux, squared_distance)              -> irradiance [W/m^2] on a surface that faces the light; with the fact
                                                    by="away" it gets the vector [m] to the light instead
    lambert(irradiance, cosine)                  -> irradiance on the tilted surface
    simplified(flux, cosine)                     -> the lecture's simplified point light
    sum_lights(contributions)                    -> the sum over a non-empty list of lights
    exitance(albedo, irradiance)                 -> [W/m^2]
    radiance(exitance)                           -> [W/(m^2 sr)]
    radiance_simplified(exitance)                -> the same in the simplified model
    hidden(normal, direction)                    -> mask: the viewer sees the back of a one-sided surface
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property, partial
from typing import Any, Literal

from rayproof.cases.registry import Entry, Place, Table
from rayproof.cases.scene import Cube, Mesh, Plane, Shape, Sphere, Square, Triangle
from rayproof.cases.stages import Stage
from rayproof.tracer.formulas.mistakes import MISTAKES
from rayproof.tracer.formulas.own_file import is_own, own_formula

Kind = Literal["right", "control", "fault"]

# The slots in the order of a configuration's name, with the stage that a wrong formula spoils.
STAGE_OF: dict[str, Stage] = {
    slot: stage
    for stage, slots in (
        (Stage.CAMERA, "basis corners half_extent inverse ndc pixel projection"),
        (Stage.RAY, "ray"),
        (Stage.CAMERA, "sample view"),
        (Stage.OBJECT, "clip_depth clip_none clip_shell"),
        (Stage.POSITION, "position"),
        (Stage.OBJECT, "to_object cube nearest plane sphere square triangle"),
        (Stage.NORMAL, "cube_normal facing sphere_normal world_normal"),
        (Stage.VISIBILITY, "shadow_ray horizon obstructed segment"),
        (Stage.IRRADIANCE, "cosine"),
        (Stage.EXITANCE, "exitance"),
        (Stage.IRRADIANCE, "falloff"),
        (Stage.RADIANCE, "hidden"),
        (Stage.IRRADIANCE, "lambert"),
        (Stage.RADIANCE, "radiance radiance_simplified"),
        (Stage.IRRADIANCE, "simplified sum_lights"),
    )
    for slot in slots.split()
}
# Whose formulas only scenes with these shapes ask for.
SHAPES_OF: dict[str, tuple[type[Shape], ...]] = {
    "sphere": (Sphere,),
    "sphere_normal": (Sphere,),
    "cube": (Cube,),
    "cube_normal": (Cube,),
    "plane": (Plane,),
    "square": (Square,),
    "triangle": (Triangle, Mesh),
}
PLACED = ("to_object", "world_normal")  # of no use where object space is world space
ROUNDED_EDGES = "two triangles round the edge that they share differently"


def _entry(kind: Kind, path: str, *covers: str, **facts: Any) -> Entry:
    """Return a line of the table: a formula of a kind, its place, and the items of the specification that it covers."""
    return Entry(path, covers=covers, kind=kind, **facts)


# `right`: a variant that must pass. `control`: a form that is printed wrongly or known to be inaccurate.
right, control = partial(_entry, "right"), partial(_entry, "control")

TABLE: dict[str, Entry] = {
    "half_extent/tangent": right("camera:half_extent", "CAM-2", default=True),
    "basis/right_handed": right("camera:basis", "CAM-1", default=True),
    "view/rows": right("camera:view", "CAM-1", default=True),
    "projection/zero_to_one": right("camera:projection", "CAM-2", default=True),
    "inverse/general": right("camera:inverse", "CAM-1", "CAM-2", default=True),
    "corners/axes": right("camera:corners", "CAM-2", default=True),
    "sample/centre": right("camera:centre", "CAM-3", default=True),
    "sample/corner": control("camera:corner", "CAM-3", erratum="E1"),
    "ndc/up": right("camera:ndc", "CAM-3", default=True),
    "pixel/down": right("camera:pixel", "CAM-3", default=True),
    "ray/reference_point": right("camera_rays:reference_point", "CAM-4", default=True),
    "ray/reference_point_at_target": right("camera_rays:reference_point_at_target", "CAM-4"),
    "ray/reference_free": right("camera_rays:reference_free", "CAM-4"),
    "ray/inverse_matrices": right("camera_rays:inverse_matrices", "CAM-5"),
    "ray/half_depth": control(
        "camera_rays:half_depth",
        "CAM-5",
        erratum="E14",
        says="forgets to divide by w where it brings a point at half depth back from clip space",
    ),
    "ray/rotated": right("camera_rays:rotated", "CAM-5"),
    "ray/w_divided_in_view": right("camera_rays:w_divided_in_view", "CAM-5"),
    "ray/matrix": control(
        "camera_rays:by_matrix",
        "CAM-5",
        known_bad="w is far (1 / 2 near - 1 / 2 near + ...), 1 up to far / near roundings, and multiplies the eye",
    ),
    "ray/matrix_w_divide": control(
        "camera_rays:matrix_w_divide",
        "CAM-5",
        known_bad="w cancels like far / near; the ray turns by u abs(eye) / near, and dies at far / near = 2 / u",
    ),
    "ray/analytic_inverse": control(
        "camera_rays:analytic_inverse",
        "CAM-5",
        known_bad="w cancels like far / near in the product; the ray turns by u abs(eye) / near, and dies at 2 / u",
    ),
    "clip_depth/planes": right("hits:planes", "HIT-2", default=True),
    "clip_depth/shell": control("hits:shell", "HIT-2", erratum="E2"),
    "clip_shell/distance": right("hits:distance", "HIT-2", default=True),
    "clip_none/in_front": right("hits:in_front", "HIT-2", default=True),
    "to_object/inverse": right("hits:to_object", "XF-1", default=True),
    "position/along_ray": right("hits:along_ray", "XF-2", default=True),
    "position/by_matrix": right("hits:by_matrix", "XF-2"),
    "position/reprojected": right("hits:reprojected", "XF-2"),
    "sphere/textbook": right("spheres:textbook", "HIT-1", space="object"),
    "sphere/first_positive": control(
        "spheres:first_positive",
        "HIT-1",
        space="object",
        erratum="E3",
        says="takes the sphere's second root without asking whether it is positive",
    ),
    "sphere/kahan": right("spheres:kahan", "HIT-1", space="object"),
    "sphere/stable_quadratic": right("spheres:stable_quadratic", "HIT-1", space="object"),
    "sphere/half_b": right("spheres:half_b", "HIT-1", space="object"),
    "sphere/haines": right("spheres:haines", "HIT-1", default=True, space="object"),
    "sphere/shift": right("spheres:shift", "HIT-1", space="object"),
    "sphere/pbrt4": right("spheres:pbrt4", "HIT-1", space="object"),
    "sphere/float64": right("spheres:float64", "HIT-1", space="object"),
    "cube/slabs": right("cubes:slabs", "HIT-3", default=True, space="object"),
    "cube/entry_only": control(
        "cubes:entry_only",
        "HIT-3",
        space="object",
        erratum="E4",
        says="takes a ray's entry into a cube as the hit, behind the eye too",
    ),
    "cube/divides_anyway": control(
        "cubes:divides_anyway",
        "HIT-3",
        space="object",
        erratum="E15",
        equivalent="0 / 0 needs a ray in the plane of a face, which sees that face edge-on, as an outline, where hit "
        "and miss are both right; elsewhere x / 0 is an infinity of the right sign",
    ),
    "cube/parallel_branch": right("cubes:parallel_branch", "HIT-3", space="object"),
    "cube/ieee_slabs": control(
        "cubes:ieee_slabs",
        "HIT-3",
        space="object",
        known_bad="0 * inf is NaN where a parallel ray starts in a face's plane, which the closed cube contains",
    ),
    "cube/division": control(
        "cubes:division",
        "HIT-3",
        space="object",
        known_bad="0 / 0 is NaN where a parallel ray starts in a face's plane, which the closed cube contains",
    ),
    "cube/ize": control(
        "cubes:ize",
        "HIT-3",
        space="object",
        known_bad="a conservative bound and no answer: ties outside the cube become hits, and 0 * inf is NaN",
    ),
    "cube/nan_dropping": control(
        "cubes:nan_dropping",
        "HIT-3",
        space="object",
        known_bad="of a slab whose plane holds a parallel ray's origin, one bound is NaN and the other an infinity "
        "that misses",
    ),
    "plane/dot_products": right("flat_shapes:dot_products", "HIT-4", default=True, space="object"),
    "plane/unguarded": control(
        "flat_shapes:unguarded",
        "HIT-4",
        space="object",
        erratum="E11",
        equivalent="a parallel ray gives t = -inf, inf or NaN, and none of these lies inside an open interval",
    ),
    "square/local": right("flat_shapes:local", "HIT-7", default=True, space="object"),
    "square/half_vectors": right("flat_shapes:half_vectors", "HIT-8"),
    "square/full_vectors": control(
        "flat_shapes:full_vectors",
        "HIT-8",
        erratum="E7",
        says="takes a square's half vectors for its whole width and height, so that it is twice as large",
    ),
    "triangle/signed_areas": right("triangles:signed_areas", "HIT-5", leaks=ROUNDED_EDGES),
    "triangle/unsigned_areas": control(
        "triangles:unsigned_areas",
        "HIT-5",
        erratum="E5",
        says="asks whether a triangle's areas sum up to exactly 1, which rounding makes false",
    ),
    "triangle/moeller_trumbore": right("triangles:moeller_trumbore", "HIT-6", leaks=ROUNDED_EDGES),
    "triangle/printed_third_row": control(
        "triangles:printed_third_row",
        "HIT-6",
        erratum="E6",
        says="takes Cramer's rule as the lecture prints it, with a third row that is always 0",
    ),
    "triangle/scalar_triple": control(
        "triangles:scalar_triple",
        "HIT-6",
        erratum="E16",
        equivalent="a word is wrong and the formula right: -(A x C) . B is the determinant that Cramer's rule asks for",
        leaks=ROUNDED_EDGES,
    ),
    "triangle/moeller_trumbore_epsilon": control(
        "triangles:moeller_trumbore_epsilon",
        "HIT-6",
        known_bad="an absolute epsilon on the determinant, an area, deletes small and slender triangles",
        leaks=ROUNDED_EDGES,
    ),
    "triangle/pluecker": right("triangles:pluecker", "HIT-5", leaks="edges need not meet exactly in a vertex"),
    "triangle/woop": right("triangles:woop", "HIT-5"),
    "triangle/woop_kahan": right("triangles:woop_kahan", "HIT-5", default=True),
    "triangle/woop_float64_fallback": right("triangles:woop_float64_fallback", "HIT-5"),
    "triangle/baldwin_weber": right("triangles:baldwin_weber", "HIT-6", leaks=ROUNDED_EDGES),
    "nearest/smaller": right("hits:smaller", "HIT-9", default=True),
    "sphere_normal/from_center": right("normals:from_center", "NRM-1", default=True),
    "sphere_normal/center_kept": control("normals:center_kept", "NRM-1", erratum="E17"),
    "cube_normal/greatest": right("normals:greatest", "NRM-2", default=True),
    "cube_normal/entering_slab": right("normals:entering_slab", "NRM-2", takes="ray"),
    "world_normal/inverse_transpose": right("normals:inverse_transpose", "NRM-3", "XF-2", default=True),
    "world_normal/whole_matrix": control(
        "normals:whole_matrix",
        "NRM-3",
        erratum="E13",
        equivalent="the inverse transpose of an affine 4x4 matrix has the 3x3 part's inverse transpose as its xyz "
        "block, and w = 0",
    ),
    "world_normal/with_w": control(
        "normals:with_w",
        "NRM-3",
        erratum="E13",
        says="normalises normals with their fourth component, so that a translation makes them too short",
    ),
    "world_normal/model_matrix": control(
        "normals:model_matrix", "NRM-3", known_bad="right for rotations and uniform scales alone"
    ),
    "facing/viewer": right("normals:viewer", "NRM-3", default=True),
    "horizon/below": right("shadow_rays:below", "LIT-1", default=True),
    "segment/to_light": right("shadow_rays:to_light", "LIT-1", default=True, bounded=True),
    "segment/endless": control("shadow_rays:endless", "LIT-1", erratum="E10"),
    "obstructed/any_hit": right("shadow_rays:any_hit", "LIT-1", default=True),
    "shadow_ray/none": control(
        "shadow_rays:no_strategy",
        "LIT-1",
        known_bad="rounding puts about half of all hit points below their own surface, which then hides the light",
        clearances=0,
    ),
    "shadow_ray/skip_last": right("shadow_rays:skip_last", "LIT-2"),
    "shadow_ray/minimum_t": right("shadow_rays:minimum_t", "LIT-3"),
    "shadow_ray/fixed_minimum_t": control(
        "shadow_rays:fixed_minimum_t",
        "LIT-3",
        known_bad="one length for every scale: too short from 100 m on, and longer than what stands close in small "
        "scenes",
        moved=Place("shadow_rays:fixed_minimum_t_moves"),
    ),
    "shadow_ray/relative_minimum_t": control(
        "shadow_rays:relative_minimum_t",
        "LIT-3",
        known_bad="too short towards the terminator, and longer than what stands close in scenes far from the origin",
        moved=Place("shadow_rays:relative_minimum_t_moves"),
    ),
    "shadow_ray/doubles": right("shadow_rays:doubles", "LIT-4", doubles=True),
    "shadow_ray/normal_offset": right("shadow_rays:normal_offset", "LIT-5", default=True),
    "shadow_ray/fixed_offset": control(
        "shadow_rays:fixed_offset",
        "LIT-5",
        known_bad="one length for every scale: too short from 1 km on, and more than the whole of a small scene",
        moved=Place("shadow_rays:fixed_offset_moves"),
    ),
    "shadow_ray/waechter_binder": control(
        "shadow_rays:waechter_binder",
        "LIT-5",
        known_bad="256 spacings of the hit point are fewer than the error of o + t d on grazing or far hits",
        moved=Place("shadow_rays:waechter_binder_moves"),
    ),
    "shadow_ray/error_bound": right("shadow_rays:error_bound", "LIT-5", clearances=4),
    "shadow_ray/mitsuba": right("shadow_rays:mitsuba", "LIT-5", moved=Place("shadow_rays:mitsuba_moves")),
    "cosine/direct": right("light:direct", "RAD-2", default=True),
    "cosine/scaled": right("light:cosine_scaled", "RAD-2"),
    "falloff/inverse_square": right("light:inverse_square", "RAD-1", default=True),
    "falloff/none": control(
        "light:no_falloff",
        "RAD-1",
        erratum="E9",
        says="leaves out 4 pi r^2, so that light neither spreads nor falls off",
    ),
    "falloff/scaled": right("light:falloff_scaled", "RAD-1", by="away"),
    "lambert/cosine": right("light:cosine_law", "RAD-2", default=True),
    "simplified/clamped_cosine": right("light:clamped_cosine", "RAD-3", default=True),
    "sum_lights/all": right("light:every", "LIT-1", "RAD-5", default=True),
    "exitance/albedo": right("light:exitance", "RAD-4", default=True),
    "radiance/diffuse": right("light:diffuse", "RAD-4", "RAD-5", default=True),
    "radiance_simplified/same": right("light:same", "RAD-3", default=True),
    "hidden/back": right("light:back", "RAD-4", default=True),
    **MISTAKES,
}
FUNCTIONS: Table[Callable[..., Any]] = Table("formula", package="rayproof.tracer.formulas", entries=TABLE)


@dataclass(frozen=True, kw_only=True)
class Formula:
    """A formula and its facts.

    A "control" is a wrong form that the lecture prints or invites (`erratum`), or a form that is inaccurate according
    to the literature (`known_bad`), kept runnable; a "fault" is planted for the audit. Unless it is `equivalent` or
    `known_bad`, the fact `says` describes a renderer that uses it by a verb phrase such as "leaves out 4 pi".
    """

    name: str  # "slot/variant", or "slot=FILE.py:function" of a user's own
    slot: str
    variant: str
    load: Callable[[], Callable[..., Any]]  # imports its module
    covers: tuple[str, ...]  # specification ids
    kind: Kind
    stage: Stage  # the one blamed when it is wrong
    module: str  # dotted name of its module; for a function of the user's, the module of the slot's default
    default: bool = False
    erratum: str | None = None  # such as "E6"
    known_bad: str | None = None  # where a form that computes the right thing in exact arithmetic breaks down
    leaks: str | None = None  # of triangles: where rays slip between two that share an edge, if they do (`watertight`)
    equivalent: str | None = None  # why a wrong form is right on every valid scene
    facts: Mapping[str, Any]  # the facts of its line in the table and of its slot

    @property
    def function(self) -> Callable[..., Any]:
        """Return the function itself."""
        return self.load()

    @property
    def summary(self) -> str:
        """Return the first line of the function's docstring."""
        return (self.function.__doc__ or "").strip().split("\n")[0]


def _formula(name: str) -> Formula:
    slot, variant = name.split("/")
    facts = FUNCTIONS.about(name)
    return Formula(
        name=name,
        slot=slot,
        variant=variant,
        load=lambda: FUNCTIONS[name],
        covers=facts["covers"],
        kind=facts["kind"],
        stage=facts.get("stage", STAGE_OF[slot]),
        module=FUNCTIONS.module(name),
        facts=facts,
        **{key: facts[key] for key in ("default", "erratum", "known_bad", "leaks", "equivalent") if key in facts},
    )


class Catalogue(Mapping[str, Formula]):
    """All formulas by "slot/variant", as the table lists them; computing with one imports its page."""

    @cached_property
    def _formulas(self) -> dict[str, Formula]:
        order = list(STAGE_OF)
        formulas = [
            _formula(name) for name in sorted(FUNCTIONS, key=lambda name: (order.index(name.split("/")[0]), name))
        ]
        for slot in order:
            defaults = [formula.name for formula in formulas if formula.slot == slot and formula.default]
            if len(defaults) != 1:
                raise ValueError(f"slot {slot!r} must have one default, got {defaults}")
        return {formula.name: formula for formula in formulas}

    def __getitem__(self, name: str) -> Formula:
        """Return the formula called "slot/variant"; a variant may be a function of the user's, "FILE.py:function".

        Raises:
            LookupError: there is none; the message lists the known names. The user's file is only read when the formula
                is loaded.

        """
        if name in self._formulas:
            return self._formulas[name]
        slot, _, variant = name.partition("/")
        if slot not in self.slots:
            raise LookupError(f"no slot is called {slot!r}; known: {', '.join(sorted(self.slots))}")
        if is_own(variant):
            return own_formula(variant, default=self[f"{slot}/{self.slots[slot]}"])
        raise LookupError(f"no variant is called {name!r}; known: {', '.join(f.name for f in self.variants(slot))}")

    def __contains__(self, name: object) -> bool:
        return name in self._formulas

    def __iter__(self) -> Iterator[str]:
        return iter(self._formulas)

    def __len__(self) -> int:
        return len(self._formulas)

    def named(self, text: str) -> Formula:
        """Return the formula that a user writes as "slot/variant", "slot=variant" or "slot=FILE.py:function".

        Raises:
            LookupError: there is none; the message lists the known names.
            OwnFormulaError: the file does not import, or contains no function that the slot can call.

        """
        formula = self[text.replace("=", "/", 1)]
        if is_own(formula.variant):
            formula.load()
        return formula

    @cached_property
    def slots(self) -> dict[str, str]:
        """Return the default variant of every slot, in the order of the light path."""
        return {formula.slot: formula.variant for formula in self._formulas.values() if formula.default}

    def variants(self, slot: str) -> tuple[Formula, ...]:
        """Return all formulas of a slot: the default first, planted faults last."""
        formulas = (formula for formula in self._formulas.values() if formula.slot == slot)
        return tuple(sorted(formulas, key=lambda formula: (not formula.default, formula.kind == "fault", formula.name)))


FORMULAS = Catalogue()
