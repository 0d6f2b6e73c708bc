"""A verdict in plain words: what the car does that the model does not, and what that does to the error."""

from collections.abc import Iterable, Mapping, Sequence
from math import log

from tasks.identification.decision.answer import ChannelError, NamedEffect, OpenOdds, Verdict
from tasks.identification.decision.candidates import Candidate
from tasks.identification.decision.comparison import find_odds
from tasks.identification.decision.held_out import is_lowered
from tasks.identification.decision.odds import ALONG_ROAD, PORT_OF_NUMBER, Explanation
from tasks.identification.decision.open_explanations import OpenExplanation
from tasks.identification.inference.hypothesis import moves_speed
from tasks.identification.rules import DecisionRules
from tasks.vehicle.effects.library import Effect, format_interval, format_number
from tasks.vehicle.parameters import Vehicle

MOST_WORDS = 30
"""Words of a first sentence [1]."""
LATE = {"pressure_rate", "time"}
"""Variables of a late brake."""
COMMON_PHRASES = {
    frozenset({"friction"}): "the tyres grip otherwise than the model's",
    frozenset({"suspension_force", "pitch_moment"}): "the body moves otherwise than the model's",
    frozenset({"sensor"}): "an instrument reads otherwise than the car moves",
}
"""What effects that act at the same ports have in common."""


def describe_effect(effect: NamedEffect, library: Sequence[Effect]) -> str:
    """Return what a named effect says of the car, with the intervals of its numbers.

    Parameters
    ----------
    effect : of the library, or a form outside it
    library : effects that may be named
    """
    known = next((e for e in library if e.name == effect.name), None)
    if known is not None:
        return known.describe(
            {p.name: p.value for p in effect.parameters},
            {p.name: (p.ci_low, p.ci_high) for p in effect.parameters if p.ci_low < p.ci_high},
        )
    port, variable = (name.replace("_", " ") for name in (effect.port, effect.variable))
    return f"the {port} depends on {variable} in a way that no effect of the library has"


def describe_verdict(
    verdict: Verdict,
    library: Sequence[Effect],
    suggested: NamedEffect | None = None,
    own: str = "",
    force: float = 0.0,
) -> str:
    """Return the verdict in plain words; the first sentence has at most `MOST_WORDS` words.

    Parameters
    ----------
    verdict : what is named, what stays open, and the errors on runs to which no number was fitted
    library : effects that may be named
    suggested : the best candidate, if nothing is named
    own : what the vehicle's own numbers that the runs moved say of the car
    force : mean deceleration by what not all open explanations name [m/s2]
    """
    effects, error, manoeuvres = verdict.effects, verdict.error, verdict.manoeuvre_error
    misses = verdict.misses or bool(verdict.disagreement and not effects)
    if not effects:
        nothing = (
            "The model misses these runs by more than their noise, and nothing that can be named explains it"
            if misses
            else "These runs show nothing that the model lacks"
        )
        if suggested is not None:
            nothing = (
                "These runs prove nothing that the model lacks. They suggest that"
                f" {describe_effect(suggested, library)}, at odds that are too small for a name"
            )
        if not own or not is_lowered(error["speed"]) or not _prints_differently(error["speed"]):
            return f"{nothing}."
        return (
            f"{nothing}. Its own numbers, fitted to these runs ({own}), take the error"
            f" {_describe_errors({'speed': error['speed'], **manoeuvres})}, on runs to which no number was fitted."
        )
    text = (
        _describe_open(verdict, library, force)
        if verdict.rivals
        else _join_sentences([describe_effect(effect, library) for effect in effects])
    )
    figures = {"speed": error["speed"], **manoeuvres}
    if not any(moves_speed(effect.effect_class, effect.variable) for effect in effects):
        # an instrument's own channel says what its error does; the car moves as before
        missed = [name for name, e in error.items() if e.frozen > 0.0]
        felt = min(missed, key=lambda name: error[name].after / error[name].frozen)
        figures = {felt: error[felt]}
    elif all(e.after >= e.retuned for e in figures.values()):
        # what a name is worth stands in another channel
        worth = min(error, key=lambda name: error[name].after / max(error[name].retuned, 1e-12))
        figures = {worth: error[worth]} | figures
    rest = " The speed is still missed by more than its noise: more is lacking than that." if misses else ""
    beside = f"With the vehicle's own numbers fitted too ({own}), that " if own else "That "
    done = f"{beside}{_describe_change(figures)}, on runs to which no number was fitted."
    return f"{text} {done}{rest}"


