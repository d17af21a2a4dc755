"""Warnings about the motion at the start: a spring that a spin winds up, a motion too fast."""

import numpy as np
import pytest

import rbstab
from rbstab.analysis.start_warnings import start_warnings
from rbstab.config.build import problem_of

TOP = {
    "body": {"mass": 0.5, "inertia": [0.0015, 0.0015, 0.0004], "contact_point": [0, 0, -0.06]},
    "gravity": [0, 0, -9.81],
    "controller": {"variant": "permanent", "K_r": [1e-6, 1e-6, 1e-6]},
    "initial": {"orientation": [0.001, 0, 0], "angular_velocity": [0, 0, 160]},
    "integration": {"duration": 10},
}


def warnings_of(config):
    return start_warnings(problem_of(config), config.integration.engine)


# Half a turn stores ½ k π²; the spin has ½ 0.0004 160² = 5.1 J and stops after 0.0004/L_r s.
WINDING = [
    ([], True),
    (["controller.K_r=0"], False),
    (["controller.K_r=[0,0,0.02]"], False),
    (["initial.angular_velocity=[0,0,0]"], False),
    (["integration.duration=0.01"], False),
    (["controller.L_r=[0,0,1e-3]"], True),
    (["controller.L_r=[0,0,1]"], False),
    (["gravity=[0,0,0]", "initial.angular_velocity=[50,0,0]"], True),
    # Upright, it falls over the other side; hanging, it is too slow to go over the top.
    (["initial.angular_velocity=[5,0,0]"], True),
    (["initial.angular_velocity=[5,0,0]", "body.contact_point=[0,0,0.06]"], False),
]


@pytest.mark.parametrize(("changes", "warned"), WINDING)
def test_a_spring_that_hardly_acts_and_is_wound_up(changes, warned):
    warnings = warnings_of(rbstab.load_config(TOP, changes))
    assert len(warnings) == warned
    if warned:
        assert warnings[0].startswith("controller.K_r: the spin winds θ")
        assert warnings[0].endswith("set K_r to 0 or leave it out")


# A body of 2 kg that is tied by K at its centre of mass: ω = √(K/2), in 3 s.
TIED = {
    "body": {"mass": 2.0, "inertia": [0.1, 0.1, 0.1], "contact_point": [0, 0, 0]},
    "controller": {
        "variant": "visco-elastic",
        "K_c": [100, 100, 100],
        "L_c": [1, 1, 1],
        "K_r": [1, 1, 1],
        "L_r": [0.1, 0.1, 0.1],
    },
    "integration": {"duration": 3.0},
}

FAST = [
    ([], None),
    (["controller.K_c=[100,100,4e12]"], ("controller.K_c", 1 / np.sqrt(2e12))),
    (["controller.K_r=[1e9,1,1]"], ("controller.K_r", 1 / np.sqrt(1e10))),
    (["controller.K_r=[1e9,1,1]", "integration.engine=heyoka"], None),
    (["controller.K_c=[100,100,4e12]", "integration.engine=heyoka"], ("controller.K_c", 7.1e-7)),
    (["controller.L_c=[1e7,1,1]"], ("controller.L_c", 2 / 1e7)),
    (["controller.L_c=[1e7,1,1]", "integration.method=Radau"], None),
    (["controller.K_r=[1e9,1,1]", "integration.method=LSODA"], ("controller.K_r", 1e-5)),
    (["body.mass=1e-9"], ("controller.L_c", 1e-9)),
]


@pytest.mark.parametrize(("changes", "expected"), FAST)
def test_a_time_scale_that_makes_a_run_hopeless(changes, expected):
    warnings = warnings_of(rbstab.load_config(TIED, changes))
    assert len(warnings) == (expected is not None)
    if expected is not None:
        key, scale = expected
        assert warnings[0].startswith(
            f"{key}: the fastest motion has a time scale of {scale:.2g} s"
        )


def test_a_time_constant_that_is_too_short_is_named():
    """Its half would not slow the motion down."""
    tie = {"kind": "coactivated", "point": [0, 0, 0.1], "anchor": [0, 0, 0.1], "excitation": 0.5}
    tie |= {"K_c": [10.0] * 3, "L_c": [1.0] * 3, "amplitude": 0, "signal": {"kind": "constant"}}
    tie |= {"activation_time": 0.01, "deactivation_time": 1e-7}
    config = rbstab.load_config(TIED | {"schema_version": 2, "elements": {"muscles": tie}})
    (warning,) = warnings_of(config)
    # Half of each way, at z = 1/2 + 3/4.
    scale = 1 / (0.5 * 1.25 / 1e-7 + 0.5 / (0.01 * 1.25))
    assert warning.startswith(
        f"elements.muscles.deactivation_time: the fastest motion has a time scale of {scale:.2g} s"
    )
