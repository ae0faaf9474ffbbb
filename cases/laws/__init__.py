"""The table of laws: relations between images of one renderer that hold for any scene, up to rounding.

To add one: a generator `law(scene, ask)` on the page of its subject, and a line in the table. It yields
`cases.laws.relations.Relation`s, or nothing if it does not apply. `stage` is the one that it concerns,
`implicates` names the specification's items that a broken one concerns. Its docstring proves it in two lines and
names its source. `anchor=True`: not a relation but one number in closed form. Laws are homogeneous, so that a constant
factor or a length that is wrong everywhere is for anchors alone to see. `own=True`: the law makes its own scene,
whatever the case. `staged=True`: it says nothing of radiance alone.
"""

from collections.abc import Callable, Iterator

from rayproof.cases.laws.relations import Ask, Relation
from rayproof.cases.registry import Entry, Table
from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage

Law = Callable[[Scene, Ask], Iterator[Relation]]

LAWS: Table[Law] = Table(
    "law",
    package="rayproof.cases.laws",
    entries={
        "albedo_flux": Entry("radiometry:albedo_flux", stage=Stage.EXITANCE, implicates=("RAD-1", "RAD-3", "RAD-4")),
        "albedo_linear": Entry("radiometry:albedo_linear", stage=Stage.EXITANCE, implicates=("RAD-4",)),
        "anchor_clip": Entry("anchors:anchor_clip", stage=Stage.OBJECT, implicates=("HIT-2",), anchor=True, own=True),
        "anchor_floor": Entry(
            "anchors:anchor_floor",
            stage=Stage.IRRADIANCE,
            implicates=("CAM-3", "CAM-4", "RAD-1", "RAD-2", "RAD-3", "RAD-4"),
            anchor=True,
            own=True,
        ),
        "anchor_sizes": Entry(
            "anchors:anchor_sizes",
            stage=Stage.DISTANCE,
            implicates=("HIT-1", "HIT-3", "HIT-7", "NRM-1", "NRM-2", "XF-1"),
            anchor=True,
            own=True,
        ),
        "anchor_sphere": Entry(
            "anchors:anchor_sphere",
            stage=Stage.RADIANCE,
            implicates=("RAD-1", "RAD-4", "HIT-1", "NRM-1"),
            anchor=True,
            own=True,
        ),
        "axes": Entry("motions:axes", stage=Stage.OBJECT, implicates=("XF-1", "HIT-3", "NRM-2", "NRM-3")),
        "baked": Entry("motions:baked", stage=Stage.NORMAL, implicates=("XF-1", "NRM-3", "HIT-6")),
        "camera_inverses": Entry(
            "camera:camera_inverses", stage=Stage.CAMERA, implicates=("CAM-1", "CAM-2", "CAM-3"), staged=True
        ),
        "camera_rays": Entry(
            "camera:camera_rays", stage=Stage.RAY, implicates=("CAM-2", "CAM-3", "CAM-4", "CAM-5"), staged=True
        ),
        "channels": Entry("radiometry:channels", stage=Stage.EXITANCE, implicates=("RAD-1", "RAD-3", "RAD-4")),
        "channels_apart": Entry("radiometry:channels_apart", stage=Stage.IRRADIANCE, implicates=("RAD-1", "RAD-4")),
        "clip_beyond": Entry("clipping:clip_beyond", stage=Stage.OBJECT, implicates=("HIT-2",)),
        "clip_join": Entry("clipping:clip_join", stage=Stage.OBJECT, implicates=("HIT-2",)),
        "clip_measured": Entry(
            "clipping:clip_measured", stage=Stage.OBJECT, implicates=("HIT-2", "CAM-2"), staged=True
        ),
        "crop": Entry("camera:crop", stage=Stage.RAY, implicates=("CAM-2", "CAM-3", "CAM-4")),
        "cube_squares": Entry(
            "shapes:cube_squares", stage=Stage.NORMAL, implicates=("HIT-3", "HIT-7", "NRM-2", "NRM-3")
        ),
        "cube_triangles": Entry(
            "shapes:cube_triangles", stage=Stage.OBJECT, implicates=("HIT-3", "HIT-5", "HIT-6", "NRM-2")
        ),
        "dolly": Entry("camera:dolly", stage=Stage.RADIANCE, implicates=("RAD-5", "HIT-2", "CAM-4")),
        "faces_commute": Entry("order:faces_commute", stage=Stage.OBJECT, implicates=("HIT-5", "HIT-6", "HIT-9")),
        "flux_linear": Entry(
            "radiometry:flux_linear", stage=Stage.IRRADIANCE, implicates=("RAD-1", "RAD-3", "RAD-4", "RAD-5")
        ),
        "flux_power": Entry(
            "radiometry:flux_power", stage=Stage.IRRADIANCE, implicates=("RAD-1", "RAD-3", "RAD-4", "RAD-5")
        ),
        "light_backed": Entry("lights:light_backed", stage=Stage.VISIBILITY, implicates=("LIT-1",)),
        "light_caged": Entry("lights:light_caged", stage=Stage.VISIBILITY, implicates=("LIT-1", "LIT-3", "LIT-5")),
        "light_dark": Entry("lights:light_dark", stage=Stage.IRRADIANCE, implicates=("LIT-1", "RAD-5")),
        "light_harmonic": Entry("radiometry:light_harmonic", stage=Stage.IRRADIANCE, implicates=("RAD-1", "RAD-2")),
        "light_hidden": Entry(
            "lights:light_hidden", stage=Stage.VISIBILITY, implicates=("LIT-1", "HIT-1", "HIT-3", "HIT-9")
        ),
        "light_in_stages": Entry(
            "radiometry:light_in_stages",
            stage=Stage.IRRADIANCE,
            implicates=("RAD-1", "RAD-2", "RAD-3", "RAD-4", "LIT-1"),
            staged=True,
        ),
        "light_sees": Entry(
            "lights:light_sees", stage=Stage.VISIBILITY, implicates=("LIT-1", "LIT-2", "LIT-3", "LIT-5"), staged=True
        ),
        "light_split": Entry("lights:light_split", stage=Stage.IRRADIANCE, implicates=("LIT-1", "RAD-5")),
        "lights_add": Entry("lights:lights_add", stage=Stage.IRRADIANCE, implicates=("LIT-1", "RAD-5")),
        "lights_commute": Entry("order:lights_commute", stage=Stage.VISIBILITY, implicates=("LIT-1", "RAD-5")),
        "mesh_parts": Entry("shapes:mesh_parts", stage=Stage.OBJECT, implicates=("HIT-6", "HIT-9", "LIT-1")),
        "mirror": Entry(
            "motions:mirror", stage=Stage.NORMAL, implicates=("CAM-1", "CAM-3", "XF-1", "NRM-3", "HIT-5", "HIT-6")
        ),
        "not_negative": Entry(
            "radiometry:not_negative", stage=Stage.IRRADIANCE, implicates=("RAD-2", "RAD-3", "LIT-1")
        ),
        "plane_square": Entry("shapes:plane_square", stage=Stage.OBJECT, implicates=("HIT-4", "HIT-7")),
        "point_on_ray": Entry("camera:point_on_ray", stage=Stage.POSITION, implicates=("XF-1", "XF-2"), staged=True),
        "resolution": Entry("camera:resolution", stage=Stage.RAY, implicates=("CAM-3", "CAM-4")),
        "rigid": Entry("motions:rigid", stage=Stage.RAY, implicates=("CAM-1", "CAM-4", "XF-1", "XF-2", "NRM-3")),
        "roll": Entry("camera:roll", stage=Stage.RAY, implicates=("CAM-1", "CAM-3", "CAM-4")),
        "scale": Entry(
            "motions:scale", stage=Stage.IRRADIANCE, implicates=("RAD-1", "RAD-2", "XF-1", "LIT-3", "LIT-5", "HIT-6")
        ),
        "scale_power": Entry(
            "motions:scale_power", stage=Stage.IRRADIANCE, implicates=("RAD-1", "RAD-2", "LIT-3", "LIT-5", "HIT-1")
        ),
        "shapes_alone": Entry("order:shapes_alone", stage=Stage.OBJECT, implicates=("HIT-9",), staged=True),
        "shapes_commute": Entry("order:shapes_commute", stage=Stage.OBJECT, implicates=("HIT-9", "LIT-1")),
        "sides_add": Entry("order:sides_add", stage=Stage.RADIANCE, implicates=("RAD-2", "RAD-4", "NRM-3")),
        "sphere_placed": Entry(
            "motions:sphere_placed", stage=Stage.OBJECT, implicates=("HIT-1", "XF-1", "XF-2", "NRM-1", "NRM-3")
        ),
        "split": Entry("shapes:split", stage=Stage.OBJECT, implicates=("HIT-5", "HIT-6", "HIT-9")),
        "square_tiles": Entry(
            "shapes:square_tiles", stage=Stage.OBJECT, implicates=("HIT-7", "HIT-8", "XF-1", "HIT-9")
        ),
        "square_triangles": Entry(
            "shapes:square_triangles", stage=Stage.OBJECT, implicates=("HIT-5", "HIT-6", "HIT-7", "HIT-8", "NRM-3")
        ),
        "symmetry": Entry(
            "motions:symmetry",
            stage=Stage.NORMAL,
            implicates=("XF-1", "XF-2", "HIT-1", "HIT-3", "HIT-4", "HIT-7", "NRM-2", "NRM-3"),
        ),
        "target_slid": Entry("camera:target_slid", stage=Stage.RAY, implicates=("CAM-1", "CAM-4", "CAM-5")),
        "triangle_mesh": Entry("shapes:triangle_mesh", stage=Stage.OBJECT, implicates=("HIT-5", "HIT-6")),
        "unit_vectors": Entry(
            "camera:unit_vectors", stage=Stage.NORMAL, implicates=("CAM-4", "NRM-1", "NRM-3"), staged=True
        ),
        "unseen": Entry(
            "clipping:unseen", stage=Stage.OBJECT, implicates=("HIT-1", "HIT-2", "HIT-3", "HIT-6", "HIT-7", "HIT-9")
        ),
        "up_slid": Entry("camera:up_slid", stage=Stage.RAY, implicates=("CAM-1", "CAM-4")),
        "view_free": Entry(
            "radiometry:view_free", stage=Stage.RADIANCE, implicates=("RAD-4", "RAD-5", "LIT-1", "NRM-3"), staged=True
        ),
        "winding": Entry("order:winding", stage=Stage.NORMAL, implicates=("HIT-5", "HIT-6", "NRM-3")),
    },
)

