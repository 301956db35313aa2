"""Settings of the report."""

from typing import Any

from pydantic import Field

from surgisim.config.base import Settings


class Report(Settings):
    moments: int = Field(5, ge=3, le=8)
    """Columns of the contact sheet. [frames]"""
    panel: int = Field(440, ge=64, le=1280)
    """Width of one panel of a film; three or four of them stand side by side. [px]"""
    cell: int = Field(300, ge=64, le=1280)
    """Width of one picture of the contact sheet. [px]"""
    quality: int = Field(22, ge=0, le=51)
    """Constant rate factor of the films: lower is better and larger. [1]"""
    column: int | None = Field(None, ge=0)
    """Column of the Y-T slices; null takes the one that changes most. [px]"""


class ReportOfRun(Report):
    """What the report's script is told beside the user's choices."""

    stages: dict[str, Any] = Field({})
    """Settings of every stage of the run, by stage [object]."""
    code: dict[str, str] = Field({})
    """Digest of every stage's code, by stage [object]."""
