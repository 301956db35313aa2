"""Nodal forces of 8-node hexahedra with one mean dilatation each, in a compiled kernel.

Total Lagrangian, 2 x 2 x 2 Gauss points. Within an element positions and velocities are written in the
seven modes xi, eta, zeta, xi eta, eta zeta, zeta xi, xi eta zeta, whose gradients at a Gauss point cost a
third of the nodal ones. Elements go through in blocks of LANES, the innermost loop, so that the
compiler can use the machine's vector instructions.
"""

import numpy as np
from numba import njit

from surgisim.phantom.elements import GAUSS, LANES

L = LANES
FAST = {"contract", "reassoc", "arcp", "nsz"}
"""Liberties of arithmetic, without which nothing is vectorised; NaN and infinity keep their meaning."""


@njit(cache=True, fastmath=FAST, error_model="numpy")
def add_forces(x, v, cells, inverse, weight, mu, lam, eta, force):
    """Add each element's forces [N] at positions x [m] and velocities v [m/s], all (N, 3), into `force`."""
    # One flat array of rows of L lanes. Only where rows lie a constant distance apart can the compiler rule out
    # that they overlap, and vectorise. Rows: 0-47 positions and velocities of node a at 6 a, 48-89 those of mode k at
    # 48 + 6 k, 90-110 forces on modes, 111-134 on nodes, 135-143 d xi / d X, 144 weight, 145 theta, 146-148 the law.
    m = np.zeros(149 * L)
    for b in range(cells.shape[0]):
        for a in range(8):
            for j in range(L):
                n = cells[b, a, j]
                for i in range(3):
                    m[(6 * a + i) * L + j] = x[n, i]
                    m[(6 * a + 3 + i) * L + j] = v[n, i]
        for c in range(6):
            _to_modes(m, c)
        m[90 * L : 111 * L] = 0.0
        for j in range(L):
            m[145 * L + j] = 0.0
            m[146 * L + j] = mu[b, j]
            m[147 * L + j] = lam[b, j]
            m[148 * L + j] = eta[b, j]
        for g in range(8):
            _swell(m, GAUSS[g, 0], GAUSS[g, 1], GAUSS[g, 2])
        for j in range(L):
            rest = 0.0
            for g in range(8):
                rest += weight[b, g, j]
            m[145 * L + j] = m[145 * L + j] / rest if rest > 0 else 1.0
        for g in range(8):
            for k in range(9):
                for j in range(L):
                    m[(135 + k) * L + j] = inverse[b, g, k, j]
            for j in range(L):
                m[144 * L + j] = weight[b, g, j]
            _stress(m, GAUSS[g, 0], GAUSS[g, 1], GAUSS[g, 2])
        for c in range(3):
            _to_nodes(m, c)
        for a in range(8):
            for j in range(L):
                n = cells[b, a, j]
                for i in range(3):
                    force[n, i] -= m[(111 + 3 * a + i) * L + j]


@njit(cache=True, fastmath=FAST, error_model="numpy")
def _to_modes(m, c):
    """The seven modes of one component of the eight nodes, by sums and differences along xi, eta and zeta."""
    at = c * L
    for j in range(L):
        n0, n1, n2, n3 = m[at + j], m[at + 6 * L + j], m[at + 12 * L + j], m[at + 18 * L + j]
        n4, n5, n6, n7 = m[at + 24 * L + j], m[at + 30 * L + j], m[at + 36 * L + j], m[at + 42 * L + j]
        s0, s1, s2, s3 = n1 + n0, n3 + n2, n5 + n4, n7 + n6
        d0, d1, d2, d3 = n1 - n0, n3 - n2, n5 - n4, n7 - n6
        m[at + 48 * L + j] = 0.125 * (d0 + d1 + d2 + d3)
        m[at + 54 * L + j] = 0.125 * (s1 - s0 + s3 - s2)
        m[at + 60 * L + j] = 0.125 * (s2 + s3 - s0 - s1)
        m[at + 66 * L + j] = 0.125 * (d1 - d0 + d3 - d2)
        m[at + 72 * L + j] = 0.125 * (s3 - s2 - s1 + s0)
        m[at + 78 * L + j] = 0.125 * (d2 + d3 - d0 - d1)
        m[at + 84 * L + j] = 0.125 * (d3 - d2 - d1 + d0)


