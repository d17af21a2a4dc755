"""The certificate of a run, read from its result."""

from typing import NamedTuple

from rbstab.store.result import Result


class CertificateLine(NamedTuple):
    """One check of a certificate: its name, its verdict, and a value with its bound.

    quantity describes value and bound. when is the time of the value, s; NaN if it has none.
    """

    check: str
    verdict: str
    value: float
    bound: float
    when: float
    quantity: str


def certificate_lines(result: Result) -> list[CertificateLine]:
    """Return the checks of the certificate; [] for an older result without a certificate."""
    names = [f"certificate/{column}" for column in CertificateLine._fields]
    if any(name not in result for name in names):
        return []
    rows = zip(*(result[name].tolist() for name in names), strict=True)
    return [CertificateLine(*row) for row in rows]
