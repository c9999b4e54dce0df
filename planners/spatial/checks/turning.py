"""How fast links turn between two poses, and how fast that changes: bounds, no samples.

Between two poses the rotation vector w_j of joint j changes by d_j, evenly. With R_j the frame of link j,
R_j = R_{j-1} exp(w_j), so its angular velocity is

    O_j = O_{j-1} + R_{j-1} v_j,    v_j = J(w_j) w_j',    J(w) = integral of exp(s w) over s in [0, 1].

exp(s w) turns at s |d_j| at most. Differentiation under the integral gives, for all times,

    |v_j| <= |d_j|,    |v_j'| <= |d_j|^2 / 2,    |v_j''| <= |d_j|^3 / 2

(|v_j''|: the rate of exp(s w) changes by (s |d_j|)^2 / 2 at most, by the second bound, and its square is at
most (s |d_j|)^2). Hence, with S, D and T bounds on O, O' and O'' of the link behind (index j - 1),

    D_j = D + S |d_j| + |d_j|^2 / 2
    T_j = T + (D + S^2) |d_j| + S |d_j|^2 + |d_j|^3 / 2
    S_j = |O_j half way| + D_j / 2.

The direction u_j of the link has u' = O x u, so |u_j'''| <= T_j + 3 S_j D_j + S_j^3. Joint k is at the feed,
which is linear, plus a link length times the sum of the directions up to it.
"""

from __future__ import annotations

import numpy as np

from hrsnake_env.arm import FloatArray

__all__ = ["third_derivatives"]


def third_derivatives(joint_angles: FloatArray) -> FloatArray:
    """Bound the third derivatives of joint places between poses, for links of length 1.

    Parameters
    ----------
    joint_angles : array, shape (n_poses, n_links, 2)
        In rad; see `planners.spatial.kinematics`.

    Returns
    -------
    bounds : array, shape (n_poses - 1, n_links + 1)
        By the time from a pose to the next.
    """
    change, halfway = np.diff(joint_angles, axis=0), (joint_angles[:-1] + joint_angles[1:]) / 2.0
    n_steps, n_links = change.shape[:2]
    bounds = np.zeros((n_steps, n_links + 1))
    spin, spin_at, spin_change = (np.zeros(n_steps) for _ in range(3))
    rate, frames = np.zeros((n_steps, 3)), np.broadcast_to(np.eye(3), (n_steps, 3, 3))
    for k in range(n_links):
        d = np.hypot(change[:, k, 0], change[:, k, 1])
        spin_change = spin_change + (spin_at + spin**2) * d + spin * d**2 + d**3 / 2.0
        spin_at = spin_at + spin * d + d**2 / 2.0
        turn, own_rate = _rotations(_vectors(halfway[:, k]), _vectors(change[:, k]))
        rate = rate + np.einsum("nij,nj->ni", frames, own_rate)
        frames = frames @ turn
        spin = np.linalg.norm(rate, axis=1) + spin_at / 2.0
        bounds[:, k + 1] = bounds[:, k] + spin_change + 3.0 * spin * spin_at + spin**3
    return bounds


def _vectors(angles: FloatArray) -> FloatArray:
    """Return joint angles, shape (n, 2), as rotation vectors in the frame of the link behind."""
    return np.stack([np.zeros(len(angles)), -angles[:, 1], angles[:, 0]], axis=1)


def _rotations(w: FloatArray, change: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Compute exp(w), shape (n, 3, 3), and J(w) times the change of w, shape (n, 3)."""
    theta = np.linalg.norm(w, axis=1)[:, None]
    sinc, versed = np.sinc(theta / np.pi), 0.5 * np.sinc(theta / (2.0 * np.pi)) ** 2
    small = theta < 1e-3
    rest = np.where(small, 1.0 / 6.0, (1.0 - sinc) / np.where(small, 1.0, theta) ** 2)
    once = np.cross(w, change)
    rate = change + versed * once + rest * np.cross(w, once)
    cross = np.zeros((len(w), 3, 3))
    cross[:, [2, 0, 1], [1, 2, 0]], cross[:, [1, 2, 0], [2, 0, 1]] = w, -w
    return np.eye(3) + sinc[..., None] * cross + versed[..., None] * (cross @ cross), rate
