"""Protects the check of claims on disturbances: true ones are verified, and no false one is.

V and V' of a held body are compared with equations of the tests' own (`support.disturbed.Held`).
"""

import copy
import json
from fractions import Fraction
from itertools import product
from typing import Any

import numpy as np
import pytest
from flint import arb, ctx
from support.disturbed import COUPLE, FORCE, Held, full_config

import rbstab
from rbstab.experiment.disturbed.prove_bound import prove_bound
from rbstab.proof.check.checker import check
from rbstab.proof.check.disturbances import _Claim, is_definite
from rbstab.proof.check.taylor import constant, leaf

SIZE = Fraction(12)
CONFIG = rbstab.load_config(
    {
        "body": {"mass": 2, "inertia": [1.0, 1.2, 0.9], "contact_point": [0.05, 0, -0.2]},
        "controller": {
            "variant": "permanent",
            "K_r": [[40, 3, 0], [3, 50, 0], [0, 0, 40]],
            "L_r": [10, 11, 9],
            "K_t": [20, 30, 10],
            "L_t": [2, 1, 1],
        },
        "initial": {},
        "integration": {"duration": 1},
    }
)


def record_of(config, loads, tilt=Fraction(1, 2)):
    found = prove_bound(config, loads, tilt)
    assert found.record is not None, found.why
    return json.loads(json.dumps(found.record))


@pytest.fixture(scope="module")
def true():
    return record_of(CONFIG, {COUPLE: SIZE})


def checked(record):
    (finding,) = check({"format": 1, "bound": record})
    return finding


@pytest.mark.slow
def test_a_true_claim_is_verified(true):
    finding = checked(true)
    assert (finding.about, finding.claim, finding.verified) == ("all disturbances", "bound", True)
    assert finding.boxes < 2000
    assert "up to w̄ = 12 takes the tilt to ρ = 1/2 rad" in finding.text


@pytest.mark.heavy
def test_a_claim_on_a_body_of_many_parts_is_verified_and_no_larger_one():
    record = record_of(full_config(), {COUPLE: Fraction(30), FORCE: Fraction(20)})
    assert checked(record).verified
    record["loads"][1]["size"] = "60"
    assert not checked(record).verified


@pytest.mark.slow
def test_its_matrices_are_those_of_the_equations_of_motion(true):
    held, claim, rng = Held(CONFIG), _Claim(true), np.random.default_rng(0)
    cross, rate, level = (float(Fraction(true[name])) for name in ("cross", "rate", "level"))
    weight, size = float(Fraction(true["loads"][0]["weight"])), float(SIZE)
    for _ in range(5):
        Theta, Omega, w = (scale * rng.normal(size=3) for scale in (0.4, 3.0, 9.0))

        def V(Theta, Omega):
            return held.value(Theta[:, None], Omega[:, None], cross).item()

        by_angles, by_rates = held.rates(*(x[:, None] for x in (Theta, Omega, w)))
        h = 1e-5
        ahead, back = (
            V(Theta + s * h * by_angles[:, 0], Omega + s * h * by_rates[:, 0]) for s in (1, -1)
        )
        v = V(Theta, Omega)
        falls = -(ahead - back) / (2 * h) - rate * (v - level) + weight * (w @ w - size**2)
        forms = claim.forms({k: leaf(k, arb(x)) for k, x in enumerate(Theta)}, 1)
        for entries, z, expected in (
            (claim.above, [1, *Omega], v - level),
            (claim.falling, [1, *Omega, *w], falls),
        ):
            M = np.zeros((len(z), len(z)))
            for i, row in enumerate(entries):
                for j, (added, terms) in enumerate(row):
                    total = arb(added) + sum(arb(c) * constant(forms[k]) for c, k in terms)
                    M[i, j] = M[j, i] = float(total)
            assert np.array(z) @ M @ np.array(z) == pytest.approx(expected, rel=1e-6, abs=1e-6)


def changed(record, path, factor):
    """Return a record with one number times a factor."""
    record = copy.deepcopy(record)
    *inner, last = path
    place: Any = record
    for key in inner:
        place = place[key]
    place[last] = str(Fraction(place[last]) * Fraction(factor))
    return record


FORGED: list[tuple[tuple[Any, ...], str]] = [
    (("loads", 0, "size"), "1.2"),
    (("level",), "1.2"),
    (("cross",), "2"),
    (("cross",), "-1"),
    (("rate",), "0.7"),
    (("loads", 0, "weight"), "1.3"),
    (("loads", 0, "weight"), "0.7"),
    (("tilt",), "0.9"),
    (("tilt",), "4"),
    (("level",), "-1"),
]


@pytest.mark.slow
@pytest.mark.parametrize(("path", "factor"), FORGED)
def test_a_forged_number_is_refused(true, path, factor):
    assert not checked(changed(true, path, factor)).verified


