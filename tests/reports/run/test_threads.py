"""Workers leave Dr.Jit its own threads: with one alone it computes on the caller's, which keeps subnormal numbers.

Then a run would judge another arithmetic than the one that is used.
"""

import subprocess
import sys
from textwrap import dedent

import pytest

from rayproof.reports.run.tasks.kinds import TRACING

pytestmark = pytest.mark.process


@pytest.mark.parametrize("kind", [TRACING, "reference:mitsuba_llvm"])
def test_subnormal_numbers_are_flushed_after_a_worker_s_task_as_before_it(kind: str) -> None:
    # In a process of its own: here other tests may have chosen a number of threads.
    script = """
        import sys
        from rayproof import tracer
        import drjit as dr
        from drjit.llvm import Float
        from rayproof.reports.run.messages import ReferenceTask, TracerTask
        from rayproof.reports.run.tasks.handlers import handler
        from tests.reports.judge.scenes import SCENE

        def facts():
            faint = dr.opaque(Float, 1e-38, 2**20) * dr.opaque(Float, 2.0**-10, 2**20)
            return dr.thread_count(), dr.count(faint != 0)[0]

        before = facts()
        do = handler(sys.argv[1])
        made = facts()
        if sys.argv[1] == "tracer":
            do(TracerTask(scene=SCENE, configuration="float32", samples=1))
        else:
            do(ReferenceTask(scene=SCENE, samples=1))
        print(before, made, facts(), sep="\\n")
    """

    done = subprocess.run([sys.executable, "-c", dedent(script), kind], check=True, capture_output=True, text=True)

    before, made, after = done.stdout.splitlines()
    assert before == made == after
