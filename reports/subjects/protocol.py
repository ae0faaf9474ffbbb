"""`Capabilities`, which a program declares, and the scene that is handed to it (JSON, OBJ); docs/protocol.md.

The scene is JSON of the published schema, with meshes as OBJ files in the same folder.
"""

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, fields, replace
from functools import lru_cache
from pathlib import Path
from typing import Any, Literal

import numpy as np

from rayproof.cases.rounding import PRECISIONS
from rayproof.cases.scene import CLIPS, SHADINGS, Clip, Matrix, Mesh, Scene, is_similarity, shown
from rayproof.cases.scene_json import NAMES, SHAPES, scene_to_json
from rayproof.cases.stages import IMAGE_STAGES, Stage
from rayproof.reports.interchange import EXPORTERS, SceneFormat, export_scene
from rayproof.reports.interchange.stand_ins import (
    FLAT,
    NoStandInError,
    is_alike_with_sides,
    is_untouched,
    tessellated,
    with_sides,
)
from rayproof.reports.results.files import number
from rayproof.reports.subjects.image_files import FORMATS, LINEAR, SRGB, Transfer

ONCE, STAYS = 1, 2  # versions of the protocol: a program is called for each image, or stays alive
OF_STAYS = ("samples", "format", "scene_format")  # keys of version 2 only
# Equivalents of these keys in the command of a program that is called for each image.
INSTEAD = {
    "samples": "{samples}",
    "format": "{output.pfm}, {output.hdr} or {output.png}",
    "scene_format": "{scene.xml}",
}
OF_DECLARATION = ("writes", "transfer")  # keys that only the file of --declare may have
JSON = "json"  # the scene format of the protocol
ALWAYS = "always"
ANYWHERE = 0.5  # px: the radius of samples that may be anywhere in their pixel
EPSILONS = ("shadow", "ray")
LEAST_RENDERS, MOST_RENDERS = 32, 4096
LONGEST_NAME = 80
PIECES = {"mesh": "a mesh of triangles", "triangle": "single triangles"}