@njit(cache=True, fastmath=FAST, error_model="numpy")
def _to_nodes(m, c):
    """The transpose of _to_modes, for one component of the forces."""
    at = c * L
    for j in range(L):
        x, y, z = 0.125 * m[at + 90 * L + j], 0.125 * m[at + 93 * L + j], 0.125 * m[at + 96 * L + j]
        xy, yz, zx = 0.125 * m[at + 99 * L + j], 0.125 * m[at + 102 * L + j], 0.125 * m[at + 105 * L + j]
        xyz = 0.125 * m[at + 108 * L + j]
        even0, odd0, even1, odd1 = yz - y - z, x - xy - zx + xyz, y - z - yz, x + xy - zx - xyz
        even2, odd2, even3, odd3 = z - y - yz, x - xy + zx - xyz, y + z + yz, x + xy + zx + xyz
        m[at + 111 * L + j] = even0 - odd0
        m[at + 114 * L + j] = even0 + odd0
        m[at + 117 * L + j] = even1 - odd1
        m[at + 120 * L + j] = even1 + odd1
        m[at + 123 * L + j] = even2 - odd2
        m[at + 126 * L + j] = even2 + odd2
        m[at + 129 * L + j] = even3 - odd3
        m[at + 132 * L + j] = even3 + odd3


@njit(cache=True, fastmath=FAST, error_model="numpy")
def _swell(m, p, q, r):
    """Add one Gauss point's volume now to row 145."""
    for j in range(L):
        a00 = m[48 * L + j] + m[66 * L + j] * q + m[78 * L + j] * r + m[84 * L + j] * q * r
        a10 = m[49 * L + j] + m[67 * L + j] * q + m[79 * L + j] * r + m[85 * L + j] * q * r
        a20 = m[50 * L + j] + m[68 * L + j] * q + m[80 * L + j] * r + m[86 * L + j] * q * r
        a01 = m[54 * L + j] + m[66 * L + j] * p + m[72 * L + j] * r + m[84 * L + j] * p * r
        a11 = m[55 * L + j] + m[67 * L + j] * p + m[73 * L + j] * r + m[85 * L + j] * p * r
        a21 = m[56 * L + j] + m[68 * L + j] * p + m[74 * L + j] * r + m[86 * L + j] * p * r
        a02 = m[60 * L + j] + m[72 * L + j] * q + m[78 * L + j] * p + m[84 * L + j] * p * q
        a12 = m[61 * L + j] + m[73 * L + j] * q + m[79 * L + j] * p + m[85 * L + j] * p * q
        a22 = m[62 * L + j] + m[74 * L + j] * q + m[80 * L + j] * p + m[86 * L + j] * p * q
        m[145 * L + j] += a00 * (a11 * a22 - a12 * a21) + a01 * (a12 * a20 - a10 * a22) + a02 * (a10 * a21 - a11 * a20)


