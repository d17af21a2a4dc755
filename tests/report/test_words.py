"""Numbers and their units stay on one line."""

import pytest

from rbstab.report.model.words import unbroken


@pytest.mark.parametrize(
    "text",
    [
        "gust.amplitude =_20_N_m, gust.amplitude =_-30_N_m",
        "v falls to t_=_4_s; then it rises.",
        "The body can rest at Θ_=_(1.977, 1.534, 2.718)_rad; it has 2 rest states.",
        "away from θ2_=_±π/2",
        # A line may break after a bar, even before such a space.
        "|θ2| <_π/2_rad",
        "this median is between 0.02424_s and 0.03843_s",
        "with v(0) below 616.763_J. v(0)_< c*",
        "a damper of 20_N_m_s/rad, a mass of 5_kg, 2_m/s, ±20_%",
        "inertia [kg_m^2], damping [N_s/m], frequency [1/s]",
    ],
)
def test_numbers_keep_their_units(text):
    assert unbroken(text.replace("_", " ")) == text.replace("_", "\u00a0")


@pytest.mark.parametrize(
    "text",
    [
        "5 members, 3 sweeps and 1 run",
        "In the same 30 cases, only one of 2 conditions",
        "variant = free, a - b",
        "member 7 of 9 was not",
        "",
    ],
)
def test_other_texts_are_the_same(text):
    assert unbroken(text) == text
