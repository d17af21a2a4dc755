"""Problems with a sliding connector: the paper's body, and a ball in a V-shaped potential."""

from dataclasses import replace

import numpy as np

from rbstab.elements.sliding import SlidingConnector
from rbstab.integrate.problem import Switching
from rbstab.integrate.switching.trust import with_connector_by_modes
from rbstab.mechanics.body import Body
from rbstab.mechanics.motion import motion_from_centre
from rbstab.systems.coordinates import ContactCoordinates
from rbstab.systems.modes import modes_of, with_modes
from support.paper_runs import REFERENCE
from support.problems import bare_system, problem, solve

SLOPE_REFERENCE = REFERENCE["cases"]["sliding_surface_c20/0/Ks20000"]
"""The paper's body with K_s = 20000 N on s = F + 20E, computed by another program."""


def sliding_problem(body, element, Z, times, switching, **stabilized):
    """Return the problem of a body with a sliding connector beside the stabilizers."""
    system = bare_system(body, ContactCoordinates(), others=(element,), **stabilized)
    start = system.start(motion_from_centre(body, np.zeros(3), Z), np.zeros(0))
    options = {"step_limit": 10**8, "time_limit": 120.0, "switching": switching}
    return problem(system, start, times, **options)


def paper_problem(K_s, slope=None, duration=2.0, samples=41, layer=None, **switching):
    """Return the paper's body with the force K_s on s = E, or on s = F + slope E."""
    body = Body(41.0, np.diag([10.0, 8.0, 0.4]), np.array([0.15, 0.1, -0.42]))
    gains = {
        "K_t": np.diag([4100.0, 4100.0, 3280.0]),
        "L_t": np.diag([200.0, 200.0, 140.0]),
        "K_r": np.diag([400.0, 400.0, 320.0]),
        "L_r": np.diag([60.0, 60.0, 42.0]),
    }
    Z = np.zeros(12)
    Z[3:6] = 16, 32, -16
    times = np.linspace(0, duration, samples)
    options = Switching(layered=layer is not None, **switching)
    return sliding_problem(body, connector(K_s, slope, layer), Z, times, options, **gains)


def connector(K_s, slope=None, layer=None):
    return SlidingConnector(
        K_s=np.full(3, float(K_s)),
        rate_weight=float(slope is not None),
        slope=1.0 if slope is None else slope,
        layer_width=layer or 1.0,
    )


def ball_in_a_V(mass, K_s, load, damping, X, V, times, layer=None, **switching):  # noqa: PLR0917
    """Return a body held at its centre of gravity: it does not turn, each axis is a ball in a V.

    mẍ = -K_s sgn x + load - damping ẋ, by axis.
    """
    force, free = np.full(3, K_s), np.zeros((3, 3))
    switching |= {"layer": layer, "damping": np.diag(damping)}
    return pushed_ball(mass, force, load, free, X, V, times, **switching)


def turning_balls(times, rate=0.0, angle=0.0):
    """Return three balls in a V on a body that turns about its second axis: θ'' = -θ - θ'."""
    still, X = np.zeros(3), np.array([0.3, 0.2, 0.5])
    balls = ball_in_a_V(2.0, 30.0, np.array([0.0, 5.0, -10.0]), still, X, still, times)
    balls.start[1], balls.start[4] = angle, rate
    return balls


def pushed_ball(  # noqa: PLR0917
    mass, K_s, load, coupling, X, V, times, slope=None, layer=None, damping=None, **switching
):
    """Return the same ball with a force linear in its position: mẍ = Λ + load - coupling x.

    K_s is given by axis. A coupling matrix with a single entry off the diagonal loads one axis by
    the motion of another, which is unaffected, so the load is a known function of time.
    """
    body = Body(mass, np.eye(3), np.zeros(3))
    gains = {
        "weight": load,
        "K_t": np.array(coupling, dtype=float),
        "L_t": np.zeros((3, 3)) if damping is None else damping,
        "K_r": np.eye(3),
        "L_r": np.eye(3),
    }
    Z = np.concatenate([np.zeros(6), X, V])
    each = replace(connector(1.0, slope, layer), K_s=np.array(K_s, dtype=float))
    options = Switching(layered=layer is not None, **switching)
    return sliding_problem(body, each, Z, times, options, **gains)


def solve_sliding(engine_name, given):
    """Return the trajectory of a problem with a sliding connector, which records its switches."""
    trajectory = solve(engine_name, given)
    assert trajectory.switches is not None
    return trajectory


def audit(run):
    """Return the largest |v(t) - v(0) - ∫v' dt + energy discarded at sticking| over v(0)."""
    energy = [s.observe(y).energy.sum() for s, y in zip(run.systems, run.states, strict=True)]
    residual = np.array(energy) - energy[0] - run.lyapunov_change
    return np.abs(residual + run.switches.discarded_energy).max() / energy[0]


def by_modes(given, sides, held=(0, 0, 0)):
    """Return the system of a problem with modes of its connector: sides ±1, 0 for a held axis."""
    system = with_connector_by_modes(given)
    upper = [float(side > 0 or is_held) for side, is_held in zip(sides, held, strict=True)]
    return with_modes(system, (*upper, *map(float, held)))


def sides_and_holds(system):
    """Return the side of each axis of the connector, 0 if it is held, and which are held."""
    modes = np.array(modes_of(system)).reshape(2, 3)
    return ((2 * modes[0] - 1) * (1 - modes[1])).tolist(), modes[1].tolist()
