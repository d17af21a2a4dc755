"""What a sweep is: its plan, its engine, what it varies, how far it was checked."""

from pathlib import Path

from rbstab.report.model.document import Cell, Head, Table
from rbstab.report.model.words import counted, shell_word, untrusted
from rbstab.report.sweeps.members import Members
from rbstab.report.sweeps.table_entries import facts, number
from rbstab.store.table import Table as Columns
from rbstab.sweep.folder.sweep_folder import PLAN_FILE
from rbstab.sweep.plan.axes import Axis
from rbstab.sweep.plan.plan import Plan


def overview_table(name: str, members: Members, path: Path) -> Table:
    """The sweep in a few lines."""
    table = members.table
    told = table.attributes
    rows = {
        "title": untrusted(told.get("title", "")),
        "file": untrusted(path),
        "plan": untrusted(told.get("plan_id", "")),
        "members": _members(members),
        "engine": untrusted(told.get("engine", "")),
        "design": _design(members.plan, str(told.get("design", ""))),
        "repeated with scipy": _check(table),
        "digest of the results": untrusted(told.get("arrays_digest", "")),
        "computed": _versions(table),
    }
    if (path.parent / PLAN_FILE).is_file():
        rows["made again by"] = f"rbstab sweep {shell_word(path.parent / PLAN_FILE)} -o again"
    return facts(f"{name}-facts", "The sweep", rows)


def varied_table(name: str, plan: Plan) -> Table:
    """What a plan varies, in its order."""
    heads = (Head("key"), Head("values"), Head("count", numbers=True), Head("moves"))
    rows = []
    for axis in plan.axes:
        for column in axis.columns:
            word = column.distribution.word
            arguments = ", ".join(_argument(a) for a in column.distribution.arguments)
            said = f"{word} [{arguments}]"
            rows.append(
                (
                    Cell(column.key),
                    Cell(f"the base's, times {said}" if column.scale else said),
                    number(axis.length or float("nan"), 9),
                    Cell(_moves(axis)),
                )
            )
    return Table(f"{name}-varied", "What is varied", heads, tuple(rows))


def _moves(axis: Axis) -> str:
    together = (
        f"together with others, as {untrusted(axis.name)}" if len(axis.columns) > 1 else "by itself"
    )
    return f"{together}, each with every point" if axis.each else together


def _argument(argument: float | str) -> str:
    return argument if isinstance(argument, str) else f"{argument:.6g}"


def _members(members: Members) -> str:
    if members.plan is None or len(members.plan.dimensions) < 2:
        return str(len(members))
    lengths = " x ".join(map(str, members.plan.dimensions.values()))
    return f"{lengths} = {len(members)}"


def _design(plan: Plan | None, word: str) -> str:
    if plan is None or plan.design is None:
        return word
    return f"{word}, {plan.design.points} points, seed {plan.design.seed}"


def _check(table: Columns) -> str:
    """The comparison with single runs by scipy, in words."""
    checked = int(table.attributes.get("checked_members", 0))
    if not checked:
        return "no member"
    unlike = int(table.attributes.get("checked_unlike", 0))
    said = f"{counted(checked, 'member')}, {unlike} unlike"
    if "check_difference" not in table.extras:
        return said
    differences, columns = table["check_difference"], table["check_column"]
    worst = int(differences.argmax())
    where = untrusted(columns[worst])
    return f"{said}; largest relative difference {differences[worst]:.2g} ({where})"


def _versions(table: Columns) -> str:
    told = table.attributes
    packages = ", ".join(
        f"{name.removesuffix('_version')} {told[name]}"
        for name in told
        if name.endswith("_version")
    )
    commit = f" (commit {told['commit']})" if told.get("commit") else ""
    return untrusted(f"{told.get('created', '')} by {packages}{commit}").strip()
