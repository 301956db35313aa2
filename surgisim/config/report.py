"""Settings of the report."""

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
