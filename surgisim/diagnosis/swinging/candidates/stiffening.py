"""A modulus that grows with strain."""

from surgisim.diagnosis.swinging.law import Frame, Law


def laws(f: Frame) -> list[Law]:
    tried = tuple(f.E * s for s in (0.1, 0.5))
    return [Law("stiffening", lambda x: ({"stiffening": {"k": x[0]}}, {}), (tried,), (1e-4 * f.E,), (10 * f.E,))]
