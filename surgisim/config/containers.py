"""Images that stages run in."""

from pydantic import Field

from surgisim.config.base import Settings


class Containers(Settings):
    """Image of each family of stages for `--sdm apptainer`: a file (.sif, or an unpacked folder), or an address such as
    docker://registry/name:tag. envs/FAMILY.Dockerfile builds them."""

    perception: str = Field("", description="Of ingest to tracking: file or address [path]")
    scene: str = Field("", description="Of reconstruction and thickening: file or address [path]")
    physics: str = Field("", description="Of the phantom, estimation, simulation and diagnosis: file or address [path]")
    report: str = Field("", description="Of evaluation, reports, tables and boards: file or address [path]")
