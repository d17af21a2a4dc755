"""The answers about a made up sweep."""

from rbstab.report.sweeps.answers import Commands, answer_of

COMMANDS = Commands("rbstab run PLAN --member", "rbstab sweep PLAN --prove")


def answered(members):
    """Return the answers about a sweep."""
    return answer_of("sweep-1", "made", members, COMMANDS)
