"""Plans of short runs of the paper's body, which starts at rest."""

from typing import Any

from support.paper_runs import paper_config

from rbstab.sweep.plan.load import load_plan

SHORT: dict[str, Any] = {"duration": 0.05, "samples": 3, "rtol": 1e-9}
K_R, SPIN = "controller.K_r", "initial.angular_velocity[0]"


def plan_of(vary, variant="permanent", **changes):
    base = paper_config(variant, initial={"angular_velocity": [0, 0, 0]}, **SHORT)
    return load_plan({"base": base | changes, "vary": vary})
