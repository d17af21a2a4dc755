"""The columns of a sweep that say what is proved of its members."""

from rbstab.store.table import Column

CONVERGENCE = ("unknown", "not proved", "proved", "not decided", "false")
"""The values of the column `convergence`, in the order of their codes.

unknown: there is no proof of its own body, and it does not start in a region that was proved for
many bodies. not proved: the member does not start in a certified
region, and its motion was not enclosed. not decided: its motion was enclosed, but convergence is
neither proved nor refuted. false: there is no rest state, proved.
"""

NO_PROOF, NOT_PROVED, PROVED, NOT_DECIDED, FALSE = range(5)

MOTION_PROOFS = (
    "not enclosed",
    "proved",
    "false",
    "step limit",
    "at rest",
    "no step",
    "no region",
    "sliding",
    "failed",
    "switches",
    "user code",
    "input",
)
"""The values of the column `motion_proof`, in the order of their codes: how the enclosure of a
motion ended. Codes from `FIRST_UNDECIDED` on are the reasons why convergence is not decided."""

FIRST_UNDECIDED = 3

COLUMN = Column((), "i1", "1", "what is proved of the convergence to a rest state", CONVERGENCE)
"""The column `convergence` of a sweep."""

REST_STATE = Column(
    (), "i4", "1", "rest state to which the member converges, proved, from 1; 0: not proved"
)
"""The column `proved_rest_state` of a sweep."""

SOLE_STATE_WORDS = ("not decided", "proved", "false")
"""The values of the column `one_rest_state`, in the order of their codes."""

STATES_UNDECIDED, SOLE_STATE, NOT_SOLE_STATE = range(3)

SOLE_STATE_COLUMN = Column(
    *(
        (),
        "i1",
        "1",
        "whether its body has one rest state in the range, by a proof of its own",
    ),
    SOLE_STATE_WORDS,
)
"""The column `one_rest_state` of a sweep."""

CONVERGENCE_COLUMNS: dict[str, Column] = {
    "convergence": COLUMN,
    "proved_rest_state": REST_STATE,
    "one_rest_state": SOLE_STATE_COLUMN,
}
"""The columns of the members file that say what is proved."""

MOTION_COLUMNS: dict[str, Column] = {
    "motion_proof": Column((), "i1", "1", "how the enclosure of the motion ended", MOTION_PROOFS),
    "proved_rest_state": REST_STATE,
    "proved_time": Column(
        (), "f8", "s", "from here in a region of proved convergence; NaN: not proved"
    ),
    "proof_steps": Column((), "i4", "1", "steps of the enclosure of the motion"),
}
"""The columns of the shards of a plan with `prove`."""
