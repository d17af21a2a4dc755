"""Motors with a limit or a lag: what is proved of them, what is not, and what is said."""

import numpy as np
import pytest
from scipy.optimize import brentq, minimize
from support.leg import BODY, WEIGHT_MOMENT, held_leg

import rbstab
from rbstab.config.errors import ConfigError
from rbstab.config.numbers import entries_of, unit_at
from rbstab.config.tolerances import tolerances_of
from rbstab.experiment.answers.motors import motor_answers
from rbstab.experiment.proof import prove
from rbstab.experiment.robust.bodies import prove_within
from rbstab.experiment.stored_proof.data import TOO_FEW
from rbstab.experiment.verification.verify import verify
from rbstab.sweep.members.engines import factory_for
from rbstab.sweep.plan.load import load_plan

PAPER = "configs/paper/case1_permanent.yaml"
K_t, K_r = np.array([4100.0, 4100, 3280]), np.array([400.0, 400, 320])
R = np.array([0.15, 0.10, -0.42])
H, N = np.array([1654.0, 732, 1204]), np.array([837.0, 2424, 336])
LIMITS = {"limit": {"H": H.tolist(), "N": N.tolist()}}


def paper(actuators, *changes):
    return rbstab.load_config(PAPER, [f"controller.actuators={actuators}", *changes])


def free(actuators, **more):
    """A body that hangs on its stabilizers, and on what is added."""
    gains = {"K_t": [4100, 4100, 3280], "L_t": [210, 210, 140]}
    gains |= {"K_r": [400, 400, 320], "L_r": [60, 60, 42]}
    data = {
        "schema_version": 2,
        "body": {"mass": 41, "inertia": [10, 8, 4], "contact_point": R.tolist()},
        "gravity": [0, 0, -9.81],
        "controller": {"variant": "free", **gains, "actuators": actuators},
        "integration": {"duration": 0.1},
    }
    return rbstab.load_config(data | more)


def rotated(Theta):
    (a, b, c), identity = Theta, np.eye(3)
    rotation = identity
    for axis, angle in ((0, a), (1, b), (2, c)):
        e = identity[axis]
        cross = np.cross(e, identity).T  # columns e × e_i
        rotation = rotation @ (
            identity + np.sin(angle) * cross + (1 - np.cos(angle)) * cross @ cross
        )
    return rotation


def energy(Theta, H=H, N=N):
    """By quadrature of the limited force along each axis."""
    nodes, weights = np.polynomial.legendre.leggauss(60)
    s, w = 0.5 * (nodes + 1), 0.5 * weights
    total = 0.0
    for k, x, limit in ((K_t, R - rotated(Theta) @ R, H), (K_r, np.asarray(Theta), N)):
        told = np.outer(s, k * x)
        total += float(w @ (told / np.sqrt(1 + (told / limit) ** 2)) @ x)
    return total


def lowest_on_faces(**limits):
    """The least energy on the six faces of the range, by descents from many points."""
    rng, end, minima = np.random.default_rng(2), np.array([np.pi, np.pi / 2, np.pi]), []
    for axis in range(3):
        others = [i for i in range(3) if i != axis]
        for side in (-1, 1):

            def of_face(x, axis=axis, others=others, side=side):
                Theta = np.zeros(3)
                Theta[axis], Theta[others] = side * end[axis], x
                return energy(Theta, **limits)

            bounds = [(-end[i], end[i]) for i in others]
            for _ in range(6):
                start = rng.uniform(-1, 1, 2) * end[others]
                minima.append(minimize(of_face, start, bounds=bounds).fun)
    return min(minima)


def level_of(proof):
    assert proof.proved
    assert proof.globally_stable
    assert proof.region is not None
    return proof.region.lower_bound


def test_the_region_of_a_limited_body_ends_at_the_lowest_energy_of_a_face():
    config = paper(LIMITS)
    lowest = lowest_on_faces()
    assert lowest * (1 - 1e-6) < level_of(prove(config)) < lowest * (1 + 1e-9)
    # It is deeper without limits.
    assert lowest < 0.9 * level_of(prove(rbstab.load_config(PAPER)))


