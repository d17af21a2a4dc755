"""Protects proofs of configs with soft guards and stops: rest states, regions, starts, refusals.

Minima are looked for by scipy with the stored energy of the system itself, which no module of the
proofs computes. U is smooth between the angles of guards: it is minimized between each two.
"""

from functools import cache
from itertools import pairwise
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from scipy.optimize import minimize
from support.config_elements import CONTROLLER, STRUT, config_data
from support.proofs import stored_energies

import rbstab
from rbstab.analysis.configuration import configurations
from rbstab.analysis.proof.reduced_energy import NoEnergyReason
from rbstab.config.build import problem_of
from rbstab.config.load import load_config
from rbstab.config.tolerances import tolerances_of
from rbstab.experiment.convergence.exact_motion import convergence_at_start
from rbstab.experiment.proof import prove
from rbstab.experiment.robust.bodies import prove_within
from rbstab.experiment.stability import stability_of
from rbstab.experiment.stored_proof.identity import proof_id
from rbstab.experiment.stored_proof.proof import Proof
from rbstab.experiment.stored_proof.starts import reached_state
from rbstab.experiment.verification.verify import verify

ROOT = Path(__file__).parents[2] / "configs"
ARM = yaml.safe_load((ROOT / "examples" / "stop.yaml").read_text(encoding="utf-8"))
CASE = yaml.safe_load((ROOT / "paper" / "case1_permanent.yaml").read_text(encoding="utf-8"))


def guard(method: str, strength: float, angle: float) -> dict[str, Any]:
    name = {"stiff": "stiffness", "repelling": "couple", "stop": "restitution"}[method]
    at = {"angle" if method == "stop" else "soft_angle": angle}
    return {"kind": "guard", "method": method, name: strength, **at}


def arm(*guards: dict[str, Any], soft: float = 3.0) -> dict[str, Any]:
    """Return the forearm of the example, which presses θ2 upwards, with guards and K_r times 3."""
    elements = {f"guard_{n}": one for n, one in enumerate(guards)}
    controller = ARM["controller"] | {"K_r": [soft * k for k in ARM["controller"]["K_r"]]}
    start = {"orientation": [0.3, 0.3, -0.2], "angular_velocity": [1.0, -2.0, 1.0]}
    return ARM | {"elements": elements, "controller": controller, "initial": start}


KINDS = {
    "stop": arm(guard("stop", 0.6, 0.5)),
    "stop, not reached": arm(guard("stop", 0.6, 0.5), soft=8.0),
    "repelling": arm(guard("repelling", 5.0, 0.5)),
    "too weak": arm(guard("repelling", 0.3, 0.5)),
    "stiff": arm(guard("stiff", 5.0, 0.5)),
    "all": arm(guard("stiff", 0.5, 0.4), guard("repelling", 0.2, 0.5), guard("stop", 0.2, 0.6)),
    "many rest states": arm(guard("repelling", 5.0, 0.5), soft=1.0),
}
HELD = {"stop", "repelling", "all", "many rest states"}


@cache
def proof_of(kind: str) -> Proof:
    return prove(KINDS[kind])


@pytest.fixture(scope="module", params=KINDS)
def proved(request):
    """Return a config with guards, and its proof."""
    return load_config(KINDS[request.param]), proof_of(request.param)


def pieces(config) -> list[tuple[float, float]]:
    """Return the intervals of θ2 on which the energy of a config is smooth."""
    elements = config.elements.values()
    end = min([one.angle for one in elements if one.method == "stop"], default=1.57)
    inner = sorted(one.soft_angle for one in elements if one.method != "stop")
    angles = [*(one for one in inner if one < end), end]
    return list(pairwise([-angle for angle in reversed(angles)] + angles))


