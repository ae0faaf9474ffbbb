"""Programs as they come: their own scene formats and pictures, one light at a time, and what --declare says of them."""

import json
import sys
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from rayproof.cases.families import select
from rayproof.cases.scene import PointLight, Scene
from rayproof.cases.stages import Stage
from rayproof.reference.analytic import Analytic
from rayproof.reports.interchange import import_scene
from rayproof.reports.subjects import Subject
from rayproof.reports.subjects.calls import filled
from rayproof.reports.subjects.choosing import chosen
from rayproof.reports.subjects.program import ask_capabilities, ask_program, notes_on
from rayproof.reports.subjects.protocol import Capabilities
from rayproof.reports.subjects.serving import Server
from tests.reports.subjects.conftest import SCENE

pytestmark = pytest.mark.process

# The oracle as a program that somebody else wrote: it reads one format and writes one kind of picture.
RENDERER = """
import json, struct, sys, zlib
from pathlib import Path
import numpy as np
from rayproof.cases.scene_json import load_scene
from rayproof.cases.stages import Stage
from rayproof.reference.analytic import Analytic
from rayproof.reports.interchange import ImportOptions, import_scene

def draw(scene_file, image_file, width, height):
    path = Path(scene_file)
    if path.suffix == ".json":
        scene = load_scene(path)
    else:
        scene = import_scene(path, ImportOptions(size=(int(width), int(height)))).scene
    assert len(scene.lights) <= MOST_LIGHTS
    image = np.clip(Analytic().render(scene, [Stage.RADIANCE])[Stage.RADIANCE], 0, LARGEST)
    height, width, _ = image.shape
    if str(image_file).endswith(".png"):
        codes = np.where(image <= 0.0031308, 12.92 * image, 1.055 * image ** (1 / 2.4) - 0.055)
        rows = np.rint(codes * 65535).astype(">u2").reshape(height, -1)
        packed = zlib.compress(b"".join(b"\\0" + row.tobytes() for row in rows))
        parts = [(b"IHDR", struct.pack(">IIBBBBB", width, height, 16, 2, 0, 0, 0)), (b"IDAT", packed), (b"IEND", b"")]
        chunks = [struct.pack(">I", len(d)) + n + d + struct.pack(">I", zlib.crc32(n + d)) for n, d in parts]
        Path(image_file).write_bytes(b"\\x89PNG\\r\\n\\x1a\\n" + b"".join(chunks))
    else:
        head = f"PF\\r\\n{width} {height}\\r\\n-1.0\\r\\n".encode()
        Path(image_file).write_bytes(head + image[::-1].astype("<f4").tobytes())
"""
CALLED = """
if sys.argv[1:] == ["--capabilities"]:
    Path(__file__).with_name("asked").touch()
    sys.exit(2)
draw(*sys.argv[1:])
"""
ALIVE = """
for line in sys.stdin:
    request = json.loads(line)
    if "capabilities" in request:
        answer = {"capabilities": CAPABILITIES}
    else:
        Path(__file__).with_name("request.json").write_text(line)
        draw(*(request[key] for key in ("scene", "output", "width", "height")))
        answer = {"ok": True}
    print(json.dumps({"id": request["id"], **answer}), flush=True)
"""
LIGHTS = (
    PointLight(position=(1.5, -1.0, 4.0), flux=(1000.0, 800.0, 600.0)),
    PointLight(position=(3.0, -3.0, 1.0), flux=(300.0, 800.0, 900.0)),
)
TWO_LIGHTS = replace(SCENE, lights=LIGHTS, camera=replace(SCENE.camera, width=18, height=12))
Making = Callable[..., Path]


@pytest.fixture
def renderer(tmp_path: Path) -> Making:
    """Return a maker of the renderer's file."""

    def make(main: str, *, lights: int = 9, largest: float = np.inf, capabilities: object = None) -> Path:
        path = tmp_path / "tiny.py"
        values = f"MOST_LIGHTS, LARGEST, CAPABILITIES = {lights}, {largest!r}, {capabilities!r}\n"
        path.write_text(RENDERER + values.replace("inf", "np.inf") + main)
        return path

    return make


def put_to_test(text: str, declare: Path | None = None) -> Subject:
    def ask(subject: Subject) -> Capabilities:
        return ask_capabilities(subject, seconds=20, server=Server(subject) if subject.stays else None)

    return chosen(text, seconds=60.0, memory=4 * 2**30, ask=ask, declare=declare)


def radiance(scene: Scene) -> np.ndarray:
    return Analytic().render(scene, [Stage.RADIANCE])[Stage.RADIANCE]


def said(folder: Path, **declared: object) -> Path:
    path = folder / "mine.json"
    path.write_text(json.dumps(declared))
    return path


def test_a_picture_that_clips_is_rendered_under_darker_lights_and_scaled_back(renderer: Making) -> None:
    scene, file = TWO_LIGHTS, renderer(CALLED, largest=1.0)
    assert radiance(scene).max() > 1

    subject = put_to_test(f"exec:{sys.executable} {file} {{scene}} {{output.png}} 1 1")
    answers = ask_program(subject, scene, samples=1)

    assert answers.error is None
    image, coarse = answers.answers[Stage.RADIANCE], answers.resolutions[Stage.RADIANCE]
    assert (np.abs(image - radiance(scene)) <= coarse.step(image) * (1 + 1e-9)).all()
    assert coarse.absolute < 1e-4 * radiance(scene).max()
    assert "65536 steps, by the sRGB curve" in coarse.because
    (note,) = (note for note in notes_on(subject, scene) if "flux" in note)
    assert "2^-1" in note


