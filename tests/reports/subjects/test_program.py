"""Whatever a program does becomes one sentence, or answers; and nothing that it started outlives its call."""

import math
import time
from pathlib import Path

import numpy as np
import OpenEXR
import psutil
import pytest

from rayproof.cases.scene import Scene
from rayproof.cases.stages import Stage
from rayproof.reports.judge.answers import Answers
from rayproof.reports.subjects import Subject
from rayproof.reports.subjects.program import ask_capabilities, ask_program
from tests.reports.subjects.conftest import SCENE, Writing

pytestmark = pytest.mark.process

SIZE = (SCENE.camera.height, SCENE.camera.width)
SLEEPER = "86399.125"  # s; no other process sleeps as long


def outcome(subject: Subject, scene: Scene = SCENE) -> Answers:
    return ask_program(subject, scene, samples=1)


def saved(folder: Path, channels: dict[str, np.ndarray]) -> Path:
    """Write an EXR for a program to hand over as its own."""
    path = folder / "prepared.exr"
    header = {"compression": OpenEXR.NO_COMPRESSION, "type": OpenEXR.scanlineimage}
    OpenEXR.File(header, {name: np.ascontiguousarray(image) for name, image in channels.items()}).write(str(path))
    return path


def full(value: float, size: tuple[int, int] = SIZE, kind: type = np.float32) -> np.ndarray:
    return np.full(size, value, dtype=kind)


HOSTILE = {
    "does nothing": (["pass"], "wrote no image"),
    "exit code": (["sys.exit('no licence')"], "exit code 1: no licence"),
    "a shell's signal": (["sys.exit(139)"], "exit code 139, a shell's word for SIGSEGV"),
    "signal": (["os.kill(os.getpid(), 11)"], "SIGSEGV"),
    "abort": (["os.abort()"], "SIGABRT"),
    "text for an image": (["open(OUTPUT, 'w').write('hello')"], "neither OpenEXR, PFM, Radiance HDR nor PNG"),
    "empty image": (["open(OUTPUT, 'w')"], "neither OpenEXR, PFM, Radiance HDR nor PNG"),
    "link to a file": (["os.symlink('/etc/hostname', OUTPUT)"], "no regular file"),
    "pipe": (["os.mkfifo(OUTPUT)"], "no regular file"),
    "folder": (["os.mkdir(OUTPUT)"], "no regular file"),
    "folder deleted": (["import shutil; shutil.rmtree(os.getcwd())"], "wrote no image"),
    "beside its folder": (["open('../stolen', 'w'); open(OUTPUT, 'w')"], "outside of its folder: stolen"),
    "header of a PFM alone": (["open(OUTPUT, 'w').write('PF\\n6 4\\n-1.0\\n')"], "0 bytes of pixels, not 288"),
    "PFM of another size": (["open(OUTPUT, 'w').write('PF\\n4 6\\n-1.0\\n')"], "4 x 6 px, not 6 x 4"),
    "PFM of another scale": (["open(OUTPUT, 'w').write('PF\\n6 4\\n-2.5\\n')"], "scale"),
    "memory": (["bytearray(2**40)"], "MemoryError"),
}


@pytest.mark.parametrize(("lines", "said"), HOSTILE.values(), ids=HOSTILE.keys())
def test_what_gives_no_image_ends_in_one_sentence(program: Writing, lines: list[str], said: str) -> None:
    ended = outcome(program(*lines))

    assert not ended.answers
    assert ended.error is not None
    assert said in ended.error
    assert "\n" not in ended.error


def test_a_program_that_hangs_is_stopped_in_time(program: Writing) -> None:
    start = time.monotonic()

    ended = outcome(program("import time; time.sleep(60)", seconds=0.5))

    assert ended.error == "the program gave no image: it did not end within 0.5 s and was stopped"
    assert time.monotonic() - start < 5


@pytest.mark.parametrize("daemon", [False, True], ids=["child", "daemon"])
def test_what_a_program_leaves_running_is_ended_and_told(program: Writing, daemon: bool) -> None:
    lines = [f"import subprocess; subprocess.Popen(['sleep', '{SLEEPER}'], start_new_session={daemon})"]
    if daemon:  # its parent goes first, so that init would inherit it
        lines = ["if os.fork() == 0:", f"    os.setsid(); os.execvp('sleep', ['sleep', '{SLEEPER}'])"]

    ended = outcome(program(*lines))

    assert ended.error is not None
    assert "left 1 process running" in ended.error
    assert [one for one in psutil.process_iter(["cmdline"]) if SLEEPER in (one.info["cmdline"] or ())] == []


