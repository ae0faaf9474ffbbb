"""The tracer's wrong formulas and planted faults as hypotheses: each is rendered by the tracer, in float64.

What one of them shows may depend on the right formulas around it: a fault of the way into object space leaves a square
alone that is met by its half vectors. So each is tried beside squares of either kind.
"""

from rayproof.reports.diagnosis import MISTAKES, Mistake, Way
from rayproof.reports.diagnosis.mistakes.shapes import LARGER_ROOTS
from rayproof.reports.diagnosis.object_space import FORWARD, MOVED, PARALLELOGRAMS, RENORMALISED, UNIT_A
from rayproof.tracer.catalogue import FORMULAS, Formula

# Those that a stranger makes, in words; the rest says what its formula says.
SAYS = {
    "to_object/fault_renormalised": (
        "renormalised_direction",
        "normalises the ray's direction in object space and takes t as it is",
    ),
    "to_object/fault_moved_direction": (
        "moved_direction",
        "moves a ray's direction like a point when it goes into object space",
    ),
    "to_object/fault_forward_matrix": (
        "forward_matrix",
        "brings rays into object space by the model matrix instead of its inverse",
    ),
    "sphere/fault_far_root": ("far_root", "takes the larger root of the sphere's quadratic"),
    "sphere/fault_unit_a": (
        "unit_a",
        "takes A = 1 in the sphere's quadratic for a direction that is no unit vector",
    ),
    "sphere/fault_half_b": ("half_b", "mixes B and B/2 in the sphere's quadratic"),
    "sphere/fault_negative_root": (
        "negative_root",
        "takes the sphere's smaller root wherever it lies, behind the eye too",
    ),
    "sphere/first_positive": (
        "second_root_unasked",
        "takes the sphere's second root without asking whether it is positive",
    ),
    "cube/fault_entry_alone": ("cube_entry_only", "takes where a ray enters a cube, and never where it leaves it"),
    "cube/entry_only": ("cube_entry_anywhere", "takes where a ray enters a cube, behind the eye too"),
    "cube/fault_behind_is_hit": ("cube_behind", "hits cubes behind the eye"),
    "cube/fault_not_swapped": ("cube_not_swapped", "does not swap the slabs' ends where a ray runs the other way"),
    "square/fault_disc_local": ("square_disc", "takes a disc for a square"),
    "plane/fault_one_sided": ("plane_one_sided", "hits planes from the front alone"),
    "plane/fault_sign": ("plane_sign", "has a sign wrong in the plane's intersection"),
    "triangle/fault_culled": ("triangle_culled", "culls triangles that face away"),
    "triangle/fault_no_sum": ("triangle_no_sum", "leaves out u + v <= 1, so that triangles become parallelograms"),
    "triangle/printed_third_row": (
        "triangle_printed",
        "takes Cramer's rule as the lecture prints it, with a third row that is always 0",
    ),
    "world_normal/fault_world_winding": (
        "normal_by_winding",
        "derives normals from the winding in the world, which a mirror turns round",
    ),
    "obstructed/fault_nearer_than_light": ("half_way", "lets only the nearer half of the way to a light be blocked"),
    "horizon/fault_reversed": ("horizon_reversed", "asks the wrong way round whether a light is above the horizon"),
    "position/fault_left_in_object_space": ("position_in_object_space", "leaves hit points in object space"),
    "simplified/fault_over_four_pi": ("four_pi_in_simplified", "divides by 4 pi under the simplified light, too"),
}
# Said elsewhere, by the oracle, which has edges and limits of its own; and acne, by how it looks.
ELSEWHERE = frozenset(
    {
        "clip_depth/fault_far_ignored", "clip_depth/fault_near_ignored", "clip_depth/shell", "clip_none/fault_behind",
        "clip_shell/fault_planes", "sphere/fault_center_ignored", "square/fault_full_size_local",
        "cube_normal/fault_greatest_value", "cube_normal/fault_unsigned", "facing/fault_never",
        "sphere_normal/center_kept", "sphere_normal/fault_inward", "world_normal/fault_inverse_untransposed",
        "world_normal/fault_model_matrix", "world_normal/fault_unnormalised", "obstructed/fault_never",
        "exitance/fault_albedo_squared", "exitance/fault_channels_swapped", "exitance/fault_white",
        "falloff/fault_hemisphere", "falloff/fault_inverse", "falloff/fault_no_four_pi", "hidden/fault_front",
        "hidden/fault_never", "lambert/fault_missing", "lambert/fault_squared", "radiance/fault_clamped",
        "radiance/fault_no_pi", "radiance/fault_srgb", "radiance_simplified/fault_over_pi",
        "sum_lights/fault_last_dropped", "sum_lights/fault_mean", "sum_lights/fault_clamped",
        "ray/fault_not_normalised", "feeler/fault_bare", "segment/endless",
        "half_extent/fault_horizontal_angle", "half_extent/fault_no_aspect", "half_extent/fault_whole_angle",
        "basis/fault_left_handed", "basis/fault_up_as_given", "sample/corner", "ndc/fault_not_flipped",
        "feeler/fault_wide_offset", "nearest/fault_first", "nearest/fault_last",
    }
)  # fmt: skip
# The same mistake of other renderers: that take the normal where the ray meets the shape in object space; whose feelers
# ask for any hit, so that both roots count for them, and are no unit vectors; and that have no tree of boxes.
ELSE = {
    "renormalised_direction": RENORMALISED,
    "moved_direction": MOVED,
    "forward_matrix": FORWARD,
    "far_root": LARGER_ROOTS,
    "unit_a": UNIT_A,
    "triangle_no_sum": PARALLELOGRAMS,
}
SQUARES = ("local", "half_vectors")


def _wanted(formula: Formula) -> bool:
    wrong = formula.kind in ("control", "fault") and formula.equivalent is None and formula.known_bad is None
    return wrong and formula.name not in ELSEWHERE


for _formula in (one for one in FORMULAS.values() if _wanted(one)):
    _name, _says = SAYS.get(_formula.name, (_formula.name, f"computes as the wrong formula {_formula.name} does"))
    _own = {_formula.slot: _formula.variant}
    _beside = (ELSE[_name],) if _name in ELSE else ()
    _around = [{}] if _formula.slot == "square" else [{"square": square} for square in SQUARES]
    MISTAKES.register(_name)(
        Mistake(
            says=_says, items=_formula.covers, ways=(*(Way(formulas=_own | around) for around in _around), *_beside)
        )
    )
