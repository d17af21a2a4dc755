"""Protects the stored form of claims on disturbances: nothing in it is lost or mistaken."""

import json
from fractions import Fraction

import pytest
from support.disturbed import COUPLE, FORCE, forms_of_config, full_config, tied_config

from rbstab.proof.disturbed.invariant import Claim
from rbstab.proof.disturbed.record import (
    Stated,
    claim_record,
    difference_from,
    read_claim,
    read_stated,
)
from rbstab.proof.record import WrongRecordError

FORMS = {
    "held": forms_of_config(tied_config("permanent")),
    "many parts": forms_of_config(full_config(), COUPLE, FORCE),
}
THIRD = Fraction(1, 3)


def record_of(forms, count):
    given = dict(zip((COUPLE, FORCE)[:count], (Fraction(20), 5 * THIRD), strict=False))
    weights = (THIRD, 2 * THIRD)[:count]
    claim = Claim(THIRD, tuple(given.values()), weights, THIRD, 4 * THIRD, 7 * THIRD)
    return claim, json.loads(json.dumps(claim_record(Stated(given, THIRD), forms, claim)))


@pytest.mark.parametrize(("name", "count"), [("held", 1), ("many parts", 2)])
def test_what_is_stored_is_read_again_without_any_rounding(name, count):
    forms = FORMS[name]
    claim, record = record_of(forms, count)
    stored, numbers = read_claim(record)
    assert numbers == claim
    assert (stored.rates, stored.still) == (forms.rates, forms.still)
    assert stored.value(THIRD) == forms.value(THIRD)
    assert stored.rest.tolist() == forms.rest.tolist()
    assert difference_from(record, forms) is None
    given, tilt = read_stated(record)
    assert (tuple(given), tilt) == ((COUPLE, FORCE)[:count], THIRD)


@pytest.mark.parametrize("key", ["values", "rates"])
def test_an_entry_that_is_another_one_is_found(key):
    forms = FORMS["held"]
    _, record = record_of(forms, 1)
    record[key][1][2][1] = record[key][0][0][0]
    assert difference_from(record, forms) == "V, or V', is different"


def test_the_claim_about_another_body_is_not_about_this_one():
    other = tied_config("permanent", K_r=[400, 400, 321])
    _, record = record_of(FORMS["held"], 1)
    assert difference_from(record, forms_of_config(other)) == "V, or V', is different"


@pytest.mark.parametrize(
    "change",
    [
        *({"version": 2}, {"level": "x"}, {"operations": []}, {"values": 5}),
        *({"loads": [{"size": "1"}]}, {"rate": "0"}, {"level": 0}),
        {"level": "1e999999"},
        {"loads": 2 * [{"kind": "couple", "point": [0, 0, 0], "size": "1", "weight": "1"}]},
        {"loads": [{"kind": "power", "point": [0, 0, 0], "size": "1", "weight": "1"}]},
    ],
)
def test_what_cannot_be_read_is_refused(change):
    _, record = record_of(FORMS["held"], 1)
    with pytest.raises(WrongRecordError):
        read_claim(record | change)
