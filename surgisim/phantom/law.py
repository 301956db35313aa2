"""What the invented tissue is made of."""

from dataclasses import dataclass

from surgisim.problem import Problem


@dataclass(frozen=True)
class Law:
    """A neo-Hookean solid with Newtonian (Kelvin-Voigt) viscosity.

    psi = mu/2 (tr F^T F - 3 - 2 ln J) + lambda/4 (theta^2 - 1 - 2 ln theta)     [J/m^3]
    sigma = (the solid's) + 2 eta D                                             [Pa]

    theta is the mean of J over an element (Nagtegaal, Parks and Rice, On numerically accurate
    finite element solutions in the fully plastic range, 1974), so nothing locks near nu = 1/2.
    """

    E: float
    """Young's modulus [Pa]."""
    nu: float
    """Poisson's ratio [1]."""
    eta: float
    """Viscosity [Pa s]."""
    density: float
    """[kg/m^3]."""

    def __post_init__(self) -> None:
        if not (self.E > 0 and 0 <= self.nu < 0.5 and self.eta >= 0 and self.density > 0):
            raise Problem(
                f"phantom: E {self.E}, nu {self.nu}, eta {self.eta}, density {self.density} are no material; "
                "E > 0, 0 <= nu < 0.5, eta >= 0 and density > 0 are wanted."
            )

    @property
    def mu(self) -> float:
        """Shear modulus [Pa]."""
        return self.E / (2 * (1 + self.nu))

    @property
    def lam(self) -> float:
        """Lame's first parameter [Pa]."""
        return self.E * self.nu / ((1 + self.nu) * (1 - 2 * self.nu))
