"""Which lights a surface cannot see because they are below its horizon."""

from typing import Any

from rayproof.cases.stages import Stage
from rayproof.tracer.feelers import FEELERS


@FEELERS.register("horizon/below", covers=("LIT-1",), kind="right", stage=Stage.VISIBILITY, default=True)
def below(cosine: Any) -> Any:
    """Return where dot(N, L) <= 0. A NaN is not below: it must stay visible as a NaN."""
    return cosine <= 0
