"""Constants of the collocation: Radau IIA nodes, differentiation, Chebyshev series.

A step is mapped to u in [0, 1]. Its polynomial has degree 12 and is fixed by the value
at u = 0 and at the 12 Radau nodes, the last of which is u = 1.
"""

from __future__ import annotations

import numpy as np
from numpy.polynomial import chebyshev, legendre

from tactile_lab.arrays import FloatArray

ORDER = 12
"""Nodes of the collocation and degree of its polynomial."""


def radau_nodes(count: int) -> FloatArray:
    """The right Radau nodes in (0, 1]: roots of P_(n-1) - P_n on [-1, 1], mapped."""
    series = np.zeros(count + 1)
    series[count - 1], series[count] = 1.0, -1.0
    x = legendre.legroots(series)
    slope = legendre.legder(series)
    for _ in range(3):
        x = x - legendre.legval(x, series) / legendre.legval(x, slope)
    x[-1] = 1.0
    nodes: FloatArray = (1.0 + x) / 2
    return nodes


def differentiation(points: FloatArray) -> FloatArray:
    """Matrix that takes values at `points` to the derivative there (barycentric)."""
    gap = points[:, None] - points[None, :]
    np.fill_diagonal(gap, 1.0)
    weight = 1.0 / np.prod(gap, axis=1)
    matrix: FloatArray = weight[None, :] / weight[:, None] / gap
    np.fill_diagonal(matrix, 0.0)
    np.fill_diagonal(matrix, -np.sum(matrix, axis=1))
    return matrix


NODES = radau_nodes(ORDER)
POINTS = np.concatenate([[0.0], NODES])
"""All 13 points of a step's polynomial, u in [0, 1]."""
DIFFERENTIATE = np.ascontiguousarray(differentiation(POINTS)[1:, 1:])
"""d/du at the nodes of a polynomial that vanishes at u = 0."""
DIFFERENTIATE_TURNED = np.ascontiguousarray(DIFFERENTIATE.T)
TO_SERIES = np.ascontiguousarray(
    np.linalg.inv(chebyshev.chebvander(2 * POINTS - 1, ORDER))
)
"""Values at POINTS to Chebyshev coefficients in x = 2u - 1."""
TO_SERIES_TURNED = np.ascontiguousarray(TO_SERIES.T)


def real_schur(matrix: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Q and T with matrix = Q T Q', Q orthogonal, T of 2 x 2 blocks and above them.

    For matrices whose eigenvalues are distinct complex pairs, as `DIFFERENTIATE` is.
    """
    Q, T = np.eye(len(matrix)), matrix
    for _ in range(2):  # eigenvectors are known to 1e-11 only: again, of what is left
        values, vectors = np.linalg.eig(T)
        upper = vectors[:, values.imag > 0]
        pairs = np.stack([upper.real, upper.imag], axis=2).reshape(matrix.shape)
        Q, _ = np.linalg.qr(Q @ np.linalg.qr(pairs)[0])
        T = Q.T @ matrix @ Q
    rows, columns = np.indices(T.shape)
    T[rows // 2 > columns // 2] = 0.0
    return np.ascontiguousarray(Q), np.ascontiguousarray(T)


SCHUR_Q, SCHUR_T = real_schur(DIFFERENTIATE)
SCHUR_Q_TURNED = np.ascontiguousarray(SCHUR_Q.T)
"""(DIFFERENTIATE + r) is solved for any number r by Q (T + r) Q'."""