@pytest.mark.parametrize("far", [1e7, 1e10])
def test_a_limit_that_is_far_above_all_forces_changes_nothing(far):
    proof = prove(paper({"limit": {"H": [far] * 3, "N": [far] * 3}}))
    lowest = lowest_on_faces(H=np.inf, N=np.inf)
    assert lowest * (1 - 1e-6) < level_of(proof) < lowest * (1 + 1e-9)
    assert proof.region is not None
    assert proof.region.level == pytest.approx(lowest, rel=1e-6)


def test_a_motor_without_stiffness_may_have_any_lag():
    (answer, _) = motor_answers(paper({"lag": 40}, "controller.K_t=[0, 0, 0]"))
    assert answer.passive
    assert answer.sentence == "K is 0, so its lag may be any: passive, proved"


def test_a_body_with_limits_and_a_stop_rests_where_its_limited_couples_balance_its_weight():
    """Five times about θ1; a stop at 0.3 rad leaves no others about θ2."""
    weight, arm = 12 * 9.81, 0.25
    limits = {"H": [5, 5, 5], "N": [20, 20, 20]}
    gains = {"K_t": [40] * 3, "L_t": [8] * 3, "K_r": [60, 60, 30], "L_r": [6, 6, 3]}
    stop = {"kind": "guard", "method": "stop", "angle": 0.3, "restitution": 0.5}
    config = {
        "schema_version": 2,
        "body": {"mass": 12, "inertia": [0.29, 0.34, 0.13], "contact_point": [0, 0, -arm]},
        "gravity": [0, 0, -9.81],
        "controller": {"variant": "permanent", "actuators": {"limit": limits}, **gains},
        "elements": {"end": stop},
        "integration": {"duration": 0.1},
    }
    proof = prove(rbstab.load_config(config))
    assert proof.proved

    def limited(told, limit):
        return told / np.sqrt(1 + (told / limit) ** 2)

    x = np.linspace(-np.pi, np.pi, 100_000)
    # G moves by arm·sin θ1 to the side, and by arm·(1 - cos θ1) down.
    side, down = arm * np.sin(x), arm * (1 - np.cos(x))
    falls = (limited(40 * down, 5) - weight) * side
    couple = limited(60 * x, 20) + limited(40 * side, 5) * arm * np.cos(x) + falls
    expected = x[:-1][couple[1:] * couple[:-1] < 0]
    orientations = np.array([state.orientation for state in proof.states])
    assert len(expected) == 5
    assert np.sort(orientations[:, 0]) == pytest.approx(expected, abs=1e-4)
    assert np.abs(orientations[:, 1:]).max() < 1e-9


def test_a_passive_lag_keeps_the_region_and_the_checker_confirms_it():
    config = paper({"lag": 0.03})
    proof = prove(config)
    lowest = lowest_on_faces(H=np.inf, N=np.inf)
    assert lowest * (1 - 1e-6) < level_of(proof) < lowest * (1 + 1e-9)
    assert all(finding.verified for finding in verify(proof, config).findings)


def test_a_body_hangs_lower_on_limited_springs():
    """By hand: y/√(1 + (y/M)²) = mg, so K_t x = mg/√(1 - (mg/M)²)."""
    weight = 41 * 9.81
    proof = prove(free({"limit": {"H": [600, 600, 600], "N": [300, 300, 300]}}))
    assert proof.proved
    assert proof.globally_stable
    sag = weight / np.sqrt(1 - (weight / 600) ** 2) / 3280
    assert proof.states[0].position == pytest.approx((0, 0, -sag), abs=1e-12)


@pytest.mark.parametrize("limit", [300, 402.2])
def test_a_motor_weaker_than_the_weight_is_named_at_once(limit):
    """The body weighs 402.21 N: it falls, and no box of angles is searched."""
    for brief in (True, False):
        proof = prove(free({"limit": {"H": [600, 600, limit], "N": [300] * 3}}), brief=brief)
        assert not proof.proved
        assert (proof.examined, proof.states) == (0, ())
        assert "no position was found where the forces balance" in proof.outcome


