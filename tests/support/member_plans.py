"""Plans of members of every kind, and which of their members run alone."""

from collections.abc import Callable
from typing import Any

import numpy as np

from rbstab.sweep.members.single import SingleRuns
from rbstab.sweep.plan.load import load_plan, plan_data
from rbstab.sweep.plan.plan import Plan
from support.config_elements import STRUT, TIE, config_data
from support.inputs import LEGS, SINE, couple, driven, force
from support.paper_runs import paper_config
from support.sliding_ties import tie
from support.stops import stop
from support.switching import data, guard, ligament

SHORT: dict[str, Any] = {"duration": 0.3, "samples": 16, "rtol": 1e-11, "engine": "heyoka"}
SPIN = {"initial.angular_velocity[0]": {"uniform": [-20, 20]}}
VARIED: dict[str, dict[str, Any]] = {
    "initial.angular_velocity[0]": {"uniform": [-20, 20]},
    "initial.orientation[1]": {"uniform": [-0.5, 0.5]},
    "body.mass": {"uniform": [20, 60]},
    "body.contact_point[2]": {"uniform": [-0.6, 0.2]},
    "body.inertia": {"scale": {"uniform": [0.7, 1.3]}},
    "controller.K_r": {"scale": {"loguniform": [0.3, 3]}},
    "controller.L_t[1]": {"uniform": [100, 300]},
    "gravity[0]": {"normal": [0, 3]},
}
ELEMENTS: dict[str, dict[str, Any]] = {
    "elements.strut.stiffness": {"uniform": [500, 2000]},
    "elements.strut.point[2]": {"uniform": [0.1, 0.4]},
    "elements.strut.damping": {"scale": {"uniform": [0, 2]}},
    "elements.tie.anchor[1]": {"uniform": [0.2, 0.3]},
    "elements.tie.K_c": {"scale": {"uniform": [0.5, 2]}},
    "elements.upright.L[0]": {"uniform": [5, 50]},
    "elements.range.stiffness": {"uniform": [1, 20]},
}
SLOPE = {"variant": "sliding", "K_s": [20000.0] * 3, "surface": {"slope": 20.0}}
CONTROLLER = {
    "variant": "visco-elastic",
    **{name: [30.0, 40.0, 50.0] for name in ("K_t", "K_r", "K_c")},
    **{name: [3.0, 4.0, 5.0] for name in ("L_t", "L_r", "L_c")},
}
AMPLITUDE = "elements.push.amplitude"
TURNS = np.array(
    [[3, 60, 2], [1, 5, 2], [9, -2, 150], [0.1, 40, 0.01], [99, 1, 1], [2, 30, -1]], dtype=float
)
"""Spins with several turns, and past θ2 = ±90°."""


def drawn(base, vary, members=12, **more):
    """Return a plan of drawn members."""
    return load_plan(
        {"base": base, "vary": vary, "design": "random", "members": members, "seed": 3} | more
    )


def keeping(plan, every):
    """Return a plan that keeps the motion of every so many members; 0: of none."""
    keep = {"traces": {"every": every}} if every else "summary"
    return load_plan(plan_data(plan) | {"keep": keep})


def listed(base, **vary):
    """Return a plan of a grid of values."""
    return load_plan({"base": base, "vary": {key: {"values": vary[key]} for key in vary}})


def paper(variant, with_gravity=True, **changes):
    """Return a short config of a case of the paper."""
    return paper_config(variant, with_gravity, **{**SHORT, **changes})


def attached():
    """Return the config of a body that starts on its anchor."""
    base = paper("visco-elastic")
    initial = {key: value for key, value in base["initial"].items() if key != "position"}
    return base | {"initial": initial | {"attached": True}}


def turning(coordinates="quaternion", samples=21):
    """Return the plan of a tied body with the spins of `TURNS`."""
    base = {
        "schema_version": 2,
        "body": {"mass": 1, "inertia": [0.01, 0.01, 0.01], "contact_point": [0, 0, 0]},
        "elements": {
            "tie": TIE
            | {"point": [0, 0, 0.1], "anchor": [0, 0, 0.1], "K_c": [100] * 3}
            | {"L_c": [5] * 3},
            "upright": {"kind": "attitude", "K": [1, 1.2, 1.5], "L": [0.02, 0.02, 0.02]},
        },
        "initial": {"orientation": [0, 0.2, 0]},
        "integration": SHORT | {"duration": 2, "samples": samples, "coordinates": coordinates},
    }
    spins = {f"initial.angular_velocity[{k}]": {"values": TURNS[:, k].tolist()} for k in range(3)}
    return load_plan({"base": base, "vary": {"spin": {"zip": spins}}})


def with_inputs(elements, vary, **more):
    """Return a plan of a tied body with inputs."""
    base = driven(elements, "heyoka", controller=CONTROLLER, integration={"samples": 17})
    return load_plan({"base": base, "vary": vary} | more)


