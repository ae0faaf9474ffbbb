"""`Capabilities`, which a program declares, and the scene that is handed to it (JSON, OBJ); docs/protocol.md.

The scene is JSON of the published schema, with meshes as OBJ files beside it.
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
OF_STAYS = ("samples", "format", "scene_format")  # keys of the second alone
# What says the same in the command of a program that is called for each image.
INSTEAD = {
    "samples": "{samples}",
    "format": "{output.pfm}, {output.hdr} or {output.png}",
    "scene_format": "{scene.xml}",
}
OF_DECLARATION = ("writes", "transfer")  # keys that only the file of --declare may have
JSON = "json"  # the scene format of this protocol itself
ALWAYS = "always"
ANYWHERE = 0.5  # px: the radius of samples that lie anywhere in their pixel
EPSILONS = ("shadow", "ray")
LEAST_RENDERS, MOST_RENDERS = 32, 4096
LONGEST_NAME = 80
PIECES = {"mesh": "a mesh of triangles", "triangle": "single triangles"}


@dataclass(frozen=True, kw_only=True)
class Capabilities:
    """What a program declares. Nothing declared means: every scene, and whatever stages it writes."""

    protocol: int = ONCE
    name: str = ""
    version: str = ""
    precision: str = "float32"
    stages: tuple[Stage, ...] | None = None
    shapes: tuple[str, ...] = tuple(SHAPES)
    shading: tuple[str, ...] = SHADINGS
    clip: tuple[str, ...] = CLIPS
    two_sided: bool | Literal["always"] = True  # "always": it shades and sees both sides of every surface
    affine: bool = True  # stretched, sheared and mirrored shapes
    triangulated: bool = False  # wants cubes, squares and triangles as meshes
    chained: bool = False  # each stage is made of the very numbers written for the stages before it, but for rounding
    world_normals: bool = False  # takes faces' normals from corners that it rounds to float32 in world space
    deterministic: bool = False  # the same scene gives the same image, to the last bit
    samples: bool = False  # of one that stays alive: it averages n x n points itself
    format: str = "exr"  # of one that stays alive: what it writes
    scene_format: str = JSON  # in which it reads scenes, by the suffix of the file
    lights: int | None = None  # 1: a case is rendered once for each light, and the images are added
    sample_offset: tuple[float, float, float] = (0.0, 0.0, 0.0)  # px: right and down from pixels' centres, and radius
    random: int = 0  # of a program that draws random numbers: renders with different seeds whose mean is judged
    writes: str = ""  # the file that it writes in its folder, if its command does not say where to
    transfer: Transfer = ""  # the curve by which it encodes radiance; "" where its file says it, or it is linear
    shadow_epsilon: float = 0.0  # m
    ray_epsilon: float = 0.0  # m

    @property
    def title(self) -> str:
        """Return program and version, as far as they are known."""
        return f"{self.name} {self.version}".strip() or "a program that does not say its name"

    @property
    def within_pixel(self) -> bool:
        """Return whether a sample may lie anywhere in its pixel."""
        return self.sample_offset[2] == ANYWHERE

    def refusal(self, scene: Scene) -> str | None:
        """Return why the program cannot draw the scene, in a sentence, or None."""
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
        """Return what the format of its scenes can say; None for the protocol's own, which says everything."""
        return None if self.scene_format == JSON else EXPORTERS.about(f".{self.scene_format}")["says"]

    def _clip(self, scene: Scene) -> Clip | None:
        """Return the clip mode under which the program gets the scene: its own, or one under which it is the same."""
        if scene.clip in self.clip:
            return scene.clip
        modes: list[Clip] = [mode for mode in CLIPS if mode in self.clip]
        return next((mode for mode in modes if is_untouched(scene, scene.clip) and is_untouched(scene, mode)), None)

    def _sides_matter_not(self, scene: Scene) -> bool:
        """Return whether the stages that it writes are the same with the sides that its surfaces have."""
        both = self.two_sided == ALWAYS
        if all(shape.two_sided == both for shape in scene.shapes):
            return True
        return is_alike_with_sides(scene, both, self.stages or IMAGE_STAGES)

    def handed(self, scene: Scene) -> Scene:
        """Return a scene that is not refused under a clip mode and with sides that the program has.

        Where its samples lie the program knows itself.
        """
        clip = self._clip(scene)
        scene = scene if clip in (None, scene.clip) else replace(scene, clip=clip)
        scene = replace(scene, camera=replace(scene.camera, sample_offset=(0.0, 0.0)))
        return scene if self.two_sided is True else with_sides(scene, two_sided=self.two_sided == ALWAYS)

    def asked(self, scene: Scene) -> Scene:
        """Return the scene that the program is asked about and judged by.

        It is under a model of light that the program has, with meshes for spheres and planes that it does not draw, and
        seen through the points of the pixels at which it samples.
        """
        scene = self.under_its_light(scene)
        found = _tessellation(self, scene)
        return self.through_its_samples(scene if isinstance(found, str) else found)

    def through_its_samples(self, scene: Scene) -> Scene:
        """Return the scene seen through the points of the pixels at which the program samples."""
        right, down, _ = self.sample_offset
        if not right and not down:
            return scene
        return replace(scene, camera=replace(scene.camera, sample_offset=(right, down)))

    @property
    def tessellated_kinds(self) -> tuple[str, ...]:
        """Return which of spheres and planes are handed over as meshes, or planes as squares."""
        flat = "mesh" in self.shapes or "triangle" in self.shapes
        able = {"sphere": flat, "plane": flat or "square" in self.shapes}
        return tuple(kind for kind, can in able.items() if can and kind not in self.shapes)

    @property
    def stand_ins(self) -> Mapping[str, str]:
        """Return what it is handed, "mesh" or "triangle", for each type that it does not draw, or not as such."""
        found = {}
        for kind in FLAT:
            if "mesh" in self.shapes and kind != "mesh" and (self.triangulated or kind not in self.shapes):
                found[kind] = "mesh"
            elif "triangle" in self.shapes and kind not in self.shapes:
                found[kind] = "triangle"
        return found

    def under_its_light(self, scene: Scene) -> Scene:
        """Return the scene under a model of light that it has: its own, or else the one that the program has."""
        return scene if scene.shading in self.shading else replace(scene, shading=self.shading[0])  # type: ignore[arg-type]

    def told(self, scene: Scene) -> tuple[str, ...]:
        """Return in sentences what of a scene is handed over as something else that has the same image."""
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
        """Return in sentences which shapes the program is asked about as others, by which it is judged."""
        asked = self.asked(scene)
        changed = [
            (NAMES[type(shape)], NAMES[type(instead)])
            for shape, instead in zip(scene.shapes, asked.shapes, strict=True)
            if type(shape) is not type(instead)
        ]
        each = {"sphere": "a mesh of flat triangles", "plane": "a square that ends beyond what is seen"}
        return tuple(
            f"Asked and judged with {each[kind]} for each {kind}, since the program draws none."
            for kind in dict.fromkeys(kind for kind, _ in changed)
        )

    def within(self, says: SceneFormat) -> "Capabilities":
        """Return the capabilities as far as a format of scenes can say what they are about.

        Raises:
            ValueError: the format has a word for nothing that the program can do.

        """
        found: dict[str, Any] = {}
        for name in ("shapes", "shading", "clip"):
            mine = getattr(self, name)
            # A program that does not clip ignores the planes that a file may have.
            common = tuple(word for word in mine if word in getattr(says, name) or (name, word) == ("clip", "none"))
            if name == "clip" and mine == CLIPS:
                common = says.clip
            if not common:
                raise ValueError(f"{says.title} has no word for the {name} {', '.join(mine)}, which is all it can")
            found[name] = common
        if self.two_sided is True:
            found["two_sided"] = says.two_sided
        if self.lights is None:
            found["lights"] = says.lights
        if says.world_normals:
            found["world_normals"] = True
        if self.stages is None:
            found["stages"] = (Stage.RADIANCE,)
        return replace(self, **found)


