"""Bodies with elements that switch, and closed forms of their motions."""

import numpy as np
from mpmath import mp

from rbstab.config.build import problem_of
from rbstab.config.load import load_config
from rbstab.elements.guards.soft_guards import StiffGuard
from rbstab.elements.ligament import Ligament
from rbstab.integrate.engines import engine

ENGINES = ("scipy", "heyoka")

TIGHT = {"scipy": {"rtol": 3e-14, "atol": 1e-15}, "heyoka": {"rtol": 1e-16}}
"""The smallest tolerances of each engine."""

MASS, INERTIA = 2.0, 1.5


def data(elements, initial=None, integration=None, **sections):
    """Return a config of a body on elements alone: no controller and no gravity."""
    return {
        "schema_version": 2,
        "body": {"mass": MASS, "inertia": [1.0, INERTIA, 2.0], "contact_point": [0.0, 0.0, 0.0]},
        "elements": elements,
        "initial": initial or {},
        "integration": {"duration": 10.0, "samples": 101} | (integration or {}),
    } | sections


def ligament(side=1.0, **changes):
    """Return a ligament of the centre of gravity that goes taut where -side x > 0.3 m."""
    return {
        "kind": "ligament",
        "point": [0, 0, 0],
        "anchor": [side * 0.7, 0, 0],
        "stiffness": 80.0,
        "slack_length": 1.0,
        "toe_strain": 0.05,
    } | changes


def guard(method, size, soft_angle=0.3):
    """Return a stiff or a repelling guard."""
    strength = "stiffness" if method == "stiff" else "couple"
    return {"kind": "guard", "method": method, strength: size, "soft_angle": soft_angle}


def problem(config):
    """Return the problem of plain data."""
    return problem_of(load_config(config))


def solved(config, engine_name, **integration):
    """Return the trajectory of plain data by an engine, at its smallest tolerances."""
    tight = TIGHT[engine_name] | {"engine": engine_name} | integration
    changed = config | {"integration": config["integration"] | tight}
    return engine(engine_name)(problem(changed))


def toe_bounce(speed, k, length, toe):
    """Return when a mass that meets a ligament leaves its toe, enters it again, and is free, s.

    The mass arrives at t = 0 along the line, and goes beyond the toe. In the toe its speed follows
    from the energy, and the time from ∫ dx / speed, by quadrature with 30 digits. Beyond, it is an
    oscillator about the strain `toe`.
    """
    with mp.workdps(30):
        m, k, length, toe, speed = map(mp.mpf, (MASS, k, length, toe, speed))

        def speed_at(strain):
            return mp.sqrt(speed**2 - 2 * length * k * strain**3 / (12 * toe) / m)

        through = mp.quad(lambda strain: length / speed_at(strain), [0, 2 * toe])
        w = mp.sqrt(k / (m * length))
        beyond = 2 / w * mp.atan2(speed_at(2 * toe), w * toe * length)
        return float(through), float(through + beyond), float(2 * through + beyond)


def random_ligament(rng, mode):
    """Return a ligament between random points, in given modes."""
    return Ligament(
        name="x",
        point=rng.normal(size=3) * 0.3,
        anchor=rng.normal(size=3) * 2.0,
        stiffness=float(rng.uniform(50, 200)),
        slack_length=float(rng.uniform(0.5, 2.0)),
        toe_strain=float(rng.uniform(0.02, 0.2)),
        damping=float(rng.uniform(1, 5)),
        mode=np.array(mode),
    )


def random_guard(rng, kind, mode):
    """Return a stiff or a repelling guard in given modes."""
    strength = "stiffness" if kind is StiffGuard else "couple"
    size, angle = float(rng.uniform(50, 200)), float(rng.uniform(0.2, 1.2))
    return kind(name="x", soft_angle=angle, mode=np.array(mode), **{strength: size})