def test_dim_light_is_made_brighter_for_a_picture_of_few_steps(renderer: Making) -> None:
    dim = replace(TWO_LIGHTS, lights=tuple(replace(one, flux=(0.01, 0.02, 0.03)) for one in LIGHTS))
    subject = put_to_test(f"exec:{sys.executable} {renderer(CALLED, largest=1.0)} {{scene}} {{output.png}} 1 1")

    image = ask_program(subject, dim, samples=1).answers[Stage.RADIANCE]

    assert np.allclose(image, radiance(dim), rtol=1e-3, atol=1e-4 * radiance(dim).max())


@pytest.mark.parametrize("lights", [1, 9])
def test_lights_one_by_one_add_up(renderer: Making, tmp_path: Path, lights: int) -> None:
    declare = said(tmp_path, lights=1) if lights == 1 else None
    subject = put_to_test(
        f"exec:{sys.executable} {renderer(CALLED, lights=lights)} {{scene}} {{output.pfm}} 1 1", declare
    )

    answers = ask_program(subject, TWO_LIGHTS, samples=1, keep=tmp_path / "kept")

    assert answers.error is None
    assert np.allclose(answers.answers[Stage.RADIANCE], radiance(TWO_LIGHTS), rtol=1e-6)
    assert (tmp_path / "kept" / "light-1" / "scene.json").is_file() == (lights == 1)
    assert any("each of 2 lights" in note for note in subject.capabilities.told(TWO_LIGHTS)) == (lights == 1)


def test_a_program_that_takes_one_light_is_not_handed_two_by_mistake(renderer: Making) -> None:
    subject = put_to_test(f"exec:{sys.executable} {renderer(CALLED, lights=1)} {{scene}} {{output.pfm}} 1 1")

    assert "AssertionError" in (ask_program(subject, TWO_LIGHTS, samples=1).error or "")


def test_a_scene_in_a_known_format_needs_no_adapter(renderer: Making, tmp_path: Path) -> None:
    file = renderer(CALLED)
    subject = put_to_test(f"exec:{sys.executable} {file} {{scene.gltf}} {{output.pfm}} {{width}} {{height}}")
    case = select(["primitives/cube"])[0].scene

    answers = ask_program(subject, subject.capabilities.asked(case), samples=1, keep=tmp_path / "kept")

    assert not file.with_name("asked").exists(), "a program that reads other programs' scenes is not asked"
    assert answers.error is None
    assert np.isclose(answers.answers[Stage.RADIANCE], radiance(case), rtol=1e-5, atol=1e-7).mean() > 0.998
    assert subject.capabilities.stages == (Stage.RADIANCE,)
    kept = import_scene(tmp_path / "kept" / "scene.gltf").scene
    assert len(kept.shapes) == len(case.shapes)


def test_one_that_stays_alive_says_which_files_it_reads_and_writes(renderer: Making, tmp_path: Path) -> None:
    able = {"protocol": 2, "scene_format": "gltf", "format": "png", "name": "Tiny Tracer 2"}
    subject = put_to_test(f"serve:{sys.executable} {renderer(ALIVE, capabilities=able)}")
    case = select(["primitives/cube"])[0].scene
    server = Server(subject)
    try:
        answers = ask_program(subject, case, samples=1, server=server)
    finally:
        server.close()

    assert answers.error is None
    request = json.loads((tmp_path / "request.json").read_text())
    assert (Path(request["scene"]).name, Path(request["output"]).name) == ("scene.gltf", "image.png")
    assert {key: request[key] for key in ("width", "height", "samples", "spp", "seed")} == {
        "width": case.camera.width,
        "height": case.camera.height,
        "samples": 1,
        "spp": 1,
        "seed": 0,
    }
    off = np.abs(answers.answers[Stage.RADIANCE] - radiance(case))
    assert (off <= answers.resolutions[Stage.RADIANCE].absolute * 1.01 + 1e-6).mean() > 0.998
    assert subject.name == "Tiny_Tracer_2"


def test_a_program_that_always_writes_the_same_file_is_declared_so(renderer: Making, tmp_path: Path) -> None:
    declare = said(tmp_path, writes="out.pfm", clip=["none"], two_sided="always", name="old")
    text = f"exec:{sys.executable} {renderer(CALLED)} {{scene}} out.pfm 1 1"
    subject = put_to_test(text, declare)

    answers = ask_program(subject, SCENE, samples=1)

    assert np.allclose(answers.answers[Stage.RADIANCE], radiance(SCENE), rtol=1e-6)
    assert (subject.name, subject.image_name) == ("old", "out.pfm")
    assert subject.capabilities.clip == ("none",)
    assert subject.options == ["--subject", text, "--declare", str(declare)]
    with pytest.raises(ValueError, match="described by --declare"):
        put_to_test(text)


def test_every_word_is_replaced() -> None:
    words = filled(
        ("r", "-s={seed}", "{width}x{height}", "{samples}", "{spp}", "{scene.pov}", "{output.hdr}"),
        Path("/f"),
        SCENE,
        samples=3,
        seed=7,
        spp=9,
    )

    assert words == ["r", "-s=7", "6x4", "3", "9", "/f/scene.pov", "/f/image.hdr"]
