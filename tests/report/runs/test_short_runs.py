"""Protects the figures of runs that ended at once, diverged, or hold numbers no axis can show."""

import numpy as np
import pytest
from support.figure_runs import (
    KINDS,
    cut,
    lines_of,
    run_of,
    with_arrays,
    without_config,
)
from support.sections import figures_in

from rbstab.report.runs.sections import figures_section
from rbstab.report.writers.decimate import decimate
from rbstab.report.writers.figure_files import figure_bytes


def figures_of(*runs):
    """Return all figures of runs except eigenvalues, and decimate each of them."""
    figures = figures_in([figures_section([without_config(run) for run in runs])])
    for figure in figures.values():
        assert len(decimate(figure).panels) == len(figure.panels)
    return figures


def drawn(figures):
    assert all(figure_bytes(figure, "svg").startswith(b"<svg") for figure in figures.values())


@pytest.mark.parametrize("kind", KINDS)
def test_one_sample(kind):
    figures = figures_of(cut(run_of(kind), 1))
    assert all(len(line.x) == 1 for line in lines_of(figures["runs-decay"].panels[0]))
    drawn({name: figures[name] for name in ("runs-decay", "run-1-energy")})


def with_broken_half(run, value):
    """Return the same run, with `value` in place of all numbers from its middle on."""
    changed = {}
    for name, variable in run.result.variables.items():
        if variable.dimensions[:1] == ("time",) and name not in ("time", "mode"):
            data = variable.data.astype(float)
            data[len(data) // 2 :] = value
            changed[name] = data
    return with_arrays(run, **changed)


@pytest.mark.slow
@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, 1e308, 5e-324, 0.0])
def test_odd_numbers(value):
    drawn(figures_of(with_broken_half(run_of("embedded"), value)))


@pytest.mark.slow
def test_nothing_but_odd_numbers():
    run = run_of("sliding")
    nothing = {
        name: np.full(run.result[name].shape, np.nan)
        for name in ("lyapunov", "energy", "orientation", "chatter_energy", "energy_residual")
    }
    figures = figures_of(with_arrays(run, **nothing), run_of("free", 1))
    drawn(figures)


def test_a_trust_that_is_not_known():
    figures = figures_of(with_arrays(run_of("sliding"), trusted_until=np.array(np.nan)))
    drawn({"run-1-events": figures["run-1-events"]})
