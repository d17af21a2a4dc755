"""Levels that the stored proofs for many bodies give for made up members."""

from rbstab.experiment.robust.covering import known_of, valid_proofs


def robust_levels(folder, config, varied, count):
    """Return the level of each member, J, by all proofs in a folder of results; 0: none."""
    return known_of(valid_proofs(folder, config), config, varied, count)[0]