@pytest.mark.slow
def test_couples_that_break_the_bound_are_refused_with_any_numbers(true):
    """A couple that follows the motion drives the body beyond the tilt."""
    held, size = Held(CONFIG), 1.8 * float(SIZE)

    def load(t, Theta, Omega):
        return size * Omega / np.maximum(np.linalg.norm(Omega, axis=0), 1e-12)

    away = 0.01 * np.random.default_rng(0).normal(size=(3, 40))
    motion = held.driven(0 * away, away, load, 3.0, 5e-3)
    assert max(held.tilt(Theta).max() for Theta, _ in motion) > 0.5
    for level, share in product(("0.8", "1.05"), ("0.6", "0.95")):
        wrong = changed(changed(true, ("loads", 0, "size"), "1.8"), ("level",), level)
        spent = Fraction(wrong["rate"]) * Fraction(wrong["level"]) * Fraction(share)
        wrong["loads"][0]["weight"] = str(spent / Fraction(wrong["loads"][0]["size"]) ** 2)
        assert not checked(wrong).verified


@pytest.mark.slow
def test_a_changed_coefficient_of_the_dissipation_is_refused(true):
    """Of -V' the diagonal entry of Ω_2 is the damping less what the cross term brings."""
    wrong = copy.deepcopy(true)
    wrong["rates"][0][2][2] = wrong["rates"][0][0][0]  # nothing is dissipated
    assert not checked(wrong).verified


@pytest.mark.slow
@pytest.mark.parametrize(
    "change",
    [
        {"operations": [["var", 3]]},
        {"operations": [["tan", 0]]},
        {"values": [[[0]], [[0]]]},
        {"values": [4 * [[0]], 4 * [[0]]]},
        {"rates": 7},
        {"loads": []},
        {"level": 3.5},
    ],
    ids=str,
)
def test_what_is_no_claim_is_refused(true, change):
    finding = checked(true | change)
    assert (finding.about, finding.claim, finding.verified) == ("all disturbances", "record", False)


@pytest.mark.slow
def test_an_entry_that_is_no_operation_is_refused(true):
    wrong = copy.deepcopy(true)
    wrong["values"][0][0][0] = -1
    assert checked(wrong).claim == "record"


@pytest.mark.slow
@pytest.mark.parametrize("switch", [["step", 1], ["step", 3], ["positive"]], ids=str)
def test_a_claim_on_matrices_that_switch_is_refused(true, switch):
    """V' is large and positive near one θ1, which no middle of a box is close to."""
    wrong = copy.deepcopy(true)
    operations, W0 = wrong["operations"], wrong["rates"][0]
    n, angle, entry = len(operations), operations.index(["var", 0]), W0[1][1]
    operations += [["sum", "-123456/10000000", "1", angle], ["pow", 2, n]]
    operations += [["sum", "1/100000000", "-1", n + 1], [*switch, n + 2]]
    operations.append(["sum", "0", "1", entry, f"1{15 * '0'}", n + 3])
    W0[1][1] = n + 4
    finding = checked(wrong)
    assert (finding.claim, finding.verified) == ("record", False)
    assert "switch" in finding.text


@pytest.mark.slow
def test_a_claim_of_another_version_is_not_decided(true):
    finding = checked({"version": 2})
    assert (finding.claim, finding.verified) == ("version", False)


def planes(n, diagonal, slopes=(0, 0, 0), error=0.0, error_beside=0.0):
    """Return a diagonal matrix of planes with errors."""
    entries = {True: (diagonal, *slopes, error), False: (0, 0, 0, 0, error_beside)}
    return [[tuple(map(arb, entries[i == j])) for j in range(i + 1)] for i in range(n)]


@pytest.mark.parametrize("n", [1, 2, 5])
def test_errors_of_entries_count(n):
    """All I + R with |R_ij| <= r are definite if and only if r < 1/n."""
    with ctx.workprec(128):
        for r, expected in ((0.99 / n, True), (1.01 / n, False)):
            assert is_definite(planes(n, 1, error=r, error_beside=r)) is expected


@pytest.mark.parametrize("signs", list(product((-1, 1), repeat=3)))
def test_all_corners_count(signs):
    """1 + Σ s_k u_k is positive for all |u_k| <= 1 if and only if Σ |s_k| < 1."""
    for s, expected in (((0.4, 0.3, 0.2), True), ((0.4, 0.3, 0.31), False)):
        assert is_definite(planes(2, 1, [a * b for a, b in zip(s, signs, strict=True)])) is expected


def test_matrices_that_are_not_definite_are_never_called_so():
    rng = np.random.default_rng(1)
    for slack, expected in ((1e-9, True), (-1e-9, False)):
        A = rng.integers(-9, 10, size=(6, 5)).astype(float)
        M = A @ A.T + slack * np.eye(6)
        rows = [[(arb(M[i, j]), *[arb(0)] * 4) for j in range(i + 1)] for i in range(6)]
        with ctx.workprec(128):
            assert is_definite(rows) is expected
