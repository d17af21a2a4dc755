"""Protects the soak, and with it sweeps on a cluster whose workers are killed all the time."""

import pytest
from support.soak import MAX_FINISHING, MAX_GROWTH, Soaked, soak


@pytest.mark.slow
def test_a_small_soak(tmp_path):
    pytest.importorskip("heyoka")
    lines: list[str] = []
    outcome = soak(tmp_path, 30_000, 1.0, lines.append)
    assert outcome.problems == []
    assert lines[0].endswith("30000 members without kills")


def soaked(**changes):
    """Return a soak without problems, changed."""
    good = {"kills": 1, "growth": {"sweep": 0}, "finishing": {"sweep": 0}, "equal": True}
    return Soaked(seconds=1.0, file_size=2_000_000, **{**good, **changes})


@pytest.mark.parametrize(
    ("outcome", "problem"),
    [
        (soaked(growth={"sweep": int(MAX_GROWTH) + 1_000_000}), "the sweep grew by"),
        (soaked(finishing={"sweep": int(MAX_FINISHING) + 5_000_000}), "the sweep needed 85 MB to"),
        (soaked(equal=False), "the results differ"),
        (soaked(kills=0), "no worker was killed"),
    ],
)
def test_what_a_soak_complains_about(outcome, problem):
    (only,) = outcome.problems
    assert only.startswith(problem)