@lru_cache(maxsize=512)
def _tessellation(able: Capabilities, scene: Scene) -> Scene | str:
    """Return the scene with meshes for spheres and planes that a program does not draw, or why there are none."""
    try:
        return tessellated(scene, able.tessellated_kinds, squares="square" in able.shapes)
    except NoStandInError as why:
        return str(why)


def _keeps_hands(matrix: Matrix) -> bool:
    """Say whether a matrix does not mirror."""
    return bool(np.linalg.det(np.asarray(matrix)[:3, :3]) > 0)


def capabilities_from(text: str) -> Capabilities | None:
    """Return what an answer declares, or None if it is no JSON object: a program need not know the question.

    Raises:
        ValueError: it is an object, but not the one that the protocol asks for; one line names the key.

    """
    try:
        declared = json.loads(text)
    except (ValueError, RecursionError):
        return None
    return capabilities_of(declared, ONCE) if isinstance(declared, dict) else None


def capabilities_of(
    declared: Mapping[str, Any], protocol: int, base: Capabilities | None = None, *, by_user: bool = False
) -> Capabilities:
    """Return what an object declares by a version of the protocol, in place of what `base` says.

    `by_user` says that it is the file of --declare, which need not name the version and has two keys more.

    Raises:
        ValueError: it is not the object that the protocol asks for; one line names the key.

    """
    known = {field.name for field in fields(Capabilities)} - {"shadow_epsilon", "ray_epsilon"} | {"epsilons"}
    known -= set() if by_user else set(OF_DECLARATION)
    for name in OF_STAYS if protocol == ONCE else ():
        if name in declared:
            raise ValueError(f"{name!r} belongs to version {STAYS}, `serve:`; with `exec:` {INSTEAD[name]} says it")
        known.discard(name)
    if unknown := sorted(set(declared) - known):
        raise ValueError(f"{unknown[0]!r} is not known; known: {', '.join(sorted(known))}")
    if declared.get("protocol", protocol if by_user else None) != protocol:
        raise ValueError(f"protocol must be {protocol}, got {declared.get('protocol')!r}")
    found = Capabilities(protocol=protocol) if base is None else base
    for name, known_names in (("shapes", tuple(SHAPES)), ("shading", SHADINGS), ("clip", CLIPS)):
        if name in declared:
            found = replace(found, **{name: _names(name, declared[name], known_names)})
    if "stages" in declared:
        found = replace(found, stages=tuple(map(Stage, _names("stages", declared["stages"], IMAGE_STAGES))))
    formats = (JSON, *(suffix.removeprefix(".") for suffix in EXPORTERS))
    for name, known_names in (("precision", PRECISIONS), ("format", FORMATS), ("scene_format", formats)):
        if name in declared:
            found = replace(found, **{name: _names(name, [declared[name]], known_names)[0]})
    for name in ("name", "version"):
        if name in declared:
            found = replace(found, **{name: _text(name, declared[name])})
    for name in ("two_sided", "affine", "triangulated", "chained", "world_normals", "deterministic", "samples"):
        if name in declared:
            word = name == "two_sided" and declared[name] == ALWAYS
            if not isinstance(declared[name], bool) and not word:
                more = f', or "{ALWAYS}"' if name == "two_sided" else ""
                raise ValueError(f"{name} must be true or false{more}, got {shown(declared[name])}")
            found = replace(found, **{name: declared[name]})
    if "lights" in declared:
        if declared["lights"] not in (0, 1) or isinstance(declared["lights"], bool | float):
            raise ValueError(f"lights must be 1, for one in each render, or 0 for all, got {shown(declared['lights'])}")
        found = replace(found, lights=declared["lights"])
    if "sample_offset" in declared:
        found = replace(found, sample_offset=_sample_offset(declared["sample_offset"]))
    if "random" in declared:
        found = replace(found, random=_renders(declared["random"]))
        if found.random and "sample_offset" not in declared:
            found = replace(found, sample_offset=(0.0, 0.0, ANYWHERE))
        if found.random and found.stages not in (None, (Stage.RADIANCE,)):
            raise ValueError("random: stages must be radiance alone, since no other stage has a mean over samples")
        found = replace(found, stages=(Stage.RADIANCE,)) if found.random else found
    if "writes" in declared:
        found = replace(found, writes=_file_name(declared["writes"]))
    if "transfer" in declared:
        found = replace(found, transfer=_transfer(declared["transfer"]))
    return replace(found, **_epsilons(declared["epsilons"])) if "epsilons" in declared else found


