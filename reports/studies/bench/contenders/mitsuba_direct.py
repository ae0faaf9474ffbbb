"""Mitsuba as its users run it: `mi.render` with the direct integrator and one sample a pixel."""

from typing import Any

import drjit as dr

from rayproof.cases.scene import Scene
from rayproof.reference.mitsuba3.variants import load, unavailable
from rayproof.reports.studies.bench import CONTENDERS, Prepared
from rayproof.reports.studies.bench.contenders.mitsuba_scene import loaded
from rayproof.reports.studies.bench.kernels import kernels


class _Direct:
    """`mi.render` in one variant."""

    variant = ""

    @classmethod
    def missing(cls) -> str | None:
        """Return why it cannot run here, or None."""
        return unavailable(cls.variant)

    def unsupported(self, scene: Scene) -> str | None:
        """Return why it cannot draw this scene, or None."""
        return None

    def prepare(self, scene: Scene) -> Prepared:
        """Load the scene."""
        mi = load(self.variant)
        world, seconds = loaded(self.variant, scene)
        is_jit = self.variant.startswith("llvm")
        last: list[Any] = [None]

        def run() -> None:
            last[0] = mi.render(world, spp=1)
            if is_jit:
                dr.eval(last[0])
                dr.sync_thread()

        return Prepared(
            build_seconds=seconds,
            run=run,
            # Its one sample is anywhere in the pixel, and of several lights it takes one at random.
            image=None,
            does=f"mi.render, direct, 1 sample a pixel, {self.variant}",
            kernels=(lambda: kernels(run)) if is_jit else None,
            # Global to the process, and another contender may have changed it.
            ready=lambda: load(self.variant),
        )


@CONTENDERS.register("mitsuba_direct")
class Direct(_Direct):
    """Compiled by LLVM."""

    variant = "llvm_ad_rgb"


@CONTENDERS.register("mitsuba_scalar")
class Scalar(_Direct):
    """Without JIT compilation, on all cores."""

    variant = "scalar_rgb"
