"""What a reference says of itself on a case, as text for the report: settings, epsilons, coarse output."""

import numpy as np

from rayproof.reports.judge.answers import Witness


def said(witness: Witness) -> dict[str, str]:
    """Return name to value with its unit; only what is set or not zero."""
    told = dict(witness.settings)
    if witness.ray_epsilon:
        told["ray epsilon"] = f"{witness.ray_epsilon:.3g} m"
    if witness.light_epsilon:
        told["light epsilon"] = f"{witness.light_epsilon:.3g} of a feeler's length"
    if witness.edge_epsilon:
        told["edge epsilon"] = f"{witness.edge_epsilon:.3g} m"
    if witness.tie_epsilon:
        told["tie epsilon"] = f"{witness.tie_epsilon:.3g} m"
    shadow = np.asarray(witness.shadow_epsilon, dtype=np.float64)
    known = shadow[np.isfinite(shadow)]
    if known.size and known.max() > 0:
        low, high = float(known.min()), float(known.max())
        told["shadow epsilon"] = f"{high:.3g} m" if low == high else f"{low:.3g} to {high:.3g} m"
    for stage, resolution in witness.resolutions.items():
        told[f"resolution of {stage}"] = resolution.because
    return told
