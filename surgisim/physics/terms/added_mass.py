"""Something heavy on or in the tissue: a clip, a swab, a pool of blood.

    rho <- rho + m exp(-|x - c|^2 / (2 r^2)) / integral of the same   [kg/m^3]

m [kg] is the whole of it, shared out over the law's place (centre c, extent r [m]). It is slower to move and, under
gravity, weighs more; it is no stiffer.
Rayleigh, The theory of sound, vol. 1, 2nd ed. (1894), section 88: a load lowers every frequency.
"""

from surgisim.physics.catalogue import Param, Term

TERM = Term(
    mass="mass",
    place="somewhere",
    params={"mass": Param("kg", low=1e-5, high=0.2, default=0.005, off=0.0, total=True)},
)
