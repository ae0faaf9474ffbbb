"""Planted mistakes of the tracer's formulas and their table; none is used unless it is named.

Facts of a mistake in addition to those of every formula: `says`, a verb phrase about a renderer with this mistake;
`cases`, cases that certainly fail with it; `also`, stages that it spoils in addition to its slot's.
"""

from typing import Any

from rayproof.cases.registry import Entry
from rayproof.cases.stages import Stage


def mistake(path: str, *covers: str, **facts: Any) -> Entry:
    """Return the entry of a mistake that is defined in a module of this folder and concerns these items."""
    return Entry(f"mistakes.{path}", covers=covers, kind="fault", **facts)


def _of_hits(name: str, *covers: str, **facts: Any) -> Entry:
    """Return the entry of a mistake of an intersection in object space, which spoils objects and distances."""
    return mistake(f"intersections:{name}", *covers, also=(Stage.DISTANCE,), space="object", **facts)


MISTAKES: dict[str, Entry] = {
    "half_extent/fault_horizontal_angle": mistake("camera:fault_horizontal_angle", "CAM-2"),
    "half_extent/fault_no_aspect": mistake("camera:fault_no_aspect", "CAM-2"),
    "half_extent/fault_whole_angle": mistake("camera:fault_whole_angle", "CAM-2"),
    "basis/fault_left_handed": mistake("camera:fault_left_handed", "CAM-1"),
    "basis/fault_up_as_given": mistake("camera:fault_up_as_given", "CAM-1", cases=("cameras/slanted_up",)),
    "view/fault_not_moved": mistake(
        "camera:fault_not_moved", "CAM-1", says="leaves the eye's translation out of the view matrix"
    ),
    "projection/fault_minus_one": mistake(
        "camera:fault_minus_one", "CAM-2", says="projects depths to -1 to 1 instead of 0 to 1"
    ),
    "inverse/fault_transposed": mistake(
        "camera:fault_transposed", "CAM-1", "CAM-2", says="transposes the camera's matrices where it has to invert them"
    ),
    "corners/fault_far_by_near": mistake(
        "camera:fault_far_by_near",
        "CAM-2",
        says="takes a box for the camera's frustum, its far corners as wide as its near ones",
    ),
    "ndc/fault_not_flipped": mistake("camera:fault_not_flipped", "CAM-3", also=(Stage.RAY,)),
    "ndc/fault_swapped_sizes": mistake(
        "camera:fault_swapped_sizes",
        "CAM-3",
        says="swaps width and height where it turns pixels into image coordinates",
    ),
    "pixel/fault_upwards": mistake(
        "camera:fault_upwards",
        "CAM-3",
        says="counts pixel rows from the bottom where it turns image coordinates into pixels",
    ),
    "ray/fault_depends_on_t": mistake(
        "camera:fault_depends_on_t", "CAM-4", says="builds rays that are right only for a target 1 m away"
    ),
    "ray/fault_not_normalised": mistake("camera:fault_not_normalised", "CAM-4"),
    "clip_depth/fault_far_ignored": mistake("hits:fault_far_ignored", "HIT-2"),
    "clip_depth/fault_far_off": mistake(
        "hits:fault_far_off",
        "HIT-2",
        says="clips a millionth of the depth before the far plane",
        cases=("walls/far",),
    ),
    "clip_depth/fault_near_ignored": mistake("hits:fault_near_ignored", "HIT-2"),
    "clip_shell/fault_planes": mistake("hits:fault_planes", "HIT-2", cases=("clipping/*_shell",)),
    "clip_none/fault_behind": mistake(
        "hits:fault_behind",
        "HIT-2",
        also=(Stage.DISTANCE,),
        says="takes hits behind the eye where nothing is to be clipped",
        cases=("behind/*",),
    ),
    "to_object/fault_forward_matrix": mistake(
        "hits:fault_forward_matrix",
        "XF-1",
        also=(Stage.DISTANCE,),
        says="brings rays into object space by the model matrix instead of its inverse",
    ),
    "to_object/fault_moved_direction": mistake(
        "hits:fault_moved_direction",
        "XF-1",
        also=(Stage.DISTANCE,),
        says="moves a ray's direction like a point when it goes into object space",
    ),
    "to_object/fault_renormalised": mistake(
        "hits:fault_renormalised",
        "XF-1",
        stage=Stage.DISTANCE,
        also=(Stage.OBJECT,),
        says="normalises the ray's direction in object space and takes t as it is",
    ),
    "position/fault_left_in_object_space": mistake(
        "hits:fault_left_in_object_space", "XF-2", says="leaves hit points in object space"
    ),
    "sphere/fault_center_ignored": _of_hits(
        "fault_center_ignored",
        "HIT-1",
        says="meets spheres as if they lay at the origin of their object space, and keeps the centre in their normals",
    ),
    "sphere/fault_discriminant_sign": _of_hits(
        "fault_discriminant_sign", "HIT-1", says="has a sign wrong in the discriminant of the sphere's quadratic"
    ),
    "sphere/fault_far_root": mistake(
        "intersections:fault_far_root",
        "HIT-1",
        stage=Stage.DISTANCE,
        also=(Stage.OBJECT,),
        space="object",
        says="takes the larger root of the sphere's quadratic",
    ),
    "sphere/fault_half_b": _of_hits("fault_half_b", "HIT-1", says="mixes B and B/2 in the sphere's quadratic"),
    "sphere/fault_negative_root": _of_hits(
        "fault_negative_root",
        "HIT-1",
        says="takes the sphere's smaller root wherever it lies, behind the eye too",
        cases=("behind/sphere", "behind/all_lit"),
    ),
    "sphere/fault_unit_a": _of_hits(
        "fault_unit_a", "HIT-1", says="takes A = 1 in the sphere's quadratic for a direction that is no unit vector"
    ),
    "cube/fault_behind_is_hit": _of_hits(
        "fault_behind_is_hit", "HIT-3", says="hits cubes behind the eye", cases=("behind/cube", "behind/all_lit")
    ),
    "cube/fault_entry_alone": _of_hits(
        "fault_entry_alone", "HIT-3", says="takes a ray's entry into a cube as the hit, and never its exit"
    ),
    "cube/fault_nan_kept": mistake(
        "intersections:fault_nan_kept",
        "HIT-3",
        space="object",
        equivalent="0 / 0 needs a ray in the plane of a face, which sees that face edge-on, as an outline, where hit "
        "and miss are both right, and a NaN lies in no interval; elsewhere x / 0 is an infinity of the "
        "right sign",
    ),
    "cube/fault_negative_zero": _of_hits(
        "fault_negative_zero",
        "HIT-3",
        says="misses cubes where a component of the direction is -0",
        cases=("parallel_rays/cubes_turned",),
    ),
    "cube/fault_not_swapped": mistake(
        "intersections:fault_not_swapped",
        "HIT-3",
        space="object",
        says="does not swap the slabs' ends where a ray runs the other way",
    ),
    "cube/fault_parallel_ignored": _of_hits(
        "fault_parallel_ignored",
        "HIT-3",
        says="hits cubes beside which a ray runs parallel to a face",
        cases=("parallel_rays/cubes",),
    ),
    "plane/fault_one_sided": mistake(
        "intersections:fault_one_sided", "HIT-4", space="object", says="hits planes from the front alone"
    ),
    "plane/fault_sign": _of_hits("fault_sign", "HIT-4", says="has a sign wrong in the plane's intersection"),
    "square/fault_disc_local": mistake(
        "intersections:fault_disc_local", "HIT-7", space="object", says="takes a disc for a square"
    ),
    "square/fault_full_size_local": mistake("intersections:fault_full_size_local", "HIT-7", space="object"),
    "square/fault_sheared_half_vectors": mistake(
        "intersections:fault_sheared_half_vectors",
        "HIT-8",
        says="tests squares by their half vectors as if these were always at right angles",
    ),
    "triangle/fault_culled": mistake("intersections:fault_culled", "HIT-6", says="culls triangles that face away"),
    "triangle/fault_fixed_epsilon": mistake(
        "intersections:fault_fixed_epsilon",
        "HIT-6",
        says="takes a small determinant for a ray parallel to the triangle, so that small triangles vanish",
        cases=("meshes/icosphere", "models/*"),
    ),
    "triangle/fault_loose_unsigned": mistake(
        "intersections:fault_loose_unsigned",
        "HIT-5",
        says="compares the triangle's areas with a tolerance of a thousandth, so that it is too large",
    ),
    "triangle/fault_no_sum": mistake(
        "intersections:fault_no_sum", "HIT-6", says="leaves out u + v <= 1, so that triangles become parallelograms"
    ),
    "triangle/fault_one_area": mistake(
        "intersections:fault_one_area", "HIT-5", says="leaves out the third side of triangles"
    ),
    "triangle/fault_strict_edges": mistake(
        "intersections:fault_strict_edges",
        "HIT-6",
        says="leaves out a triangle's edges, so that rays slip between neighbours",
        cases=("watertight/*",),
    ),
    "nearest/fault_first": mistake("intersections:fault_first", "HIT-9"),
    "nearest/fault_last": mistake("intersections:fault_last", "HIT-9"),
    "sphere_normal/fault_inward": mistake("normals:fault_inward", "NRM-1"),
    "sphere_normal/fault_unnormalised": mistake(
        "normals:fault_unnormalised", "NRM-1", says="does not divide the sphere's normal by its radius"
    ),
    "cube_normal/fault_greatest_value": mistake("normals:fault_greatest_value", "NRM-2"),
    "cube_normal/fault_other_tie": mistake(
        "normals:fault_other_tie",
        "NRM-2",
        equivalent="it differs only where two coordinates are equal, on the cube's own edges, and there the "
        "specification (E8) counts either face as right",
    ),
    "cube_normal/fault_unsigned": mistake("normals:fault_unsigned", "NRM-2"),
    "world_normal/fault_inverse_untransposed": mistake("normals:fault_inverse_untransposed", "NRM-3", "XF-2"),
    "world_normal/fault_model_matrix": mistake("normals:fault_model_matrix", "NRM-3", "XF-2"),
    "world_normal/fault_unnormalised": mistake("normals:fault_world_normal_unnormalised", "NRM-3", "XF-2"),
    "world_normal/fault_world_winding": mistake(
        "normals:fault_world_winding",
        "NRM-3",
        "XF-2",
        says="derives normals from the winding in the world, which a mirror turns round",
        cases=("transforms/*_mirrored", "normals/mirrored"),
    ),
    "facing/fault_away": mistake(
        "normals:fault_away", "NRM-3", says="turns the normals of two-sided surfaces away from the viewer"
    ),
    "facing/fault_never": mistake("normals:fault_never", "NRM-3"),
    "horizon/fault_never": mistake(
        "shadow_rays:fault_never", "LIT-1", says="does not ask whether a light is above the horizon of the surface"
    ),
    "horizon/fault_reversed": mistake(
        "shadow_rays:fault_reversed", "LIT-1", says="asks the wrong way round whether a light is above the horizon"
    ),
    "segment/fault_long": mistake(
        "shadow_rays:fault_long",
        "LIT-1",
        says="lets its shadow rays run 15 % farther than the light",
        bounded=True,
        cases=("along_the_way/behind_the_light",),
    ),
    "segment/fault_short": mistake(
        "shadow_rays:fault_short",
        "LIT-1",
        says="lets its shadow rays end 10 % before the light",
        bounded=True,
        cases=("along_the_way/before_the_light",),
    ),
    "obstructed/fault_nearer_than_light": mistake(
        "shadow_rays:fault_nearer_than_light",
        "LIT-1",
        says="lets only the nearer half of the way to a light be blocked",
    ),
    "obstructed/fault_never": mistake("shadow_rays:fault_obstructed_never", "LIT-1"),
    "shadow_ray/fault_bare": mistake("shadow_rays:fault_bare", "LIT-5"),
    "shadow_ray/fault_inward": mistake(
        "shadow_rays:fault_inward", "LIT-5", says="starts its shadow rays below the surface"
    ),
    "shadow_ray/fault_wide_offset": mistake("shadow_rays:fault_wide_offset", "LIT-5"),
    "falloff/fault_hemisphere": mistake("light:fault_hemisphere", "RAD-1"),
    "falloff/fault_inverse": mistake("light:fault_inverse", "RAD-1"),
    "falloff/fault_no_four_pi": mistake("light:fault_no_four_pi", "RAD-1"),
    "lambert/fault_missing": mistake("light:fault_missing", "RAD-2"),
    "lambert/fault_squared": mistake("light:fault_squared", "RAD-2"),
    "lambert/fault_unclamped": mistake(
        "light:fault_unclamped",
        "RAD-2",
        says="does not clamp the cosine to zero, so that lights below the horizon darken",
    ),
    "simplified/fault_over_four_pi": mistake(
        "light:fault_over_four_pi", "RAD-3", says="divides by 4 pi under the simplified light, too"
    ),
    "simplified/fault_unclamped": mistake(
        "light:fault_simplified_unclamped", "RAD-3", says="does not clamp the cosine to zero under the simplified light"
    ),
    "sum_lights/fault_clamped": mistake("light:fault_sum_lights_clamped", "RAD-3", "RAD-5"),
    "sum_lights/fault_last_dropped": mistake("light:fault_last_dropped", "RAD-5"),
    "sum_lights/fault_mean": mistake("light:fault_mean", "RAD-5"),
    "exitance/fault_albedo_squared": mistake("light:fault_albedo_squared", "RAD-4"),
    "exitance/fault_channels_swapped": mistake("light:fault_channels_swapped", "RAD-4"),
    "exitance/fault_white": mistake("light:fault_white", "RAD-4"),
    "radiance/fault_clamped": mistake("light:fault_clamped", "RAD-4"),
    "radiance/fault_no_pi": mistake("light:fault_no_pi", "RAD-4"),
    "radiance/fault_srgb": mistake("light:fault_srgb", "RAD-4"),
    "radiance_simplified/fault_over_pi": mistake("light:fault_over_pi", "RAD-3"),
    "hidden/fault_front": mistake("light:fault_front", "RAD-4"),
    "hidden/fault_never": mistake("light:fault_never", "RAD-4", cases=("sidedness/*_behind", "sidedness/*_one_sided")),
}