def declaration(path: Path) -> Mapping[str, Any]:
    """Return the object in the file of --declare, whose keys `capabilities_of` looks at.

    Raises:
        ValueError: it is no JSON object; the line names the file.
        OSError: it cannot be read.

    """
    try:
        declared = json.loads(path.read_text(encoding="utf-8"))
    except (ValueError, RecursionError) as error:
        raise ValueError(f"--declare {path}: is no JSON: {' '.join(str(error).split())}") from None
    if not isinstance(declared, dict):
        raise ValueError(f"--declare {path}: must be a JSON object, got {shown(declared)}")
    return declared


def _file_name(given: Any) -> str:
    """Return the name of a file that a program always writes."""
    if not isinstance(given, str) or Path(given).name != given or not given.isprintable() or given in (".", ".."):
        raise ValueError(f"writes must be the name of a file in the folder of the call, got {shown(given)}")
    return given


def _sample_offset(declared: Any) -> tuple[float, float, float]:
    """Return [right, down, radius] [px] of the samples in their pixels."""
    numbers = [None if isinstance(part, str) else number(part) for part in declared if isinstance(declared, list)]
    right, down, radius = numbers if len(numbers) == 3 else (None, None, None)
    if right is None or down is None or radius is None or max(abs(right), abs(down), radius) > 0.5 or not radius >= 0:
        raise ValueError(
            "sample_offset must be [right, down, radius] in pixels, each at most 0.5 and the radius at least 0, "
            f"got {shown(declared)}"
        )
    return float(right), float(down), float(radius)