def test_a_search_that_would_not_end_in_time_is_given_up_early():
    """The tie carries the weight, and weak motors leave the body several ways to rest."""
    config = free({"limit": {"H": [165, 73, 120], "N": [84, 242, 34]}}).plain()
    config["controller"] |= {"variant": "visco-elastic", "K_c": [12300, 12300, 9840]}
    config["controller"] |= {"L_c": [600, 600, 420]}
    proof = prove(rbstab.load_config(config))
    assert not proof.proved
    assert proof.outcome.startswith(TOO_FEW)
    assert proof.examined < 45_000
    assert proof.stable_count > 1


def test_a_hard_limit_is_not_called_a_missing_spring():
    """Beside a limit, far angles may be rest states; its spring K_r is positive definite."""
    proof = prove(
        rbstab.load_config(
            {
                "schema_version": 2,
                "body": {"mass": 10, "inertia": [0.5, 0.6, 0.2], "contact_point": [0, 0, -0.4]},
                "gravity": [0, 0, -9.81],
                "controller": {
                    "variant": "permanent",
                    "K_r": [100, 100, 60],
                    "L_r": [10, 10, 3],
                    "actuators": {"limit": {"N": [20, 20, 20]}, "law": "hard"},
                },
                "elements": {"upright": {"kind": "attitude", "K": [1, 1, 1], "L": [2, 2, 2]}},
                "integration": {"duration": 0.1},
            }
        )
    )
    assert proof.proved
    assert not proof.unsprung


TIE = {"point": [0.1, 0, 0.4], "anchor": [0.1, 0, 0.4], "K_c": [900, 700, 800], "L_c": [50, 50, 50]}


def with_tie(actuators):
    tie = {"kind": "visco-elastic", **TIE, "actuators": actuators}
    damper = {"K": [300, 400, 500], "L": [2, 2, 2]}
    return rbstab.load_config(
        {
            "schema_version": 2,
            "body": {"mass": 5, "inertia": [1, 1, 1], "contact_point": [0, 0, 0]},
            "controller": {"variant": "permanent"},
            "elements": {"tie": tie, "upright": {"kind": "attitude", **damper}},
            "initial": {"angular_velocity": [1, 2, 0]},
            "integration": {"duration": 3.0},
        }
    )


@pytest.mark.parametrize("actuators", [{"limit": [60, 60, 60]}, {"lag": 0.04}])
def test_ties_have_motors_too(actuators):
    config = with_tie(actuators)
    (answer,) = motor_answers(config)
    assert (answer.name, answer.passive) == ("tie", True)
    run = rbstab.simulate(config)
    assert np.abs(run["energy_residual"]).max() < 1e-10 * run["lyapunov"][0]
    if "limit" in actuators:  # with its elements the tie turns the body about C: |force| < √3 M
        assert np.linalg.norm(run["element_force"], axis=-1).max() < np.sqrt(3) * 60
    assert prove(config).proved


@pytest.mark.parametrize(
    ("actuators", "passive", "said"),
    [
        ({"lag": 0.0426}, True, "its lag is below 0.04268 s"),
        # 140/3280 s: with fewer digits it would be below the lag.
        ({"lag": 0.042682}, True, "its lag is below 0.0426829 s"),
        ({"lag": 0.0427}, False, "not passive, nothing is proved. The body is stable by the eig"),
        (
            {"lag": 0.0844},
            False,
            "is stable by the eigenvalues at the rest state Θ = (0, 0, 0) rad (",
        ),
        (
            {"lag": 0.0846},
            False,
            "is unstable by the eigenvalues at the rest state Θ = (0, 0, 0) rad (",
        ),
        (LIMITS, True, "its limit keeps it passive, proved"),
    ],
)
def test_what_is_said_of_the_motor_of_the_force(actuators, passive, said):
    answer = motor_answers(paper(actuators))[0]
    assert (answer.name, answer.passive) == ("H", passive)
    assert said in answer.sentence
    assert (answer.sureness == "proved") == passive


