"""Protects the colour scale of maps: both renderers use the same limits."""

import numpy as np
import pytest

from rbstab.report.model.figure import Axis, Cells, Figure, Panel
from rbstab.report.writers.matplotlib_figures import renderer as matplotlib_renderer
from rbstab.report.writers.plotly_figures import renderer as plotly_renderer


def figure_of(span, log):
    cells = Cells(np.arange(2.0), np.arange(1.0), np.array([[2.0, 5.0]]), Axis("z", log=log), span)
    return Figure("map", "Map", (Panel(Axis("x"), Axis("y"), (cells,)),))


@pytest.mark.parametrize("log", [False, True])
@pytest.mark.parametrize(("span", "expected"), [(None, (2.0, 5.0)), ((1.0, 100.0), (1.0, 100.0))])
def test_on_paper(span, log, expected):
    axes, *_ = matplotlib_renderer.draw_figure(figure_of(span, log)).axes
    (mesh,) = axes.collections
    assert mesh.get_clim() == expected


@pytest.mark.parametrize("log", [False, True])
@pytest.mark.parametrize(("span", "expected"), [(None, (2.0, 5.0)), ((1.0, 100.0), (1.0, 100.0))])
def test_on_a_page(span, log, expected):
    scale = plotly_renderer.plotly_data(figure_of(span, log))["layout"]["coloraxis"]
    ends = np.log10(expected) if log else expected
    assert (scale["cmin"], scale["cmax"]) == pytest.approx(tuple(ends))
