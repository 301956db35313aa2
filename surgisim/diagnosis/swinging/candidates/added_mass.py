"""Mass in one place along the body."""

from surgisim.diagnosis.swinging.law import ALONG, Frame, Law


def laws(f: Frame) -> list[Law]:
    def make(x):
        return {"added_mass": {"mass": x[0]}}, {"added_mass": f.point(x[1])}

    tried = tuple(f.mass * s for s in (0.1, 0.4, 1.0))
    return [Law("added_mass", make, (tried, ALONG), (1e-5, 0.0), (3 * f.mass, 1.0))]
