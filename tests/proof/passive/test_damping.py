"""A proof needs definite masses and inertias, and dampers that leave no motion, without round-off.

What is damped is compared with the smallest eigenvalue of the summed damping at many poses.
"""

from dataclasses import replace
from fractions import Fraction
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation
from support.rest import paper_system

from rbstab.analysis.exact import decimals
from rbstab.config.build import system_of
from rbstab.config.load import load_config
from rbstab.proof.passive.damping import indefinite_parameter, why_not_damped

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


@pytest.mark.parametrize("name", ["L_t", "L_r", "L_c", "L_d"])
def test_every_damping_counts(name):
    """Each is exactly semidefinite at least; those that a config may leave out, no more."""
    assert indefinite_parameter(with_gain(name, BARELY_INDEFINITE)) == name
    expected = name if name == "L_d" else None
    assert indefinite_parameter(with_gain(name, np.diag([1.0, 0.0, 1.0]))) == expected
    assert indefinite_parameter(with_gain(name, BARELY_DEFINITE)) is None


def test_mass_and_inertia_count():
    assert indefinite_parameter(with_body(mass=-1.0)) == "mass"
    assert indefinite_parameter(with_body(inertia=BARELY_INDEFINITE)) == "inertia"
    assert indefinite_parameter(with_body(inertia=BARELY_DEFINITE)) is None


def tie(x, y, z, L=(2, 3, 8), kind="visco-elastic"):
    gains = {"K_c": [2000, 3000, 8000], "L_c": list(L)}
    if kind == "embedded":
        gains |= {"K_d": [1, 1, 1], "L_d": [1, 1, 1]}
    return {"kind": kind, "point": [x, y, z], "anchor": [x, y, z], **gains}


def attitude(L):
    return {"kind": "attitude", "K": [1, 1, 1], "L": L}


SPRING: dict[str, Any] = {"kind": "spring", "point": [0, 0, 0.1], "anchor": [0, 0, 0.3]}
SPRING |= {"stiffness": 10, "rest_length": 0.1}
MOUNTS = [tie(x, y, -0.15) for x in (0.3, -0.3) for y in (0.2, -0.2)]
AT_C = tie(0, 0, -0.15)
HELD = {"variant": "permanent", "K_t": [1] * 3, "L_t": [1] * 3, "K_r": [1] * 3, "L_r": [1] * 3}

DAMPERS = {
    "three points": ([*MOUNTS[:2], AT_C], None),
    "an embedded tie": ([*MOUNTS[:2], tie(0.1, 0, 0, kind="embedded")], None),
    "an attitude damper and a tie": ([attitude([1, 2, 3]), AT_C], None),
    "a spring without a damper": ([SPRING], "the body"),
    "two points": (MOUNTS[:2], "a rotation about body y through (0.3, 0, -0.15) m"),
    "one point": ([AT_C], "a rotation about body x through (0, 0, -0.15) m"),
    "three points on a line": (
        [tie(0.1, 0.2, 0.3), tie(0.2, 0.4, 0.6), tie(0.3, 0.6, 0.9)],
        "a rotation about body (0.3333, 0.6667, 1)",
    ),
    "no tie": ([attitude([1, 2, 3])], "a translation"),
}


def system_with(elements, controller=None):
    data = {
        "schema_version": 2,
        "body": {"mass": 20, "inertia": [0.42, 0.75, 0.87], "contact_point": [0, 0, -0.15]},
        "elements": {f"e{number}": element for number, element in enumerate(elements)},
        "integration": {"duration": 1},
    }
    return load_config(data | ({"controller": controller} if controller else {}))


def smallest_damping(system, A):
    """Return the smallest eigenvalue of the power that is dissipated, as a form of V and Ω."""
    form = np.zeros((6, 6))
    for element in system.elements:
        if hasattr(element, "L"):
            form[3:, 3:] += element.L
        if hasattr(element, "L_c"):
            p = element.point
            cross = np.array([[0, -p[2], p[1]], [p[2], 0, -p[0]], [-p[1], p[0], 0]])
            rates = np.hstack([np.eye(3), -A @ cross])
            form += rates.T @ element.L_c @ rates
    return np.linalg.eigvalsh(form)[0]


@pytest.mark.parametrize("name", DAMPERS)
def test_which_motion_loses_no_energy(name):
    elements, motion = DAMPERS[name]
    config = system_with(elements)
    expected = None if motion is None else f"no damper acts on {motion}"
    assert why_not_damped(system_of(config, decimals)) == expected
    poses = Rotation.random(20, random_state=1).as_matrix()
    least = [smallest_damping(system_of(config), A) for A in poses]
    assert min(least) > 1e-2 if motion is None else max(np.abs(least)) < 1e-9


def test_what_may_act_but_is_not_shown_to_is_named():
    damped = SPRING | {"damping": 1.0}
    why = why_not_damped(system_of(system_with([*MOUNTS[:2], damped]), decimals))
    motion = "a rotation about body y through (0.3, 0, -0.15) m"
    assert why == f"only e2 may damp {motion}, and perhaps not at every pose"


def test_points_that_vary_prove_nothing():
    """Among bodies within tolerances, three points may be on one line."""
    exact = system_of(system_with(MOUNTS), decimals)
    assert why_not_damped(exact, points_vary=True) is not None
    exact = system_of(system_with([attitude([1, 2, 3]), AT_C]), decimals)
    assert why_not_damped(exact, points_vary=True) is None


def exact(entries):
    """Return a matrix of decimals as rational numbers; from its rows, or from its diagonal."""
    numbers = np.array([Fraction(entry) for entry in np.ravel(np.array(entries, dtype=object))])
    return np.diag(numbers) if len(numbers) == 3 else numbers.reshape(3, 3)


def with_matrices(system, **matrices):
    return replace(
        system,
        elements=tuple(
            replace(element, **{k: exact(v) for k, v in matrices.items() if hasattr(element, k)})
            for element in system.elements
        ),
    )


LEFT = (
    "only translational stabilizer may damp a rotation about body y, and perhaps not at every pose "
    "(L_t is singular and L_r is singular)"
)


@pytest.mark.parametrize(
    ("matrices", "expected"),
    [
        ({"L_r": [0, 0, 1]}, None),
        (
            {"L_t": [0, 0, 0], "L_r": [["0.1", "0.3", 0], ["0.3", "0.9", 0], [0, 0, 1]]},
            "no damper acts on a rotation about body (1, -0.3333, 0) "
            "(L_t is 0 and L_r is singular)",
        ),
        ({"L_t": [0, 1, 1], "L_r": [1, 0, 1]}, LEFT),
    ],
)
def test_what_damps_a_held_body(matrices, expected):
    """C is below G, so L_t damps all rotations about C but that about z."""
    system = with_matrices(system_of(system_with([], HELD), decimals), **matrices)
    assert why_not_damped(system) == expected
