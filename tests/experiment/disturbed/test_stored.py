"""Protects the stored proofs of bounds on disturbances: they are about their body and its start."""

import json
from fractions import Fraction
from typing import Any

import pytest
from support.config_elements import config_data

import rbstab
from rbstab.experiment.answers.run_answer import answer_of
from rbstab.experiment.answers.words import Sureness
from rbstab.experiment.disturbed import prove_bound as prove
from rbstab.experiment.disturbed import stored as proofs
from rbstab.experiment.disturbed.prove_bound import prove_bound
from rbstab.experiment.disturbed.stored import bound_file
from rbstab.store.document import write_document

# Without K_t and L_t V has few terms, and proofs are quick; without a weight it rests at Θ = 0.
HELD = {"variant": "permanent", "K_r": [400, 400, 320], "L_r": [60, 60, 42]}
DATA: dict[str, Any] = config_data({}, HELD) | {"gravity": [0, 0, 0], "initial": {}}
DATA |= {"bound": {"couple": 20, "tilt": 0.5}}
CONFIG = rbstab.load_config(DATA)
stated_in: Any = prove.stated_in
kept_bound: Any = proofs.kept_bound
bound_for: Any = proofs.bound_for


def changed(**sections):
    return rbstab.load_config(DATA | sections)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    folder = tmp_path_factory.mktemp("results")
    bound_for(folder, CONFIG)
    return folder


@pytest.mark.slow
def test_the_stored_bound_is_the_one_that_was_proved(folder):
    stated = stated_in(CONFIG)
    made = prove_bound(CONFIG, stated.given, stated.tilt)
    assert made.proved
    assert kept_bound(folder, CONFIG) == made


@pytest.mark.slow
def test_the_level_that_is_printed_is_the_one_that_was_proved(folder):
    bound = kept_bound(folder, CONFIG)
    printed = bound.claimed.rpartition(" V < ")[2].removesuffix(" J")
    assert Fraction(printed) == bound.claim.level


@pytest.mark.slow
def test_of_another_start_it_has_another_v(folder):
    turned = changed(initial={"orientation": [0.2, 0, 0]})
    found, stated = kept_bound(folder, turned), stated_in(turned)
    assert found == prove_bound(turned, stated.given, stated.tilt)
    assert found.start > kept_bound(folder, CONFIG).start == 0.0
    assert "is one of these starts" in found.about_start
    fast = kept_bound(folder, changed(initial={"angular_velocity": [50, 0, 0]}))
    assert fast.proved
    assert "is not one of these starts" in fast.about_start


@pytest.mark.slow
@pytest.mark.parametrize(
    "sections",
    [
        {"bound": {"couple": 20.5, "tilt": 0.5}},
        {"bound": {"couple": 20, "tilt": 0.51}},
        {"bound": {"force": 20, "tilt": 0.5}},
        {"controller": {**HELD, "K_r": [400, 400, 321]}},
        {"desired": {"orientation": [0.1, 0, 0]}},
    ],
)
def test_it_says_nothing_of_another_bound_or_body(folder, sections):
    assert kept_bound(folder, CONFIG) is not None
    assert kept_bound(folder, changed(**sections)) is None


@pytest.mark.slow
@pytest.mark.parametrize("place", ["size", "tilt", "digest"])
def test_a_stored_bound_that_was_changed_is_made_again(folder, tmp_path, place):
    whole = bound_file(folder, CONFIG, stated_in(CONFIG)).read_text()
    data = json.loads(whole)
    file = bound_file(tmp_path, CONFIG, stated_in(CONFIG))
    file.parent.mkdir()
    if place == "size":
        data["claim"]["loads"][0]["size"] = "19"
    elif place == "tilt":
        data["claim"]["tilt"] = "2/5"
    del data["digest"]
    write_document(file, data)
    if place == "digest":
        file.write_text(whole.replace('"20"', '"21"'))
    assert kept_bound(tmp_path, CONFIG) is None
    assert bound_for(tmp_path, CONFIG).proved
    assert kept_bound(tmp_path, CONFIG).proved


def _fewer_rows(claim):
    del claim["values"][1][2]


def _fewer_entries(claim):
    del claim["rates"][1][4][2]


def _shorter_rest(claim):
    del claim["rest"][2]


def _no_rest(claim):
    claim["rest"] = "1/3"


def _other_variable(claim):
    claim["operations"][claim["operations"].index(["var", 0])] = ["var", 7]


@pytest.mark.slow
@pytest.mark.parametrize(
    "change", [_fewer_rows, _fewer_entries, _shorter_rest, _no_rest, _other_variable]
)
def test_a_stored_bound_with_parts_that_do_not_fit_is_no_proof(folder, tmp_path, change):
    data = json.loads(bound_file(folder, CONFIG, stated_in(CONFIG)).read_text())
    del data["digest"]
    change(data["claim"])
    file = bound_file(tmp_path, CONFIG, stated_in(CONFIG))
    file.parent.mkdir()
    write_document(file, data)
    assert kept_bound(tmp_path, CONFIG) is None


@pytest.mark.slow
def test_the_answers_of_a_run_say_how_sure_it_is(folder):
    result = rbstab.simulate(CONFIG)
    assert answer_of(result, changed(bound=None)).bound is None
    missing: Any = answer_of(result, CONFIG).bound
    assert missing.sureness is Sureness.NOT_DECIDED
    assert "no proof of the stated bound is stored" in missing.sentence
    proved: Any = answer_of(result, CONFIG, bound=kept_bound(folder, CONFIG)).bound
    assert proved.sureness is Sureness.PROVED
    assert proved.sentence.startswith("any disturbance couple up to 20 N m keeps the tilt of this")
    large = changed(bound={"couple": 1e6, "tilt": 0.5})
    open_: Any = answer_of(result, large, bound=bound_for(folder, large)).bound
    assert open_.sureness is Sureness.NOT_DECIDED
    assert "for ever: the best V that was found allows a couple up to" in open_.sentence
    assert kept_bound(folder, large).why == bound_for(folder, large).why