def list_unshared(effects: Sequence[NamedEffect], opened: Sequence[OpenOdds]) -> list[NamedEffect]:
    """Return the named effects that not all open explanations name.

    Parameters
    ----------
    effects : that are named
    opened : all explanations that are open
    """
    return [effect for effect in effects if not all(_find_name(effect) in other.names for other in opened)]


def _find_name(effect: NamedEffect) -> str:
    """Return the name under which an explanation holds an effect: a form there has no shape."""
    return f"form {effect.port}({effect.variable})" if effect.effect_class == "form" else effect.name


def _describe_open(verdict: Verdict, library: Sequence[Effect], force: float) -> str:
    """Return sentences on a set: what all its explanations share, then each of them with its odds."""
    effects, rivals, opened = verdict.effects, [rival for _, rival in verdict.rivals], verdict.odds
    left = list_unshared(effects, opened)
    shared = [describe_effect(effect, library) for effect in effects if effect not in left]
    known = {_find_name(effect): effect for effect in (*rivals, *effects)}
    named = [[known[name] for name in other.names] for other in opened]
    # a form of another shape at the same port reads the same
    phrases: dict[str, float] = {}
    for own, other in zip(named, opened, strict=True):
        rest = [effect for effect in own if effect not in effects or effect in left]
        phrase = join_phrases(describe_effect(effect, library) for effect in rest) if rest else "nothing more"
        phrases.setdefault(phrase, other.odds)
    if len(phrases) < 2:
        return _join_sentences([describe_effect(effect, library) for effect in effects])
    common = _describe_common([e for own in named for e in own if e not in effects or e in left], left, force)
    nothing = f"These runs show something that the model lacks, and leave {len(phrases)} explanations open."
    first = _join_sentences([*shared, *common]) or nothing
    listed = "; or ".join(f"{phrase} ({format_number(odds)} : 1)" for phrase, odds in phrases.items())
    return f"{first} They cannot tell apart: {listed}."


def _describe_common(rest: Sequence[NamedEffect], left: Sequence[NamedEffect], force: float) -> list[str]:
    """Return what effects that stand in for one another have in common, as at most one phrase."""
    ports = {PORT_OF_NUMBER.get(effect.name, effect.port) for effect in rest}
    if ports == {"brake_torque"} and {effect.variable for effect in rest} <= LATE:
        return ["the brakes answer late, whatever the law"]
    if ports <= ALONG_ROAD and force:
        way = "holds the car back" if force > 0.0 else "pushes the car on"
        interval = None
        if len(left) == 1 and left[0].effect_class != "form":
            number = left[0].parameters[0]
            ends = sorted(abs(force) * end / number.value for end in (number.ci_low, number.ci_high))
            interval = (ends[0], ends[1])
        return [f"a further {format_interval(abs(force), interval)} m/s2 on average {way}, whatever its law"]
    return [
        f"{phrase}, whatever the law" for group, phrase in COMMON_PHRASES.items() if ports and ports <= group
    ]


def _join_sentences(phrases: Sequence[str]) -> str:
    """Return phrases as one sentence, or as two where one would be too long; none is no sentence."""
    first = list(phrases)
    while len(first) > 1 and len(join_phrases(first).split()) > MOST_WORDS:
        first.pop()
    rest = phrases[len(first) :]
    texts = [join_phrases(part) for part in (first, rest) if part]
    return " ".join(f"{text[0].upper()}{text[1:]}." for text in texts)


def _prints_differently(error: ChannelError) -> bool:
    """Whether a sentence prints another number after than before."""
    return format_number(error.frozen) != format_number(error.after)


def _describe_errors(figures: Mapping[str, ChannelError], *, retuned: bool = False) -> str:
    """Return from what to what errors go, and with ``retuned`` to what the vehicle's own numbers alone take them."""
    return join_phrases(
        f"of the {name.replace('_', ' ')} from {format_number(e.frozen)}"
        f"{f' (re-tuned {format_number(e.retuned)})' if retuned else ''} to {format_number(e.after)} {e.unit}"
        for name, e in figures.items()
    )


