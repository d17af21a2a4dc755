"""Protects what is proved about: the same energy of two descriptions, searches, closed forms.

The table of claims has the proofs of many bodies, with searches that find nothing against them.
Here are elements of users that it has not, and bodies that two configs describe.
"""

from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from scipy.optimize import brentq
from support.proved_code import (
    CUBIC_OF_CENTRE,
    REPELLING_GUARD,
    STIFF_GUARD,
)
from support.switching_cords import CLUTCH, CORD, REPELLING, STIFF, linear, text_of
from support.user_code import CREEPING_TIE, loaded_with, python_section
from support.user_code import TIE as TIE_CODE

from rbstab.analysis.rest_system import smooth_rest_system
from rbstab.config.build import problem_of, system_of
from rbstab.config.schema import Config
from rbstab.config.user_code.permission import without_code
from rbstab.experiment.proof import prove
from rbstab.experiment.stability import stability_of
from rbstab.experiment.stored_proof.identity import proof_id
from rbstab.experiment.stored_proof.proof import Proof
from rbstab.proof.record import energy_record
from rbstab.proof.rest_states import Body

CONFIGS = Path(__file__).parents[2] / "configs"
RANGE_END = np.array([np.pi, np.pi / 2, np.pi])
TEXTS = {
    "stiff": STIFF_GUARD,
    "repelling": REPELLING_GUARD,
    "cubic": CUBIC_OF_CENTRE,
    "tie": TIE_CODE,
    "creeping": CREEPING_TIE.read_text(encoding="utf-8").replace("CreepingTie", "Mine"),
    "cord": CORD,
    "stiff cord": text_of(STIFF),
    "repelling cord": text_of(REPELLING),
    "linear cord": linear(CORD),
    "linear stiff cord": linear(text_of(STIFF)),
    "linear repelling cord": linear(text_of(REPELLING)),
    "clutch": CLUTCH,
}
Elements = dict[str, Any]
POINT: Elements = {"point": [0.1, 0.2, -0.1], "anchor": [0.0, 0.3, 0.1]}
TIED: Elements = POINT | {
    "K_c": [[30.0, 2.0, 0.0], [2.0, 20.0, 1.0], [0.0, 1.0, 10.0]],
    "L_c": [[2.0, 1.0, 0.0], [1.0, 3.0, 0.5], [0.0, 0.5, 1.0]],
}
CREEP: Elements = TIED | {"K_d": [9.0, 8.0, 7.0], "L_d": [3.0, 2.0, 1.0]}
GAINS: Elements = {"K_t": [40, 40, 30], "L_t": [2, 2, 1], "L_r": [0.6, 0.6, 0.4]}


@pytest.fixture(scope="module", autouse=True)
def folder(tmp_path_factory):
    """The working folder, with a file for each text."""
    with pytest.MonkeyPatch.context() as patch:
        folder = tmp_path_factory.mktemp("elements")
        patch.chdir(folder)
        for name, text in TEXTS.items():
            (folder / f"{name}.py").write_text(text, encoding="utf-8")
        yield folder


def code(name, **parameters):
    return python_section(**parameters) | {"file": f"{name}.py"}


def guard(method, strength, soft):
    names = {"stiff": "stiffness", "repelling": "couple", "stop": "restitution"}
    angle = "angle" if method == "stop" else "soft_angle"
    return {"kind": "guard", "method": method, names[method]: strength, angle: soft}


def cord(name, soft=0.02):
    return code(name, point=[0, 0, 0.4], k=31.0, soft=soft)


def held(elements, stiffness=(4, 4, 3), **changes):
    """Return the config of a held body under a load."""
    controller = {"variant": "permanent", **GAINS, "K_r": list(stiffness)}
    return loaded_with(elements, controller=controller, **changes)


def tied(elements):
    return loaded_with(elements, "visco-elastic")


def stiff(elements):
    return held(elements, (20, 20, 20))


Of = Callable[[Elements], Config]
OUR_TIE = {"kind": "visco-elastic"} | TIED
OUR_CREEP = {"kind": "embedded"} | CREEP