@dataclass(frozen=True, kw_only=True)
class Capabilities:
    """The capabilities that a program declares. By default it supports every scene, and the stages that it writes."""

    protocol: int = ONCE
    name: str = ""
    version: str = ""
    precision: str = "float32"
    stages: tuple[Stage, ...] | None = None
    shapes: tuple[str, ...] = tuple(SHAPES)
    shading: tuple[str, ...] = SHADINGS
    clip: tuple[str, ...] = CLIPS
    two_sided: bool | Literal["always"] = True  # "always": it shades and sees both sides of every surface
    affine: bool = True  # whether it supports stretched, sheared and mirrored shapes
    triangulated: bool = False  # whether it gets cubes, squares and triangles as meshes
    chained: bool = False  # whether each stage is computed from the values written for earlier stages, but for rounding
    world_normals: bool = False  # whether it computes normals of faces from corners in world space, in float32
    deterministic: bool = False  # whether the same scene gives the same image, to the last bit
    samples: bool = False  # of a program that stays alive: whether it averages n x n points itself
    format: str = "exr"  # of a program that stays alive: the format of its images
    scene_format: str = JSON  # the format in which it reads scenes, by the suffix of the file
    lights: int | None = None  # 1: a case is rendered once for each light, and the images are added
    sample_offset: tuple[float, float, float] = (0.0, 0.0, 0.0)  # px: right and down from pixels' centres, and radius
    random: int = 0  # of a program that draws random numbers: number of renders, with different seeds, for the mean
    writes: str = ""  # the name of the file that it writes in its folder, if its command has no output path
    transfer: Transfer = ""  # the curve by which it encodes radiance; "" if the file specifies it, or it is linear
    shadow_epsilon: float = 0.0  # m
    ray_epsilon: float = 0.0  # m

    @property
    def title(self) -> str:
        """Return the declared name and version of the program."""
        return f"{self.name} {self.version}".strip() or "a program that does not say its name"

    @property
    def within_pixel(self) -> bool:
        """Return whether a sample may be anywhere in its pixel."""
        return self.sample_offset[2] == ANYWHERE

    def refusal(self, scene: Scene) -> str | None:
        """Return a sentence with the reason why the program cannot draw the scene, or None."""
        for index, shape in enumerate(scene.shapes):
            kind = NAMES[type(shape)]
            if kind not in self.shapes and kind not in self.stand_ins:
                why = "" if kind not in self.tessellated_kinds else f" {_tessellation(self, scene)}"
                return f"It draws no {kind}, as shapes[{index}] is.{why}"
            if not self.affine and not (is_similarity(shape.to_world) and _keeps_hands(shape.to_world)):
                return f"It cannot stretch, shear or mirror, as shapes[{index}] is."
            if (says := self.says) is not None and max(shape.albedo) > says.greatest_albedo:
                return f"{says.title} has no albedo above {says.greatest_albedo:g}, as shapes[{index}] has."
        if scene.shading not in self.shading:
            return f"It has no {scene.shading} light."
        if self._clip(scene) is None:
            return f"It does not clip by {scene.clip}, and here that makes a difference."
        if self.two_sided is not True and not self._sides_matter_not(scene):
            what = "two-sided" if self.two_sided is False else "one-sided"
            return f"It has no {what} surfaces, and here that makes a difference."
        return None

    @property
    def says(self) -> SceneFormat | None:
        """Return the features of the scene format, or None for the protocol's own format, which supports everything."""
        return None if self.scene_format == JSON else EXPORTERS.about(f".{self.scene_format}")["says"]

    def _clip(self, scene: Scene) -> Clip | None:
        """Return the scene's clip mode, or one that the program supports and that gives the same image; or None."""
        if scene.clip in self.clip:
            return scene.clip
        modes: list[Clip] = [mode for mode in CLIPS if mode in self.clip]
        return next((mode for mode in modes if is_untouched(scene, scene.clip) and is_untouched(scene, mode)), None)

    def _sides_matter_not(self, scene: Scene) -> bool:
        """Return whether the program's one-sided or two-sided surfaces give the same images of its stages."""
        two_sided = self.two_sided == ALWAYS
        if all(shape.two_sided == two_sided for shape in scene.shapes):
            return True
        return is_alike_with_sides(scene, two_sided, self.stages or IMAGE_STAGES)

    def handed(self, scene: Scene) -> Scene:
        """Return the scene for the program, which must not be refused, with a clip mode and sides that it supports.

        The sample offset is removed, since the program applies its own.
        """
        clip = self._clip(scene)
        scene = scene if clip in (None, scene.clip) else replace(scene, clip=clip)
        scene = replace(scene, camera=replace(scene.camera, sample_offset=(0.0, 0.0)))
        return scene if self.two_sided is True else with_sides(scene, two_sided=self.two_sided == ALWAYS)

    def asked(self, scene: Scene) -> Scene:
        """Return the scene that the program renders and by which it is judged.

        It has a model of light that the program supports, meshes for spheres and planes that it does not draw, and the
        program's sample points in the pixels.
        """
        scene = self.under_its_light(scene)
        with_meshes = _tessellation(self, scene)
        return self.through_its_samples(scene if isinstance(with_meshes, str) else with_meshes)

    def through_its_samples(self, scene: Scene) -> Scene:
        """Return the scene with the program's sample points in the pixels."""
        right, down, _ = self.sample_offset
        if not right and not down:
            return scene
        return replace(scene, camera=replace(scene.camera, sample_offset=(right, down)))

    @property
    def tessellated_kinds(self) -> tuple[str, ...]:
        """Return the kinds ("sphere", "plane") that are handed over as meshes, or as squares for planes."""
        flat = "mesh" in self.shapes or "triangle" in self.shapes
        able = {"sphere": flat, "plane": flat or "square" in self.shapes}
        return tuple(kind for kind, can in able.items() if can and kind not in self.shapes)

    @property
    def stand_ins(self) -> Mapping[str, str]:
        """Return, for each kind that is handed over as triangles, its substitute: "mesh" or "triangle"."""
        substitutes = {}
        for kind in FLAT:
            if "mesh" in self.shapes and kind != "mesh" and (self.triangulated or kind not in self.shapes):
                substitutes[kind] = "mesh"
            elif "triangle" in self.shapes and kind not in self.shapes:
                substitutes[kind] = "triangle"
        return substitutes

    def under_its_light(self, scene: Scene) -> Scene:
        """Return the scene with its model of light, or the program's first model if it does not support that."""
        return scene if scene.shading in self.shading else replace(scene, shading=self.shading[0])  # type: ignore[arg-type]

    def told(self, scene: Scene) -> tuple[str, ...]:
        """Return sentences on the parts of a scene that are handed over in another form with the same image."""
        kinds = [kind for kind in self.stand_ins if any(NAMES[type(shape)] == kind for shape in scene.shapes)]
        whole = "since the program asks for it" if self.triangulated else "since the program does not draw it"
        notes = [f"Each {kind} is handed over as {PIECES[self.stand_ins[kind]]}, {whole}." for kind in kinds]
        clip = self._clip(scene)
        if clip not in (None, scene.clip):
            notes.append(f"Handed over with clip {clip} in place of {scene.clip}: near and far plane touch nothing.")
        if self.two_sided is not True and any(shape.two_sided != (self.two_sided == ALWAYS) for shape in scene.shapes):
            sides = "two-sided" if self.two_sided == ALWAYS else "one-sided"
            notes.append(f"Each surface is handed over as {sides}: its image is the same.")
        if self.lights == 1 and len(scene.lights) > 1:
            notes.append(f"Rendered once for each of {len(scene.lights)} lights; the images are added.")
        if self.random:
            notes.append(f"Rendered {self.random} times with different seeds; the mean is judged.")
        return tuple(notes)

    def not_equal(self, scene: Scene) -> tuple[str, ...]:
        """Return sentences on the shapes that are replaced by others, both for the program and for judging."""
        scene_for_program = self.asked(scene)
        changed = [
            (NAMES[type(shape)], NAMES[type(instead)])
            for shape, instead in zip(scene.shapes, scene_for_program.shapes, strict=True)
            if type(shape) is not type(instead)
        ]
        substitutes = {"sphere": "a mesh of flat triangles", "plane": "a square that ends beyond what is seen"}
        return tuple(
            f"Asked and judged with {substitutes[kind]} for each {kind}, since the program draws none."
            for kind in dict.fromkeys(kind for kind, _ in changed)
        )

    def within(self, says: SceneFormat) -> "Capabilities":
        """Return the capabilities, limited to those that a scene format can represent.

        Raises:
            ValueError: the format can represent none of the program's shapes, models of light or clip modes.

        """
        changes: dict[str, Any] = {}
        for name in ("shapes", "shading", "clip"):
            words = getattr(self, name)
            # A program that does not clip ignores clipping planes in the file.
            common = tuple(word for word in words if word in getattr(says, name) or (name, word) == ("clip", "none"))
            if name == "clip" and words == CLIPS:
                common = says.clip
            if not common:
                raise ValueError(f"{says.title} has no word for the {name} {', '.join(words)}, which is all it can")
            changes[name] = common
        if self.two_sided is True:
            changes["two_sided"] = says.two_sided
        if self.lights is None:
            changes["lights"] = says.lights
        if says.world_normals:
            changes["world_normals"] = True
        if self.stages is None:
            changes["stages"] = (Stage.RADIANCE,)
        return replace(self, **changes)


