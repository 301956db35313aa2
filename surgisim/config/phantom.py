"""Settings of the phantom: the invented clip."""

from typing import Literal

from pydantic import Field

from surgisim.config.base import Settings


class Phantom(Settings):
    seed: int = Field(7, ge=0)
    """Decides texture, hills, grip, directions and noise [1]."""
    width: int = Field(160, ge=32, le=1920, multiple_of=2)
    """Of the image [px]."""
    height: int = Field(128, ge=32, le=1080, multiple_of=2)
    """Of the image [px]."""
    fps: float = Field(25.0, gt=0)
    """Frames per second [1/s]."""
    duration: float = Field(2.6, gt=0)
    """Of the clip [s]."""
    focal: float = Field(1.2, gt=0)
    """Focal length over image width [1]."""
    distance: float = Field(0.070, gt=0)
    """Camera to the middle of the tissue [m]."""
    slant: float = Field(0.32, ge=0, le=1.0)
    """Angle between the view and the tissue's normal [rad]."""
    relief: float = Field(1.6e-3, ge=0)
    """RMS height of the hills [m]."""
    dome: float = Field(0.0, ge=0)
    """How far the middle of the tissue rises above its corners [m]."""
    thickness: float = Field(0.016, gt=0)
    """Of the tissue above its held base [m]."""
    margin: float = Field(3e-3, ge=0)
    """How far the tissue reaches beyond the image [m]."""
    sides: Literal["free", "held"] = "free"
    """Whether the four sides of the tissue are free or held still [name]."""
    spacing: float = Field(2.8e-3, gt=0)
    """Edge of the finite elements [m]."""
    E: float = 500.0
    """Young's modulus [Pa]."""
    nu: float = 0.45
    """Poisson's ratio [1]."""
    eta: float = 1.8
    """Viscosity [Pa s]."""
    density: float = 1050.0
    """Of the tissue [kg/m^3]."""
    grip_radius: float = Field(0.0055, gt=0)
    """Of the ball of tissue that the jaws carry [m]."""
    pull: float = Field(8.5e-3, ge=0)
    """How far it is carried [m]."""
    lift: float = 0.75
    """Angle of the pull above the tissue's plane [rad]."""
    grasp: float = 0.16
    """When the jaws have closed [s]."""
    load: float = 0.2
    """When the pull begins [s]."""
    hold: float = 0.8
    """When the pull has arrived [s]."""
    release: float = 1.56
    """When the jaws let go [s]."""
    points: int = Field(300, ge=1)
    """Surface points whose true paths are recorded [1]."""
    noise: float = Field(0.006, ge=0)
    """Sensor noise at white, linear light [1]."""
    wet: float = Field(1.0, ge=0, le=3)
    """How strongly its film of water glints [1]."""
    smoke: float = Field(0.0, ge=0, le=0.8)
    """Mean opacity of smoke before it [1]."""
    samples: int = Field(2, ge=1, le=8)
    """Rays per pixel along x and along y [1]."""
    crf: int = Field(12, ge=0, le=51)
    """Constant rate factor of the video encoder [1]."""
