"""The samples of a lane side by side: a step of all of them comes before the next step of any.

Dr.Jit writes the code of one scope before that of the next, and within a scope follows each result back to where it
came from, one sample after the other. A sample's operations wait for each other, and a processor looks some two
hundred instructions ahead, less than one sample has: step by step it finds other samples' work to do meanwhile.
"""

import drjit as dr

from rayproof.tracer.device.arrays import BACKENDS, ArrayTypes


def next_step(types: ArrayTypes, *, samples: int) -> None:
    """End a step: what is computed from here on comes later in the kernel than all that was computed before.

    A lane of one sample has nothing to put beside it.
    """
    if samples > 1:
        dr.detail.new_scope(BACKENDS[types.backend])
