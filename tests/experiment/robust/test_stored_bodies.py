"""Proofs for all bodies within tolerances: records, files, ids, and the largest tolerance."""

from fractions import Fraction

import pytest
from support.bodies import HEAVY, config_of

from rbstab.config.tolerances import tolerances_of
from rbstab.experiment.robust import bodies
from rbstab.experiment.robust.bodies import all_bodies, bodies_for, bodies_id, prove_within
from rbstab.experiment.robust.largest import largest_within
from rbstab.experiment.robust.record import BodiesRecord, bounds_of
from rbstab.experiment.robust.sentences import largest_sentences, within_sentences

TEXTS = ["controller.K_r=±10%", "body.contact_point=±0.01"]


@pytest.fixture(scope="module")
def record():
    """The proof for the permanent body."""
    config = config_of("permanent")
    return prove_within(config, tolerances_of(config, TEXTS))


def test_a_stored_proof_is_read_again(tmp_path, monkeypatch):
    config = config_of("permanent")
    tolerances = tolerances_of(config, TEXTS)
    first = bodies_for(tmp_path, config, tolerances)
    (file,) = (tmp_path / "proofs").iterdir()
    assert file == BodiesRecord.file(tmp_path, first.id)

    def fail(*_):
        raise AssertionError("it is made again")

    monkeypatch.setattr(bodies, "prove_within", fail)
    assert bodies_for(tmp_path, config, tolerances) == first
    # The order of the tolerances, the initial state and the integration have no effect.
    turned = tolerances_of(config, TEXTS[::-1])
    other = config_of("permanent", initial={"orientation": [0.1, 0.2, 0.3]})
    assert bodies_for(tmp_path, other, turned) == first


@pytest.mark.parametrize("damage", ["", "edited"])
def test_a_damaged_proof_is_missing(tmp_path, record, damage):
    """So is one that was edited, and the file of another proof is not taken for this one."""
    record.keep(tmp_path)
    file = BodiesRecord.file(tmp_path, record.id)
    assert BodiesRecord.kept(tmp_path, record.id) == record
    whole = file.read_text()
    text = whole.replace('"proved":true', '"proved":false') if damage == "edited" else damage
    file.write_text(text)
    assert BodiesRecord.kept(tmp_path, record.id) is None
    assert all_bodies(tmp_path) == []
    BodiesRecord.file(tmp_path, "1" * 32).write_text(whole)
    assert BodiesRecord.kept(tmp_path, "1" * 32) is None


def test_id_depends_on_body_tolerances_and_equations(monkeypatch):
    config = config_of("permanent")
    ids = {
        bodies_id(body, bounds_of(tolerances_of(body, [text])))
        for body in (config, config_of("permanent", scale=0.5), config_of("visco-elastic"))
        for text in ("controller.K_r=±10%", "controller.K_r=±10.1%", "controller.K_t=±10%")
    }
    assert len(ids) == 9
    before = bodies_id(config, ())
    monkeypatch.setattr("rbstab.experiment.robust.bodies.equations_of", lambda _: "other")
    assert bodies_id(config, ()) != before


def test_a_false_claim_names_the_body():
    config = config_of("permanent", scale=0.2)
    texts = ["controller.K_t=±5%"]
    proof = prove_within(config, tolerances_of(config, texts))
    assert proof.proved is False
    assert len(proof.rest_states) > 1
    (sentence,) = within_sentences(texts, proof)
    assert sentence.startswith("For every body within controller.K_t ±5 %: one rest state: false")
    assert sentence.endswith("rad: that of the config.")
    key = "controller.K_t[0]"
    moved = proof.model_copy(update={"body": {**(proof.body or {}), key: "4000.5"}})
    (sentence,) = within_sentences(texts, moved)
    assert sentence.endswith(f"rad: {key} = 4000.5; the rest as in the config.")


HEAVY_BODY, FIXED = config_of("permanent", gravity=HEAVY), ["body.contact_point=±0.01"]


def fake(record, threshold, tried):
    """Return a function that "proves" percentages up to a threshold."""

    def prove(tolerances):
        fixed, *_, varied = tolerances
        assert (fixed.entry.key, fixed.radius) == ("body.contact_point[0]", Fraction(1, 100))
        percent = float(100 * varied.radius / abs(varied.middle))
        tried.append(percent)
        return record.model_copy(update={"proved": True if percent <= threshold else None})

    return prove


@pytest.mark.parametrize("threshold", [0.05, 3.21, 640.0])
def test_largest_is_found_to_one_percent(record, threshold):
    tried: list[float] = []
    largest = largest_within(HEAVY_BODY, fake(record, threshold, tried), "gravity", FIXED)
    assert largest.percent is not None
    assert largest.not_proved is not None
    assert float(largest.percent) <= threshold < float(largest.not_proved)
    assert largest.not_proved - largest.percent <= largest.percent / 100
    assert len(tried) == len(set(tried)) < 20


def test_largest_tells_what_it_has_at_its_limit_of_time(record):
    tried: list[float] = []
    largest = largest_within(
        HEAVY_BODY, fake(record, 3.21, tried), "gravity", FIXED, is_late=lambda: len(tried) == 3
    )
    # 1 % and 2 % are proved, and 4 % is not.
    assert largest.late
    assert (largest.percent, largest.not_proved) == (Fraction(2), Fraction(4))
    first = largest_sentences(largest, FIXED)[0]
    assert "found by the time limit: ±2 %, proved. At ±4 % it is not decided" in first


def test_largest_ends_where_the_bounds_are_no_config(record):
    """Gains cannot be negative, so 101 % is not valid; here every valid percentage is "proved"."""
    config = config_of("permanent")
    largest = largest_within(config, lambda _: record, "controller", [])
    assert largest.why is None
    assert largest.percent == Fraction(100)
    assert "a bound is not a valid number" in largest_sentences(largest, [])[0]


def test_dampings_must_be_definite_for_each_body():
    """With both entries high, or both low, the least eigenvalue is 41 - 25 N m s/rad.

    With one high and one low, it is 41 - 2 * 25 N m s/rad.
    """
    matrix = [[41, 0, 0], [0, 41, 25], [0, 25, 41]]
    config = config_of("permanent", controller={"L_r": matrix})
    texts = ["controller.L_r[0][1]=±25", "controller.L_r[0][2]=±25"]
    proof = prove_within(config, tolerances_of(config, texts))
    assert (proof.proved, proof.why) == (None, "L_r is not positive definite for each body")