# Law and case that a run without selectors puts to each other; docs/laws.md says how they were chosen.
USUAL: tuple[tuple[str, str], ...] = (
    ("rigid", "random_scenes/seed_2"),
    ("rigid", "parallel_rays/cubes"),
    ("mirror", "random_scenes/seed_2"),
    ("roll", "cameras/panorama"),
    ("crop", "cameras/ordinary"),
    ("resolution", "cameras/portrait"),
    ("up_slid", "cameras/slanted_up"),
    ("target_slid", "cameras/banked"),
    ("clip_join", "clipping/sphere_depth"),
    ("clip_beyond", "primitives/cube"),
    ("clip_measured", "clipping/faces_shell"),
    ("unseen", "behind/sphere"),
    ("unseen", "clipping/sphere_none"),
    ("scale", "transforms/sphere_sheared"),
    ("scale", "shadows/every_blocker"),
    ("sphere_placed", "normals/offset_sphere"),
    ("cube_squares", "inside/cube"),
    ("symmetry", "transforms/cube_sheared"),
    ("square_triangles", "transforms/square_sheared"),
    ("plane_square", "primitives/plane"),
    ("split", "meshes/torus"),
    ("baked", "transforms/mesh_mirrored"),
    ("winding", "sidedness/triangle_lit_from_the_viewer"),
    ("sides_add", "sidedness/square_lit_from_behind"),
    ("sides_add", "sidedness/plane_from_below_two_sided"),
    ("shapes_commute", "nearest/interpenetrating"),
    ("lights_add", "several_lights/inverse_square"),
    ("lights_add", "simplified/lights_at_1.5m"),
    ("light_split", "several_lights/inverse_square"),
    ("light_harmonic", "transforms/sphere_rotated"),
    ("light_hidden", "shadows/every_blocker"),
    ("light_caged", "shadows/every_blocker"),
    ("light_backed", "shadows/every_blocker"),
    ("not_negative", "several_lights/simplified"),
    ("not_negative", "acne/terminator"),
    ("albedo_linear", "several_lights/inverse_square"),
    ("channels", "several_lights/inverse_square"),
    ("flux_power", "several_lights/inverse_square"),
    ("unit_vectors", "normals/turned_to_the_viewer"),
    ("point_on_ray", "transforms/cube_translated"),
    ("light_in_stages", "several_lights/inverse_square"),
    ("light_in_stages", "inverse_square/angle_95"),
    ("light_sees", "shadows/every_blocker"),
    ("camera_inverses", "cameras/ordinary"),
    ("camera_rays", "cameras/ordinary"),
    ("anchor_sphere", "primitives/sphere"),
    ("anchor_floor", "primitives/sphere"),
    ("anchor_sizes", "primitives/sphere"),
    ("anchor_clip", "primitives/sphere"),
)