PAIRS: dict[str, tuple[Of, Elements, Elements]] = {
    "a clutch, which stores nothing at rest": (stiff, {"one": cord("clutch")}, {}),
    "a tie": (tied, {"one": code("tie", **TIED)}, {"one": OUR_TIE}),
    "a creeping tie": (held, {"one": code("creeping", **CREEP)}, {"one": OUR_CREEP}),
    **{
        f"{method}, {soft} rad, {of.__name__}": (
            of,
            {"one": code(method, k=30.0, soft=soft)},
            {"one": guard(method, 30.0, soft)},
        )
        for method in ("stiff", "repelling")
        for soft, of in ((0.02, held), (0.3, held), (0.02, tied))
    },
    **{
        f"{kind}{method} cord, {of.__name__}": (
            of,
            {"one": cord(f"{kind}{method} cord")},
            {"one": cord(f"{kind}cord"), "range": guard(method, 31.0, 0.02)},
        )
        for kind, method, of in (
            ("", "stiff", stiff),
            ("linear ", "stiff", tied),
            ("linear ", "repelling", tied),
        )
    },
}
"""Two descriptions of one body: first in elements of users, then in those of the program."""


def body_of(config):
    """Return the body with its energy, as `prove` has it."""
    exact = partial(system_of, without_code(config))
    return Body(smooth_rest_system(problem_of(config)), exact)


@pytest.mark.parametrize("name", PAIRS)
def test_two_descriptions_of_a_body_have_the_same_energy(name):
    """All that is proved follows from the energy; it may be written in another order of sums."""
    of, *both = PAIRS[name]
    configs = [of(elements) for elements in both]
    assert proof_id(configs[0]) != proof_id(configs[1])
    first, second = (body_of(config) for config in configs)
    first_record, second_record = energy_record(first.energy), energy_record(second.energy)
    if "stiff" not in name:
        assert first_record == second_record
        return
    same = ("free", "stop", "closed")
    assert [first_record[key] for key in same] == [second_record[key] for key in same]
    steps = [
        {op[1] for op in record["operations"] if op[0] == "step"}
        for record in (first_record, second_record)
    ]
    assert steps == [{2}, {2}]
    points = np.random.default_rng(5).uniform(-1, 1, (50, 3)) * RANGE_END
    U, expected = (body.bounded.at(points.T)[0] for body in (first, second))
    np.testing.assert_allclose(U, expected, rtol=1e-12, atol=1e-12)


def test_the_rest_state_of_a_spring_that_stiffens_is_that_of_a_cubic_equation():
    """k z³ + K_t z + m g = 0; nothing turns the body but K_r, so c* is ½ K_r (π/2)²."""
    k, K_t, weight = 9000.0, 300.0, 2.0 * 9.81
    gains = {"K_t": [K_t] * 3, "L_t": [20, 20, 20], "K_r": [9, 9, 8], "L_r": [1, 1, 0.8]}
    config = loaded_with(
        {"one": code("cubic", k=[4000.0, 3000.0, k])},
        controller={"variant": "free", **gains},
        gravity=[0, 0, -9.81],
    )
    proof = prove(config)
    assert proof.globally_stable
    z = brentq(lambda z: k * z**3 + K_t * z + weight, -1, 0, xtol=1e-15)
    (state,) = proof.states
    np.testing.assert_allclose(state.orientation, 0, atol=1e-12)
    np.testing.assert_allclose(state.position, [0, 0, z], atol=1e-12)
    energy = 0.25 * k * z**4 + 0.5 * K_t * z**2 + weight * z
    assert state.energy == pytest.approx(energy, abs=1e-11)
    depth = 0.5 * 9 * (np.pi / 2) ** 2
    assert proof.region is not None
    assert proof.region.energy == pytest.approx(energy + depth, rel=1e-6)
    assert 0.99 * depth < proof.region.lower_bound <= proof.region.level
    assert "a length" not in " ".join(stability_of(problem_of(config), proof).statements)
    assert Proof.model_validate_json(proof.model_dump_json()) == proof


def test_a_soft_guard_raises_the_level_by_its_energy_at_the_end():
    """Without load, c* of case 1 is on θ2 = ±π/2, where the guard adds the same at each point."""
    path = CONFIGS / "paper" / "case1_permanent.yaml"
    data = yaml.safe_load(path.read_text(encoding="utf-8"))
    bare = prove(data).region
    data |= {"schema_version": 2, "elements": {"range": guard("stiff", 1e3, 1.2)}}
    proof = prove(data)
    assert proof.globally_stable
    assert not proof.every_start
    assert bare is not None
    assert proof.region is not None
    added = 500 * (np.pi / 2 - 1.2) ** 2
    assert proof.region.lower_bound == pytest.approx(bare.lower_bound + added, rel=1e-8)