WRONG = {
    "size": ({name: full(0.5, (9, 9)) for name in "RGB"}, "9 x 9 px, not 6 x 4"),
    "channels": ({"luminance": full(0.5)}, "its channels are luminance; none of them is a stage's"),
    "one channel short": ({"normal.X": full(0.5), "normal.Y": full(0.5)}, "not normal.X, normal.Y, normal.Z"),
    "a light too many": ({"visibility.0": full(1), "visibility.1": full(1)}, "not visibility.0"),
}


@pytest.mark.parametrize(("channels", "said"), WRONG.values(), ids=WRONG.keys())
def test_an_image_of_the_wrong_kind_says_so(
    program: Writing, tmp_path: Path, channels: dict[str, np.ndarray], said: str
) -> None:
    path = saved(tmp_path, channels)

    ended = outcome(program(f"import shutil; shutil.copyfile({str(path)!r}, OUTPUT)"))

    assert ended.error is not None
    assert said in ended.error


def test_what_is_written_is_answered_and_the_rest_is_unsupported(program: Writing, tmp_path: Path) -> None:
    path = saved(tmp_path, {name: full(math.nan) for name in "RGB"} | {"distance.V": full(2.5, kind=np.float16)})

    given = outcome(program(f"import shutil; shutil.copyfile({str(path)!r}, OUTPUT)"))

    assert given.error is None
    assert given.answers
    assert set(given.answers) == {Stage.RADIANCE, Stage.DISTANCE}
    assert np.isnan(given.answers[Stage.RADIANCE]).all(), "NaN is an answer, for the judge to find wrong"
    assert given.resolutions[Stage.DISTANCE].relative == 2.0**-11
    assert set(given.unsupported) == set(Stage) - set(given.answers)


def test_a_program_may_say_that_it_cannot(program: Writing) -> None:
    ended = outcome(program("print('No tori today.'); sys.exit(77)"))

    assert ended.error is None
    assert set(ended.unsupported.values()) == {"No tori today."}


def test_what_was_declared_and_not_written_costs_that_stage_alone(program: Writing, tmp_path: Path) -> None:
    path = saved(tmp_path, {name: full(0.5) for name in "RGB"})
    lines = ["if sys.argv[1:] == ['--capabilities']:"]
    lines += ['    print(\'{"protocol": 1, "stages": ["radiance", "normal"]}\'); sys.exit()']
    subject = program(*lines, f"import shutil; shutil.copyfile({str(path)!r}, OUTPUT)")
    from dataclasses import replace

    declared = replace(subject, capabilities=ask_capabilities(subject, seconds=10))

    ended = outcome(declared)

    assert (ended.error, list(ended.answers or ())) == (None, [Stage.RADIANCE])
    assert ended.lacking == {Stage.NORMAL: "it declares this stage and wrote no channel of it"}
    assert Stage.NORMAL not in ended.unsupported


def test_a_mean_is_taken_from_a_finer_image_or_from_the_program_itself(program: Writing) -> None:
    from dataclasses import replace

    lines = ["import json, struct", "camera = json.load(open(SCENE))['camera']"]
    lines += ["samples = int(sys.argv[3]) if len(sys.argv) > 3 else 0"]
    lines += ["size = camera['width'] * camera['height'] * 3"]
    lines += ["head = f\"PF\\n{camera['width']} {camera['height']}\\n-1.0\\n\".encode()"]
    lines += ["open(OUTPUT, 'wb').write(head + struct.pack(f'<{size}f', *[samples or camera['width']] * size))"]
    subject = program(*lines)

    finer = ask_program(subject, SCENE, samples=3)
    own = ask_program(replace(subject, command=(*subject.command, "{samples}")), SCENE, samples=3)

    assert finer.mean is not None
    assert finer.mean.shape == (*SIZE, 3)
    assert np.all(finer.mean == 3 * SCENE.camera.width), "the scene came at three times the resolution"
    assert own.mean is not None
    assert np.all(own.mean == 3), "the program was told how many samples to take"
