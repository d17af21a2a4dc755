"""Protects the JSON Schema of plans for editors: it accepts and refuses the same as the program."""

from pathlib import Path

import pytest
from support.json_schemas import schema_errors, validator_of

from rbstab.config.source import read_source
from rbstab.sweep.plan.plan_file import plan_json_schema

READY = Path(__file__).parents[3] / "configs" / "sweeps"

PLAN = "base: free.yaml\nvary:\n"
DRAWN = "design: random\nmembers: 5\nseed: 1\n"

ACCEPTED = [
    PLAN + "  body.mass: {values: [1]}\n",
    PLAN + "  body.mass: {scale: {logspace: [0, 1, 3]}}\nkeep: {traces: {every: 3}}\n",
    PLAN + "  a: {zip: {body.mass: {scale: {values: [2]}}}}\nkeep: {traces: [0]}\n",
    PLAN
    + "  body.mass: {normal: [50, 1]}\n  a: {each: {zip: {'gravity[0]': {values: [1]}}}}\n"
    + DRAWN,
    PLAN + "  controller.variant: {values: [free]}\ndesign: grid\nschema_version: 1\n",
    PLAN + "  body.mass: {values: [1]}\nprove: motion\n",
    PLAN + "  body.mass: {values: [1]}\nprove: {motion: {steps: 2000, members: 1}}\n",
]

REFUSED = [
    "",
    "vary:\n  body.mass: {values: [1]}\n",
    PLAN + "  body.mass: 5\n",
    PLAN + "  body.mass: {values: []}\n",
    PLAN + "  body.mass: {values: [x]}\n",
    PLAN + "  body.mass: {valeus: [1]}\n",
    PLAN + "  body.mass: {values: [1], normal: [1, 2]}\n",
    PLAN + "  body.mass: {linspace: [1, 2]}\n",
    PLAN + "  body.mass: {linspace: [1, 2, 0]}\n",
    PLAN + "  body.mass: {linspace: [1, 2, 1.5]}\n",
    PLAN + "  body.mass: {scale: {scale: {values: [1]}}}\n",
    PLAN + "  a: {zip: {}}\n",
    PLAN + "  a: {zip: {body.mass: {each: {values: [1]}}}}\n",
    PLAN + "  body.mass: {values: [1]}\nmembers: 5\n",
    PLAN + "  body.mass: {values: [1]}\nseed: 5\n",
    PLAN + "  body.mass: {values: [1]}\ndesign: random\nmembers: 5\n",
    PLAN + "  body.mass: {values: [1]}\ndesign: cube\n",
    PLAN + "  body.mass: {values: [1]}\nkeep: all\n",
    PLAN + "  body.mass: {values: [1]}\nkeep: {traces: {every: 0}}\n",
    PLAN + "  body.mass: {values: [1]}\nprove: all\n",
    PLAN + "  body.mass: {values: [1]}\nprove: {motion: [3]}\n",
    PLAN + "  body.mass: {values: [1]}\nprove: {motion: {steps: 2001}}\n",
    PLAN + "  body.mass: {values: [1]}\nprove: {motion: {members: 0}}\n",
    PLAN + "  body.mass: {values: [1]}\ncolour: red\n",
    PLAN + "  body.mass: {values: [1]}\nschema_version: 2\n",
]


@pytest.fixture(scope="module")
def validator():
    return validator_of(plan_json_schema())


@pytest.mark.parametrize("text", ACCEPTED)
def test_both_accept(validator, load, text):
    load(text)
    assert schema_errors(validator, text) == []


@pytest.mark.parametrize("text", REFUSED)
def test_both_refuse(validator, complaints, text):
    complaints(text)
    assert schema_errors(validator, text)


@pytest.mark.parametrize("path", sorted(READY.glob("*")), ids=lambda path: path.stem)
def test_the_ready_plans(validator, path):
    assert list(validator.iter_errors(read_source(path).data)) == []
