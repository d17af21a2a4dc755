"""No false claim: proved starts of random bodies end at the rest state that the proof names.

The bodies are soft, stiff, heavy, nearly degenerate, or have several minima. Most starts have an
energy just below the bound of a region. Their motions are integrated by heyoka, which shares
nothing with the proofs but the equations.
"""

import numpy as np
import pytest
from support.sweeping import run_sweep
from support.valleys import TWO_VALLEYS

import rbstab
from rbstab.config.build import problem_of
from rbstab.experiment.proof_cache import proof_for
from rbstab.experiment.stored_proof.starts import region_bounds
from rbstab.integrate.engines import engine
from rbstab.sweep.members.engines import factory_for
from rbstab.sweep.plan.load import load_plan

STARTS = 260
"""Starts of each body."""

VARIANTS = ("permanent", "visco-elastic", "free", "embedded")

KINDS = ("soft", "stiff", "heavy", "nearly degenerate", "several minima")


def random_base(seed):
    """Return a random config of one of `KINDS`, with its motion until it has come to rest."""
    rng = np.random.default_rng(seed)
    kind = KINDS[seed % len(KINDS)]
    if kind == "several minima":
        return valleys(rng)
    stiffness = {"soft": 40.0, "stiff": 4000.0}.get(kind, 300.0)
    K_r = stiffness * rng.uniform(0.5, 1.5, 3)
    if kind == "nearly degenerate":
        K_r[1] = K_r[0] * (1.0 + 1e-6)
    K_t = 4000.0 * rng.uniform(0.5, 1.5, 3)
    inertia = rng.uniform(2.0, 4.0, 3)
    mass = float(rng.uniform(5.0, 60.0))
    variant = VARIANTS[seed % len(VARIANTS)]
    lever = rng.uniform(-0.4, 0.4, 3)
    gravity = [0.0, 0.0, -float(rng.uniform(5, 30))] if kind == "heavy" else [0.0, 0.0, 0.0]
    damping = np.sqrt(K_r * inertia)
    slowest = float((damping / K_r).max())
    K_c = 3000.0 * rng.uniform(0.5, 1.5, 3)
    L_c = 0.8 * np.sqrt(K_c * mass)
    connector = {"K_c": K_c.tolist(), "L_c": L_c.tolist()}
    own_state = {"K_d": K_c.tolist(), "L_d": L_c.tolist()}
    connectors = {"visco-elastic": connector, "embedded": connector | own_state}
    return {
        "body": {"mass": mass, "inertia": inertia.tolist(), "contact_point": lever.tolist()},
        "gravity": gravity,
        "controller": {
            "variant": variant,
            **connectors.get(variant, {}),
            "K_t": K_t.tolist(),
            "L_t": (0.8 * np.sqrt(K_t * mass)).tolist(),
            "K_r": K_r.tolist(),
            "L_r": damping.tolist(),
        },
        "integration": {
            "duration": 60.0 * max(slowest, 0.3),
            "samples": 21,
            "rtol": 1e-9,
            "engine": "heyoka",
        },
    }


def valleys(rng):
    """Return a random config with two minima."""
    gravity = np.array(TWO_VALLEYS["gravity"]) * rng.uniform(0.9, 1.1, 3)
    K_r = np.array(TWO_VALLEYS["controller"]["K_r"]) * rng.uniform(0.95, 1.05, 3)
    controller = TWO_VALLEYS["controller"] | {"K_r": K_r.tolist()}
    integration = {"duration": 60.0, "samples": 21, "rtol": 1e-9, "engine": "heyoka"}
    changes = {"gravity": gravity.tolist(), "controller": controller, "integration": integration}
    return TWO_VALLEYS | changes


def starts_near_the_bounds(config, proof, rng):
    """Return columns of a plan: starts with energies at and below the bounds of the regions."""
    system = problem_of(config).system
    states = [np.array(state.orientation) for state in proof.states]
    bounds = region_bounds(proof)
    rows: list[np.ndarray] = []
    while len(rows) < STARTS:
        bound = bounds[rng.integers(len(bounds))]
        centre = states[rng.integers(len(states))]
        Theta = centre + rng.normal(size=3) * rng.choice([0.05, 0.3, 1.0])
        if np.any(np.abs(Theta) > [3.1, 1.5, 3.1]):
            continue
        spin = rng.normal(size=3)
        values = np.concatenate([Theta, spin])
        start = _energy(system, config, Theta, np.zeros(3))
        room = bound * rng.choice([1 - 1e-6, 0.9999, 0.99, 0.7, 1.02]) - start
        if room < 0:
            continue
        values[3:] *= np.sqrt(room / (_energy(system, config, Theta, spin) - start))
        rows.append(values)
    keys = [
        f"initial.{name}[{k}]" for name in ("orientation", "angular_velocity") for k in range(3)
    ]
    return dict(zip(keys, np.transpose(rows).tolist(), strict=True))


def _energy(system, config, Theta, Omega):
    initial = config.initial.model_copy(
        update={"orientation": tuple(Theta), "angular_velocity": tuple(Omega)}
    )
    start = problem_of(config.model_copy(update={"initial": initial})).start
    return float(system.observe(start).energy.sum())


@pytest.mark.parametrize(
    ("bodies", "least"),
    [
        pytest.param(5, 600, marks=pytest.mark.slow),
        pytest.param(55, 10_000, marks=pytest.mark.long),
    ],
)
def test_proved_starts_end_where_they_should(tmp_path, bodies, least):
    """The others are above the bound, or between regions; at least `least` starts are proved."""
    engine("heyoka")
    proved, several = 0, 0
    for seed in range(bodies):
        base = random_base(seed)
        config = rbstab.load_config(base)
        folder = tmp_path / str(seed)
        proof = proof_for(folder, config)
        if not region_bounds(proof):
            continue
        columns = starts_near_the_bounds(config, proof, np.random.default_rng(1000 + seed))
        vary = {"starts": {"zip": {key: {"values": v} for key, v in columns.items()}}}
        plan = load_plan({"base": base, "vary": vary})
        run_sweep(folder / "sweep", plan, threads=1, factory=factory_for("heyoka"))
        table = rbstab.open_sweep(folder / "sweep")
        numbers = table["proved_rest_state"]
        claimed = np.flatnonzero(numbers > 0)
        states = np.array([state.orientation for state in proof.states])
        ends = table["final_orientation"][claimed]
        distance = np.abs(ends - states[numbers[claimed] - 1]).max(axis=1)
        assert (table.words("status")[claimed] == "completed").all(), seed
        assert distance.max(initial=0.0) < 1e-2, (seed, distance.max())
        proved += len(claimed)
        several += len(set(numbers[claimed].tolist())) > 1
    assert proved >= least
    assert several > 0, "no body with proved starts at two rest states"
