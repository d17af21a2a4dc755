"""A proof needs masses, inertias and dampings that are positive definite without round-off."""

from dataclasses import replace

import numpy as np
import pytest
from support.rest import paper_system

from rbstab.analysis.proof.definite import indefinite_parameter

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
    assert indefinite_parameter(with_gain(name, BARELY_INDEFINITE)) == name
    assert indefinite_parameter(with_gain(name, np.diag([1.0, 0.0, 1.0]))) == name
    assert indefinite_parameter(with_gain(name, BARELY_DEFINITE)) is None


def test_stiffness_is_checked_elsewhere():
    assert indefinite_parameter(with_gain("K_r", BARELY_INDEFINITE)) is None


def test_mass_and_inertia_count():
    assert indefinite_parameter(with_body(mass=-1.0)) == "mass"
    assert indefinite_parameter(with_body(inertia=BARELY_INDEFINITE)) == "inertia"
    assert indefinite_parameter(with_body(inertia=BARELY_DEFINITE)) is None
