"""Verify a proof of a bound on disturbances, and compare it with a config."""

from collections.abc import Callable, Iterator
from contextlib import suppress

from rbstab.config.build import supplies_power
from rbstab.config.schema import Config
from rbstab.experiment.disturbed.prove_bound import forms_for, stated_in
from rbstab.experiment.disturbed.stored import StoredBound, bound_id
from rbstab.proof.check.checker import FORMAT, check
from rbstab.proof.check.disturbances import DISTURBANCES
from rbstab.proof.check.findings import VERSION, Finding
from rbstab.proof.disturbed.forms import NoFormsError
from rbstab.proof.disturbed.record import difference_from, read_stated
from rbstab.proof.record import WrongRecordError

CONFIG = "the config"


def verify_bound(
    stored: StoredBound, config: Config | None, progress: Callable[[Finding], None]
) -> tuple[list[Finding], list[str]]:
    """Return what was found of a proof, and sentences on what was not checked.

    Args:
        stored: The proof.
        config: The config; None to check its claim on its own V and V' alone.
        progress: Called with each finding about the proof as soon as it is made.
    """
    if stored.claims_nothing:
        text = f"There is no proof: {stored.outcome}."
        return [Finding(DISTURBANCES, "bound", False, text)], []
    findings = check({"format": FORMAT, "bound": stored.claim}, progress)
    is_readable = all(finding.claim != VERSION for finding in findings)
    if config is not None and is_readable:
        findings = [*_config_findings(stored, config), *findings]
    unchecked = [
        "That V' is the derivative of V along the equations: one program makes both of them.",
        "Values in doubles, which are not proved: V at a start, the state at rest.",
    ]
    if config is None:
        unchecked.append("V and V' were not compared with a config; use --config CONFIG.")
    else:
        with suppress(WrongRecordError):  # then the findings say so
            if stated_in(config) not in (None, read_stated(stored.claim)):
                text = "The config states another bound, of which this proof says nothing."
                unchecked.append(text)
    return findings, unchecked


def _config_findings(stored: StoredBound, config: Config) -> Iterator[Finding]:
    """Check that the proof is about a config."""
    try:
        stated = read_stated(stored.claim)
    except WrongRecordError as error:
        yield Finding(CONFIG, "V and V'", False, f"It cannot be read: {error}.")
        return
    same_id = stored.id == bound_id(config, stated)
    text = "The id of the proof is that of the config."
    if not same_id:
        text = "The id of the proof is not that of the config: it was made for another one."
    yield Finding(CONFIG, "id", same_id, text)
    try:
        forms = forms_for(config, tuple(stated.given))
    except NoFormsError as error:
        yield Finding(CONFIG, "hypotheses", False, f"The config has no such proof: {error}.")
        return
    other = difference_from(stored.claim, forms)
    if stored.without_inputs != supplies_power(config):
        other = other or "one of both has inputs"
    text = "V and V' of the proof are those of the config, as exact expressions."
    text = text if other is None else f"V and V' are not those of the config: {other}."
    yield Finding(CONFIG, "V and V'", other is None, text)
