"""Protects the energy along θ2 that reports draw: no point with this θ2 has less."""

from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import pytest
from scipy.optimize import minimize

from rbstab.analysis.configuration import configurations
from rbstab.analysis.proof.guards.barrier import BarrierEnergy
from rbstab.analysis.proof.guards.guard import Guard
from rbstab.analysis.proof.reduced_energy import reduced_energy
from rbstab.analysis.proof.regions.profile import least_along_pitch
from rbstab.config.build import problem_of, system_of
from rbstab.config.load import load_config

PAPER = Path(__file__).parents[4] / "configs" / "paper"
PITCH = np.array([-np.pi / 2, -1.3, -0.4, 0.0, 0.8, 1.5])


@pytest.mark.parametrize("gains", ["[400, 400, 320]", "[120, 120, 96]"])
def test_no_start_of_scipy_ends_lower(gains):
    config = load_config(PAPER / "case1_permanent.yaml", [f"controller.K_r={gains}"])
    at_rest = configurations(problem_of(config).system)
    form = reduced_energy(problem_of(config).system, partial(system_of, config)).form
    rng = np.random.default_rng(5)
    for pitch, least in zip(PITCH, least_along_pitch(form, PITCH), strict=True):
        found = []
        for _ in range(6):
            q = np.array([rng.uniform(-5, 5), pitch, rng.uniform(-5, 5)])
            fixed = [(None, None), (pitch, pitch), (None, None)]
            found.append(minimize(at_rest.energy, q, jac=at_rest.gradient, bounds=fixed).fun)
        assert least == pytest.approx(min(found), rel=1e-5, abs=1e-5)


def test_a_barrier_is_added():
    config = load_config(PAPER / "case1_permanent.yaml")
    form = reduced_energy(problem_of(config).system, partial(system_of, config)).form
    bare = least_along_pitch(form, PITCH[1:])
    guarded = least_along_pitch(replace(form, guard=Guard(BarrierEnergy(7.0))), PITCH[1:])
    np.testing.assert_allclose(guarded - bare, 3.5 * np.tan(PITCH[1:]) ** 2, rtol=1e-9, atol=1e-9)
