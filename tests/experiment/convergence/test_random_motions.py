"""What is proved of random motions is what happens to them: soft, stiff, and loaded bodies."""

import numpy as np
import pytest
from scipy.integrate import solve_ivp
from support.configs import BY_VARIANT, plain

import rbstab
from rbstab.config.build import problem_of
from rbstab.experiment.convergence.convergence import Enclose
from rbstab.experiment.convergence.exact_motion import prove_convergence
from rbstab.experiment.proof import prove

LIMITS = np.array([np.pi, np.pi / 2, np.pi])


def random_config(seed):
    """Return a config: any variant, gravity up to 30 m/s², and a start anywhere in the range."""
    rng = np.random.default_rng(seed)
    variant = rng.choice(list(BY_VARIANT))
    data = plain(BY_VARIANT[variant])
    controller, body = data["controller"], data["body"]
    softness = 10 ** rng.uniform(-1.5, 0.5)
    controller["K_r"] = (softness * np.array(controller["K_r"])).round(2).tolist()
    body["inertia"] = [10.0, 8.0, float(rng.choice([0.4, 3.0, 9.0]))]
    if variant in {"visco-elastic", "embedded"}:
        stiffness = 10 ** rng.uniform(-1, 1)
        controller["K_c"] = (stiffness * np.array(controller["K_c"])).round(1).tolist()
    direction = rng.normal(size=3)
    gravity = rng.choice([0.0, 9.81, 30.0]) * direction / np.linalg.norm(direction)
    data["gravity"] = gravity.round(3).tolist()
    # Some starts are very near to the borders of the range.
    near = rng.choice([0.3, 0.9, 0.9999])
    angles = near * LIMITS * rng.uniform(-1, 1, 3)
    data["initial"] = {
        "orientation": angles.round(6).tolist(),
        "angular_velocity": (rng.choice([0.1, 3.0, 30.0]) * rng.normal(size=3)).round(3).tolist(),
    }
    data["integration"] = {"duration": 0.5, "samples": 26}
    return rbstab.load_config(data)


def end_of(config, duration):
    """Return the state of a motion much later, integrated with another method."""
    problem = problem_of(config)
    end = solve_ivp(
        lambda _, y: problem.system.rates(y),
        (0, duration),
        problem.start,
        method="LSODA",
        rtol=1e-9,
        atol=1e-9,
    ).y[:, -1]
    return problem.system.motion(end)


def checked(seed):
    """Check one random config, and return whether its convergence is proved, and at once."""
    config = random_config(seed)
    proof = prove(config)
    found = prove_convergence(config, problem_of(config), proof).convergence
    if not found.proved:
        assert found.why
        return None
    assert found.energy is not None
    assert found.time is not None
    assert found.rest_state is not None
    assert found.bound is not None
    low, high = found.energy
    assert low <= high < found.bound
    result = rbstab.simulate(config, proof=proof, enclose=Enclose.UNTIL_PROVED)
    assert result.attributes["verdict"] == "consistent"
    last = end_of(config, found.time + 60.0)
    rest = proof.states[found.rest_state - 1]
    assert last.Theta.tolist() == pytest.approx(rest.orientation, abs=0.02)
    assert last.X.tolist() == pytest.approx(rest.position, abs=0.02)
    return found.time == 0.0


@pytest.mark.slow
def test_random_motions_end_where_it_is_proved():
    answers = [checked(seed) for seed in range(312, 318)]
    assert answers.count(False) >= 1
    assert answers.count(True) >= 1
