"""Tables of facts on a sweep: plan, engine, comparison with SciPy, varied keys."""

from pathlib import Path

from rbstab.files.paths import is_file
from rbstab.files.text import grouped, shell_word
from rbstab.report.model.document import Table
from rbstab.report.model.words import counted, untrusted
from rbstab.report.sweeps.members import Members
from rbstab.store.table import Table as Columns
from rbstab.sweep.folder.sweep_folder import PLAN_FILE
from rbstab.sweep.plan.plan import Plan


def overview_table(name: str, members: Members, path: Path) -> Table:
    """Return the table of facts on a sweep, and of its varied keys.

    Args:
        name: The name of the sweep; that of the table begins with it.
        members: The members.
        path: The file of the sweep.
    """
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
        **({} if members.plan is None else _varied(members.plan)),
    }
    if is_file(path.parent / PLAN_FILE):
        rows["command to repeat"] = f"rbstab sweep {shell_word(path.parent / PLAN_FILE)} -o again"
    return Table.of(f"{name}-facts", "The sweep", ("property", "value"), [*rows.items()], "")


def _varied(plan: Plan) -> dict[str, str]:
    """Return how each key of a plan varies, in the order of the plan."""
    rows = {}
    for axis in plan.axes:
        manner = "independently"
        if len(axis.varied_keys) > 1:
            manner = f"together with other keys, as {untrusted(axis.name)}"
        if axis.each:
            manner += "; every value is combined with every point"
        for column in axis.varied_keys:
            arguments = ", ".join(
                part if isinstance(part, str) else f"{part:.6g}"
                for part in column.distribution.root
            )
            base = "base value times " if column.scale else ""
            values = f"{base}{column.distribution.keyword} [{arguments}]"
            count = f" ({counted(axis.length, 'value')})" if axis.length else ""
            rows[f"varied: {column.key}"] = f"{values}{count}, {manner}"
    return rows


def _members(members: Members) -> str:
    if members.plan is None or len(members.plan.dimensions) < 2:
        return grouped(len(members))
    lengths = " x ".join(map(grouped, members.plan.dimensions.values()))
    return f"{lengths} = {grouped(len(members))}"


def _poses(members: Members) -> str:
    """Return at how many poses members rest; those of different bodies may differ by little."""
    poses = members.sweep_outcomes.poses
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
