"""Settings of the score of a scene alone."""

from pydantic import Field

from surgisim.config.evaluation import Evaluation


class SceneScore(Evaluation):
    """As the evaluation's."""

    seed: int = Field(0, ge=0)
    """Seed of the scene's fit, for the tables [1]."""