def test_the_rest_state_whose_eigenvalues_tell_is_named():
    """With the centre at (0, -d, h) it leans: K θ1 = m g (h sin θ1 + d cos θ1)."""
    d, h, weight = 0.01, 0.186, WEIGHT_MOMENT / 0.186
    leg = held_leg((10, 10, 5), body=BODY | {"contact_point": [0, d, -h]})
    leg["controller"]["actuators"] = {"lag": 0.2}
    lean = brentq(lambda x: 10 * x - weight * (h * np.sin(x) + d * np.cos(x)), 0, 1)
    (answer,) = motor_answers(rbstab.load_config(leg))
    assert answer.as_data()["orientation"] == pytest.approx((lean, 0, 0), abs=1e-9)
    assert f"at the rest state Θ = ({lean:.4g}, 0, 0) rad (largest Re λ" in str(answer)


SUPPLIES = "an element supplies power"


def test_nothing_is_proved_of_motors_that_are_not_passive():
    for actuators in (LIMITS | {"axes": "body"}, {"lag": 0.05}):
        config = paper(actuators)
        proof = prove(config)
        assert not proof.proved
        assert proof.outcome == SUPPLIES
        assert rbstab.simulate(config).attributes["verdict"] == "driven"
    name, passive, _, sureness, said, at = motor_answers(paper(LIMITS | {"axes": "body"}))[1]
    assert (name, passive, sureness, at) == ("N", False, "not decided", None)
    assert "body axes" in said


def test_a_lag_is_in_no_proof_beside_a_stop_nor_within_tolerances():
    stop = {"kind": "guard", "method": "stop", "angle": 1.0, "restitution": 0.5}
    stopped = free({"lag": 0.03}, elements={"end": stop})
    proof = prove(stopped)
    assert not proof.proved
    assert "no proof takes this beside a stop" in proof.outcome
    # Without the lag it is proved, and so is the lag without the stop.
    assert prove(free({"lag": 0.03})).proved
    config = paper({"lag": 0.03})
    record = prove_within(config, tolerances_of(config, ["controller.K_r=±1%"]))
    assert not record.proved
    assert "motors with a lag" in record.why


def test_a_lag_without_damping_left_in_some_direction_is_not_passive():
    """A full matrix L - τK decides, not its diagonal."""
    L_t = [[60, 55, 0], [55, 60, 0], [0, 0, 60]]  # eigenvalues 5, 60, 115
    K_t = [1000, 1000, 1000]
    for lag, passive in ((0.0049, True), (0.0051, False)):
        gains = f"controller.L_t={L_t}", f"controller.K_t={K_t}"
        assert motor_answers(paper({"lag": lag}, *gains))[0].passive == passive


def test_members_of_a_sweep_are_passive_or_not_each_by_its_own_lag():
    vary = {"controller.actuators.lag": {"values": [0.03, 0.06]}}
    base = paper({"lag": 0.03}, "integration.duration=0.5", "integration.engine=heyoka").plain()
    plan = load_plan({"title": "lags", "base": base, "vary": vary, "design": "grid"})
    outcome = factory_for(plan.engine)(plan).compute(0, 2).outcome
    for k in range(2):
        run = rbstab.simulate(plan.config_of(k))
        assert ("supplied_energy" in run) == (k == 1)
        np.testing.assert_allclose(
            outcome["final_orientation"][k], run["orientation"][-1], atol=1e-9
        )
        assert outcome["lyapunov_end"][k] == pytest.approx(run["lyapunov"][-1], rel=1e-8)


