"""Normal stress inside an elastic half-space under frictionless loads, closed forms.

With the harmonic function psi whose boundary value is the pressure on the surface, the
stress on a plane at depth z is psi - z dpsi/dz (K. L. Johnson, Contact Mechanics, 1985,
sections 2.2, 3.2 and 4.2; I. N. Sneddon, Fourier Transforms, 1951, chapter 10). So
mechanoreceptors beneath skin were computed by Phillips and Johnson (J. Neurophysiol.
46, 1192, 1981). Compression is positive.

A load is one row: its kind, where it stands beside the centre of what it belongs to,
and its shape. Its strength is a force in N or a pressure in Pa, as the kind says.
"""

from __future__ import annotations

import cmath
import math

from tactile_lab.arrays import FloatArray
from tactile_lab.model.compiled import inner

SPHERE, PUNCH, STRIP, WAVE, UNIFORM = range(5)
"""Kinds of a load. N: SPHERE, PUNCH; Pa: STRIP, WAVE, UNIFORM."""
KIND, X, Y, SHAPE_1, SHAPE_2, SHAPE_3, SHAPE_4, COLUMNS = range(8)
"""Columns of a load; its shape is

SPHERE: radius / effective modulus, m/Pa.
PUNCH:  radius, m.
STRIP:  cosine and sine of its normal, edges along it, m.
WAVE:   wave vector, rad/m; phase, rad; amplitude over the mean pressure.
"""
POINT_LIKE = 1e-3
"""A contact smaller than so much of the depth is a point load: the closed form of the
sphere would lose digits there."""


@inner
def under_point(P: float, r: float, z: float) -> float:
    """Boussinesq: Pa under a point force, N."""
    rho2 = r * r + z * z
    return float(3.0 * P * z**3 / (2.0 * math.pi * rho2 * rho2 * math.sqrt(rho2)))


@inner
def under_punch(P: float, a: float, r: float, z: float) -> float:
    """Pa under a rigid flat punch of radius a, m, pressed with P, N."""
    if a < POINT_LIKE * z:
        return under_point(P, r, z)
    w = complex(z, a)
    R = cmath.sqrt(r * r + w * w)
    psi = -(1.0 / R).imag
    slope = (w / (R * R * R)).imag
    return P / (2.0 * math.pi * a) * (psi - z * slope)


@inner
def under_sphere(P: float, radius_per_modulus: float, r: float, z: float) -> float:
    """Pa under a sphere pressed with P, N: Hertz's pressure p0 sqrt(1 - r^2/a^2)."""
    a = (0.75 * P * radius_per_modulus) ** (1.0 / 3.0)
    if a < POINT_LIKE * z:
        return under_point(P, r, z)
    w = complex(z, a)
    R = cmath.sqrt(r * r + w * w)
    logarithm = cmath.log(w + R)
    psi = (R - z * logarithm).imag
    slope = (complex(0.0, a) / R - logarithm).imag
    return float(1.5 * P / (math.pi * a**3) * (psi - z * slope))


@inner
def under_strip(near: float, far: float, z: float) -> float:
    """Under pressure 1 on a strip whose edges lie `near` and `far` behind, m."""
    angle = math.atan2(z * (near - far), z * z + near * far)
    edges = near / (near * near + z * z) - far / (far * far + z * z)
    return (angle + z * edges) / math.pi


@inner
def stress(load: FloatArray, strength: float, x: float, y: float, z: float) -> float:
    """Pa of one load at the depth z, m, and at x, y, m, from its centre."""
    kind = int(load[KIND])
    dx, dy = x - load[X], y - load[Y]
    if kind == SPHERE:
        return under_sphere(strength, load[SHAPE_1], math.hypot(dx, dy), z)
    if kind == PUNCH:
        return under_punch(strength, load[SHAPE_1], math.hypot(dx, dy), z)
    if kind == STRIP:
        u = dx * load[SHAPE_1] + dy * load[SHAPE_2]
        return strength * under_strip(u - load[SHAPE_3], u - load[SHAPE_4], z)
    if kind == WAVE:
        wave = math.cos(load[SHAPE_1] * dx + load[SHAPE_2] * dy + load[SHAPE_3])
        return under_wave(load, strength, z) * wave
    return strength


@inner
def under_wave(load: FloatArray, strength: float, z: float) -> float:
    """Amplitude of the stress under a wave of pressure, Pa."""
    k = math.hypot(load[SHAPE_1], load[SHAPE_2])
    return float(strength * load[SHAPE_4] * (1.0 + k * z) * math.exp(-k * z))


@inner
def most_stress(
    load: FloatArray, strength: float, x: float, y: float, z: float,
    way_x: float, way_y: float, length: float,
) -> float:  # fmt: skip
    """Pa that `stress` never exceeds while its centre moves by `length`, m.

    Pressure adds up over the contact with a weight that falls with the distance, so
    that none is worse than all of it at the nearest place; under a ball and under a
    strip, whose pressure falls outwards, stress itself does.
    """
    kind = int(load[KIND])
    dx, dy = x - load[X], y - load[Y]
    along = dx * way_x + dy * way_y
    passed = min(max(along, min(length, 0.0)), max(length, 0.0))
    dx, dy = dx - passed * way_x, dy - passed * way_y
    if kind == SPHERE:
        return under_sphere(strength, load[SHAPE_1], math.hypot(dx, dy), z)
    if kind == PUNCH:
        return under_point(strength, max(math.hypot(dx, dy) - load[SHAPE_1], 0.0), z)
    if kind == STRIP:
        middle = 0.5 * (load[SHAPE_3] + load[SHAPE_4])
        half = 0.5 * (load[SHAPE_4] - load[SHAPE_3])
        off = x * load[SHAPE_1] + y * load[SHAPE_2] - middle
        most = length * (way_x * load[SHAPE_1] + way_y * load[SHAPE_2])
        off -= min(max(off, min(most, 0.0)), max(most, 0.0))
        return strength * under_strip(off + half, off - half, z)
    if kind == WAVE:
        return abs(under_wave(load, strength, z))
    return strength
