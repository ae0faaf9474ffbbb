"""Small errors: what is found grows with the error and with the precision."""

import pytest

from rayproof.cases.families import select
from rayproof.reports.audit.graded_task import QUANTITIES, work
from rayproof.reports.audit.orders import GradedOrder

(CASE,) = select(["primitives/sphere"])
AMOUNTS = (1e-2, 1e-4, 1e-6)


@pytest.mark.parametrize("quantity", QUANTITIES)
def test_every_quantity_is_noticed_and_in_float64_sooner(quantity: str) -> None:
    single, double = (
        work(GradedOrder(case=CASE, quantity=quantity, precision=precision, amounts=AMOUNTS)).smallest
        for precision in ("float32", "float64")
    )

    assert single
    assert set(single) <= set(double)
    assert all(double[stage] <= amount for stage, amount in single.items())
    assert min(double.values()) == AMOUNTS[-1]


def test_albedo_shows_after_irradiance_only() -> None:
    found = work(GradedOrder(case=CASE, quantity="albedo", precision="float32", amounts=AMOUNTS)).smallest

    assert set(found) == {"exitance", "radiance"}
