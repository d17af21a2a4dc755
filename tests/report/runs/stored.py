"""Made up runs and proofs stored beside them."""

import math

import numpy as np
import yaml
from support.made_runs import made_result
from support.proofs import parabola
from support.results import with_data

from rbstab.config.load import load_config
from rbstab.experiment.proof_cache import proof_file
from rbstab.experiment.stored_proof.identity import proof_id
from rbstab.experiment.stored_proof.proof import Proof
from rbstab.report.reading.sources import read_sources
from rbstab.store.document import write_document
from rbstab.store.result import write_result

ORIGIN = (0.0, 0.0, 0.0)


def runs_of(*paths):
    """Return runs."""
    return read_sources(paths).runs


def with_v(path, change, settled=math.nan):
    """Write a made up run with another v and settling time; return its file."""
    made = made_result()
    made = with_data(made, "lyapunov", change(made["time"], made["lyapunov"].copy()))
    write_result(path, with_data(made, "settling_time", np.array(settled)))
    return path


def store_proof(folder, text, states=1, *, level=1e9, energy=None):
    """Store a proof with so many rest states at the origin, as `rbstab stability` does."""
    config = load_config(yaml.safe_load(text))
    at_origin = parabola(ORIGIN, 1.0)
    place = {"position": ORIGIN, "connector_state": (), "energy": 0.0}
    region = {"energy": level, "level": level, "lower_bound": level, "attained_at": ORIGIN}
    proof = Proof.model_validate(
        {
            "id": proof_id(config),
            "outcome": "all found",
            "proved": True,
            "unique": states == 1,
            "examined": 10,
            "seconds": 0.1,
            "undecided": (),
            "states": [at_origin["states"][0] | place] * states,
            "region": region | {"face": None, "proved": True, "energy_bound": level},
            "reduced_energy": energy or at_origin["reduced_energy"],
        }
    )
    write_document(proof_file(folder, config), proof.model_dump(mode="json"))
