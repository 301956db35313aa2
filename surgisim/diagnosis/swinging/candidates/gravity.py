"""Weight that pulls otherwise than was said: along the way it is said to, and along the body."""

from surgisim.diagnosis.swinging.law import Frame, Law


def laws(f: Frame) -> list[Law]:
    own = f.down if f.down.any() else f.axis

    def make(x):
        g = x[0] * own + x[1] * f.axis
        return {"gravity": {**dict(zip("xyz", map(float, g), strict=True)), "onset": -1.0}}, {}

    return [Law("gravity", make, ((-2.0, 2.0), (-2.0, 2.0)), (-10.0, -10.0), (10.0, 10.0))]