@njit(cache=True, fastmath=FAST, error_model="numpy")
def _stress(m, p, q, r):
    """Add one Gauss point's first Piola-Kirchhoff stress, as seen by each mode, to rows 90-110."""
    qr, rp, pq = q * r, r * p, p * q
    for j in range(L):
        a00 = m[48 * L + j] + m[66 * L + j] * q + m[78 * L + j] * r + m[84 * L + j] * qr
        a10 = m[49 * L + j] + m[67 * L + j] * q + m[79 * L + j] * r + m[85 * L + j] * qr
        a20 = m[50 * L + j] + m[68 * L + j] * q + m[80 * L + j] * r + m[86 * L + j] * qr
        a01 = m[54 * L + j] + m[66 * L + j] * p + m[72 * L + j] * r + m[84 * L + j] * rp
        a11 = m[55 * L + j] + m[67 * L + j] * p + m[73 * L + j] * r + m[85 * L + j] * rp
        a21 = m[56 * L + j] + m[68 * L + j] * p + m[74 * L + j] * r + m[86 * L + j] * rp
        a02 = m[60 * L + j] + m[72 * L + j] * q + m[78 * L + j] * p + m[84 * L + j] * pq
        a12 = m[61 * L + j] + m[73 * L + j] * q + m[79 * L + j] * p + m[85 * L + j] * pq
        a22 = m[62 * L + j] + m[74 * L + j] * q + m[80 * L + j] * p + m[86 * L + j] * pq
        b00 = m[51 * L + j] + m[69 * L + j] * q + m[81 * L + j] * r + m[87 * L + j] * qr
        b10 = m[52 * L + j] + m[70 * L + j] * q + m[82 * L + j] * r + m[88 * L + j] * qr
        b20 = m[53 * L + j] + m[71 * L + j] * q + m[83 * L + j] * r + m[89 * L + j] * qr
        b01 = m[57 * L + j] + m[69 * L + j] * p + m[75 * L + j] * r + m[87 * L + j] * rp
        b11 = m[58 * L + j] + m[70 * L + j] * p + m[76 * L + j] * r + m[88 * L + j] * rp
        b21 = m[59 * L + j] + m[71 * L + j] * p + m[77 * L + j] * r + m[89 * L + j] * rp
        b02 = m[63 * L + j] + m[75 * L + j] * q + m[81 * L + j] * p + m[87 * L + j] * pq
        b12 = m[64 * L + j] + m[76 * L + j] * q + m[82 * L + j] * p + m[88 * L + j] * pq
        b22 = m[65 * L + j] + m[77 * L + j] * q + m[83 * L + j] * p + m[89 * L + j] * pq
        i00, i01, i02 = m[135 * L + j], m[136 * L + j], m[137 * L + j]
        i10, i11, i12 = m[138 * L + j], m[139 * L + j], m[140 * L + j]
        i20, i21, i22 = m[141 * L + j], m[142 * L + j], m[143 * L + j]
        # F = a i and its rate, R = b i
        f00, f01, f02 = (
            a00 * i00 + a01 * i10 + a02 * i20,
            a00 * i01 + a01 * i11 + a02 * i21,
            a00 * i02 + a01 * i12 + a02 * i22,
        )
        f10, f11, f12 = (
            a10 * i00 + a11 * i10 + a12 * i20,
            a10 * i01 + a11 * i11 + a12 * i21,
            a10 * i02 + a11 * i12 + a12 * i22,
        )
        f20, f21, f22 = (
            a20 * i00 + a21 * i10 + a22 * i20,
            a20 * i01 + a21 * i11 + a22 * i21,
            a20 * i02 + a21 * i12 + a22 * i22,
        )
        r00, r01, r02 = (
            b00 * i00 + b01 * i10 + b02 * i20,
            b00 * i01 + b01 * i11 + b02 * i21,
            b00 * i02 + b01 * i12 + b02 * i22,
        )
        r10, r11, r12 = (
            b10 * i00 + b11 * i10 + b12 * i20,
            b10 * i01 + b11 * i11 + b12 * i21,
            b10 * i02 + b11 * i12 + b12 * i22,
        )
        r20, r21, r22 = (
            b20 * i00 + b21 * i10 + b22 * i20,
            b20 * i01 + b21 * i11 + b22 * i21,
            b20 * i02 + b21 * i12 + b22 * i22,
        )
        # cofactors c: F^-T = c / J
        c00, c01, c02 = f11 * f22 - f12 * f21, f12 * f20 - f10 * f22, f10 * f21 - f11 * f20
        c10, c11, c12 = f02 * f21 - f01 * f22, f00 * f22 - f02 * f20, f01 * f20 - f00 * f21
        c20, c21, c22 = f01 * f12 - f02 * f11, f02 * f10 - f00 * f12, f00 * f11 - f01 * f10
        over = 1.0 / (f00 * c00 + f01 * c01 + f02 * c02)
        # J D = sym(R c^T); viscous P = 2 eta J D F^-T
        d00 = r00 * c00 + r01 * c01 + r02 * c02
        d11 = r10 * c10 + r11 * c11 + r12 * c12
        d22 = r20 * c20 + r21 * c21 + r22 * c22
        d01 = 0.5 * (r00 * c10 + r01 * c11 + r02 * c12 + r10 * c00 + r11 * c01 + r12 * c02)
        d12 = 0.5 * (r10 * c20 + r11 * c21 + r12 * c22 + r20 * c10 + r21 * c11 + r22 * c12)
        d20 = 0.5 * (r20 * c00 + r21 * c01 + r22 * c02 + r00 * c20 + r01 * c21 + r02 * c22)
        # P = mu F + (s I + 2 eta J D / J) c, with s = p - mu / J
        w = m[144 * L + j]
        k = w * m[146 * L + j]
        e = w * 2.0 * m[148 * L + j] * over
        s = w * (0.5 * m[147 * L + j] * (m[145 * L + j] - 1.0 / m[145 * L + j]) - m[146 * L + j] * over)
        t00, t11, t22, t01, t12, t20 = s + e * d00, s + e * d11, s + e * d22, e * d01, e * d12, e * d20
        p00, p01, p02 = (
            k * f00 + t00 * c00 + t01 * c10 + t20 * c20,
            k * f01 + t00 * c01 + t01 * c11 + t20 * c21,
            k * f02 + t00 * c02 + t01 * c12 + t20 * c22,
        )
        p10, p11, p12 = (
            k * f10 + t01 * c00 + t11 * c10 + t12 * c20,
            k * f11 + t01 * c01 + t11 * c11 + t12 * c21,
            k * f12 + t01 * c02 + t11 * c12 + t12 * c22,
        )
        p20, p21, p22 = (
            k * f20 + t20 * c00 + t12 * c10 + t22 * c20,
            k * f21 + t20 * c01 + t12 * c11 + t22 * c21,
            k * f22 + t20 * c02 + t12 * c12 + t22 * c22,
        )
        # dual of a: h_ik = P_ij i_kj
        h00, h01, h02 = (
            p00 * i00 + p01 * i01 + p02 * i02,
            p00 * i10 + p01 * i11 + p02 * i12,
            p00 * i20 + p01 * i21 + p02 * i22,
        )
        h10, h11, h12 = (
            p10 * i00 + p11 * i01 + p12 * i02,
            p10 * i10 + p11 * i11 + p12 * i12,
            p10 * i20 + p11 * i21 + p12 * i22,
        )
        h20, h21, h22 = (
            p20 * i00 + p21 * i01 + p22 * i02,
            p20 * i10 + p21 * i11 + p22 * i12,
            p20 * i20 + p21 * i21 + p22 * i22,
        )
        m[90 * L + j] += h00
        m[91 * L + j] += h10
        m[92 * L + j] += h20
        m[93 * L + j] += h01
        m[94 * L + j] += h11
        m[95 * L + j] += h21
        m[96 * L + j] += h02
        m[97 * L + j] += h12
        m[98 * L + j] += h22
        m[99 * L + j] += h00 * q + h01 * p
        m[100 * L + j] += h10 * q + h11 * p
        m[101 * L + j] += h20 * q + h21 * p
        m[102 * L + j] += h01 * r + h02 * q
        m[103 * L + j] += h11 * r + h12 * q
        m[104 * L + j] += h21 * r + h22 * q
        m[105 * L + j] += h00 * r + h02 * p
        m[106 * L + j] += h10 * r + h12 * p
        m[107 * L + j] += h20 * r + h22 * p
        m[108 * L + j] += h00 * qr + h01 * rp + h02 * pq
        m[109 * L + j] += h10 * qr + h11 * rp + h12 * pq
        m[110 * L + j] += h20 * qr + h21 * rp + h22 * pq