def seen_minima(config) -> list[np.ndarray]:
    """Return the minima in the range of eq. 5 that descents reach."""
    at_rest = configurations(problem_of(config).system)
    rng, found = np.random.default_rng(0), list[np.ndarray]()

    def lowest(start, low, high):
        limits = [(-3.1, 3.1), (low, high), (-3.1, 3.1)]

        def energy(Theta):
            # Inside of the ends, where a mode begins or ends.
            inner = np.clip(Theta, [-9, low + 1e-12, -9], [9, high - 1e-12, 9])
            return float(at_rest.energy(inner)), np.array(at_rest.gradient(inner), dtype=float)

        return minimize(
            energy,
            start,
            jac=True,
            method="L-BFGS-B",
            bounds=limits,
            options={"ftol": 1e-15, "gtol": 1e-10},
        )

    intervals = pieces(config)
    for low, high in intervals:
        for _ in range(12):
            start = rng.uniform([-3, low, -3], [3, high, 3])
            at = lowest(start, low, high).x
            # A minimum of one piece at its end is one of U if it is one of the next piece too.
            for other in intervals:
                if (
                    other != (low, high)
                    and min(abs(at[1] - other[0]), abs(at[1] - other[1])) < 1e-9
                ):
                    at = lowest(at, *other).x
            known = any(np.abs(at - one).max() < 1e-3 for one in found)
            if not known and np.abs(at[[0, 2]]).max() < 3.0:
                found.append(at)
    return found


def test_the_minima_are_those_that_descents_find(proved):
    config, proof = proved
    assert proof.proved
    minima = [np.array(one.orientation) for one in proof.states if one.index == 0]
    seen = seen_minima(config)
    assert seen
    for one in seen:
        assert min(np.abs(one - other).max() for other in minima) < 1e-4
    for one in minima:
        if np.abs(one[[0, 2]]).max() < 3.0:
            assert min(np.abs(one - other).max() for other in seen) < 1e-4


def test_held_states_press_against_a_guard(proved):
    """At the angle, the load on θ2 is between nothing and the couple of the guard."""
    config, proof = proved
    bare = problem_of(config.model_copy(update={"elements": {}}))
    at_rest = configurations(bare.system)
    held = [one for one in proof.states if one.held]
    for one in held:
        pitch = one.orientation[1]
        gradient = np.array(at_rest.gradient(np.array(one.orientation)), dtype=float)
        elements = config.elements.values()
        stops = [e for e in elements if e.method == "stop" and e.angle == abs(pitch)]
        soft = [e for e in elements if e.method != "stop"]
        pressing = -np.sign(pitch) * gradient[1]
        pressing -= sum(
            e.stiffness * max(abs(pitch) - e.soft_angle, 0) for e in soft if e.method == "stiff"
        )
        pressing -= sum(
            e.couple for e in soft if e.method == "repelling" and abs(pitch) > e.soft_angle
        )
        couple = np.inf if stops else sum(e.couple for e in soft if e.soft_angle == abs(pitch))
        assert 0 < pressing < couple
        np.testing.assert_allclose(gradient[[0, 2]], 0.0, atol=1e-9)


@pytest.mark.parametrize("kind", KINDS)
def test_which_lowest_states_are_held(kind):
    lowest = proof_of(kind).states[0]
    assert lowest.index == 0
    assert bool(lowest.held) == (kind in HELD)
    assert proof_of(kind).every_start == ("stop" in kind or kind == "all")


def test_the_stored_energy_is_that_of_the_system(proved):
    config, proof = proved
    at_rest = configurations(problem_of(config).system)
    end = min([e.angle for e in config.elements.values() if e.method == "stop"], default=1.5)
    points = np.random.default_rng(0).uniform(-1, 1, size=(50, 3)) * [3, end, 3]
    ours = stored_energies(proof, points)
    np.testing.assert_allclose(ours, [float(at_rest.energy(q)) for q in points], atol=1e-9)


@pytest.mark.heavy
def test_a_stored_proof_is_the_same_and_is_verified(proved):
    config, proof = proved
    again = Proof.model_validate_json(proof.model_dump_json())
    assert again == proof
    assert verify(proof, config).verified