def _renders(declared: Any) -> int:
    """Return of how many renders the mean is judged, 0 for a program that draws no random numbers."""
    if isinstance(declared, bool):
        return LEAST_RENDERS if declared else 0
    if not isinstance(declared, int) or not LEAST_RENDERS <= declared <= MOST_RENDERS:
        raise ValueError(
            f"random must be true, false, or the number of renders, {LEAST_RENDERS} to {MOST_RENDERS}, "
            f"got {shown(declared)}"
        )
    return declared


def _transfer(given: Any) -> Transfer:
    if given in (LINEAR, SRGB):
        return str(given)
    exponent = None if isinstance(given, str) else number(given)
    if exponent is None or not 0.1 <= exponent <= 10:
        raise ValueError(f'transfer must be "{LINEAR}", "{SRGB}" or a gamma from 0.1 to 10, got {shown(given)}')
    return float(exponent)


def _names(name: str, given: Any, known: tuple[str, ...]) -> tuple[str, ...]:
    if not isinstance(given, list) or not given or not all(isinstance(one, str) for one in given):
        raise ValueError(f"{name} must be a list of names, got {given!r}")
    for one in given:
        if one not in known:
            raise ValueError(f"{name}: {one!r} is not known; known: {', '.join(known)}")
    return tuple(given)


def _text(name: str, given: Any) -> str:
    if not isinstance(given, str) or not given.isprintable() or len(given) > LONGEST_NAME:
        raise ValueError(f"{name} must be at most {LONGEST_NAME} printable characters, got {str(given)[:40]!r}")
    return given


def _epsilons(given: Any) -> dict[str, float]:
    if not isinstance(given, Mapping) or not set(given) <= set(EPSILONS):
        raise ValueError(f"epsilons must be an object with {' and '.join(EPSILONS)}, got {given!r}")
    for name, value in given.items():
        length = None if isinstance(value, str) else number(value)  # JSON's whole numbers have no end
        if length is None or not math.isfinite(length) or length < 0:
            raise ValueError(f"epsilons.{name} must be a length >= 0 m, got {shown(value)}")
    return {f"{name}_epsilon": float(value) for name, value in given.items()}


NAME = "scene.json"


def scene_name(scene_format: str) -> str:
    """Return the name of the file in which a scene is handed over."""
    return f"scene.{scene_format}"


def hand_over(scene: Scene, folder: Path, scene_format: str = JSON) -> Path:
    """Write the scene into `folder` and return the path of its JSON, or of its file in another format.

    The JSON is written in any case.
    """
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
    # Shortest decimals that read back, as float64 or float32, to the very vertex.
    lines = ["v {!r} {!r} {!r}".format(*vertex) for vertex in mesh.vertices.astype(np.float64).tolist()]
    lines += ["f {} {} {}".format(*face) for face in (mesh.faces + 1).tolist()]
    return "\n".join(lines) + "\n"
