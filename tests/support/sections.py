"""Checks that hold for the sections of every report, and readers of their figures and tables."""

import numpy as np

from rbstab.report.model.document import Table
from rbstab.report.model.figure import Cells, Figure, Line, Points
from rbstab.report.sweeps.sections import sweep_part


def check_sections(sections):
    """Assert that sections are complete: unique names, matching shapes, no empty first cells."""
    sections = tuple(sections)
    blocks = [block for section in sections for block in section.blocks]
    named = [*sections, *(block for block in blocks if not isinstance(block, str))]
    names = [item.name for item in named]
    assert len(set(names)) == len(names)
    assert all(name == name.lower().replace(" ", "") for name in names)
    assert all(section.blocks for section in sections)
    for block in blocks:
        if isinstance(block, Table):
            assert block.rows
            assert {len(row) for row in block.rows} == {len(block.heads)}
            assert all(cell.text for row in block.rows for cell in row[:1])
        elif isinstance(block, Figure):
            _check_figure(block)


def _check_figure(figure):
    assert figure.panels
    for panel in figure.panels:
        for mark in panel.marks:
            if isinstance(mark, Cells):
                assert mark.values.shape == (len(mark.y), len(mark.x))
                assert (np.diff(mark.x) > 0).all()
                assert (np.diff(mark.y) > 0).all()
                if mark.scale.categories:
                    seen = mark.values[np.isfinite(mark.values)]
                    assert set(seen.tolist()) <= set(range(len(mark.scale.categories)))
            elif isinstance(mark, Line | Points):
                assert len(mark.x) == len(mark.y)


def figures_in(sections):
    """Return all figures by name; the names must be unique."""
    blocks = [block for section in sections for block in section.blocks]
    figures = [block for block in blocks if isinstance(block, Figure)]
    by_name = {figure.name: figure for figure in figures}
    assert len(by_name) == len(figures), "names of figures are not unique"
    return by_name


def tables(sections):
    """Return all tables by name."""
    blocks = [block for section in sections for block in section.blocks]
    return {block.name: block for block in blocks if isinstance(block, Table)}


def texts(table):
    """Return the text of each cell, row by row."""
    return [[cell.text for cell in row] for row in table.rows]


def sweep_sections(sweep):
    """Return the sections on the only sweep of a report, with its card."""
    return sweep_part(sweep, alone=True).sections
