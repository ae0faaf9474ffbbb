"""The child process of `pictures`: jobs come on stdin, what it does goes to stdout, a line of JSON each.

A line before each case names what was being drawn should the process die there. Run as
`python -m rayproof.reports.publish.scene3d.picture_worker PARENT`.
"""

import json
import sys
from pathlib import Path
from typing import Any

from rayproof.reports.processes.parent_death import end_with_parent


def main() -> None:
    """Draw every job of stdin; end with the parent, whose process number is the argument."""
    for parent in sys.argv[1:]:
        end_with_parent(int(parent), "rayproof-draw")
    from rayproof.cases.scene_json import load_scene
    from rayproof.reports.publish.scene3d.picture_scene import draw, new_plotter
    from rayproof.reports.publish.scene3d.view_file import write_view
    from rayproof.reports.publish.scene3d.view_state import new_recorder
    from rayproof.reports.results.images import kept_images

    plotter, recorder = None, new_recorder()
    for line in sys.stdin:
        job = json.loads(line)
        _say(state="started", name=job["name"])
        try:
            scene = load_scene(Path(job["scene"]))
            folder = Path(job["folder"])
            images, _ = kept_images(folder, job["case"], only=(job["ours"], job["theirs"]))
            ours, theirs = images.get(job["ours"]), images.get(job["theirs"])
            shown = {"ours": ours, "theirs": theirs, "stage": job["stage"]}
            if job["picture"] is not None:
                plotter = plotter or new_plotter()
                draw(plotter, Path(job["picture"]), scene, **shown)
            write_view(recorder, folder, job["view"], scene, **shown)
        except (OSError, ValueError) as error:
            _say(state="failed", name=job["name"], why=str(error))
        else:
            _say(state="drawn", name=job["name"])


def _say(**report: Any) -> None:
    sys.stdout.write(json.dumps(report) + "\n")
    sys.stdout.flush()


if __name__ == "__main__":
    main()