SMOOTH = {"push": force(SINE, point=[0.1, 0, 0.2]), "turn": couple({"kind": "constant"})}
NOISY = {"gust": couple(LEGS["noise"])}
SWITCHING = {"a": ligament(-1.0, damping=2.0), "soft": guard("stiff", 40.0, 0.1)}
PITCHING = paper("free", False, initial={"angular_velocity": [0, 0, 0]})
PITCH = "initial.angular_velocity[1]"


def switching(engine="heyoka"):
    """Return a plan of a body with a ligament and a guard."""
    stabilizers = {"K_t": [40, 50, 60], "L_t": [4, 5, 6], "K_r": [30, 40, 50], "L_r": [3, 4, 5]}
    base = data(
        SWITCHING,
        {"velocity": [4.1, 0.3, 0], "angular_velocity": [0, 1.5, 0]},
        {"duration": 2.0, "samples": 31, "engine": engine, "rtol": 1e-12},
        controller={"variant": "free"} | stabilizers,
    )
    return listed(base, **{"elements.a.stiffness": [40.0, 80.0, 160.0]})


def stopped(engine="heyoka"):
    """Return a plan of a held body that falls against a stop."""
    controller = {"variant": "permanent", "K_t": [40.0] * 3, "L_t": [9.0] * 3}
    base = data(
        {"end": stop()},
        {"angular_velocity": [0.5, 1.0, -0.3]},
        {"duration": 1.5, "samples": 16, "engine": engine},
        controller=controller | {"K_r": [9.0] * 3, "L_r": [3.0] * 3},
        gravity=[0.0, 0.0, -9.81],
    )
    base["body"] |= {"contact_point": [-0.8, 0.1, -0.2]}
    return listed(base, **{"elements.end.restitution": [0.0, 0.4]})


def sliding():
    """Return a plan of sliding members and batched ones, in alternating pairs."""
    base = paper("visco-elastic", False, controller=SLOPE, duration=0.05, samples=5)
    vary = {
        "body.mass": [40.0, 42.0],
        "controller.variant": ["sliding", "visco-elastic"],
        PITCH: [5.0, 20.0],
    }
    return listed(base, **vary)


VARIANTS = {"controller.variant": {"each": {"values": ["free", "embedded", "visco-elastic"]}}}

PLANS: dict[str, tuple[Callable[[], Plan], set[int]]] = {
    "visco-elastic": (lambda: drawn(paper("visco-elastic"), VARIED, 20), set()),
    "free": (lambda: drawn(paper("free"), SPIN), set()),
    "permanent": (lambda: drawn(paper("permanent"), SPIN), set()),
    "embedded": (lambda: drawn(paper("embedded"), SPIN), set()),
    "variants": (lambda: drawn(paper("embedded"), SPIN | VARIANTS, 5), set()),
    "attached": (
        lambda: drawn(attached(), {k: VARIED[k] for k in list(VARIED)[1:4]}),
        set(),
    ),
    "elements": (lambda: drawn(config_data(integration=SHORT), ELEMENTS), set()),
    "without a controller": (
        lambda: drawn(
            config_data({"strut": STRUT}, None, integration=SHORT),
            {"elements.strut.stiffness": {"uniform": [500, 2000]}},
        ),
        set(),
    ),
    "quaternion": (turning, set()),
    # Some need another energy scale and are integrated twice.
    "inputs": (
        lambda: with_inputs(
            SMOOTH,
            {
                AMPLITUDE: {"values": [1e-4, 3.0, 30.0]},
                "elements.push.signal.frequency": {"linspace": [0.5, 9.0, 3]},
            },
        ),
        set(),
    ),
    "range left": (lambda: listed(PITCHING, **{PITCH: [1.0, 32.0, 2.0, 40.0, 3.0]}), {1, 3}),
    "diverged": (
        lambda: listed(paper("visco-elastic"), **{"initial.velocity[0]": [0.0, 1e200, 1.0]}),
        {1},
    ),
    "step limit": (lambda: drawn(paper("free", step_limit=5), SPIN, 3), {0, 1, 2}),
    "projected": (
        lambda: drawn(
            paper("permanent", coordinates="manifold", drift_control="projection", samples=3),
            SPIN,
            2,
        ),
        {0, 1},
    ),
    "noise": (
        lambda: with_inputs(
            NOISY,
            {"elements.gust.signal.seed": {"member": [5]}},
            design="random",
            members=4,
            seed=1,
        ),
        {0, 1, 2, 3},
    ),
    "switching": (switching, {0, 1, 2}),
    "stopped": (stopped, {0, 1}),
    "sliding": (sliding, {0, 1, 4, 5}),
    "sliding tie": (
        lambda: listed(
            data({"tie": tie()}, {"velocity": [1.0, 0.2, 0]}, SHORT), **{"body.mass": [1.0, 2.0]}
        ),
        {0, 1},
    ),
}
"""Plans by name, and the members that no batch integrates to the end."""


class RecordedSingleRuns(SingleRuns):
    """Single runs that record the members which the batch engine leaves to them."""

    def __init__(self, plan):
        super().__init__(plan, "heyoka")
        self.members: set[int] = set()

    def compute(self, start, stop):
        self.members |= set(range(start, stop))
        return super().compute(start, stop)
