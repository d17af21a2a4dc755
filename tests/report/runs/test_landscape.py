"""Protects the energy landscape: curves are those of the stored proofs and runs."""

from fractions import Fraction

import numpy as np
import pytest
import yaml
from report.runs.stored import runs_of, store_proof
from support.made_runs import LARGEST_PITCH, V_START, made_config, made_file

from rbstab.config.load import load_config, resolved_yaml
from rbstab.proof.exact.expr import expr, variable
from rbstab.proof.model import Energy
from rbstab.proof.record import energy_record
from rbstab.report.model.figure import Level, Line, Points
from rbstab.report.runs.figures.landscape import landscape_figure

STIFFNESS = 6.0
BARRIER = {"kind": "guard", "method": "barrier", "stiffness": STIFFNESS}
LEVEL = 0.7


def config_text(barrier=False, *changes):
    """Return a config with a controller, and with a barrier if wanted."""
    data = yaml.safe_load(made_config(*changes)) | {"schema_version": 2}
    return resolved_yaml(load_config(data | {"elements": {"range": BARRIER} if barrier else {}}))


def energy(barrier):
    """Return the record of U = ½ |Θ|², J; with a barrier + ½ k tan² θ2 = ½ k (1/cos² θ2 - 1)."""
    squares = (variable(k) * variable(k) for k in range(3))
    U = sum(squares, expr(0)).scaled(Fraction(1, 2))
    if barrier:
        U = U + (variable(1).cos() ** -2 - 1).scaled(Fraction(STIFFNESS) / 2)
    return energy_record(Energy(U, closed=frozenset({1} if barrier else ())))


TEXTS = {
    "bare": (config_text(), False),
    "guarded": (config_text(barrier=True), True),
    "other": (config_text(False, "body.mass=50"), False),
}


@pytest.fixture
def paths(tmp_path):
    return [made_file(tmp_path / f"{name}.h5", text) for name, (text, _) in TEXTS.items()]


def test_without_a_proof_there_is_no_figure(paths):
    assert landscape_figure(runs_of(*paths)) is None


def test_a_body_with_and_without_a_barrier_has_one_panel(paths, tmp_path):
    """U = ½ |Θ|², whose least value along θ2 is ½ θ2²; the barrier adds 3 tan² θ2."""
    for text, barrier in TEXTS.values():
        store_proof(tmp_path, text, level=LEVEL, energy=energy(barrier))
    figure = landscape_figure(runs_of(*paths))
    assert figure is not None
    assert [panel.title for panel in figure.panels] == ["bare, guarded", "other"]
    assert len(figure.caption.split()) <= 40
    assert "Below c*" in figure.caption
    marks = figure.panels[0].marks
    lines = {mark.label: mark for mark in marks if isinstance(mark, Line)}
    least, walled = lines["least, without barrier"], lines["least, with barrier"]
    np.testing.assert_allclose(least.y, 0.5 * least.x**2, atol=1e-9)
    drawn = np.isfinite(walled.y)
    expected = 0.5 * walled.x**2 + 3.0 * np.tan(walled.x) ** 2
    np.testing.assert_allclose(walled.y[drawn], expected[drawn], rtol=1e-9, atol=1e-9)
    assert not drawn[[0, -1]].any()
    assert np.nanmax(walled.y) <= 1.15 * V_START
    for name in ("bare", "guarded"):
        assert (lines[name].x[0], lines[name].y[0]) == (LARGEST_PITCH, V_START)
    assert {mark.value for mark in marks if isinstance(mark, Level)} == {LEVEL}
    (rest,) = [mark for mark in marks if isinstance(mark, Points)]
    np.testing.assert_array_equal(rest.y, 0.0)