@lru_cache(maxsize=512)
def _tessellation(able: Capabilities, scene: Scene) -> Scene | str:
    """Return the scene with meshes for spheres and planes that a program does not draw, or why this is impossible."""
    try:
        return tessellated(scene, able.tessellated_kinds, squares="square" in able.shapes)
    except NoStandInError as why:
        return str(why)


def _keeps_hands(matrix: Matrix) -> bool:
    """Return whether a matrix preserves handedness, that is, does not mirror."""
    return bool(np.linalg.det(np.asarray(matrix)[:3, :3]) > 0)


def capabilities_from(text: str) -> Capabilities | None:
    """Return the capabilities in a program's output, or None if it is no JSON object: programs need not declare any.

    Raises:
        ValueError: the object is against the protocol; the message is one line that names the key.

    """
    try:
        declared = json.loads(text)
    except (ValueError, RecursionError):
        return None
    return capabilities_of(declared, ONCE) if isinstance(declared, dict) else None


def capabilities_of(
    declared: Mapping[str, Any], protocol: int, base: Capabilities | None = None, *, by_user: bool = False
) -> Capabilities:
    """Return the capabilities in an object of this version of the protocol, with the values of `base` for missing keys.

    `by_user`: the object is from the file of --declare, which may omit the version and may have two more keys.

    Raises:
        ValueError: the object is against the protocol; the message is one line that names the key.

    """
    allowed = {field.name for field in fields(Capabilities)} - {"shadow_epsilon", "ray_epsilon"} | {"epsilons"}
    allowed -= set() if by_user else set(OF_DECLARATION)
    for name in OF_STAYS if protocol == ONCE else ():
        if name in declared:
            raise ValueError(f"{name!r} belongs to version {STAYS}, `serve:`; with `exec:` {INSTEAD[name]} says it")
        allowed.discard(name)
    if unknown := sorted(set(declared) - allowed):
        raise ValueError(f"{unknown[0]!r} is not known; known: {', '.join(sorted(allowed))}")
    if declared.get("protocol", protocol if by_user else None) != protocol:
        raise ValueError(f"protocol must be {protocol}, got {declared.get('protocol')!r}")
    capabilities = Capabilities(protocol=protocol) if base is None else base
    for name, known_names in (("shapes", tuple(SHAPES)), ("shading", SHADINGS), ("clip", CLIPS)):
        if name in declared:
            capabilities = replace(capabilities, **{name: _names(name, declared[name], known_names)})
    if "stages" in declared:
        capabilities = replace(
            capabilities, stages=tuple(map(Stage, _names("stages", declared["stages"], IMAGE_STAGES)))
        )
    formats = (JSON, *(suffix.removeprefix(".") for suffix in EXPORTERS))
    for name, known_names in (("precision", PRECISIONS), ("format", FORMATS), ("scene_format", formats)):
        if name in declared:
            capabilities = replace(capabilities, **{name: _names(name, [declared[name]], known_names)[0]})
    for name in ("name", "version"):
        if name in declared:
            capabilities = replace(capabilities, **{name: _text(name, declared[name])})
    for name in ("two_sided", "affine", "triangulated", "chained", "world_normals", "deterministic", "samples"):
        if name in declared:
            word = name == "two_sided" and declared[name] == ALWAYS
            if not isinstance(declared[name], bool) and not word:
                more = f', or "{ALWAYS}"' if name == "two_sided" else ""
                raise ValueError(f"{name} must be true or false{more}, got {shown(declared[name])}")
            capabilities = replace(capabilities, **{name: declared[name]})
    if "lights" in declared:
        if declared["lights"] not in (0, 1) or isinstance(declared["lights"], bool | float):
            raise ValueError(f"lights must be 1, for one in each render, or 0 for all, got {shown(declared['lights'])}")
        capabilities = replace(capabilities, lights=declared["lights"])
    if "sample_offset" in declared:
        capabilities = replace(capabilities, sample_offset=_sample_offset(declared["sample_offset"]))
    if "random" in declared:
        capabilities = replace(capabilities, random=_renders(declared["random"]))
        if capabilities.random and "sample_offset" not in declared:
            capabilities = replace(capabilities, sample_offset=(0.0, 0.0, ANYWHERE))
        if capabilities.random and capabilities.stages not in (None, (Stage.RADIANCE,)):
            raise ValueError("random: stages must be radiance alone, since no other stage has a mean over samples")
        capabilities = replace(capabilities, stages=(Stage.RADIANCE,)) if capabilities.random else capabilities
    if "writes" in declared:
        capabilities = replace(capabilities, writes=_file_name(declared["writes"]))
    if "transfer" in declared:
        capabilities = replace(capabilities, transfer=_transfer(declared["transfer"]))
    return replace(capabilities, **_epsilons(declared["epsilons"])) if "epsilons" in declared else capabilities