@pytest.mark.parametrize("place", range(3))
def test_a_proof_of_another_guard_is_refused(place):
    config = load_config(KINDS["all"])
    name, field = f"guard_{place}", ("stiffness", "couple", "angle")[place]
    section = config.elements[name]
    changed = section.model_copy(update={field: getattr(section, field) * (1 + 1e-9)})
    other = config.model_copy(update={"elements": dict(config.elements) | {name: changed}})
    found = verify(proof_of("all"), other).findings
    assert {finding.claim for finding in found if not finding.verified} == {"id", "energy"}


@pytest.mark.parametrize("kind", ["stop", "stop, not reached", "too weak", "stiff", "all"])
def test_motions_in_a_region_end_at_its_rest_state(kind):
    """Not those that a repelling guard holds: they hop about its angle without end."""
    proof, rng = proof_of(kind), np.random.default_rng(1)
    for _ in range(3):
        start = {"orientation": rng.uniform([-0.4, 0.0, -0.4], [0.4, 0.45, 0.4]).tolist()}
        start["angular_velocity"] = rng.uniform(-1, 1, 3).tolist()
        integration = {"duration": 20.0, "samples": 5}
        data = KINDS[kind] | {"initial": start, "integration": integration}
        config = load_config(data)
        assert convergence_at_start(config, problem_of(config), proof).rest_state == 1
        result = rbstab.simulate(config)
        assert result.status == "completed"
        expected = proof.states[0].orientation
        np.testing.assert_allclose(result["orientation"][-1], expected, atol=1e-2)


def test_with_a_stop_every_start_converges():
    data = CASE | {"schema_version": 2, "elements": {"range": guard("stop", 0.5, 1.2)}}
    config = load_config(data)
    proof = prove(config)
    assert proof.every_start
    assert proof.kept_by == "a stop"
    assert verify(proof, config).verified
    sentences = " ".join(stability_of(problem_of(config), proof).statements)
    assert "Every start in the range converges: proved. A stop keeps every motion away" in sentences
    far = np.array([40.0, 1.1, -300.0])
    assert reached_state(proof, 1e9, far, far) == 1
    for speed in (10.0, 60.0):
        fast = data | {
            "initial": {"orientation": [0.5, 1.0, -2.0], "angular_velocity": [speed, speed, -speed]}
        }
        result = rbstab.simulate(fast | {"integration": {"duration": 60.0, "samples": 3}})
        assert result.status == "completed"
        np.testing.assert_allclose(result["orientation"][-1], 0.0, atol=1e-2)


def certified(proof: Proof) -> float:
    assert proof.region is not None
    return proof.region.lower_bound


def test_a_soft_guard_raises_the_level_by_its_energy_at_the_end():
    """Without load, c* of case 1 is on θ2 = ±π/2, where the guard adds the same at each point."""
    bare = certified(prove(CASE))
    room = np.pi / 2 - 1.2
    for method, strength, added in (
        ("stiff", 1e3, 500 * room**2),
        ("repelling", 500.0, 500 * room),
    ):
        data = CASE | {"schema_version": 2, "elements": {"range": guard(method, strength, 1.2)}}
        proof = prove(data)
        assert proof.globally_stable
        assert not proof.every_start
        assert certified(proof) == pytest.approx(bare + added, rel=1e-8)


def test_ids_depend_on_the_method():
    plain = {"range": {"kind": "guard", "method": "barrier", "stiffness": 1.0}}
    texts = [arm(), *KINDS.values(), ARM | {"elements": plain}]
    assert len({proof_id(load_config(data)) for data in texts}) == len(texts)


@pytest.mark.parametrize("method", ["stiff", "repelling", "stop"])
def test_bodies_within_tolerances_are_proved_with_a_guard(method):
    elements = {"range": guard(method, 0.5, 1.2)}
    held = load_config(config_data(elements, CONTROLLER | {"variant": "permanent"}))
    within = prove_within(held, tolerances_of(held, ["controller.K_r=±1%"]))
    assert within.proved
    assert within.level > 0


def test_a_stop_beside_a_spring_of_a_tied_body_has_no_proof():
    tied = prove(config_data({"strut": STRUT, "range": guard("stop", 0.5, 1.2)}))
    assert tied.outcome == NoEnergyReason.STOP_IN_SIX.value
