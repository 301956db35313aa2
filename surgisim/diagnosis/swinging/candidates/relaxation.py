"""A part of the stiffness that flows away within about half a swing."""

from surgisim.diagnosis.swinging.law import Frame, Law

DAMPS = True


def laws(f: Frame) -> list[Law]:
    scan = tuple(f.E * s for s in (0.02, 0.06, 0.2)), (f.period / 2,)
    return [
        Law(
            "relaxation", lambda x: ({"relaxation": {"G": x[0], "tau": x[1]}}, {}), scan,
            (1e-4 * f.E, 0.02), (f.E, 20.0),
        )
    ]  # fmt: skip