@pytest.mark.parametrize(
    ("actuators", "problem"),
    [
        ({}, "has neither limit nor lag (expected one of them)"),
        (LIMITS | {"lag": 0.01}, "has both limit and lag"),
        ({"lag": 0.01, "axes": "body"}, "has axes: body without a limit of N"),
        ({"limit": {}}, "has a limit of nothing"),
        ({"limit": {"H": [1, 1, 0]}}, "limit.H[2]: is 0 (expected a number greater than 0)"),
        ({"lag": 0}, "lag: is 0 (expected a number greater than 0)"),
        ({"lag": 0.01, "law": "hard"}, "has law: hard without a limit"),
        (LIMITS | {"axes": "body", "law": "hard"}, "has law: hard in body axes"),
    ],
)
def test_wrong_motors_are_refused(actuators, problem):
    with pytest.raises(ConfigError) as caught:
        paper(actuators)
    assert problem in str(caught.value)


@pytest.mark.parametrize("gain", ["K_t=[[9,1,0],[1,9,0],[0,0,9]]", "L_t=[1,1,0]", "K_t=[0,1,1]"])
def test_a_limit_needs_diagonal_gains_in_its_axes(gain):
    with pytest.raises(ConfigError, match="has a limit, which acts along the axes of K, but"):
        paper({"limit": {"H": [1, 1, 1]}}, f"controller.{gain}")
    # A limit of N does not read them.
    assert paper({"limit": {"N": [1, 1, 1]}}, f"controller.{gain}")


def test_what_stops_at_switches_is_refused_beside_a_hard_limit():
    hard = LIMITS | {"law": "hard"}
    for change in ("integration.method=LSODA", "integration.drift_control=projection"):
        more = ["integration.coordinates=manifold"] if "drift" in change else []
        assert paper(LIMITS, *more, change)
        with pytest.raises(ConfigError, match=r"switch.* of controller\.actuators"):
            paper(hard, *more, change)


def test_no_limited_spring_carries_the_weight_to_where_a_linear_one_does():
    with pytest.raises(ConfigError, match="but H has a limit"):
        paper(LIMITS, "controller.anchor=equilibrium")
    assert paper({"limit": {"N": N.tolist()}}, "controller.anchor=equilibrium")


def test_a_hard_limit_is_passive_and_damps_nothing_in_proofs():
    config = paper(LIMITS | {"law": "hard"})
    answer = motor_answers(config)[0]
    assert answer.passive
    assert "Beyond its hard limit it damps nothing" in answer.sentence
    proof = prove(config)
    assert not proof.proved
    assert "only translational stabilizer and rotational stabilizer may damp" in proof.outcome
    assert "law: smooth damps everywhere" in proof.outcome
    gains = "controller.K_r=[300,300,300]", "controller.L_r=[30,30,30]"
    damped = rbstab.load_config(with_tie({"limit": [60, 60, 60], "law": "hard"}), gains)
    record = prove_within(damped, tolerances_of(damped, ["body.mass=±1%"]))
    assert not record.proved
    assert "a hard limit" in record.why
    run = rbstab.simulate(config)
    assert run.attributes["verdict"] != "violated"
    assert "supplied_energy" not in run


SMALL = 0.4 * H
"""A limit that is reached within the certified region, N."""


def hard_energy(Theta):
    """The closed form: ½ k x² up to the limit, and M|x| - ½ M²/k beyond."""
    x, told = R - rotated(Theta) @ R, np.abs(K_t * (R - rotated(Theta) @ R))
    inside, beyond = 0.5 * K_t * x**2, SMALL * np.abs(x) - 0.5 * SMALL**2 / K_t
    return np.where(told < SMALL, inside, beyond).sum() + 0.5 * K_r @ np.square(Theta)


