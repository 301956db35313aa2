"""The rotation in a deformation gradient, with its own adjoint."""

import warp as wp


@wp.func
def rotation(F: wp.mat33):
    """R of F = R S by Newton's iteration R <- (R + R^-T) / 2 (Higham, Computing the polar decomposition, 1986)."""
    # Newton's iteration, not an SVD: equal stretches are where every particle starts, and there
    # the SVD's adjoint is wrong without saying so.
    R = F
    for _ in range(12):
        N = 0.5 * (R + wp.transpose(wp.inverse(R)))
        change = wp.ddot(N - R, N - R)
        R = N
        # Newton's error is half the square of its last change.
        if change < 1.0e-7:
            break
    return R


@wp.func
def rotation(F: wp.mat33d):  # noqa: F811 - Warp's own way to overload a function
    R = F
    for _ in range(20):
        N = wp.float64(0.5) * (R + wp.transpose(wp.inverse(R)))
        change = wp.ddot(N - R, N - R)
        R = N
        if change < wp.float64(1.0e-15):
            break
    return R


# dR = R [w], (tr(S) I - S) w = vee(R^T dF - dF^T R); the transpose of that map is below. It is
# singular only where two stretches sum to zero, which an uninverted F never reaches.


@wp.func_grad(rotation)
def adj_rotation(F: wp.mat33, adj_ret: wp.mat33):
    R = rotation(F)
    S = wp.transpose(R) * F
    G = wp.trace(S) * wp.identity(n=3, dtype=wp.float32) - 0.5 * (S + wp.transpose(S))
    B = wp.transpose(R) * adj_ret
    y = wp.inverse(G) * wp.vec3(B[2, 1] - B[1, 2], B[0, 2] - B[2, 0], B[1, 0] - B[0, 1])
    wp.adjoint[F] += R * wp.skew(y)


@wp.func_grad(rotation)
def adj_rotation(F: wp.mat33d, adj_ret: wp.mat33d):  # noqa: F811
    R = rotation(F)
    S = wp.transpose(R) * F
    G = wp.trace(S) * wp.identity(n=3, dtype=wp.float64) - wp.float64(0.5) * (S + wp.transpose(S))
    B = wp.transpose(R) * adj_ret
    y = wp.inverse(G) * wp.vec3d(B[2, 1] - B[1, 2], B[0, 2] - B[2, 0], B[1, 0] - B[0, 1])
    wp.adjoint[F] += R * wp.skew(y)
