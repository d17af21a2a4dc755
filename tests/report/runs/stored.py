"""Proofs stored beside made up runs, and the facts on such runs."""

import math

import yaml
from support.proofs import parabola

from rbstab.config.load import load_config
from rbstab.experiment.proof_cache import proof_file
from rbstab.experiment.stored_proof.entries import ProvedEnergy
from rbstab.experiment.stored_proof.identity import proof_id
from rbstab.experiment.stored_proof.proof import Proof
from rbstab.proof.entries import ProvedRegion, ProvedState
from rbstab.report.reading.sources import read_sources
from rbstab.store.document import write_document

ORIGIN = (0.0, 0.0, 0.0)


def runs_of(*paths):
    """Return runs."""
    return read_sources(paths).runs


def store_proof(folder, text, states, *, level=1e9):
    """Store a proof with so many rest states, as `rbstab stability` does."""
    config = load_config(yaml.safe_load(text))
    state = ProvedState(
        orientation=ORIGIN,
        position=ORIGIN,
        connector_state=(),
        energy=0.0,
        index=0,
        proved=True,
        enclosure=(ORIGIN, ORIGIN),
        index_proved=True,
    )
    region = ProvedRegion(
        energy=level,
        level=level,
        lower_bound=level,
        attained_at=ORIGIN,
        face=None,
        proved=True,
        energy_bound=level,
    )
    proof = Proof(
        id=proof_id(config),
        outcome="all found",
        proved=True,
        unique=states == 1,
        examined=10,
        seconds=0.1,
        undecided=(),
        states=(state,) * states,
        region=region,
        end=(math.pi, math.pi / 2, math.pi),
        reduced_energy=ProvedEnergy.model_validate(parabola(ORIGIN, 1.0)["reduced_energy"]),
    )
    write_document(proof_file(folder, config), proof.model_dump(mode="json"))
