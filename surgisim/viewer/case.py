"""What a run left of one clip and variant, as far as a viewer needs it."""

from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

import numpy as np

from surgisim.artifacts.base import Artifact, load
from surgisim.artifacts.body import Body
from surgisim.artifacts.camera import Camera
from surgisim.artifacts.deformation import Deformation
from surgisim.artifacts.frames import Frames
from surgisim.artifacts.material import Material
from surgisim.artifacts.motion import Motion
from surgisim.artifacts.physics import Physics
from surgisim.artifacts.replay import Replay
from surgisim.artifacts.scene import Scene
from surgisim.mpm.setup import prepare, values_of
from surgisim.physics.catalogue import choose, columns
from surgisim.physics.place import Place
from surgisim.problem import Problem

A = TypeVar("A", bound=Artifact)


@dataclass(frozen=True)
class Case:
    clip: str
    variant: str
    camera: Camera
    frames: Frames
    scene: Scene
    deformation: Deformation
    body: Body
    mesh: Path
    """Closed surface around the body, PLY."""
    material: Material
    physics: Physics
    motion: Motion
    replay: Replay
    named: tuple[Physics, Material] | None
    """The fitted physics with the law that a diagnosis named; None where there is no diagnosis or it names none."""

    @property
    def laws(self) -> tuple[str, ...]:
        """What the diagnosis added."""
        return () if self.named is None else tuple(t for t in self.named[0].terms if t not in self.physics.terms)


def listed(out: Path) -> list[tuple[str, str]]:
    """Clips and variants in a run's folder that were simulated."""
    found = sorted(out.glob("results/*/*/simulation/replay.npz"))
    return [(path.parts[-4], path.parts[-3]) for path in found]


def chosen(out: Path, clip: str | None, variant: str | None) -> tuple[str, str]:
    """The one that is meant. Raises Problem where there is none, or several and nothing says which."""
    there = listed(out)
    if not there:
        raise Problem(
            f"{out}: holds no results/CLIP/VARIANT/simulation/replay.npz, so there is nothing to view. Run "
            f"'surgisim run CLIP --out {out}' first, or name the folder that was given to --out."
        )
    fits = [(c, v) for c, v in there if clip in (None, c) and variant in (None, v)]
    if variant is None and len(fits) > 1:
        fits = [(c, v) for c, v in fits if v == "main"] or fits
    names = ", ".join(f"{c}/{v}" for c, v in there)
    if len(fits) != 1:
        asked = f"clip {clip or 'any'}, variant {variant or 'any'}"
        raise Problem(
            f"{out}: {asked} fits {len(fits)} of what was simulated there ({names}). Say which with --clip and "
            "--variant."
        )
    return fits[0]


def read(out: Path, clip: str, variant: str) -> Case:
    """Everything a viewer shows. Raises Problem where a file is missing."""
    folder = out / "results" / clip

    def found(stage: str, name: str) -> Path:
        """Variants that agree up to a stage share its files: they lie with one of them."""
        for home in (variant, "main"):
            if (folder / home / stage / name).is_file():
                return folder / home / stage / name
        others = sorted(folder.glob(f"*/{stage}/{name}"))
        if len(others) != 1:
            raise Problem(
                f"{folder}: variant '{variant}' has no {stage}/{name} of its own, and {len(others)} other variants "
                "have one. Run that variant alone into another folder."
            )
        return others[0]

    def get(kind: type[A], stage: str, name: str) -> A:
        return load(kind, found(stage, name))

    body, material = get(Body, "estimation", "body.npz"), get(Material, "estimation", "material.npz")
    physics = get(Physics, "estimation", "physics.json")
    return Case(
        clip=clip,
        variant=variant,
        camera=get(Camera, "ingest", "camera.json"),
        frames=get(Frames, "ingest", "frames.npz"),
        scene=get(Scene, "reconstruction", "scene.ply"),
        deformation=get(Deformation, "reconstruction", "deformation.npz"),
        body=body,
        mesh=found("thickening", "body_mesh.ply"),
        material=material,
        physics=physics,
        motion=get(Motion, "estimation", "motion.npz"),
        replay=load(Replay, folder / variant / "simulation" / "replay.npz"),
        named=_named(folder / variant / "diagnosis" / "physics.json", body, physics, material),
    )


def _named(path: Path, body: Body, fitted: Physics, material: Material) -> tuple[Physics, Material] | None:
    """A diagnosis's physics on the fitted body, with its law's place laid over the particles."""
    if not path.is_file():
        return None
    physics = load(Physics, path)
    if not set(physics.terms) - set(fitted.terms):
        return None
    places = {law: Place(**place) for law, place in physics.places.items()}
    made = prepare(body, tuple(physics.terms), density=physics.density, places=places)
    theta = made.theta(values_of(physics), held=material.held)
    names = np.array(columns(choose(physics.terms, str(path))))
    return physics, Material(names=names, values=theta.astype(np.float32), held=material.held)