def declaration(path: Path) -> Mapping[str, Any]:
    """Return the object in the file of --declare; `capabilities_of` validates its keys.

    Raises:
        ValueError: the file is no JSON object; the message names the file.
        OSError: the file cannot be read.

    """
    try:
        declared = json.loads(path.read_text(encoding="utf-8"))
    except (ValueError, RecursionError) as error:
        raise ValueError(f"--declare {path}: is no JSON: {' '.join(str(error).split())}") from None
    if not isinstance(declared, dict):
        raise ValueError(f"--declare {path}: must be a JSON object, got {shown(declared)}")
    return declared


def _file_name(declared: Any) -> str:
    """Return the validated name of the file that a program always writes."""
    if (
        not isinstance(declared, str)
        or Path(declared).name != declared
        or not declared.isprintable()
        or declared in (".", "..")
    ):
        raise ValueError(f"writes must be the name of a file in the folder of the call, got {shown(declared)}")
    return declared


def _sample_offset(declared: Any) -> tuple[float, float, float]:
    """Return the validated offset (right, down) and radius [px] of the samples in their pixels."""
    numbers = [None if isinstance(part, str) else number(part) for part in declared if isinstance(declared, list)]
    right, down, radius = numbers if len(numbers) == 3 else (None, None, None)
    if right is None or down is None or radius is None or max(abs(right), abs(down), radius) > 0.5 or not radius >= 0:
        raise ValueError(
            "sample_offset must be [right, down, radius] in pixels, each at most 0.5 and the radius at least 0, "
            f"got {shown(declared)}"
        )
    return float(right), float(down), float(radius)


