"""The handful of numbers that say how the run went."""

from dataclasses import dataclass

from surgisim.report.story import Story


@dataclass(frozen=True)
class Card:
    title: str
    value: str
    unit: str
    beside: str
    """What to compare it with."""
    protocol: str
    mark: str
    """good, poor or plain."""


def headline(story: Story) -> list[Card]:
    cards = [_masking(story), _tracking(story), _depth(story), *_reconstruction(story), *_simulation(story)]
    return [c for c in [*cards, _replay(story), *_cost(story)] if c is not None]


def shown(value: float) -> str:
    """Three digits, two below 0.1, without an exponent where that can be read."""
    size = abs(value)
    if value == 0:
        return "0"
    if size >= 1e6 or size < 1e-4:
        return f"{value:.1e}"
    if size >= 1:
        return f"{value:,.{max(0, 3 - len(str(int(size))))}f}"
    return f"{value:.3f}" if size >= 0.1 else f"{value:#.2g}"


def _card(story: Story, title: str, group: str, name: str, beside: str = "", mark: str = "plain") -> Card | None:
    entry = story.metrics.values.get(group, {}).get(name)
    if entry is None:
        return None
    return Card(
        title, shown(entry["value"]), "" if entry["unit"] == "1" else entry["unit"], beside, entry["protocol"], mark
    )


def _masking(story: Story) -> Card | None:
    iou = story.value("masking", "tool_iou")
    if iou is None:
        return _card(story, "Instrument mask", "masking", "confidence", "the stage's own confidence, 0-1")
    return _card(
        story, "Instrument mask", "masking", "tool_iou", "overlap with the truth; 1 is perfect", _mark(iou >= 0.85)
    )


def _tracking(story: Story) -> Card | None:
    value = story.value("tracking", "median")
    if value is None:
        return _card(story, "Tracks", "tracking", "sigma", "the tracker's own uncertainty; no truth is known")
    still = story.value("tracking", "still_mean")
    beside = f"median off the truth; mean motion is {shown(still)} px" if still is not None else ""
    return _card(story, "Tracks", "tracking", "median", beside, _mark(value <= 1))


def _depth(story: Story) -> Card | None:
    for name, what in (("true_relative", "off the truth"), ("given_relative", "off the given depth")):
        if story.value("depth", name) is not None:
            scale = "" if story.run.depth.scale == "known" else ", after one scale factor"
            return _card(story, "Depth", "depth", name, f"mean, {what}{scale}")
    return _card(story, "Depth", "depth", "confidence", "the stage's own confidence, 0-1; no truth is known")


def _reconstruction(story: Story) -> list[Card | None]:
    still, value = story.value("reconstruction", "still_psnr_between"), story.value("reconstruction", "psnr_between")
    beside = "frames never used"
    if still is not None and value is not None:
        beside += f"; frame 0 held still {shown(still)} dB"
        return [_card(story, "Reconstruction", "reconstruction", "psnr_between", beside, _mark(value > still))]
    return [_card(story, "Reconstruction", "reconstruction", "psnr_between", beside)]


def _simulation(story: Story) -> list[Card | None]:
    for kind, words in (("true", "true points"), ("tracked", "tracked points")):
        value = story.value("simulation", f"{kind}_held_out_moving_px")
        still = story.value("simulation", f"{kind}_held_out_moving_still_px")
        if value is None or still is None:
            continue
        beside = f"off moving {words}, frames never used; {shown(still)} if nothing moved"
        card = _card(story, "Replay's motion", "simulation", f"{kind}_held_out_moving_px", beside, _mark(value < still))
        return [card, _told(story), _fit(story)]
    return [_told(story), _fit(story)]


def _told(story: Story) -> Card | None:
    """Whether the intervals hold the truth, where it is known."""
    share = story.value("physics", "told_inside")
    return _card(
        story, "Truth in the intervals", "physics", "told_inside", "share of what the clip is said to tell",
        _mark(share is not None and share >= 0.8),
    )  # fmt: skip


def _fit(story: Story) -> Card | None:
    fitted, default = story.value("simulation", "fit_fitted"), story.value("simulation", "fit_default")
    if fitted is None or default is None or not story.run.fit.history:
        return None
    beside = f"track error, frames never used; default parameters {shown(default)}"
    return _card(story, "Fitted physics", "simulation", "fit_fitted", beside, _mark(fitted < default))


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
    return Card("Replay's body", word, "", beside, entry["sane"]["protocol"], _mark(bool(sane)))


def _cost(story: Story) -> list[Card]:
    costs = story.metrics.stages.values()
    seconds, memory = [c["seconds"] for c in costs if "seconds" in c], [c["peak_mb"] for c in costs if "peak_mb" in c]
    if not seconds:
        return []
    total = sum(seconds)
    value, unit = (shown(total / 60), "min") if total >= 120 else (shown(total), "s")
    beside = f"of work, all stages; peak memory {shown(max(memory) / 1000)} GB" if memory else "of work, all stages"
    return [Card("Cost", value, unit, beside, "sum of wall times, largest resident size", "plain")]


def _mark(good: bool) -> str:
    return "good" if good else "poor"