def test_beside_other_dampers_a_hard_limit_of_a_held_body_is_proved_and_checked():
    """N damps all; c* is the least energy on the faces of the range, here by many descents."""
    config = paper({"limit": {"H": SMALL.tolist()}, "law": "hard"})
    proof = prove(config)
    rng, end = np.random.default_rng(3), np.array([np.pi, np.pi / 2, np.pi])
    lowest = np.inf
    for axis in range(3):
        others = [i for i in range(3) if i != axis]
        for _ in range(16):
            Theta = rng.choice([-1, 1]) * end

            def of_face(x, Theta=Theta, others=others):
                Theta[others] = x
                return hard_energy(Theta)

            start, bounds = rng.uniform(-1, 1, 2) * end[others], [(-end[i], end[i]) for i in others]
            lowest = min(lowest, minimize(of_face, start, bounds=bounds).fun)
    assert lowest * (1 - 1e-5) < level_of(proof) < lowest * (1 + 1e-7)
    assert all(finding.verified for finding in verify(proof, config).findings)
    # It is not the energy without a limit, nor that with a smooth one.
    smooth = level_of(prove(paper({"limit": {"H": SMALL.tolist()}})))
    assert smooth < 0.97 * lowest < 0.85 * level_of(prove(rbstab.load_config(PAPER)))


def test_a_hard_limit_of_a_body_that_is_not_held_is_in_no_proof():
    """H = -sat(K_t X) is softer than its spring, so nothing is eliminated there."""
    connector = connected({"limit": [300, 300, 300], "law": "hard"})
    proof = prove(rbstab.load_config(connector))
    assert not proof.proved
    assert "a hard limit acts on the position of a body that is not held" in proof.outcome


@pytest.mark.parametrize("share", [0.1, 0.04])
def test_limits_far_below_the_largest_forces_are_proved_as_well(share):
    limits = {"H": share * H, "N": share * N}
    proof = prove(paper({"limit": {name: M.tolist() for name, M in limits.items()}}))
    lowest = lowest_on_faces(**limits)
    assert lowest * (1 - 1e-5) < level_of(proof) < lowest * (1 + 1e-7)


def test_an_embedded_tie_with_a_limit_is_proved():
    """By hand: at rest Λ = sat(K_c (E - D)) = K_d D, a convex problem in D at each attitude."""
    M, K_c, K_d = np.array([300.0] * 3), np.array([900.0, 700, 800]), np.array([600.0, 500, 700])
    point, held = np.array([0.1, 0, 0.4]), np.array([0, 0.3, 0.1])
    ends = {"point": point.tolist(), "anchor": point.tolist()}
    tie = {"kind": "embedded", **ends, "actuators": {"limit": M.tolist()}}
    tie |= {"K_c": K_c.tolist(), "L_c": [50] * 3, "K_d": K_d.tolist(), "L_d": [60] * 3}
    data = {
        "schema_version": 2,
        "body": {"mass": 5, "inertia": [1, 1, 1], "contact_point": held.tolist()},
        "gravity": [0, 0, -9.81],
        "controller": {"variant": "permanent", "K_r": [300] * 3, "L_r": [20] * 3},
        "elements": {"tie": tie},
        "integration": {"duration": 0.1},
    }
    proof = prove(rbstab.load_config(data))
    assert proof.proved

    def stored(q):
        A, D = rotated(q[:3]), q[3:]
        x = A @ (point - held) + held - point - D
        spring = M**2 / K_c * (np.sqrt(1 + (K_c * x / M) ** 2) - 1)
        height = (held - A @ held)[2]
        rest = 0.5 * D @ (K_d * D) + 150 * q[:3] @ q[:3] + 5 * 9.81 * height
        return spring.sum() + rest

    lowest = minimize(stored, np.zeros(6), options={"gtol": 1e-9}).x
    assert len(proof.states) == 1
    np.testing.assert_allclose(proof.states[0].orientation, lowest[:3], atol=1e-6)


def test_a_couple_with_a_lag_acts_on_euler_angles_even_without_a_spring():
    config = free(
        {"lag": 0.01}, elements={"up": {"kind": "attitude", "K": [9, 8, 7], "L": [3, 3, 3]}}
    )
    config = rbstab.load_config(config, ["controller.K_r=[0,0,0]"])
    assert config.integration.coordinates != "quaternion"
    assert prove(config).on_rotations is None


