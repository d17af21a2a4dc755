"""What the program claims about a config: the only module here that asks it for proofs."""

import time
from typing import Any

import rbstab
from rbstab.config.build import problem_of
from rbstab.config.tolerances import tolerances_of
from rbstab.experiment.convergence.convergence import Enclose
from rbstab.experiment.convergence.exact_motion import prove_convergence
from rbstab.experiment.robust.bodies import prove_within
from rbstab.experiment.stability import kind_of

Claims = dict[str, Any]
"""The claims about one config, as plain data.

- `range`: the rest states with |θ2| < π/2, |θ1| and |θ3| < π. `complete`: whether they are proved
  to be all, else `why` not; `boxes`: of the search; `undecided`: the boxes that are left; `states`:
  lowest first, each with its Θ (`at`, rad), U (`energy`, J), `kind`, and `index`, the proved number
  of directions in which U falls; null if the state or its index is not proved. `level`: c* above
  the lowest state, J, null if nothing is proved. `depths`: by number of a state, the depth of its
  region, J.
- `all_angles`: the same for all real θ1 and θ3; null if there is no such search.
- `every_start`: whether every start is proved to converge; `keeps_range`: whether every motion
  that stays in the range is (false: it is proved that not; null: not decided).
- `almost_every_start`: `proved`, and if not, `why`.
- `this_start`: `state`, the number of the state to which it converges, proved; `never`: it is
  proved that it comes to no rest; else `why` nothing is proved.
- `passive`: whether the theorems apply, else `why_not`: it is not damped, or supplies power, or has
  no energy of a form that is in proofs.
- `brief`: whether a search stopped because nobody asked for the proof.
- `seconds`: CPU time of the proof (`rest`) and of the exact motion (`start`).
"""

DIGITS = 9
"""Angles, rad, have so many decimals; energies and levels as many significant digits."""


def claims_of(config, *, asked=False):
    """Return what the program proves about a config, made anew.

    Args:
        config: The config.
        asked: Whether the proof is asked for, as by `rbstab run --prove` or `rbstab stability`;
            otherwise it is the one that `rbstab run` makes unasked.
    """
    problem = problem_of(config)
    begin = time.process_time()
    proof = rbstab.prove(config, problem, brief=not asked)
    proved = time.process_time()
    enclose = Enclose.UNTIL_PROVED if asked else Enclose.BRIEFLY
    start = prove_convergence(config, problem, proof, enclose).convergence
    ended = time.process_time()
    almost = proof.almost_every_start
    never = start.proved is False
    return {
        "range": _states(proof, proof),
        "all_angles": None if proof.unwrapped is None else _states(proof, proof.unwrapped),
        "every_start": proof.every_start,
        "keeps_range": proof.globally_stable,
        "almost_every_start": {"proved": almost.proved, "why": almost.why},
        "this_start": {
            "state": start.rest_state if start.proved else None,
            "never": never,
            "why": "" if start.proved else start.why,
        },
        "passive": proof.has_energy,
        "why_not": "" if proof.has_energy else proof.ended,
        "brief": proof.brief is True,
        "seconds": {"rest": round(proved - begin, 2), "start": round(ended - proved, 2)},
    }


def within_of(config, texts, limit):
    """Return what is proved of all bodies within tolerances: that they have one rest state.

    Args:
        config: The config.
        texts: The tolerances, as those of `--within`.
        limit: The CPU time, s, after which no further part of the box is begun.

    Returns:
        `proved`: true, false or null (not decided, `why`), with the common `level`, J, the boxes
        and the CPU time `seconds`.
    """
    begin = time.process_time()
    answer = prove_within(
        config,
        tolerances_of(config, list(texts)),
        is_late=lambda: time.process_time() - begin > limit,
    )
    return {
        "proved": answer.proved,
        "why": answer.why,
        "level": _rounded(answer.level),
        "boxes": answer.boxes,
        "seconds": round(time.process_time() - begin, 2),
    }


def _states(proof, searched):
    level = searched.region.lower_bound if searched.region and searched.region.proved else None
    return {
        "complete": searched.proved,
        "why": "" if searched.proved else proof.ended_in(searched),
        "boxes": searched.examined,
        "undecided": len(searched.undecided),
        "states": [_state(state) for state in searched.states],
        "level": None if level is None else _rounded(level),
        "depths": {
            str(region.rest_state): _rounded(region.lower_bound) for region in searched.regions
        },
    }


def _state(state):
    decided = state.proved and state.index_proved is True and not state.degenerate
    return {
        "at": [round(float(angle), DIGITS) + 0.0 for angle in state.orientation],
        "energy": _rounded(state.energy),
        "kind": kind_of(state),
        "index": state.index + (1 if state.ridge else 0) if decided else None,
        "proved": state.proved,
    }


def _rounded(value):
    return float(f"{value:.{DIGITS}g}")
