"""How many files a reader has to open who follows one sphere from its scene to its image."""

import subprocess
import sys
from textwrap import dedent

import pytest

MOST = 25  # product files in which `tracer.render` of one sphere calls a function


@pytest.mark.process
def test_one_sphere_is_rendered_by_few_files() -> None:
    # In a process of its own, in which nothing has been computed before and is kept.
    script = """
        import sys
        from pathlib import Path
        import rayproof
        from rayproof.cases.families import select
        from rayproof.cases.stages import Stage
        from rayproof.tracer.configuration import Configuration
        from rayproof.tracer.render import render
        scene = select(["primitives/sphere"])[0].scene
        entered = set()
        def note(frame, event, argument):
            if event == "call" and frame.f_code.co_name != "<module>":
                entered.add(frame.f_code.co_filename)
        sys.setprofile(note)
        render(scene, list(Stage), Configuration())
        sys.setprofile(None)
        folders = [rayproof.ROOT.resolve() / name for name in ("cases", "tracer", "reference", "reports")]
        found = {Path(name).resolve() for name in entered if name.endswith(".py")}
        print(*sorted(str(path) for path in found if any(folder in path.parents for folder in folders)), sep="\\n")
    """
    command = [sys.executable, "-c", dedent(script)]
    files = subprocess.run(command, capture_output=True, text=True, check=True).stdout.split()

    assert any(file.endswith("tracer/formulas/spheres.py") for file in files)
    assert len(files) <= MOST, files
