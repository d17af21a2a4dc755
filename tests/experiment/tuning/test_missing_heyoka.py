"""Protects the message of derivatives on systems without heyoka: no other engine has them."""

import sys

import pytest
from support.paper_runs import paper_config

import rbstab
from rbstab.integrate.engines import EngineMissingError

CALLS = {
    "sensitivities": rbstab.sensitivities,
    "tune": lambda config: rbstab.tune(config, "energy", ["controller.L_r"]),
}


@pytest.mark.parametrize("call", CALLS.values(), ids=CALLS)
def test_only_heyoka_helps(monkeypatch, call):
    monkeypatch.setitem(sys.modules, "heyoka", None)
    monkeypatch.delitem(sys.modules, "rbstab.integrate.heyoka.engine", raising=False)
    with pytest.raises(EngineMissingError) as caught:
        call(paper_config("free"))
    message = str(caught.value)
    assert message.startswith("derivatives of a run need heyoka, which cannot be used here: ")
    assert message.endswith("; install heyoka from PyPI (Linux) or conda-forge (other systems)")
