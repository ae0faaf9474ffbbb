"""One entry as bytes: it comes back as it was written, and whatever was altered is noticed."""

from typing import Any

import numpy as np
import pytest

from rayproof.reports.run.cache_store import DamagedEntryError, decode, encode

SIGNED: Any = {"question": "a"}
ARRAYS = {
    "float32 inside": np.array([[0.1, -0.0], [np.nan, np.inf]], dtype=np.float32).astype(np.float64),
    "float64": np.array([0.1, 1e300, 5e-324]),
    "bool": np.array([[True, False]]),
    "whole": np.arange(6).reshape(2, 3),
    "empty": np.zeros((0, 3)),
}


def test_an_entry_comes_back_to_the_last_bit_and_type():
    about, arrays = decode(encode({"key": "a"}, ARRAYS, **SIGNED), **SIGNED)

    assert about == {"key": "a"}
    for name, array in ARRAYS.items():
        assert arrays[name].dtype == array.dtype
        assert arrays[name].shape == array.shape
        assert arrays[name].tobytes() == array.tobytes()


@pytest.mark.parametrize("place", [0, 20, 60, -1], ids=["magic", "signature", "header", "array"])
def test_any_byte_altered_is_noticed(place):
    data = bytearray(encode({"key": "a"}, ARRAYS, **SIGNED))
    data[place] ^= 1

    with pytest.raises(DamagedEntryError):
        decode(bytes(data), **SIGNED)
