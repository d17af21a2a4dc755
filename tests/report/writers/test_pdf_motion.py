"""Protects the motions of PDF reports: rows of poses."""

from dataclasses import replace

import numpy as np
import pytest
from report.writers.pdf_reports import MOTION, SOLID, read, report, text_of

from rbstab.report.model.document import Section
from rbstab.report.writers import pdf
from rbstab.report.writers.matplotlib_figures.stills import _row


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


def drawn_height(animation, others):
    """Return the height of the body in the first pose, in."""
    axes = _row(animation, others).axes[0]
    (body,) = axes.collections
    figure = axes.get_figure()
    assert figure is not None
    low, high = axes.get_ylim()
    places = np.concatenate([path.vertices for path in body.get_paths()])[:, 1]
    inches = axes.get_position().height * figure.get_figheight()
    return np.ptp(places) / (high - low) * inches


def test_equal_bodies_have_one_scale():
    """Up to the perspective: the camera looks at the middle of each motion."""
    far, near = far_and_near()
    alone = [drawn_height(motion, ()) for motion in (far, near)]
    assert alone[1] > 1.4 * alone[0]
    together = [drawn_height(motion, (far, near)) for motion in (far, near)]
    assert together[1] == pytest.approx(together[0], rel=0.1)


def test_other_bodies_and_motions_without_stills_have_scales_of_their_own():
    far, near = far_and_near()
    vertices = 2 * SOLID.vertices
    alone = drawn_height(near, ())
    for other in (replace(far, solid=replace(SOLID, vertices=vertices)), replace(far, stills=())):
        assert drawn_height(near, (other, near)) == alone


def test_a_report_gives_all_its_motions_to_each_row(monkeypatch):
    seen = []
    png = pdf.stills_png

    def spied(animation, others):
        seen.append((animation, list(others)))
        return png(animation, others)

    monkeypatch.setattr(pdf, "stills_png", spied)
    far, near = far_and_near()
    read(report(far, near))
    assert seen == [(far, [far, near]), (near, [far, near])]
