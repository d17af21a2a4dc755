"""Tables of facts on a sweep: plan, engine, comparison with SciPy, varied keys."""

from pathlib import Path

from rbstab.files.counts import grouped
from rbstab.files.existence import is_file
from rbstab.files.shell_words import shell_word
from rbstab.report.model.document import Cell, Head, Table
from rbstab.report.model.words import NO_VALUE, counted, untrusted
from rbstab.report.sweeps.members import Members
from rbstab.report.sweeps.table_entries import whole
from rbstab.store.table import Table as Columns
from rbstab.sweep.folder.sweep_folder import PLAN_FILE
from rbstab.sweep.plan.axes import Axis
from rbstab.sweep.plan.plan import Plan


def overview_table(name: str, members: Members, path: Path) -> Table:
    """Return the table of facts on a sweep."""
    table = members.table
    attributes = table.attributes
    rows = {
        "title": untrusted(attributes.get("title", "")),
        "file": untrusted(path),
        "plan": untrusted(attributes.get("plan_id", "")),
        "members": _members(members),
        "poses at rest": _poses(members),
        "engine": untrusted(attributes.get("engine", "")),
        "design": _design(members.plan, str(attributes.get("design", ""))),
        "compared with SciPy": _comparison(table),
        "digest of the results": untrusted(attributes.get("shards_digest", "")),
        "computed": _versions(table),
    }
    if is_file(path.parent / PLAN_FILE):
        rows["command to repeat"] = f"rbstab sweep {shell_word(path.parent / PLAN_FILE)} -o again"
    cells = tuple((Cell(key), Cell(text)) for key, text in rows.items())
    return Table(f"{name}-facts", "The sweep", (Head("property"), Head("value")), cells)


def varied_table(name: str, plan: Plan) -> Table:
    """Return the table of varied keys, in the order of the plan."""
    heads = (Head("key"), Head("values"), Head("count", numbers=True), Head("varies"))
    rows = []
    for axis in plan.axes:
        for column in axis.varied_keys:
            word = column.distribution.keyword
            arguments = ", ".join(_argument(a) for a in column.distribution.root)
            values = f"{word} [{arguments}]"
            rows.append(
                (
                    Cell(column.key),
                    Cell(f"base value times {values}" if column.scale else values),
                    whole(axis.length) if axis.length else Cell(NO_VALUE),
                    Cell(_varies(axis)),
                )
            )
    return Table(f"{name}-varied", "Varied keys", heads, tuple(rows))


def _varies(axis: Axis) -> str:
    manner = (
        f"together with other keys, as {untrusted(axis.name)}"
        if len(axis.varied_keys) > 1
        else "independently"
    )
    return f"{manner}; every value is combined with every point" if axis.each else manner


def _argument(argument: float | str) -> str:
    return argument if isinstance(argument, str) else f"{argument:.6g}"


def _members(members: Members) -> str:
    if members.plan is None or len(members.plan.dimensions) < 2:
        return grouped(len(members))
    lengths = " x ".join(map(grouped, members.plan.dimensions.values()))
    return f"{lengths} = {grouped(len(members))}"


def _poses(members: Members) -> str:
    """Return at how many poses members rest; those of different bodies may differ by little."""
    poses = members.found.poses
    count = "very many" if poses is None else grouped(poses)
    return count if members.share_rest_states else f"{count} (the bodies differ)"


def _design(plan: Plan | None, word: str) -> str:
    if plan is None or plan.design is None:
        return word
    return f"{word}, {grouped(plan.design.points)} points, seed {plan.design.seed}"


def _comparison(table: Columns) -> str:
    """Return a summary of the comparison with single runs by SciPy."""
    checked = int(table.attributes.get("checked_members", 0))
    if not checked:
        return "no member"
    unlike = int(table.attributes.get("checked_unlike", 0))
    summary = f"{counted(checked, 'member')}, {grouped(unlike)} differ"
    if "check_difference" not in table:
        return summary
    differences, columns = table["check_difference"], table["check_column"]
    worst = int(differences.argmax())
    column = untrusted(columns[worst])
    return f"{summary}; largest relative difference {differences[worst]:.2g} ({column})"


def _versions(table: Columns) -> str:
    attributes = table.attributes
    packages = ", ".join(
        f"{name.removesuffix('_version')} {attributes[name]}"
        for name in attributes
        if name.endswith("_version")
    )
    commit = f" (commit {attributes['commit']})" if attributes.get("commit") else ""
    return untrusted(f"{attributes.get('created', '')} by {packages}{commit}").strip()
