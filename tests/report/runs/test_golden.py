"""Holds what reports say of the paper's runs and of those of the leg, through changes of the code.

`support.golden_report` writes the file; its numbers were made before the report was rewritten.
"""

import json

import pytest
from support.golden_report import GOLDEN, make, said_of

SAID = json.loads(GOLDEN.read_text(encoding="utf-8"))

SMALLEST = 1e-9
"""Numbers below this are round-off, in m, rad, J, and as a share of the largest energy."""


@pytest.fixture(scope="module")
def said(tmp_path_factory):
    return said_of(make(tmp_path_factory.mktemp("golden")))


@pytest.mark.parametrize("run", SAID)
def test_what_is_said_of_a_run(run, said):
    assert set(said[run]) == set(SAID[run])
    for name, value in SAID[run].items():
        if isinstance(value, float):
            # Other processors round otherwise; the error of an integration is 1e-8 or less.
            assert said[run][name] == pytest.approx(value, rel=1e-6, abs=SMALLEST, nan_ok=True), (
                name
            )
        else:
            assert said[run][name] == value, name
