"""The handful of numbers that say how the run went."""

from collections.abc import Callable
from dataclasses import dataclass

from surgisim.report.by_phase import Entries, Headline, Line, lines
from surgisim.report.digits import shown, spread
from surgisim.report.goals import (
    DEFAULT,
    DEPTH,
    DEPTH_MEASURED,
    GAIN,
    GRIP,
    INSIDE,
    MASK,
    RIGID,
    STILL,
    STILL_TRUE,
    TRACKS,
    Mark,
    mark,
    worst,
)
from surgisim.report.story import Story


@dataclass(frozen=True)
class Card:
    title: str
    value: str
    unit: str
    beside: str
    """What to compare it with."""
    protocol: str
    mark: Mark
    """Of the worst phase."""
    lines: tuple[Line, ...] = ()
    """One a phase, where the number is told by phase; the value is empty then."""


def headline(story: Story) -> list[Card]:
    cards = [_masking(story), _tracking(story), _depth(story), _grip(story), _reconstruction(story), _motion(story)]
    return [c for c in [*cards, _told(story), _fit(story), _replay(story), *_cost(story)] if c is not None]


def _card(story: Story, title: str, group: str, name: str, beside: str = "", of: Mark = "plain") -> Card | None:
    entry = story.metrics.values.get(group, {}).get(name)
    if entry is None:
        return None
    unit = "" if entry["unit"] == "1" else entry["unit"]
    return Card(title, shown(entry["value"]), unit, beside, entry["protocol"], of)


def _phased(story: Story, title: str, headline: Headline, beside: str) -> Card | None:
    """A card of lines; None where no phase was measured."""
    found = lines(story, headline)
    if not found:
        return None
    protocol = story.metrics.values[headline.group][headline.name.format(span=found[0].phase)]["protocol"]
    return Card(title, "", "", beside, protocol, worst(line.mark for line in found), tuple(found))


def _also(name: str, words: str) -> Callable[[Entries], str]:
    """What another number is, in words with {} for it."""
    return lambda entry: words.format(shown(found["value"])) if (found := entry(name)) else ""


def _masking(story: Story) -> Card | None:
    name, title = "tool_iou_{span}", "Instrument mask"
    told = Headline("masking", name, ((name, MASK),), lambda _: "")
    card = _phased(story, title, told, f"overlap with the truth, goal {MASK.words}")
    return card or _card(story, title, "masking", "confidence", "the stage's own confidence, 0-1")


def _tracking(story: Story) -> Card | None:
    name, title = "moving_{span}", "Tracks"
    told = Headline("tracking", name, ((name, TRACKS),), _also(name + "_still", "moved {} px"))
    card = _phased(story, title, told, f"moving points, median off the truth, goal {TRACKS.words}")
    return card or _card(story, title, "tracking", "sigma", "the tracker's own uncertainty; no truth is known")


def _depth(story: Story) -> Card | None:
    given, name = story.run.given, "change_{span}_share"
    goal = DEPTH_MEASURED if len(given.right) or len(given.depth) else DEPTH
    told = Headline("depth", name, ((name, goal),), _also("replay_" + name, "replay {} %"))
    card = _phased(
        story,
        "Depth's change",
        told,
        f"of moving points since frame 0, off as a share of the true one, goal {goal.words}",
    )
    if card:
        return card
    for name, what in (("true_relative", "off the truth"), ("given_relative", "off the given depth")):
        if story.value("depth", name) is not None:
            scale = "" if story.run.depth.scale == "known" else ", after one scale factor"
            return _card(story, "Depth", "depth", name, f"mean, {what}{scale}")
    return _card(story, "Depth", "depth", "confidence", "the stage's own confidence, 0-1; no truth is known")


def _grip(story: Story) -> Card | None:
    fitted, found = (f"path_{of}_{{span}}_share" for of in ("fitted", "found"))
    told = Headline("grasp", fitted, ((fitted, GRIP),), _also(found, "before the fit {} %"))
    return _phased(story, "Grip's path", told, f"off the true one as a share of its length, goal {GRIP.words}")


def _reconstruction(story: Story) -> Card | None:
    name, title = "psnr_between_{span}", "Reconstruction"
    told = Headline("reconstruction", name, ((name + "_gain", GAIN),), _also(name + "_still", "still {} dB"))
    card = _phased(story, title, told, f"frames never used, goal {GAIN.words}")
    return card or _card(story, title, "reconstruction", "psnr_between", "frames never used")


def _motion(story: Story) -> Card | None:
    """Beside a still body and a rigid one: in space where the truth is known, else in the picture."""
    for kind, view, still, words in (
        ("true", "", STILL_TRUE, "moving true points in space"),
        ("tracked", "_px", STILL, "moving tracks in the picture"),
    ):
        name = f"{kind}_held_out_{{span}}_moving"
        judged = ((f"{name}_of_still{view}", still), (f"{name}_of_rigid{view}", RIGID))
        others = [_also(f"{name}_{guess}{view}", guess + " {}") for guess in ("still", "rigid")]
        told = Headline(
            "simulation", name + view, judged, lambda entry, others=others: ", ".join(other(entry) for other in others)
        )
        beside = f"off {words}, frames never used, goal {still.words} and {RIGID.words}"
        if card := _phased(story, "Replay's motion", told, beside):
            return card
    return None


def _told(story: Story) -> Card | None:
    """Whether the intervals hold the truth, where it is known."""
    entry = story.metrics.values.get("physics", {}).get("told_inside")
    if entry is None:
        return None
    beside = f"{spread(entry)}; share of the {entry['count']} told numbers with a known truth, goal {INSIDE.words}"
    return _card(story, "Truth in the intervals", "physics", "told_inside", beside, mark(entry, INSIDE))


def _fit(story: Story) -> Card | None:
    if not story.run.fit.history:
        return None
    title, name = "Fitted physics", "fit_{span}_"
    told = Headline("simulation", name + "fitted", ((name + "share", DEFAULT),), _also(name + "default", "default {}"))
    card = _phased(story, title, told, f"track error, frames never used, goal {DEFAULT.words}")
    if card:
        return card
    default = story.value("simulation", "fit_default")
    beside = "track error, frames never used"
    # Without intervals neither is called better.
    beside += f"; default parameters {shown(default)}" if default is not None else ""
    return _card(story, title, "simulation", "fit_fitted", beside)


def _replay(story: Story) -> Card | None:
    sane = story.value("replay", "sane")
    if sane is None:
        return None
    entry = story.metrics.values["replay"]
    ratio = story.value("replay", "displacement_ratio")
    beside = f"smallest det F {shown(entry['smallest_det_f']['value'])}"
    if ratio is not None:
        beside += f", moves {shown(ratio)} × the grip"
    word = "stays whole" if sane else "breaks"
    return Card("Replay's body", word, "", beside, entry["sane"]["protocol"], "good" if sane else "poor")


def _cost(story: Story) -> list[Card]:
    costs = story.metrics.stages.values()
    seconds, memory = [c["seconds"] for c in costs if "seconds" in c], [c["peak_mb"] for c in costs if "peak_mb" in c]
    if not seconds:
        return []
    total = sum(seconds)
    value, unit = (shown(total / 60), "min") if total >= 120 else (shown(total), "s")
    beside = f"of work, all stages; peak memory {shown(max(memory) / 1000)} GB" if memory else "of work, all stages"
    return [Card("Cost", value, unit, beside, "sum of wall times, largest resident size", "plain")]
