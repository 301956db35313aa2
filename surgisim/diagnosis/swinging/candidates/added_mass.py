"""Mass in one place along the body."""

from surgisim.diagnosis.swinging.law import ALONG, HUNG, Frame, Law


def laws(f: Frame) -> list[Law]:
    def make(x):
        return {"added_mass": {"mass": x[0]}}, {"added_mass": f.somewhere(x[1], HUNG)}

    tried = tuple(f.mass * s for s in (0.1, 0.4, 1.0))
    return [Law("added_mass", make, (tried, ALONG), (1e-5, 0.0), (3 * f.mass, 1.0))]
