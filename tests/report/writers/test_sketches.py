"""Sketches as SVG: points where they belong, gaps, texts that cannot break the page."""

import re
from xml.etree import ElementTree

import numpy as np
import pytest

from rbstab.report.model.document import Sketch
from rbstab.report.model.palette import COLOURS
from rbstab.report.writers.sketches import HEIGHT, WIDTH, svg

SVG = "{http://www.w3.org/2000/svg}"


def drawn(sketch):
    """Return the curves of a sketch as SVG paths, without the frame."""
    root = ElementTree.fromstring(svg(sketch))  # noqa: S314 (our own text)
    _, *curves = root.findall(f"{SVG}path")
    return root, curves


def test_the_unit_square_fills_the_frame():
    curve = np.array([[0.0, 1.0], [1.0, 0.0]])
    marks = np.array([[0.5, 0.25]])
    root, (path,) = drawn(Sketch("a", (("", curve),), marks))
    assert path.get("d") == f"M0.0 0.0L{WIDTH:.1f} {HEIGHT:.1f}"
    (dot,) = root.findall(f"{SVG}circle")
    assert (dot.get("cx"), dot.get("cy")) == (f"{WIDTH / 2:.1f}", f"{0.75 * HEIGHT:.1f}")


def test_a_gap_is_not_closed_and_no_peak_is_cut():
    x = np.linspace(0, 1, 1001)
    y = np.zeros(1001)
    y[250], y[600:700] = 1.0, np.nan
    _, (path,) = drawn(Sketch("a", (("", np.column_stack([x, y])),)))
    text = path.get("d")
    assert text.count("M") == 2
    numbers = [float(n) for n in re.findall(r"[-\d.]+", text)]
    assert 0.0 in numbers[1::2]
    assert len(numbers) / 2 <= WIDTH


def test_each_curve_has_its_colour():
    curve = np.array([[0.0, 0.0], [1.0, 1.0]])
    _, paths = drawn(Sketch("a", (("first", curve), ("second", curve))))
    assert [path.get("stroke") for path in paths] == list(COLOURS[:2])


@pytest.mark.parametrize(
    ("ends", "words"),
    [
        ({}, 'a < b & "c".'),
        (
            {"x_ends": ("0 s", "2 s"), "y_ends": ("0", "7 J")},
            'a < b & "c". From 0 to 7 J, over 0 s to 2 s.',
        ),
    ],
)
def test_those_who_do_not_see_it_are_told_what_it_shows(ends, words):
    root, _ = drawn(Sketch('a < b & "c".', (("", np.zeros((2, 2))),), **ends))
    assert root.get("aria-label") == words
