"""The cost of one more element of a config, and of elements that switch, as ratios."""

from collections.abc import Mapping
from functools import partial
from typing import Any

from benchmarks.measure import least_by_turns, line
from rbstab import load_config
from rbstab.config.build import problem_of
from rbstab.integrate.engines import engine
from rbstab.integrate.problem import Problem
from rbstab.sweep.members.engine import MemberEngine
from rbstab.sweep.members.engines import factory_for
from rbstab.sweep.plan.load import load_plan

CASE = "configs/paper/case2_visco_elastic.yaml"
ROUNDS = {"heyoka": 60, "scipy": 4}
MEMBERS = 512
MEMBER_ROUNDS = 4
MEMBERS_UNBATCHED = 128

POINT, ANCHOR = [0.15, 0.10, -0.30], [0.15, 0.30, -0.50]
LENGTH = 0.28
"""m: between the least and the largest distance of both in the run, so the ligament switches."""

TIE = {"kind": "visco-elastic", "point": POINT, "anchor": POINT, "K_c": [5] * 3, "L_c": [0.5] * 3}
ATTITUDE = {"kind": "attitude", "K": [5] * 3, "L": [0.5] * 3}
LINE = {"point": POINT, "anchor": ANCHOR, "damping": 2.0}
SPRING = LINE | {"kind": "spring", "stiffness": 200 / LENGTH, "rest_length": LENGTH}
LIGAMENT = LINE | {"kind": "ligament", "stiffness": 200, "slack_length": LENGTH, "toe_strain": 0.03}
STIFF = {"kind": "guard", "method": "stiff", "stiffness": 100, "soft_angle": 0.4}

SMOOTH = {"tie": TIE, "attitude spring": ATTITUDE, "spring": SPRING}
"""The elements that are added to the case, one at a time; all are so weak that it moves alike."""

SWITCHING = {"ligament": LIGAMENT, "stiff guard": STIFF}


def main() -> None:
    """Measure the case with no element, with one more, and with one that switches."""
    for name in ("heyoka", "scipy"):
        run = engine(name)
        kinds: dict[str, Any] = {"none": None, **SMOOTH, **SWITCHING}
        problems = [_problem(element) for element in kinds.values()]
        actions = [partial(run, problem) for problem in problems]
        seconds = dict(zip(kinds, least_by_turns(ROUNDS[name], *actions), strict=True))
        for kind in SMOOTH:
            line(
                f"{name}: a {kind} beside the case, ratio", seconds[kind] / seconds["none"], "", ""
            )
        for kind in SWITCHING:
            text = f"{name}: a {kind} that switches, over a smooth spring"
            line(text, seconds[kind] / seconds["spring"], "", "at most 3")
    _measure_members()


def _measure_members() -> None:
    """Measure the same in batches."""
    weak: list[Any] = [None, *SMOOTH.values()]
    engines = [_members(element) for element in weak]
    actions = [partial(batched.compute, 0, MEMBERS) for batched in engines]
    bare, *others = least_by_turns(MEMBER_ROUNDS, *actions)
    for kind, seconds in zip(SMOOTH, others, strict=True):
        line(f"batches: one more {kind} beside the case, ratio", seconds / bare, "", "")
    for kind, element in SWITCHING.items():
        unbatched = _members(element)
        (seconds,) = least_by_turns(1, partial(unbatched.compute, 0, MEMBERS_UNBATCHED))
        line(f"members one by one, with a {kind}", MEMBERS_UNBATCHED / seconds, "1/s", "")


def _data(element: Mapping[str, Any] | None) -> dict[str, Any]:
    data = load_config(CASE, ["integration.samples=201"]).plain() | {"schema_version": 2}
    return data | {"elements": {} if element is None else {"one": dict(element)}}


def _problem(element: Mapping[str, Any] | None) -> Problem:
    return problem_of(load_config(_data(element)))


def _members(element: Mapping[str, Any] | None) -> MemberEngine:
    spin = {"uniform": [-40, 40]}
    vary = {f"initial.angular_velocity[{axis}]": spin for axis in (0, 1)}
    base = _data(element)
    base["integration"] = {"duration": 2.0, "samples": 201, "engine": "heyoka", "rtol": 1e-8}
    drawn = {"design": "random", "members": MEMBERS, "seed": 1, "keep": "summary"}
    return factory_for("heyoka")(load_plan({"base": base, "vary": vary, **drawn}))


if __name__ == "__main__":
    main()
