"""The tracer's wrong and planted formulas as hypotheses, rendered by the tracer in float64.

What one of them shows may depend on the right formulas around it: a fault of the way into object space leaves a square
alone that is met by its half vectors. So each is tried beside squares of either kind. What the mistake is in words, a
wrong formula declares where it is registered: `says`.
"""

from rayproof.reports.diagnosis import MISTAKES, Mistake, Way
from rayproof.reports.diagnosis.mistakes.normals import FORWARD, MOVED, PARALLELOGRAMS, RENORMALISED, UNIT_A
from rayproof.reports.diagnosis.mistakes.shapes import LARGER_ROOTS
from rayproof.tracer.formulas import FORMULAS, Formula

# Those that other programs make too, by what these call them; the rest goes by the name of its formula.
NAMES = {
    "to_object/fault_renormalised": "renormalised_direction",
    "to_object/fault_moved_direction": "moved_direction",
    "to_object/fault_forward_matrix": "forward_matrix",
    "sphere/fault_far_root": "far_root",
    "sphere/fault_unit_a": "unit_a",
    "sphere/fault_half_b": "half_b",
    "sphere/fault_negative_root": "negative_root",
    "sphere/first_positive": "second_root_unasked",
    "cube/fault_entry_alone": "cube_entry_only",
    "cube/entry_only": "cube_entry_anywhere",
    "cube/fault_behind_is_hit": "cube_behind",
    "cube/fault_not_swapped": "cube_not_swapped",
    "square/fault_disc_local": "square_disc",
    "plane/fault_one_sided": "plane_one_sided",
    "plane/fault_sign": "plane_sign",
    "triangle/fault_culled": "triangle_culled",
    "triangle/fault_no_sum": "triangle_no_sum",
    "triangle/printed_third_row": "triangle_printed",
    "world_normal/fault_world_winding": "normal_by_winding",
    "obstructed/fault_nearer_than_light": "half_way",
    "horizon/fault_reversed": "horizon_reversed",
    "position/fault_left_in_object_space": "position_in_object_space",
    "simplified/fault_over_four_pi": "four_pi_in_simplified",
}
# Said elsewhere, under the name given: by the oracle, which has edges and limits of its own, or by how it looks.
ELSEWHERE = {
    "clip_depth/fault_far_ignored": "far_ignored",
    "clip_depth/fault_near_ignored": "near_ignored",
    "clip_depth/shell": "clips_by_shell",
    "clip_shell/fault_planes": "clips_by_planes",
    "square/fault_full_size_local": "square_doubled",
    "cube_normal/fault_greatest_value": "cube_normal_greatest_value",
    "cube_normal/fault_unsigned": "cube_normal_unsigned",
    "facing/fault_never": "normal_never_turned",
    "sphere_normal/center_kept": "normal_keeps_center",
    "sphere_normal/fault_inward": "normal_inward",
    "world_normal/fault_inverse_untransposed": "normal_by_inverse",
    "world_normal/fault_model_matrix": "normal_by_model",
    "world_normal/fault_unnormalised": "normal_not_normalised",
    "obstructed/fault_never": "no_shadows",
    "exitance/fault_albedo_squared": "albedo_squared",
    "exitance/fault_channels_swapped": "bgr",
    "exitance/fault_white": "no_albedo",
    "falloff/fault_hemisphere": "two_pi",
    "falloff/fault_inverse": "linear_falloff",
    "falloff/fault_no_four_pi": "no_four_pi",
    "hidden/fault_front": "front_hidden",
    "hidden/fault_never": "back_seen",
    "lambert/fault_missing": "no_cosine",
    "lambert/fault_squared": "cosine_squared",
    "radiance/fault_clamped": "clamped",
    "radiance/fault_no_pi": "no_pi",
    "radiance/fault_srgb": "srgb",
    "radiance_simplified/fault_over_pi": "pi_in_simplified",
    "sum_lights/fault_last_dropped": "last_of_several_left_out",
    "sum_lights/fault_mean": "mean_of_lights",
    "sum_lights/fault_clamped": "lights_clamped",
    "ray/fault_not_normalised": "not_normalised",
    "feeler/fault_bare": "acne",
    "segment/endless": "beyond_the_light",
    "half_extent/fault_horizontal_angle": "fovx_for_fovy",
    "half_extent/fault_no_aspect": "no_aspect",
    "half_extent/fault_whole_angle": "whole_angle",
    "basis/fault_left_handed": "left_handed",
    "basis/fault_up_as_given": "up_as_given",
    "sample/corner": "pixel_corner",
    "ndc/fault_not_flipped": "upside_down",
    "feeler/fault_wide_offset": "feeler_offset",
    "nearest/fault_first": "first_hit",
    "nearest/fault_last": "last_hit",
}
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


def _wrong(formula: Formula) -> bool:
    return formula.kind in ("control", "fault") and formula.equivalent is None and formula.known_bad is None


# Each wrong formula with the name of the mistake that it makes.
NAME_OF = {
    one.name: ELSEWHERE.get(one.name) or NAMES.get(one.name, one.name) for one in FORMULAS.values() if _wrong(one)
}
for _formula in (FORMULAS[name] for name in NAME_OF if name not in ELSEWHERE):
    _name, _says = NAMES.get(_formula.name, _formula.name), _formula.facts.get("says")
    if _says is None:
        raise ValueError(f"the wrong formula {_formula.name} must declare in words what a renderer with it does: says=")
    _own = {_formula.slot: _formula.variant}
    _beside = (ELSE[_name],) if _name in ELSE else ()
    _around = [{}] if _formula.slot == "square" else [{"square": square} for square in SQUARES]
    MISTAKES.register(_name)(
        Mistake(
            says=_says, items=_formula.covers, ways=(*(Way(formulas=_own | around) for around in _around), *_beside)
        )
    )