def test_numbers_of_motors_have_keys_and_units():
    config, tied = paper(LIMITS), with_tie({"lag": 0.02})
    keys = {entry.key: entry.value for entry in entries_of(config)}
    assert keys["controller.actuators.limit.N[1]"] == N[1]
    assert unit_at(config, "controller.actuators.limit.H") == "N"
    assert unit_at(config, "controller.actuators.limit.N[1]") == "N m"
    of_tie = {entry.key: entry.value for entry in entries_of(tied)}
    assert of_tie["elements.tie.actuators.lag"] == 0.02
    assert unit_at(tied, "elements.tie.actuators.lag") == "s"
    assert unit_at(with_tie({"limit": [1, 2, 3]}), "elements.tie.actuators.limit[0]") == "N"


def test_a_lag_beside_implicit_steps_is_refused():
    data = free({"lag": 0.01}).plain()
    data["controller"] |= {"variant": "sliding", "K_s": [9, 9, 9], "surface": {"slope": 2.0}}
    data["controller"] |= {"law": {"implicit": 0.001}}
    with pytest.raises(ConfigError, match="has implicit steps beside actuators"):
        rbstab.load_config(data)


CONNECTOR = {"K_c": [12300, 12300, 12300], "L_c": [600, 600, 600]}
OWN = {"K_d": [9000, 9000, 9000], "L_d": [900, 900, 900]}


def connected(actuators, variant="visco-elastic", **more):
    """The body of `free` with a connector whose motors are given."""
    data = free({"lag": 0.01}).plain()
    gains = CONNECTOR | (OWN if variant == "embedded" else {}) | more
    data["controller"] |= {"variant": variant, **gains, "connector_actuators": actuators}
    data["controller"].pop("actuators", None)
    return data


def test_a_connector_has_motors_of_its_own():
    config = rbstab.load_config(connected({"limit": [300, 200, 100]}))
    (answer,) = motor_answers(config)
    assert str(answer) == "Motor connector: its limit keeps it passive, proved"
    assert unit_at(config, "controller.connector_actuators.limit[1]") == "N"
    keys = {entry.key: entry.value for entry in entries_of(config)}
    assert keys["controller.connector_actuators.limit[1]"] == 200
    # The lag is that of the connector alone: 600/12300 s is its longest passive one.
    for lag, passive in ((0.048, True), (0.049, False)):
        late = rbstab.load_config(connected({"lag": lag}))
        (answer,) = motor_answers(late)
        assert answer.passive == passive
        run = rbstab.simulate(late)
        assert ("supplied_energy" in run) != passive
        assert run["connector.lagged_velocity"].shape == run["velocity"].shape


@pytest.mark.parametrize(
    ("actuators", "variant", "problem"),
    [
        ({"lag": 0.01}, "embedded", "has a lag beside the own state D, which together are not sho"),
        ({"limit": [1, 1, 1], "law": "hard"}, "embedded", "(expected law: smooth)"),
        ({}, "embedded", "has neither limit nor lag"),
        ({"limit": [1, 1, 1], "lag": 0.1}, "visco-elastic", "has both limit and lag"),
        ({"limit": {"H": [1, 1, 1]}}, "visco-elastic", "limit"),
        ({"limit": [1, 1, 1]}, "free", "is not a key of the variant free (it belongs to visco-"),
    ],
)
def test_wrong_motors_of_connectors_are_refused(actuators, variant, problem):
    with pytest.raises(ConfigError) as caught:
        rbstab.load_config(connected(actuators, variant))
    assert "connector_actuators" in str(caught.value)
    assert problem in str(caught.value)


def test_a_limited_connector_needs_diagonal_gains():
    matrix = [[900, 1, 0], [1, 900, 0], [0, 0, 900]]
    with pytest.raises(ConfigError, match="K_c is not the diagonal of a positive matrix"):
        rbstab.load_config(connected({"limit": [1, 1, 1]}, K_c=matrix))
    hard = connected({"limit": [1, 1, 1], "law": "hard"})
    hard["integration"] |= {"method": "LSODA"}
    with pytest.raises(ConfigError, match=r"switch.* of controller\.connector_actuators"):
        rbstab.load_config(hard)
