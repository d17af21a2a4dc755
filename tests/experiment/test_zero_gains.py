"""Bodies without some of the springs and dampers of the two stabilizers: runs, answers, proofs."""

from typing import Any

import numpy as np
import pytest
from support.leg import BODY

import rbstab
from rbstab.config.tolerances import tolerances_of
from rbstab.experiment.answers.run_answer import answer_of
from rbstab.experiment.robust.bodies import prove_within

TIE = {"K_c": [4000, 4000, 40000], "L_c": [80, 80, 200]}
EMBEDDED = TIE | {"K_d": [4000, 4000, 40000], "L_d": [80, 80, 200]}
TURNING = {"K_r": [10, 10, 5], "L_r": [0.8, 0.8, 0.3]}
# A rod that leans: k θ = m g l sin θ, with m g l = 6.386 N m and k = 5 N m/rad.
LEANING = 1.18190
"""rad: 67.7°."""

VARIANTS: dict[str, dict[str, Any]] = {
    "free": {},
    "permanent": {},
    "visco-elastic": TIE,
    "embedded": EMBEDDED,
    "sliding": {"K_s": [100, 100, 100], "surface": {"slope": 20}},
}


def leg(variant, *, duration=5.0, **gains):
    start: dict[str, Any] = {
        "orientation": [0.1, 0.17, 0.0],
        "angular_velocity": [0.0, 2.0, 0.0],
    }
    return {
        "body": BODY,
        "gravity": [0, 0, -9.81],
        "controller": {"variant": variant, **VARIANTS[variant], **gains},
        "initial": start | ({} if variant == "permanent" else {"attached": True}),
        "integration": {"duration": duration, "samples": 51},
    }


@pytest.mark.heavy
@pytest.mark.parametrize("variant", ["permanent", "visco-elastic", "embedded"])
def test_a_leg_keeps_its_proofs_without_the_translational_stabilizer(variant):
    """m g l = 6.386 N m: it stands on 10 N m/rad, and leans on 5."""
    stands = rbstab.prove(leg(variant, **TURNING))
    assert stands.proved
    assert len(stands.states) == 1
    assert stands.globally_stable
    falls = rbstab.prove(leg(variant, **TURNING | {"K_r": [5, 5, 2.5]}))
    assert falls.proved
    stable = [state for state in falls.states if state.index == 0]
    lean = max(np.abs(state.orientation).max() for state in stable)
    if variant == "permanent":
        assert lean == pytest.approx(LEANING, abs=1e-4)
    assert len(falls.states) > 1


@pytest.mark.heavy
def test_all_legs_within_tolerances_are_proved_without_the_translational_stabilizer():
    config = rbstab.load_config(leg("visco-elastic", **TURNING))
    assert prove_within(config, tolerances_of(config, ["controller=±1%"])).proved is True
    # The largest bodies of this box have no damper of θ2.
    wide = prove_within(config, tolerances_of(config, ["controller.L_r[1]=±0.8"]))
    assert wide.proved is None
    assert "only connector may damp a rotation about body y" in wide.why
    assert "L_r is singular" in wide.why


REASONS = [
    ("permanent", {}, "no damper acts on the body (L_t is 0 and L_r is 0)"),
    ("permanent", {"K_r": [10, 10, 5]}, "no damper acts on the body (L_t is 0 and L_r is 0)"),
    ("permanent", {"L_r": [1, 0, 1]}, "no damper acts on a rotation about body y"),
    ("free", {}, "no damper acts on the body (L_t is 0 and L_r is 0)"),
    ("free", TURNING, "no damper acts on a translation (L_t is 0)"),
    ("free", TURNING | {"L_t": [1, 1, 1]}, "nothing holds the position"),
    ("visco-elastic", {}, "no damper acts on a rotation about body x through (0, 0, -0.186) m"),
    # They may turn freely about the vertical through the contact point.
    ("visco-elastic", {"L_r": [1, 1, 1]}, "a continuum (a family)"),
    ("permanent", {"L_r": [1, 1, 1], "K_r": [10, 10, 0]}, "a continuum (a family) of rest states"),
]


@pytest.mark.heavy
@pytest.mark.parametrize(("variant", "gains", "reason"), REASONS)
def test_nothing_is_proved_where_a_hypothesis_fails(variant, gains, reason):
    proof = rbstab.prove(leg(variant, **gains), brief=True)
    assert not proof.proved
    assert not proof.globally_stable
    assert reason in proof.ended


@pytest.mark.heavy
@pytest.mark.parametrize("engine", ["scipy", "heyoka"])
@pytest.mark.parametrize("variant", VARIANTS)
def test_a_body_without_stabilizers_moves(variant, engine):
    """Its answers are never *proved*, and no number of them is NaN."""
    config = leg(variant, duration=0.5)
    config["integration"]["engine"] = engine
    result = rbstab.simulate(config, proof=rbstab.prove(config, brief=True))
    assert result.status == "completed"
    answer = answer_of(result)
    assert "proved" not in {answer.this_start.sureness, answer.whole_range.sureness}
    assert "nan" not in str(answer).split()
    if variant in {"free", "permanent"}:
        energy = result["energy"].sum(axis=1)
        np.testing.assert_allclose(energy, energy[0], rtol=1e-9, atol=1e-9)
