"""Settings of the evaluation."""

from pydantic import Field

from surgisim.config.base import Settings


class Evaluation(Settings):
    clip: str = ""
    """Name of the clip in the tables; empty takes the recording's own name. [text]"""
    variant: str = "main"
    """Name of the variant in the tables. [text]"""
    lpips_weights: str = ""
    """File of LPIPS weights (lpips_alex.safetensors); empty leaves LPIPS out and says so. [path]"""
    first_frames: int = Field(25, ge=1)
    """How many first frames the canonical scene is judged on, as in the paper. [frames]"""
