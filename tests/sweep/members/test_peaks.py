"""Protects the peaks of members between samples: any number of samples gives the same peaks."""

import numpy as np
import pytest
from support.configs import paper_config

from rbstab.analysis.peak_search import Samples, find_peaks
from rbstab.sweep.members.ensemble import ensemble_engine
from rbstab.sweep.members.single import SingleRuns
from rbstab.sweep.plan.load import load_plan

MASS, STIFFNESS, DAMPING, SPEED = 5.0, 6.0e4, 40.0, 3.0
"""kg, N/m, N s/m and m/s of a body that only translates; its frequency is 110 rad/s."""

ENGINES = {"heyoka": ensemble_engine, "scipy": SingleRuns}


def translating(samples, engine):
    """Return a plan of bodies that oscillate along the first axis in the stabilizer alone."""
    controller = {
        "variant": "free",
        "K_t": [STIFFNESS] * 3,
        "L_t": [DAMPING] * 3,
        "K_r": [400.0] * 3,
        "L_r": [60.0] * 3,
    }
    base = paper_config(
        "free",
        False,
        controller=controller,
        body={"mass": MASS},
        initial={
            "orientation": [0, 0, 0],
            "angular_velocity": [0, 0, 0],
            "position": [0, 0, 0],
            "velocity": [SPEED, 0, 0],
        },
        duration=0.5,
        samples=samples,
        engine=engine,
    )
    return load_plan({"base": base, "vary": {"initial.velocity[0]": {"values": [SPEED, -1.0]}}})


def columns(plan, engine):
    return ENGINES[engine](plan).compute(0, plan.members).outcome


@pytest.mark.parametrize("engine", ENGINES)
@pytest.mark.parametrize("samples", [3, 11, 21, 51, 201])
def test_a_translation_has_the_peak_of_its_closed_form(samples, engine):
    """x = V/w e^(-dt) sin wt has its peak where tan wt = w/d."""
    d = DAMPING / (2 * MASS)
    w = np.sqrt(STIFFNESS / MASS - d**2)
    time = np.arctan2(w, d) / w
    peak = np.exp(-d * time) * np.sin(w * time) / w
    found = columns(translating(samples, engine), engine)
    for member, speed in enumerate((SPEED, -1.0)):
        assert found["peak_contact_displacement"][member, 0] == pytest.approx(
            speed * peak, rel=1e-6
        )
        assert found["peak_time"][member, 0] == pytest.approx(time, abs=1e-3 / w)
        assert found["peak_contact_displacement_error"][member] <= 1e-6 * abs(speed * peak)
    assert (found["peak_orientation"] < 1e-12).all()


def spinning(samples, engine, duration=2.0):
    """Return a plan of free bodies with fast random spins."""
    base = paper_config(
        "free", True, initial={}, duration=duration, samples=samples, engine=engine, rtol=1e-12
    )
    keys = [f"initial.angular_velocity[{axis}]" for axis in range(3)]
    vary = dict.fromkeys(keys, {"uniform": [-12, 12]})
    return load_plan({"base": base, "vary": vary, "design": "random", "members": 16, "seed": 3})
