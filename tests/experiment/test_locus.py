"""Protects root loci: one gain is scaled, and the eigenvalues form continuous curves."""

import numpy as np
import pytest
from support.paper_runs import paper_config

import rbstab
from rbstab.experiment.along.locus import root_locus
from rbstab.experiment.along.parameter import Parameter


def config_of(variant, **changes):
    return rbstab.load_config(paper_config(variant, with_gravity=True, **changes))


def test_a_gain_is_scaled_as_a_whole_and_nothing_else():
    config = config_of("permanent")
    changed = Parameter("controller.K_r", np.array([0.1])).at(config, 0.1)
    assert changed.controller.K_r == pytest.approx(tuple(0.1 * k for k in config.controller.K_r))
    assert changed.controller.K_t == config.controller.K_t
    assert changed.body == config.body
    assert Parameter("body.mass", np.array([2.0])).at(config, 2.0).body.mass == 82.0


def linearisation_at(point):
    assert point.linearisation is not None
    return point.linearisation


@pytest.mark.parametrize("variant", ["free", "permanent", "visco-elastic", "embedded"])
def test_the_locus_passes_through_the_nominal_point(variant):
    config = config_of(variant)
    points = root_locus(config, Parameter("controller.L_r", np.geomspace(0.1, 10, 21)))
    assert all(point.linearisation for point in points)
    (nominal_point,) = root_locus(config, Parameter("controller.L_r", np.array([1.0])))
    nominal = linearisation_at(nominal_point).eigenvalues
    middle = linearisation_at(points[10]).eigenvalues
    assert np.sort_complex(middle) == pytest.approx(np.sort_complex(nominal), abs=1e-6)


def test_the_curves_go_on_from_point_to_point():
    points = root_locus(config_of("free"), Parameter("controller.L_r", np.geomspace(0.5, 2, 101)))
    linearisations = [linearisation_at(point) for point in points]
    eigenvalues = np.array([linear.eigenvalues for linear in linearisations])
    for linear in linearisations:
        expected = linear.modes * linear.eigenvalues
        assert linear.matrix @ linear.modes == pytest.approx(expected, abs=1e-6)
    steps = np.abs(np.diff(eigenvalues, axis=0))
    # Away from branch points, each step of a curve is as small as the change of the gain.
    assert np.median(steps) < 0.02 * np.abs(eigenvalues).max()
    assert (steps < 0.2 * np.abs(eigenvalues).max()).all()
    # L_r does not act on the translation of the free body: three pairs do not move.
    moved = np.ptp(eigenvalues.real, axis=0) + np.ptp(eigenvalues.imag, axis=0)
    assert (moved < 1e-6).sum() == 6
