"""What is wrong with this run, or not to be believed, in sentences."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from surgisim.measure.spans import SPANS, THREE
from surgisim.report.digits import shown, spread
from surgisim.report.story import Story


@dataclass(frozen=True)
class Doubt:
    serious: bool
    sentence: str


def distrust(story: Story) -> list[Doubt]:
    """Serious ones first."""
    found = [*_recording(story), *_perception(story), *_grasp(story), *_scene(story), *_physics(story), *_replay(story)]
    return sorted(found, key=lambda doubt: not doubt.serious)


def _recording(story: Story) -> Iterator[Doubt]:
    camera = story.run.camera
    if camera.scale == "arbitrary":
        yield Doubt(
            False,
            "The scale is arbitrary: one camera cannot know absolute size, so lengths, speeds and stiffnesses share "
            "unknown factors. Ratios, times and pixels can be read.",
        )
    if camera.focal_from == "assumed":
        yield Doubt(
            False,
            f"The focal length is assumed ({camera.fx:.0f} px), not calibrated: relief and motions along the view "
            "may be stretched. Give it as ingest.focal.",
        )
    if story.run.truth is None:
        yield Doubt(
            False,
            "No truth is known for this clip: errors are against the recording's pixels and against tracks and depths "
            "that are estimates themselves.",
        )


def _perception(story: Story) -> Iterator[Doubt]:
    run = story.run
    unsure = np.flatnonzero(run.masks.confidence < 0.5)
    if len(unsure):
        yield Doubt(
            True,
            f"The instrument's outline is unsure (confidence below 0.5) in {len(unsure)} of "
            f"{len(run.masks.confidence)} frames, first frame {unsure[0]}. Clicks on the tool or "
            "given masks help.",
        )
    if not run.masks.tool.any():
        yield Doubt(True, "No instrument was found in any frame.")
    leak = story.value("masking", "tool_taken_for_tissue")
    if leak is not None and leak > 0.05:
        yield Doubt(True, f"{leak:.0%} of the instrument's pixels are taken for tissue.")
    invented = (run.inpainted.origin == 2).mean()
    if invented > 0.02:
        yield Doubt(
            False,
            f"{invented:.1%} of all pixels were never seen without the instrument; what is there is invented.",
        )
    if run.depth.confidence.mean() < 0.5:
        yield Doubt(True, f"The depth's own confidence is low (mean {run.depth.confidence.mean():.2f} of 1).")
    if run.tracks.visible.size and run.tracks.visible.mean() < 0.5:
        yield Doubt(True, f"Tracked points are seen only {run.tracks.visible.mean():.0%} of the time.")


def _grasp(story: Story) -> Iterator[Doubt]:
    motion = story.run.motion
    if len(motion.radius) == 0:
        yield Doubt(True, "No grasp was found: nothing drives the replay. Give one as tracking.grasp if there is one.")
    elif motion.source == "found" and motion.confidence.min() < 0.6:
        yield Doubt(
            True,
            f"The grasp was found with a confidence of only {motion.confidence.min():.2f}: its place, path or "
            "release may be wrong, and all physics with it.",
        )
    if len(motion.radius) and story.release is None:
        yield Doubt(False, "The grip never lets go within the clip: no rebound is seen, so damping is hard to tell.")


def _scene(story: Story) -> Iterator[Doubt]:
    value, still = story.value("reconstruction", "psnr_between"), story.value("reconstruction", "still_psnr_between")
    if value is not None and still is not None and value <= still:
        yield Doubt(
            True,
            f"On frames it never saw the reconstruction ({shown(value)} dB) is no better than frame 0 held still "
            f"({shown(still)} dB).",
        )


def _physics(story: Story) -> Iterator[Doubt]:
    table = story.run.fit.identifiability
    edges = [name for name, found in table.items() if found.get("at_edge")]
    unknown = [name for name, found in table.items() if not found["told"] and name not in edges]
    if edges:
        yield Doubt(
            True,
            f"{', '.join(edges)} ended at the limit of the range that was searched: more likely making up for a wrong "
            "depth, grip or support than measured.",
        )
    missed = [
        f"{name} ({shown(e['low'])} to {shown(e['high'])}, true {shown(e['true'])})"
        for name, e in story.metrics.values.get("physics", {}).items()
        if e.get("told") and e.get("inside") is False
    ]
    if missed:
        yield Doubt(True, f"The truth lies outside the 90 % interval of {', '.join(missed)}.")
    if unknown:
        yield Doubt(
            False,
            f"This clip cannot tell {', '.join(unknown)}: what is given is where the search stood, not a measurement.",
        )
    fitted, default = story.value("simulation", "fit_fitted"), story.value("simulation", "fit_default")
    if not story.run.fit.history:
        yield Doubt(False, "No parameter was fitted: the replay runs with default or given numbers.")
    elif fitted is not None and default is not None and fitted >= default:
        yield Doubt(True, "The fitted parameters predict unseen frames no better than the default ones.")


def _replay(story: Story) -> Iterator[Doubt]:
    if story.value("replay", "sane") == 0.0:
        yield Doubt(
            True,
            f"The replay does not stay whole: smallest det F {shown(story.value('replay', 'smallest_det_f') or 0)}, "
            f"{shown(story.value('replay', 'displacement_ratio') or 0)} times the grip's displacement, "
            f"{story.value('replay', 'inside') or 0:.0%} of the particles stay in the picture.",
        )
    if not story.replayed:
        yield Doubt(True, "The replay was not rendered over the recording's frames, so pictures cannot be compared.")
    kind = "tracked" if story.run.truth is None else "true"
    covered = story.value("simulation", f"{kind}_moving_on_body")
    if covered is not None and covered < 0.8:
        yield Doubt(
            True,
            f"The body has only {covered:.0%} of the {kind} points that move: errors of the replay say nothing of the "
            "others.",
        )
    value = story.value("simulation", f"{kind}_used_moving_px")
    still = story.value("simulation", f"{kind}_used_moving_still_px")
    if value is not None and still is not None and value >= still:
        yield Doubt(
            True,
            f"On used frames the replay follows the {kind} points no better than a body that never moves "
            f"({shown(value)} against {shown(still)} px).",
        )
    for span in THREE:
        for other, words in (("still", "a body that never moves"), ("rigid", "one that goes rigidly with the grip")):
            # Let go, a rigid body is a still one.
            if (span, other) == ("released", "rigid"):
                continue
            entry = story.metrics.values.get("simulation", {}).get(f"{kind}_held_out_{span}_moving_of_{other}_px")
            if entry and entry["low"] is not None and entry["low"] >= 100:
                yield Doubt(
                    True,
                    f"On frames never used {SPANS[span][1]} the replay follows the {kind} points worse than {words} "
                    f"({shown(entry['value'])} % of its error, {spread(entry)}).",
                )
