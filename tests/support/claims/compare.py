"""Whether a claim was lost since the table was made; a claim that is doubted is not held."""

import numpy as np

SAME_PLACE = 1e-6
"""rad: two states with angles this close are the same."""

SAME_ENERGY = 1e-6
"""Relative to the larger of the energy and 1 J."""

LEAST_LEVEL = 0.98
"""The least share of a level that is kept."""

RANGES = ("range", "all_angles")


def lost(before, now):
    """Return the claims that the program no longer makes, or makes otherwise, in words."""
    doubted = set(before.get("doubts", {}))
    losses = list(_lost_words(before, now))
    for name in RANGES:
        if before[name] is not None:
            every = now["every_start"]
            losses += [(name, text) for text in _lost_in(before[name], now[name], every=every)]
    return [f"{claim}: {text}" if text else claim for claim, text in losses if claim not in doubted]


def lost_within(before, now):
    """Return what is no longer proved, or refuted, within tolerances, in words."""
    losses = []
    for texts, old in before.items():
        new = now[texts]
        if old["proved"] is not None and new["proved"] != old["proved"]:
            losses.append(f"{texts}: {old['proved']} became {new['proved']}; {new['why']}")
        elif new["level"] < LEAST_LEVEL * old["level"]:
            losses.append(f"{texts}: the level {old['level']} J became {new['level']} J")
    return losses


def gained(before, now):
    """Return the claims that are new since the table was made, in words."""
    words = [claim for claim, _ in _lost_words(now, before)]
    for name in RANGES:
        old, new = before[name], now[name]
        if new is not None and new["complete"] and not (old and old["complete"]):
            words.append(f"{name}: complete")
        elif new is not None and new["level"] and not (old and old["level"]):
            words.append(f"{name}: a level")
    return words


def _lost_words(before, now):
    """Yield the claims without numbers that are in one record and not in the other."""
    if before["every_start"] and not now["every_start"]:
        yield "every_start", ""
    if before["keeps_range"] is not None and now["keeps_range"] != before["keeps_range"]:
        yield "keeps_range", f"{before['keeps_range']} became {now['keeps_range']}"
    if before["almost_every_start"]["proved"] and not now["almost_every_start"]["proved"]:
        yield "almost_every_start", now["almost_every_start"]["why"]
    if before["passive"] and not now["passive"]:
        yield "passive", now["why_not"]
    old, new = before["this_start"], now["this_start"]
    if old["never"] and not new["never"]:
        yield "this_start", new["why"]
    if old["state"] is not None and _end_of(before) != _end_of(now):
        at, other = _end_of(before), _end_of(now)
        if other is None or not same_place(np.array(at), np.array(other)):
            yield "this_start", f"{at} became {other}; {new['why']}"


def _end_of(claims):
    """Return the Θ to which the motion from this start converges; None if that is not proved."""
    number = claims["this_start"]["state"]
    if number is None:
        return None
    for name in RANGES:
        states = claims[name]["states"] if claims[name] else []
        if number <= len(states):
            at: list[float] = states[number - 1]["at"]
            return at
    return None


def _lost_in(old, new, *, every):
    """Yield what one range has lost; where every start converges, no level is needed."""
    if new is None:
        if old["complete"] or old["level"] is not None or _has_proved(old):
            yield "it is not searched"
        return
    if old["complete"] and not new["complete"]:
        yield f"the list is not proved to be complete: {new['why']}"
    if old["complete"] and len(new["states"]) != len(old["states"]):
        yield f"{len(old['states'])} states became {len(new['states'])}"
    numbers = {}
    for number, state in enumerate(old["states"], start=1):
        if not state["proved"]:
            continue
        match = _match(state, new["states"])
        if match is None:
            yield f"the state at {state['at']} is missing"
            continue
        numbers[str(number)] = str(match)
        yield from _changed(state, new["states"][match - 1])
    if not every:
        yield from _lower(old, new, numbers)


def _has_proved(claims):
    return any(state["proved"] for state in claims["states"])


def _match(state, states):
    """Return the number of a state among others, from 1; None if it is not there."""
    for number, other in enumerate(states, start=1):
        if same_place(np.array(state["at"]), np.array(other["at"])):
            return number
    return None


def same_place(pose, other):
    """Return whether two poses are the same; on the border of the range, π is also -π."""
    apart = np.abs(pose - other)
    border = np.abs(np.abs(pose) - np.pi) < SAME_PLACE
    apart = np.where(border, np.minimum(apart, np.abs(apart - 2 * np.pi)), apart)
    return bool(np.all(apart < SAME_PLACE))


def _changed(old, new):
    at = old["at"]
    if not new["proved"]:
        yield f"the state at {at} is not proved"
    if old["index"] is not None and new["index"] != old["index"]:
        yield f"the index {old['index']} of the state at {at} became {new['index']}"
    if abs(old["energy"] - new["energy"]) > SAME_ENERGY * max(1.0, abs(old["energy"])):
        yield f"the energy {old['energy']} J of the state at {at} became {new['energy']} J"


def _lower(old, new, numbers):
    """Yield the levels that are lower, or missing."""
    pairs = {"level": (old["level"], new["level"])} if old["level"] is not None else {}
    for number, depth in old["depths"].items():
        pairs[f"depth of state {number}"] = (depth, new["depths"].get(numbers.get(number, "")))
    for name, (before, now) in pairs.items():
        if now is None or now < LEAST_LEVEL * before:
            yield f"the {name}, {before} J, became {now} J"
