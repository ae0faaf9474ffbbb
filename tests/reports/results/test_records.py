"""The classes of records: what they name is documented, and what is documented is named."""

from rayproof.reports.judge import measurement
from rayproof.reports.results import case_records


def test_pixel_counts_have_a_number_for_each_kind_and_add_up() -> None:
    counts = case_records.Examined(wide=1, rounding=2, epsilon=3, wrong=4, unexamined=5, pixels=21)

    assert counts.strict == 6
    assert [kind.name.lower() for kind in measurement.Kind] == list(counts.counts)[1:]
    assert sum(counts.counts.values()) == 2 * counts.pixels
    assert (counts + counts).counts == {name: 2 * count for name, count in counts.counts.items()}
