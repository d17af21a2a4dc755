"""Proofs of bodies with elements of all kinds are verified, and none that is changed."""

from collections.abc import Callable
from fractions import Fraction
from functools import cache
from pathlib import Path
from typing import Any

import pytest
from support.config_elements import BAND, HELD, RANGE, STRUT, UPRIGHT, config_data, guard
from support.paper_runs import paper_config
from support.proved_code import OUTWARDS
from support.user_code import loaded_with, python_section

from rbstab.config.load import load_config
from rbstab.config.schema import Config
from rbstab.experiment.proof import prove
from rbstab.experiment.stored_proof.proof import Proof
from rbstab.experiment.verification.verify import verify
from rbstab.proof.record import expression_of


def _code(text, **parameters):
    Path("mine.py").write_text(text, encoding="utf-8")
    return loaded_with({"one": python_section(**parameters)})


def _of(elements, controller=HELD):
    return load_config(config_data(elements, controller))


GUARDED = Path(__file__).parents[3] / "configs/examples/stability/fast_guarded.yaml"

KINDS: dict[str, Callable[[], Config]] = {
    "embedded": lambda: load_config(paper_config("embedded", with_gravity=True)),
    "barrier": lambda: load_config(GUARDED),
    "stop": lambda: _of({"one": guard("stop", restitution=0.5, angle=0.5)}),
}
HEAVY_KINDS: dict[str, Callable[[], Config]] = {
    "attitude": lambda: _of({"upright": UPRIGHT}),
    "barriers": lambda: _of({"range": RANGE}),
    "stiff guard": lambda: _of({"one": guard("stiff", stiffness=900.0, soft_angle=0.002)}),
    "repelling guard": lambda: _of({"one": guard("repelling", couple=90.0, soft_angle=0.002)}),
    "ridges": lambda: _code(OUTWARDS, k=30.0, soft=0.3),
    "ligament": lambda: _of({"one": BAND}),
    "spring": lambda: _of({"one": STRUT}),
}
ALL = [*KINDS, *(pytest.param(name, marks=pytest.mark.heavy) for name in HEAVY_KINDS)]
CLOSED = {"barrier", "barriers", "stop"}
"""Every start converges: no region is stored."""


@pytest.fixture(scope="module", autouse=True)
def folder(tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch:
        patch.chdir(tmp_path_factory.mktemp("elements"))
        yield


@cache
def _proved(kind):
    config = (KINDS | HEAVY_KINDS)[kind]()
    return config, prove(config)


def _refused(proof, config=None):
    return [finding.claim for finding in verify(proof, config).findings if not finding.verified]


@pytest.mark.parametrize("kind", ALL)
def test_a_proof_is_verified_and_read_as_it_was_stored(kind):
    config, proof = _proved(kind)
    assert proof.proved
    assert Proof.model_validate_json(proof.model_dump_json()) == proof
    assert _refused(proof, config) == []


Data = dict[str, Any]


def _other_factor(data):
    """Make the last term of the energy one per cent larger."""
    last = data["reduced_energy"]["operations"][-1]
    last[-2] = str(Fraction(last[-2]) * Fraction(101, 100))


def _relabelled_factor(data):
    """Change the digest too."""
    _other_factor(data)
    energy = data["reduced_energy"]
    energy["digest"] = expression_of(energy["operations"]).digest


def _no_state(data):
    del data["states"][-1]
    data.update(unique=False, region=None, regions=[], closed=None)
    data["unique"] = len(data["states"]) == 1


def _moved(data):
    for corner in data["states"][0]["enclosure"]:
        corner[0] += 1e-3


def _other_index(data):
    data["states"][0]["index"] = 1
    data["closed"] = None


def _higher(data):
    region = data["region"] or data["regions"][0]
    region["energy_bound"] += 0.01 * max(region["level"], 1.0)


def _open_range(data):
    """Let no barrier or stop close the range."""
    data["closed"] = True
    data["reduced_energy"].update(closed=[], stop=None)


CHANGES: dict[str, tuple[Callable[[Data], None], str]] = {
    "a factor": (_other_factor, "energy"),
    "a factor and its digest": (_relabelled_factor, "energy"),
    "a state removed": (_no_state, "no other rest state"),
    "a moved enclosure": (_moved, "rest states"),
    "another index": (_other_index, "rest states"),
    "a higher region": (_higher, "region"),
}


@pytest.mark.parametrize("change", CHANGES)
@pytest.mark.parametrize("kind", ALL)
def test_a_changed_proof_is_refused(kind, change):
    config, proof = _proved(kind)
    data = proof.model_dump(mode="json") | {"unwrapped": None}
    make, claim = CHANGES[change]
    if change == "a higher region" and kind in CLOSED:
        assert proof.every_start
        make, claim = _open_range, "every start"
    make(data)
    refused = _refused(Proof.model_validate(data), config)
    assert any(claim in text for text in refused)
