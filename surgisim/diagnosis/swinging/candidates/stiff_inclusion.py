"""Stiffer or softer in one place, or from some place on to what is held."""

from surgisim.diagnosis.swinging.law import ALONG, SEAM, Frame, Law
from surgisim.physics.place import Place


def _called(what: str):
    return lambda x: f"a {'softer' if x[0] < 1 else 'stiffer'} {what}"


def laws(f: Frame) -> list[Law]:
    def lump(x):
        return {"stiff_inclusion": {"s": x[0]}}, {"stiff_inclusion": f.somewhere(x[1])}

    def part(x):
        place = Place(f.along(x[1]), SEAM * f.length, tuple(map(float, f.axis)))
        return {"stiff_inclusion": {"s": x[0]}}, {"stiff_inclusion": place}

    seams = 0.3, 0.5, 0.7
    return [
        Law("stiff_inclusion", lump, ((0.2, 4.0), ALONG), (0.06, 0.0), (16.0, 1.0), called=_called("place")),
        # The base's modulus is then the one near what is held.
        Law("stiff_inclusion", part, ((0.4, 2.5), seams), (0.06, 0.1), (16.0, 0.95), called=_called("part"), divides=0),
    ]