def _renders(declared: Any) -> int:
    """Return the number of renders whose mean is judged, 0 for a program that draws no random numbers."""
    if isinstance(declared, bool):
        return LEAST_RENDERS if declared else 0
    if not isinstance(declared, int) or not LEAST_RENDERS <= declared <= MOST_RENDERS:
        raise ValueError(
            f"random must be true, false, or the number of renders, {LEAST_RENDERS} to {MOST_RENDERS}, "
            f"got {shown(declared)}"
        )
    return declared


def _transfer(declared: Any) -> Transfer:
    if declared in (LINEAR, SRGB):
        return str(declared)
    exponent = None if isinstance(declared, str) else number(declared)
    if exponent is None or not 0.1 <= exponent <= 10:
        raise ValueError(f'transfer must be "{LINEAR}", "{SRGB}" or a gamma from 0.1 to 10, got {shown(declared)}')
    return float(exponent)


def _names(name: str, declared: Any, allowed: tuple[str, ...]) -> tuple[str, ...]:
    if not isinstance(declared, list) or not declared or not all(isinstance(word, str) for word in declared):
        raise ValueError(f"{name} must be a list of names, got {declared!r}")
    for word in declared:
        if word not in allowed:
            raise ValueError(f"{name}: {word!r} is not known; known: {', '.join(allowed)}")
    return tuple(declared)


def _text(name: str, declared: Any) -> str:
    if not isinstance(declared, str) or not declared.isprintable() or len(declared) > LONGEST_NAME:
        raise ValueError(f"{name} must be at most {LONGEST_NAME} printable characters, got {str(declared)[:40]!r}")
    return declared


def _epsilons(declared: Any) -> dict[str, float]:
    if not isinstance(declared, Mapping) or not set(declared) <= set(EPSILONS):
        raise ValueError(f"epsilons must be an object with {' and '.join(EPSILONS)}, got {declared!r}")
    for name, value in declared.items():
        length = None if isinstance(value, str) else number(value)  # JSON's integers are unbounded
        if length is None or not math.isfinite(length) or length < 0:
            raise ValueError(f"epsilons.{name} must be a length >= 0 m, got {shown(value)}")
    return {f"{name}_epsilon": float(value) for name, value in declared.items()}


NAME = "scene.json"


def scene_name(scene_format: str) -> str:
    """Return the file name of a scene in this format."""
    return f"scene.{scene_format}"


def hand_over(scene: Scene, folder: Path, scene_format: str = JSON) -> Path:
    """Write the scene into `folder`, as JSON and in `scene_format`; return the path of the latter."""
    document = scene_to_json(scene)
    for index, (shape, members) in enumerate(zip(scene.shapes, document["shapes"], strict=True)):
        if isinstance(shape, Mesh):
            del members["vertices"], members["faces"]
            members["file"] = f"mesh-{index}.obj"
            (folder / members["file"]).write_text(_obj(shape), encoding="ascii")
    path = folder / NAME
    path.write_text(json.dumps(document, indent=1) + "\n", encoding="utf-8")
    if scene_format != JSON:
        path = folder / scene_name(scene_format)
        export_scene(scene, path)
    return path


def _obj(mesh: Mesh) -> str:
    # The shortest decimals that give the same number when read as float64 (or as float32, for vertices in float32).
    lines = ["v {!r} {!r} {!r}".format(*vertex) for vertex in mesh.vertices.astype(np.float64).tolist()]
    lines += ["f {} {} {}".format(*face) for face in (mesh.faces + 1).tolist()]
    return "\n".join(lines) + "\n"
