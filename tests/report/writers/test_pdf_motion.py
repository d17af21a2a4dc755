"""Protects the motions of PDF reports: rows of poses."""

from dataclasses import replace

import numpy as np
import pytest
from report.writers.pdf_reports import MOTION, SOLID, read, report, text_of

from rbstab.report.model.document import Section
from rbstab.report.writers.matplotlib_figures.renderer import WIDTH
from rbstab.report.writers.matplotlib_figures.stills import _row, stills_png
from rbstab.report.writers.write import write_report


def test_a_motion_without_stills_is_left_out_with_a_sentence():
    motion = replace(MOTION, stills=())
    assert "animates the motion of case 1" in text_of(read(report(motion)))


def test_a_motion_is_shown_as_stills():
    reader = read(report(MOTION))
    (page,) = [page for page in reader.pages if page.images]
    assert len(page.images) == 1
    text = text_of(reader)
    assert "Motion of case 1: poses at the times shown." in text
    assert "green: anchor" in text


def test_the_first_block_of_a_section_is_a_motion_on_the_page_of_its_heading():
    for lines in range(14, 28, 2):
        sections = (
            Section("a", "Before", ("Line.",) * lines),
            Section("b", "The heading", (MOTION,)),
        )
        pages = read(replace(report(), sections=sections)).pages
        (page,) = [page for page in pages if "The heading" in page.extract_text()]
        assert len(page.images) == 1


def far_and_near():
    """Return a motion that goes far, and one of the same body that stays."""
    far = replace(MOTION, positions=np.array([[0.0, 0, 0], [0, 3, 0]]))
    return far, MOTION


def metres_per_inch(animation, others):
    """Return the scale of the poses at the middle of the view, by the bar that shows it."""
    axes = _row(animation, others).axes[-1]
    (label,) = [text.get_text() for text in axes.texts if text.get_text().endswith(" m")]
    bar = axes.lines[-1].get_xdata()
    return float(label.removesuffix(" m")) / (np.ptp(bar) * axes.get_position().width * WIDTH)


def test_equal_bodies_have_one_scale():
    far, near = far_and_near()
    alone = [metres_per_inch(motion, ()) for motion in (far, near)]
    assert alone[0] > 1.4 * alone[1]
    together = [metres_per_inch(motion, (far, near)) for motion in (far, near)]
    assert together[1] == pytest.approx(together[0])


def test_other_bodies_and_motions_without_stills_have_scales_of_their_own():
    far, near = far_and_near()
    vertices = 2 * SOLID.vertices
    alone = metres_per_inch(near, ())
    for other in (replace(far, solid=replace(SOLID, vertices=vertices)), replace(far, stills=())):
        assert metres_per_inch(near, (other, near)) == alone


@pytest.mark.parametrize("form", ["pdf", "md"])
def test_a_report_gives_all_its_motions_to_each_row(form, monkeypatch, tmp_path):
    seen = []

    def spied(animation, others, **options):
        seen.append((animation, list(others)))
        return stills_png(animation, others, **options)

    for module in ("pdf", "matplotlib_figures.stills"):
        monkeypatch.setattr(f"rbstab.report.writers.{module}.stills_png", spied)
    far, near = far_and_near()
    write_report(report(far, near), tmp_path / f"a.{form}", form)
    assert seen == [(far, [far, near]), (near, [far, near])]
