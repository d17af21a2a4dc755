"""`rbstab sensitivities`."""

from typing import Any

from rbstab_cli.options import declare, output, takes


@declare("sensitivities", "rbstab sensitivities experiment.yaml")
@takes("config", "set", "allow_python", "json")
@output("Also write the JSON to FILE.")
@takes("force", "quiet")
def command(**given: Any) -> None:
    """Compute how a run depends on its gains, its body and its initial state.

    Prints derivatives of the settling time (after which v stays below v(0)/1000) and of the peak of
    E by axis (the value farthest from zero). They are taken with respect to every gain, the mass,
    the inertia, the contact point and the initial state; the most important come first. One table
    is relative, in % for 1 %; the other is per unit of the parameter. An off-diagonal entry of a
    symmetric matrix changes in both of its places. --json adds the times of the peaks and the final
    state.

    The derivatives are exact: they come from variational equations, which go through switches and
    impacts. They need heyoka, also for a config with another engine. A motion without derivatives,
    such as a chaotic one, is refused with the reason.
    """
    from rbstab_cli.work.sensitivities import sensitivities

    sensitivities(**given)