def _describe_change(figures: Mapping[str, ChannelError]) -> str:
    """Return which errors fall and which grow: "lowers the error of the speed from 1 to 0.1 m/s"."""
    lower = {name: e for name, e in figures.items() if e.after <= e.frozen}
    higher = {name: e for name, e in figures.items() if e.after > e.frozen}
    phrases = [f"lowers the error {_describe_errors(lower, retuned=True)}"] if lower else []
    phrases += (
        [f"raises {'that' if lower else 'the error'} {_describe_errors(higher, retuned=True)}"]
        if higher
        else []
    )
    return join_phrases(phrases)


def describe_open_explanations(
    opened: Sequence[OpenExplanation], explanations: Sequence[Explanation], rules: DecisionRules
) -> list[str]:
    """Return a sentence on the explanations that the runs leave open, with their odds.

    Parameters
    ----------
    opened : the first being the one that is named
    explanations : all that were weighed, the best first
    rules : the odds of a name
    """
    if len(opened) < 2:
        return []
    listed = [
        f"{join_phrases(sorted(o.names)) if o.names else 'nothing'} ({format_number(find_odds(o.log_odds))} : 1)"
        for o in opened[1:]
    ]
    first = join_phrases(sorted(opened[0].names)) if opened[0].names else "nothing"
    return [
        f"of {len(explanations)} explanations these runs leave {len(opened)} open within {rules.named_odds:g} : 1;"
        f" against {first}: {'; '.join(listed)}"
    ]


def describe_foreign(disagreement: float, rules: DecisionRules) -> str:
    """Return that the runs disagree with the model whatever is named: the car's equations are not the model's.

    Parameters
    ----------
    disagreement : of the runs with the best explanation [1]
    rules : up to which something is named
    """
    return (
        f"the runs disagree with the model by a factor of {disagreement:.1f} whatever is named; noise alone gives 1,"
        f" and names can be told up to {rules.foreign_disagreement:g}"
    )


def describe_unnamed(
    tried: Sequence[NamedEffect], best: Explanation, named: Sequence[Candidate], rules: DecisionRules
) -> list[str]:
    """Return why nothing is named: the best candidate's odds, or that it is smaller than what matters.

    Parameters
    ----------
    tried : candidates that are not named, the best first
    best : the explanation with the largest odds
    named : its members that are large enough to be named
    rules : the odds of a name
    """
    small = [member.name for member in best.members if member not in named]
    if small and best.log_odds > log(rules.named_odds):
        return [
            f"the runs show {join_phrases(small)}, smaller than what matters, or not surely larger: not named"
        ]
    if not tried:
        return ["no effect of the library explains anything of what the model leaves over"]
    odds = find_odds(tried[0].score)
    return [
        f"the best candidate, {tried[0].name}, has odds of {format_number(odds)} : 1 against nothing; a name needs"
        f" {rules.named_odds:g} : 1"
    ]


def describe_driven(drive: float) -> str:
    """Return the sentence on runs that begin at their brake.

    Parameters
    ----------
    drive : acceleration before the brake that the model leaves open [m/s2]
    """
    return (
        f"before the brake the car was driven with {drive:.2f} m/s2, and no channel says by what: each stop on a flat"
        " road is judged from its brake on; log the throttle or the engine's torque, or coast for a second before it"
    )


def describe_present_effects(vehicle: Vehicle) -> list[str]:
    """Return a sentence where a vehicle has effects or forms already, on top of which others are named.

    Parameters
    ----------
    vehicle : that is judged
    """
    present = [name for name, value in vehicle.effects.items() if value] + [f.name for f in vehicle.forms]
    if not present:
        return []
    return [f"{vehicle.name} already has {', '.join(present)}: what is named comes on top of that"]


def join_phrases(phrases: Iterable[str]) -> str:
    """Return phrases as one: "a, b and c".

    Parameters
    ----------
    phrases : at least one
    """
    *before, last = phrases
    return f"{', '.join(before)} and {last}" if before else last
