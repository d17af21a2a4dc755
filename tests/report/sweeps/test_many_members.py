"""Counts of 10,000 members and more have separators; what is typed or read by programs has none."""

import re

import numpy as np
import pytest
from support.made_sweeps import SPIN, code, write_sweep

from rbstab.report.build import report_of
from rbstab.report.model.document import Table
from rbstab.report.reading.sources import read_sources

MANY = {f"{SPIN}[0]": {"linspace": [-2, 2, 300]}, f"{SPIN}[1]": {"linspace": [0, 30, 100]}}
"""30,000 members."""

BARE = re.compile(r"(?<![\w.,-])[1-9]\d{4,}(?![\w.])")
"""A whole number of five digits and more without separators."""


def columns(found):
    """Let 11,000 members settle and 12,000 not, and end 7,000 early."""
    k = found["run"]
    return {
        "status": np.where(k < 23_000, code("completed"), code("range left")).astype(np.int8),
        "settling_time": np.where(k < 11_000, 1.0, np.nan),
        "smallest_regularity": np.where(k > 22_000, 0.1, 0.9),
    }


@pytest.fixture(scope="module")
def report(tmp_path_factory):
    path = write_sweep(tmp_path_factory.mktemp("many") / "members.h5", MANY, columns).path
    return report_of(read_sources([path]), "again")


def blocks_of(report):
    return [block for section in report.sections for block in section.blocks]


def texts_of(report):
    """Return the sentences, and what tables show, without commands."""
    for block in blocks_of(report):
        if isinstance(block, str):
            yield block
        elif isinstance(block, Table):
            yield from (cell.text for row in block.rows for cell in row if not cell.command)


def test_counts_have_separators(report):
    texts = " | ".join(texts_of(report))
    for count in ("30,000", "11,000", "12,000", "300 x 100 = 30,000"):
        assert count in texts
    assert "7000" in texts
    # Members are named by their numbers, as commands take them.
    assert not BARE.findall(re.sub(r"members? \d[\d, to]*", "", texts))


def test_numbers_of_members_have_none(report):
    notable = next(
        block for block in blocks_of(report) if isinstance(block, Table) and "notable" in block.name
    )
    numbers = [int(row[0].text) for row in notable.rows]
    assert max(numbers) > 9999
    assert numbers == [row[0].value for row in notable.rows]
    assert all(row[0].command.endswith(f" {row[0].text}") for row in notable.rows)
