"""Protects the summary of a run against the same numbers computed without shortcuts."""

import numpy as np
import pytest
from support.paper_runs import paper_config

import rbstab
from rbstab.analysis.peaks import signed_peak
from rbstab.experiment.summary import summary_of
from rbstab.mechanics.attitude import rate_matrix


@pytest.mark.parametrize("samples", [2, 3, 9, 41])
@pytest.mark.parametrize("spin", [[16, 32, -16], [-20, 5, 25], [0, -8, 0]])
def test_the_largest_pitch_is_that_of_all_cubics(samples, spin):
    """The summary computes rates only where θ2 can be largest; the result is the same."""
    config = paper_config("visco-elastic", duration=0.5, samples=samples, rtol=1e-8)
    config["initial"]["angular_velocity"] = spin
    result = rbstab.simulate(rbstab.load_config(config))
    Theta, Omega = result["orientation"], result["angular_velocity"]
    rates = np.array([(rate_matrix(a) @ w)[1] for a, w in zip(Theta, Omega, strict=True)])
    expected = abs(signed_peak(result["time"], Theta[:, 1], rates))
    assert summary_of(result).largest_pitch == expected
    assert expected >= np.abs(Theta[:, 1]).max()
