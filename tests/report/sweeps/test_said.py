"""Protects what reports of sweeps say: sentences, tables and figures, as in a stored file."""

import json

import pytest
from report.sweeps.said import FILE, SWEEPS, said


@pytest.mark.parametrize("name", SWEEPS)
def test_the_report_says_what_is_stored(tmp_path, name):
    stored = json.loads(FILE.read_text(encoding="utf-8"))[name]
    sections = json.loads(json.dumps(said(name, tmp_path / name)))
    assert [s["name"] for s in sections] == [s["name"] for s in stored]
    for section, other in zip(sections, stored, strict=True):
        # As texts, for NaN differs from itself.
        assert json.dumps(section, indent=1) == json.dumps(other, indent=1)
