"""The certificate of a run as it stands in its result."""

from typing import NamedTuple

from rbstab.store.result import Result


class CertificateLine(NamedTuple):
    """One line: what is checked and what was found, by what number against what bound.

    value and bound are as `quantity` says; when, s, is NaN where the value belongs to no time.
    """

    check: str
    verdict: str
    value: float
    bound: float
    when: float
    quantity: str


def certificate_lines(result: Result) -> list[CertificateLine]:
    """The lines of the certificate; none where the result has none, as older ones."""
    names = [f"certificate/{column}" for column in CertificateLine._fields]
    if any(name not in result for name in names):
        return []
    rows = zip(*(result[name].tolist() for name in names), strict=True)
    return [CertificateLine(*row) for row in rows]
