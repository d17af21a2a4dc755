"""The held body is the limit of a stiff connector."""

from typing import Any

import numpy as np
from support.paper_runs import paper_config, reference_case

import rbstab


def test_held_body_is_the_limit_of_a_stiff_connector():
    held = reference_case("permanent", with_gravity=True)
    sampling: dict[str, Any] = {"engine": "heyoka", "duration": 1.0, "samples": 11}
    limit = rbstab.simulate(paper_config("permanent", with_gravity=True, **sampling))
    errors = []
    for stiffness in (4e6, 8e6, 16e6, 32e6):
        # Strong damping prevents oscillation, so that only the connector's slow creep remains.
        gains = {
            "L_t": held["params"]["Lt"],
            "K_c": [stiffness] * 3,
            "L_c": [stiffness / 100] * 3,
        }
        start = {"velocity": held["initial"]["V"]}
        config = paper_config(
            "visco-elastic", with_gravity=True, controller=gains, initial=start, **sampling
        )
        tied = rbstab.simulate(config)
        names = ("orientation", "angular_velocity", "position", "contact_force")
        errors.append([np.abs(tied[name] - limit[name])[1:].max() for name in names])
    ratios = np.array(errors[:-1]) / np.array(errors[1:])
    # The error is of first order in 1/K: each doubling of K halves it.
    np.testing.assert_allclose(ratios, 2.0, rtol=0.02)
