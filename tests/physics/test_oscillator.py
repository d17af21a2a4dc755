"""The centre of a free body is a damped oscillator in three axes, however the body tumbles.

By eq. 1 with Λ = 0 the centre moves independently of the rotation.
"""

import numpy as np
import pytest
from scipy.linalg import expm
from support.problems import bare_system, problem, solve

from rbstab.mechanics.body import Body
from rbstab.systems.coordinates import ContactCoordinates

MASS = 4.0
BODY = Body(MASS, np.diag([2.0, 1.5, 1.0]), np.array([0.15, 0.1, -0.42]))
WEIGHT = np.array([3.0, -7.0, -40.0])
POSITION = np.array([0.3, -0.2, 0.1])
VELOCITY = np.array([-1.0, 0.5, 2.0])
SPIN = np.array([0.4, 0.6, -0.3])
TIMES = np.linspace(0.0, 3.0, 61)

ERROR = 1e-11

# Symmetric, positive definite and far from diagonal.
FULL_STIFFNESS = np.array([[90.0, 30.0, -20.0], [30.0, 120.0, 15.0], [-20.0, 15.0, 60.0]])
FULL_DAMPING = np.array([[9.0, -3.0, 2.0], [-3.0, 6.0, 1.0], [2.0, 1.0, 12.0]])


def centre(engine, K_t, L_t, coordinates=None):
    """Return X and V over time of a body that is thrown and tumbles."""
    system = bare_system(BODY, coordinates, weight=WEIGHT, K_t=K_t, L_t=L_t)
    Z = np.concatenate([np.zeros(3), SPIN, POSITION, VELOCITY])
    if coordinates is not None:
        # At Θ = 0, E = X and F = V + Ω × R.
        Z[9:12] += np.cross(SPIN, BODY.contact_point)
    trajectory = solve(engine, problem(system, Z, TIMES))
    assert trajectory.status == "completed"
    motions = [system.motion(state) for state in trajectory.states]
    return np.array([m.X for m in motions]), np.array([m.V for m in motions])


@pytest.mark.parametrize(
    ("engine", "coordinates"),
    [("scipy", None), ("heyoka", None), ("scipy", ContactCoordinates())],
    ids=["scipy-Z", "heyoka-Z", "scipy-W"],
)
def test_full_gains_give_a_matrix_exponential(engine, coordinates):
    X, V = centre(engine, FULL_STIFFNESS, FULL_DAMPING, coordinates)
    rest = np.linalg.solve(FULL_STIFFNESS, WEIGHT)
    flow = np.block(
        [
            [np.zeros((3, 3)), np.eye(3)],
            [-FULL_STIFFNESS / MASS, -FULL_DAMPING / MASS],
        ]
    )
    start = np.concatenate([POSITION - rest, VELOCITY])
    expected = np.array([expm(flow * t) @ start for t in TIMES])
    np.testing.assert_allclose(X - rest, expected[:, :3], rtol=0, atol=ERROR)
    np.testing.assert_allclose(V, expected[:, 3:], rtol=0, atol=ERROR)
