"""Protects the soak, and with it sweeps on a cluster whose workers are killed all the time."""

import pytest
from support.soak import MAX_GROWTH, Soaked, soak


@pytest.mark.slow
def test_a_small_soak(tmp_path):
    pytest.importorskip("heyoka")
    lines: list[str] = []
    found = soak(tmp_path, 30_000, 1.0, lines.append)
    assert found.problems == []
    assert lines[0].endswith("30000 members without kills")


@pytest.mark.parametrize(
    ("found", "problem"),
    [
        (Soaked(1.0, 1, {"sweep": int(MAX_GROWTH) + 1_000_000}, equal=True), "the sweep grew by"),
        (Soaked(1.0, 1, {"sweep": 0}, equal=False), "the results differ"),
        (Soaked(1.0, 0, {"sweep": 0}, equal=True), "no worker was killed"),
    ],
)
def test_what_a_soak_complains_about(found, problem):
    (only,) = found.problems
    assert only.startswith(problem)
