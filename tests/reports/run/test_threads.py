"""Workers compute with Dr.Jit's arithmetic: its own threads flush subnormal numbers, and the caller's keeps them.

With one thread alone Dr.Jit computes on the caller's, and a run would judge another arithmetic than is used.
"""

import subprocess
import sys
from textwrap import dedent

import pytest

from rayproof.reports.subjects import TRACER

pytestmark = pytest.mark.process


@pytest.mark.parametrize("kind", [TRACER, "reference:mitsuba_llvm"])
def test_subnormal_numbers_are_flushed_after_a_worker_s_task_as_before_it(kind: str) -> None:
    # In a process of its own: here other tests may have chosen a number of threads.
    script = """
        import sys
        from rayproof import tracer
        import drjit as dr
        from drjit.llvm import Float
        from rayproof.reports.run.worker_tasks import prepare, render_reference
        from tests.reports.judge.scenes import SCENE

        def facts():
            faint = dr.opaque(Float, 1e-38, 2**20) * dr.opaque(Float, 2.0**-10, 2**20)
            return dr.thread_count(), dr.count(faint != 0)[0]

        before = facts()
        prepare(sys.argv[1])
        made = facts()
        if sys.argv[1] == "tracer":
            from rayproof.reports.run.tracer_task import trace
            trace(SCENE, "float32")
        else:
            render_reference(sys.argv[1].removeprefix("reference:"), SCENE)
        print(before, made, facts(), sep="\\n")
    """

    done = subprocess.run([sys.executable, "-c", dedent(script), kind], check=True, capture_output=True, text=True)

    before, made, after = done.stdout.splitlines()
    assert before == made == after


@pytest.mark.parametrize("precision", ["float32", "float64"])
def test_one_thread_alone_flushes_subnormal_numbers_and_leaves_the_caller_as_it_was(precision: str) -> None:
    script = """
        import sys
        from rayproof import tracer
        import drjit as dr
        from drjit.llvm import Float, Float64
        from rayproof.tracer.kernel.compiler import one_thread

        kind, faint = (Float, 1e-38) if sys.argv[1] == "float32" else (Float64, 1e-307)

        def subnormal():
            return dr.count(dr.opaque(kind, faint, 2**10) * dr.opaque(kind, 2.0**-10, 2**10) != 0)[0]

        threads = dr.thread_count()
        with one_thread():
            print(subnormal(), dr.thread_count())
        print(sys.float_info.min / 2 > 0, dr.thread_count() == threads)
        dr.set_thread_count(1)
        print(subnormal())
    """

    done = subprocess.run([sys.executable, "-c", dedent(script), precision], check=True, capture_output=True, text=True)

    within, after, otherwise = done.stdout.splitlines()
    assert within.startswith("0 ")
    assert after == "True True"
    assert otherwise == "1024"  # what the test would not see if the caller's thread flushed anyway
