"""A proof needs masses, inertias and dampings that are positive definite without round-off."""

from dataclasses import replace

import numpy as np
import pytest
from support.rest import paper_system

from rbstab.analysis.proof.definite import damps_every_motion, indefinite_parameter, undamped_by

# Its determinant is -2⁻⁵² in exact numbers.
BARELY_INDEFINITE = np.array([[1.0, 1.0, 0.0], [1.0, 1.0 - 2.0**-52, 0.0], [0.0, 0.0, 1.0]])
BARELY_DEFINITE = np.array([[1.0, 1.0, 0.0], [1.0, 1.0 + 2.0**-52, 0.0], [0.0, 0.0, 1.0]])


def with_gain(name, value):
    system = paper_system("embedded")
    elements = tuple(
        replace(element, **{name: value}) if hasattr(element, name) else element
        for element in system.elements
    )
    return replace(system, elements=elements)


def with_body(**changes):
    system = paper_system("embedded")
    return replace(system, body=replace(system.body, **changes))


def test_paper_body_has_what_is_needed():
    assert indefinite_parameter(paper_system("embedded")) is None


@pytest.mark.parametrize("name", ["L_t", "L_r", "L_c", "L_d"])
def test_every_damping_counts(name):
    """Each is exactly semidefinite at least; those that a config may leave out, no more."""
    may_be_singular = name in {"L_t", "L_r"}
    assert indefinite_parameter(with_gain(name, BARELY_INDEFINITE)) == name
    singular = with_gain(name, np.diag([1.0, 0.0, 1.0]))
    assert indefinite_parameter(singular) == (None if may_be_singular else name)
    assert indefinite_parameter(with_gain(name, BARELY_DEFINITE)) is None


@pytest.mark.parametrize("diagonal", [[0.0, 0.0, 0.0], [1.0, 0.0, 1.0]])
def test_motions_are_damped_in_sum(diagonal):
    """The embedded connector damps V where L_t does not; nothing damps Ω where L_r does not."""
    no_L_t, no_L_r = (with_gain(name, np.diag(diagonal)) for name in ("L_t", "L_r"))
    assert damps_every_motion(no_L_t)
    assert not damps_every_motion(no_L_r)
    assert undamped_by(no_L_r) == ["L_r is singular" if any(diagonal) else "L_r is 0"]
    free = replace(no_L_t, elements=no_L_t.elements[:3])
    assert not damps_every_motion(free)
    assert undamped_by(free) == ["L_t is singular" if any(diagonal) else "L_t is 0"]


def test_stiffness_is_checked_elsewhere():
    assert indefinite_parameter(with_gain("K_r", BARELY_INDEFINITE)) is None


def test_mass_and_inertia_count():
    assert indefinite_parameter(with_body(mass=-1.0)) == "mass"
    assert indefinite_parameter(with_body(inertia=BARELY_INDEFINITE)) == "inertia"
    assert indefinite_parameter(with_body(inertia=BARELY_DEFINITE)) is None
