"""The vectors as files: the same to the last bit everywhere, with numbers that come back."""

import csv
import hashlib
import re

import msgspec
import numpy as np
import pytest

from rayproof.cases.ladders import all_ladders
from rayproof.reports.vectors import NO_FILE, SLOTS_OF
from rayproof.reports.vectors.check import FILES, VERSION
from rayproof.reports.vectors.files import VectorsRecord, contents, flat, number
from rayproof.reports.vectors.rows import LADDERS, everything
from rayproof.tracer.formulas import STAGE_OF
from tests.harness.choose_vectors import chosen


@pytest.fixture(scope="module")
def texts() -> dict[str, str]:
    return contents()


def test_every_slot_has_a_file_but_two() -> None:
    assert set(STAGE_OF) - {slot for slots in SLOTS_OF.values() for slot in slots} == set(NO_FILE)
    assert set(SLOTS_OF) == set(FILES)


def test_ids_begin_with_the_version_and_occur_once(texts: dict[str, str]) -> None:
    ids = [
        line.partition(",")[0]
        for name, text in texts.items()
        if name.endswith(".csv")
        for line in text.split("\n")[1:-1]
    ]

    assert len(ids) == len(set(ids)) == len(everything()[0]) + len(everything()[1])
    assert all(re.fullmatch(rf"{VERSION}-[a-z_]+-\d{{3}}", identity) for identity in ids)


def test_inputs_are_float32_numbers_and_come_back() -> None:
    for identity, row in everything()[0].items():
        for name, value in row.inputs.items():
            for cell in flat(name, value).values():
                if not isinstance(cell, str) and np.isfinite(cell):
                    assert float(np.float32(cell)) == cell == float(f"{cell:.17g}"), (identity, name)
                    assert np.signbit(float(f"{cell:.17g}")) == np.signbit(cell)


def test_the_record_reads_back_and_holds_the_digests(texts: dict[str, str]) -> None:
    record = msgspec.json.decode(texts["vectors.json"], type=VectorsRecord)
    tables = {name: text for name, text in texts.items() if name.endswith(".csv")}

    assert record.sha256 == hashlib.sha256("".join(tables[name] for name in sorted(tables)).encode()).hexdigest()
    for name, file in record.files.items():
        rows = list(csv.DictReader(texts[f"{name}.csv"].splitlines()))
        assert file.sha256 == hashlib.sha256(texts[f"{name}.csv"].encode()).hexdigest()
        assert [row["id"] for row in rows] == [row["id"] for row in file.rows]
        for row, kept in zip(rows, file.rows, strict=True):
            assert {k: number(v) if isinstance(v, float) else v for k, v in kept.items()} == {k: row[k] for k in kept}


def test_rays_of_ladders_are_those_that_would_be_chosen_again() -> None:
    from rayproof.reports.vectors.rows import CHOSEN

    ladder = next(ladder for ladder in all_ladders() if ladder.name == "SPH-TAN")

    assert chosen(ladder) == msgspec.json.decode(CHOSEN.read_bytes())[ladder.name]
    assert {one.name for one in LADDERS} == set(msgspec.json.decode(CHOSEN.read_bytes()))
