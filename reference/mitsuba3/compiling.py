"""An integrator compiled apart from camera and film, whose numbers Mitsuba writes into the code that it compiles.

In one kernel with them, the integrator is compiled anew for every camera; on its own, once for every mixture of shapes.
"""

from typing import Any


def apart(mi: Any, integrator: Any) -> Any:
    """Return `integrator`, its rays and its radiances computed in memory between two short kernels."""
    import drjit as dr

    class Apart(mi.SamplingIntegrator):
        def __init__(self) -> None:
            super().__init__(mi.Properties())

        def sample(self, scene: Any, sampler: Any, ray: Any, medium: Any = None, active: Any = True) -> Any:
            dr.eval(ray)
            found = integrator.sample(scene, sampler, ray, medium, active)
            dr.eval(found)
            return found

    return Apart()
