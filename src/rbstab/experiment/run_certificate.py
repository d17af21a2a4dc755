"""The certificate of a run, as arrays of its result."""

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from rbstab.analysis.certificate.verdict import Check, Verdict
from rbstab.experiment.answers.state_words import kinds_of
from rbstab.experiment.convergence.decisions import convergence_at_start
from rbstab.integrate.problem import Problem
from rbstab.store.variables import Variable

if TYPE_CHECKING:
    from rbstab.experiment.stored_proof.proof import Proof

GLOBAL_STABILITY, CERTIFIED_REGION = "global stability", "certified region"
"""Names of the checks that only a proof decides."""

REST_STATES = "rest states in the range"
"""What is counted by the check of global stability; of several, their kinds follow."""

ON_ROTATIONS = "rest states on SO(3)"
"""The same of a body whose energy depends on no Euler angles."""

LEAST_REST_STATES = f"{REST_STATES}, at least"
"""The same where the search was not complete: there may be more."""

ABOVE = "start above rest state 1, J"
"""What is compared with the level of the region of the lowest rest state. v(0) is not this number:
it counts from the rest state below the end of the motion."""

GROUP = "certificate"
"""Name of the group of a result file that holds the certificate."""


def rest_state_check(proof: "Proof | None") -> Check:
    """Return the check of global stability: the number of rest states in the range is 1.

    A counterexample needs no complete search. Then the number is that of the proved rest states:
    there are at least so many.
    """
    stable = Check(GLOBAL_STABILITY, Verdict.UNKNOWN, np.nan, 1.0, np.nan, REST_STATES)
    if proof is None or not (proof.states or proof.proved):
        return stable
    verdicts = {True: Verdict.CERTIFIED, False: Verdict.VIOLATED, None: Verdict.UNKNOWN}
    verdict, count = verdicts[proof.globally_stable], len(proof.states)
    proved_count, quantity = sum(state.proved for state in proof.states), LEAST_REST_STATES
    incomplete = verdict is Verdict.VIOLATED and not proof.proved
    if proof.families:
        count = max(count + 1, 2)
    elif incomplete and proved_count > 1:
        count = proved_count
    else:
        verdict = Verdict.UNKNOWN if incomplete else verdict
        quantity = REST_STATES if proof.on_rotations is None else ON_ROTATIONS
        quantity += f": {kinds_of(proof.states)}" if count > 1 else ""
        if verdict is Verdict.VIOLATED and proof.almost_every_start.proved:
            quantity += "; almost every start converges"
    return stable._replace(verdict=verdict, value=float(count), quantity=quantity)


def proved_checks(problem: Problem, proof: "Proof | None") -> list[Check]:
    """Return the two checks that a proof decides: global stability, and certified region.

    The first concerns all motions, the second the start of the problem.
    """
    stable = rest_state_check(proof)
    region = Check(CERTIFIED_REGION, Verdict.UNKNOWN, np.nan, np.nan, np.nan, ABOVE)
    if proof is None or not (proof.states or proof.proved):
        return [stable, region]
    # Imported late: most runs have no proof.
    from rbstab.experiment.stored_proof.starts import start_level

    level, convergence = start_level(problem, proof), convergence_at_start(problem, proof)
    if level is not None and convergence.rest_state is not None and convergence.bound is not None:
        value = level + proof.states[0].energy - proof.states[convergence.rest_state - 1].energy
        quantity = ABOVE.replace("1", str(convergence.rest_state))
        region = Check(
            CERTIFIED_REGION, Verdict.CERTIFIED, value, convergence.bound, np.nan, quantity
        )
    elif level is not None and proof.region is not None:
        region = region._replace(value=level, bound=proof.region.lower_bound)
    return [stable, region]


COLUMNS = {
    "check": ("1", "what is checked"),
    "verdict": ("1", "what was found"),
    "value": ("1", "by what number"),
    "bound": ("1", "what the number is compared with"),
    "when": ("s", "time of the number; NaN: of no time"),
    "quantity": ("1", "what the number is"),
}
"""The columns of a stored certificate, each with its unit and its meaning."""


def certificate_variables(checks: Sequence[Check]) -> dict[str, Variable]:
    """Return the checks as arrays of the group `certificate`."""
    variables = {}
    for (name, described), entries in zip(COLUMNS.items(), zip(*checks, strict=True), strict=True):
        texts = isinstance(entries[0], str)
        data = np.array(
            [*map(str, entries)] if texts else entries, dtype=object if texts else float
        )
        variables[f"{GROUP}/{name}"] = Variable(("check",), data, *described)
    return variables
