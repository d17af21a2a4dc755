"""Protects the arguments of the functions for notebooks: a path, plain data or a config, with the
same outcome; and what a proof shows of itself.
"""

from typing import Any

import pytest
from support.configs import PERMANENT, plain

import rbstab

SHORT = ["integration.duration=0.01", "integration.samples=3"]


@pytest.mark.parametrize("kind", ["path", "text of a path", "plain data", "config"])
def test_every_kind_of_argument(kind, tmp_path):
    path = tmp_path / "a.yaml"
    path.write_text(PERMANENT)
    config = rbstab.load_config(path)
    given: dict[str, Any] = {"path": path, "text of a path": str(path), "config": config}
    argument = given.get(kind, plain(PERMANENT))
    assert rbstab.load_config(argument) == config
    short = rbstab.load_config(argument, SHORT)
    assert short.integration.samples == 3
    assert short.body == config.body
    assert rbstab.prove(argument, search_only=True).id == rbstab.prove(config, search_only=True).id
    assert rbstab.simulate(short).attributes["title"] == config.title


def test_a_config_is_returned_as_it_is_and_never_changed():
    config = rbstab.load_config(plain(PERMANENT))
    assert rbstab.load_config(config) is config
    changed = rbstab.load_config(config, "body.mass=50")
    assert (config.body.mass, changed.body.mass) == (41.0, 50.0)
    with pytest.raises(rbstab.ConfigError, match=r"did you mean body\.mass"):
        rbstab.load_config(config, "mass=50")


def test_a_proof_shows_itself():
    proof = rbstab.prove(plain(PERMANENT))
    assert repr(proof) == f"<rbstab.Proof: 1 rest state, proved to be all, {proof.examined} boxes>"
    assert str(proof) == repr(proof)
    searched = rbstab.prove(plain(PERMANENT), search_only=True)
    assert "looked for, not proved" in repr(searched)
