"""What the viewer says of a case."""

from surgisim.viewer.case import Case


def about(case: Case) -> str:
    scale = "metres" if case.camera.scale == "known" else "lengths known up to one factor"
    count, cell = len(case.body.rest), 1e3 * case.body.spacing
    return (
        f"**{case.clip}**, variant {case.variant}: {len(case.scene.mean):,} Gaussians, {count:,} particles, "
        f"cells of {cell:.2f} mm, {case.camera.fps:g} frames a second ({scale})."
    )


def parameters(case: Case) -> str:
    """Table of the laws' numbers, with the fit's intervals where the clip tells them."""
    lines = ["| law | number | value | 90 % interval |", "|---|---|---|---|"]
    physics = case.physics if case.named is None else case.named[0]
    for law, numbers in physics.terms.items():
        for name, entry in numbers.items():
            low, high = entry.get("low"), entry.get("high")
            interval = "not told by the clip" if low is None or high is None else f"{low:.3g} to {high:.3g}"
            value, unit = entry.get("tissue", entry["value"]), entry["unit"]
            lines.append(f"| {law} | {name} | {value:.4g} {'' if unit == '1' else unit} | {interval} |")
    return "\n".join(lines)
