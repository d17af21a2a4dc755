"""Protects the colours of answers: with any colour vision they can be told apart, on any page."""

from itertools import combinations

import numpy as np
import pytest

from rbstab.report.model.palette import ANSWERS, COLOURS, colour, contrast
from rbstab.report.sweeps.members import OUTCOME_COLOURS

VISION = {
    "normal": np.eye(3),
    "no red": np.array(
        [
            [0.152286, 1.052583, -0.204868],
            [0.114503, 0.786281, 0.099216],
            [-0.003882, -0.048116, 1.051998],
        ]
    ),
    "no green": np.array(
        [
            [0.367322, 0.860646, -0.227968],
            [0.280085, 0.672501, 0.047413],
            [-0.011820, 0.042940, 0.968881],
        ]
    ),
    "no blue": np.array(
        [
            [1.255528, -0.076749, -0.178779],
            [-0.078411, 0.930809, 0.147602],
            [0.004733, 0.691367, 0.303900],
        ]
    ),
}
"""How linear red, green and blue look without a kind of cones (Machado et al., 2009)."""

XYZ = np.array([[0.4124, 0.3576, 0.1805], [0.2126, 0.7152, 0.0722], [0.0193, 0.1192, 0.9505]])
"""CIE XYZ of linear sRGB."""


def linear(tone):
    """Return the linear red, green and blue of a colour of sRGB."""
    shares = np.array([*bytes.fromhex(tone[1:])]) / 255
    return np.where(shares <= 0.04045, shares / 12.92, ((shares + 0.055) / 1.055) ** 2.4)


def lab(tone, vision):
    """Return a colour in CIE L*a*b*, where distances are about those that people see."""
    seen = XYZ @ np.clip(vision @ linear(tone), 0, 1) / XYZ.sum(axis=1)
    root = np.where(seen > 0.008856, np.cbrt(seen), 7.787 * seen + 16 / 116)
    return np.array([116 * root[1] - 16, 500 * (root[0] - root[1]), 200 * (root[1] - root[2])])


def distance(tone, other, vision):
    return float(np.linalg.norm(lab(tone, vision) - lab(other, vision)))


@pytest.mark.parametrize("vision", VISION.values(), ids=VISION)
def test_answers_can_be_told_apart(vision):
    for tone, other in combinations(ANSWERS.values(), 2):
        assert distance(tone, other, vision) > 23, (tone, other)


@pytest.mark.parametrize("vision", VISION.values(), ids=VISION)
def test_outcomes_can_be_told_apart(vision):
    tones = [ANSWERS[number] for number in OUTCOME_COLOURS]
    for tone, other in combinations(tones, 2):
        assert distance(tone, other, vision) > 28, (tone, other)


@pytest.mark.parametrize("page", ["#FFFFFF", "#14181C"])
def test_answers_show_on_a_page(page):
    for tone in ANSWERS.values():
        assert distance(tone, page, VISION["normal"]) > 12, tone


@pytest.mark.parametrize("number", [*ANSWERS, *range(len(COLOURS))])
def test_numbers_on_a_colour_are_in_the_tone_with_more_contrast(number):
    """The contrast of WCAG 2: of both tones, the larger one, which is at least 4.5."""
    luminance = float(XYZ[1] @ linear(colour(number)))
    ratios = {"#FFFFFF": 1.05 / (luminance + 0.05), "#000000": (luminance + 0.05) / 0.05}
    assert contrast(number) == max(ratios, key=lambda tone: ratios[tone])
    assert max(ratios.values()) > 4.5
