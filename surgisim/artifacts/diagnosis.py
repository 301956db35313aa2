"""What a diagnosis says of a recording; the fields are those of format surgisim-diagnosis/1 (docs/diagnosis.md)."""

from dataclasses import dataclass, field
from typing import Any

from surgisim.artifacts.base import JsonArtifact, check

ALIKE = 1e-5
"""Errors that differ by less are the same [mm]: positions of 5 cm have steps of 4e-6 mm in single precision."""
VERDICTS = ("named", "equivalence class", "nothing detectable", "unexplained")


@dataclass(frozen=True)
class Diagnosis(JsonArtifact):
    recording: str
    verdict: str
    effects: list[dict[str, Any]]
    """Each with term, probability, place, time, parameters, runners_up, separating_experiment."""
    ranking: list[dict[str, Any]]
    """Every law tried: term, place, log_evidence, probability, cos to the winner, held_out RMS [mm] or null."""
    detectable_above: dict[str, Any]
    """{"value", "unit"}: RMS size beyond which an effect would mostly have been seen; and "laws": law -> size."""
    missing_phases: list[str]
    fit: dict[str, Any]
    """RMS distance between recording and prediction: noise_floor, before, after, placebo, flexible, unit."""
    held_out: dict[str, Any]
    unexplained_fraction: float
    words: str
    base: dict[str, Any]
    """The base's parameters: value, low, high, unit."""
    noise: dict[str, Any]
    """The tracks' noise as estimated; how many samples `strayed`, and which points were `left_out`."""
    global_test: dict[str, Any]
    """Evidence of the best law, what nulls reach, and the threshold."""
    format: str = "surgisim-diagnosis/1"
    frame: str = "recording"
    """Frame of every place and direction here, in physics.json and in mismatch: that of the recording's own files."""
    axes: dict[str, Any] = field(default_factory=lambda: {"names": ["x", "y", "z"], "unit": "m"})
    """What the three numbers of a place are, in their order; `words` gives them in mm."""
    markers: list[dict[str, Any]] = field(default_factory=list)
    """What `words` and the page call a place by: mark ("1", "2", ... of an effect, "A" of the largest misfit), of,
    center, unit, and where known extent and time [s]."""
    nuisances: list[dict[str, Any]] = field(default_factory=list)
    """Each with name, value, sd, unit, and said: whether the recording says more of it than was assumed."""
    goodness: dict[str, Any] = field(default_factory=dict)
    """per_frame: chi square over its degrees of freedom, one number or null a frame, with what is named; degrees: those
    degrees of freedom, one number or one a frame."""
    untold: list[str] = field(default_factory=list)
    """Parameters that this recording does not tell: at a bound of what was tried, or hardly surer than beforehand."""
    residual: dict[str, Any] = field(default_factory=dict)
    """Where nothing is named, what was modelled without a name: laws (each as an effect), character
    (artifacts/character.py), numbers (how many), log_evidence, fit and held_out (as above, before and after), helps
    (whether the frames held out come nearer; only then physics.json has it) and words. Empty where that was not tried.
    """
    as_given: list[str] = field(default_factory=list)
    """Parameters of which something was known of this body beforehand, and which the recording makes hardly surer."""
    forces: dict[str, Any] = field(default_factory=dict)
    """Beside the base: count, largest, simulated_there and rms_left of measured forces, unit; empty if none."""
    foretold: dict[str, Any] = field(default_factory=dict)
    """Of another recording that was never fitted: its name, RMS before and after what is named, unit; {} if none."""
    elsewhere: dict[str, Any] = field(default_factory=dict)
    """The base that another recording told: file, numbers (low, high, unit by name), passed_over laws; {} if none."""

    def __post_init__(self) -> None:
        check(self.verdict in VERDICTS, f"Diagnosis: verdict '{self.verdict}' is none of {VERDICTS}.")
