"""Protects the comparison of a proof's energy with the equations, evaluated in balls."""

from functools import partial

import numpy as np
import pytest
from support.paper_runs import CASE_NAMES, CASES, paper_config

import rbstab
from rbstab.analysis.proof.reduced_energy import reduced_energy
from rbstab.analysis.proof_check.equations import agrees_with_equations
from rbstab.config.build import system_of


@pytest.mark.parametrize(("variant", "with_gravity"), CASES, ids=CASE_NAMES)
def test_each_coefficient_is_seen(variant: str, with_gravity: bool) -> None:
    config = rbstab.load_config(paper_config(variant, with_gravity))
    exact = partial(system_of, config)
    form = reduced_energy(system_of(config), exact).form
    energy = {
        "quadratic": form.quadratic.tolist(),
        "linear": form.linear.tolist(),
        "coefficients": form.coefficients.tolist(),
    }
    assert agrees_with_equations(energy, exact)
    scale = np.abs(form.quadratic).max()
    for place in ("quadratic", "linear", "coefficients"):
        values = np.array(energy[place])
        # The largest entry, and the first one, which may be 0.
        for index in [np.unravel_index(np.abs(values).argmax(), values.shape), (0,) * values.ndim]:
            other = values.copy()
            other[index] += 1e-9 * scale
            if place == "quadratic":
                other = (other + other.T) / 2
            changed = {**energy, place: other.tolist()}
            assert not agrees_with_equations(changed, exact)
