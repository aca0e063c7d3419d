"""Fibres whose damper and force-velocity relation are one formula, as OpenSim's deprecated classes
have them; all other laws have curves.

`load` is what the fibre bears beside f_PE, `capacity` is a f_l, both over F0; velocities are over
the maximum contraction velocity that the activation leaves.

Thelen (2003), damped, with A = `af`, L = `flen`, C = 2 + 2/A and beta:

    v = (load - capacity) / (capacity + load / A + beta)                          shortening
    v = (load - capacity) / (C (capacity L - load) / (L - 1) + beta)              lengthening

and straight lines below no load and above 0.95 L capacity, whose slopes are OpenSim's: not of the
tangents, but of secants so short that rounding would show if they were not worked out on paper.

Schutte, Rodgers, Zajac, Glaser (1993), IEEE Transactions on Rehabilitation Engineering 1, 109-125:

    load = capacity f_v(v) + beta v,    f_v = K (1 + v) / (K - v)                 shortening
                                        f_v = (S + M v) / (S + v)                 lengthening

where a load below zero moves the fibre no faster than none.
"""

from __future__ import annotations

import math

from ..numerics.kernel import kernel

CURVES, THELEN, SCHUTTE = range(3)  # of `FORM`

TOP = 0.95  # part of L capacity where the upper line begins
SECANT = 1e-6  # length of the secants: of the load below, of the part of L capacity above
K, M = 0.15, 1.4  # Hill's constant of the shortening fibre, force of the lengthening one at most
S = 0.13 * K / (1.0 + K)  # how soon the lengthening fibre reaches it


@kernel
def velocity_of_load(form, af, flen, beta, capacity, load):
    """v, and its derivatives with respect to capacity and load."""
    if form == SCHUTTE:
        return schutte_velocity(beta, capacity, load)
    return thelen_velocity(af, flen, beta, capacity, load)


@kernel
def load_of_velocity(form, af, flen, beta, capacity, v):
    """The load, and its derivatives with respect to capacity and v."""
    if form == SCHUTTE:
        f_v, slope = schutte_multiplier(v)
        load = capacity * f_v + beta * v
        if load < 0.0:
            return 0.0, 0.0, 0.0
        return load, f_v, capacity * slope + beta
    load = thelen_load(af, flen, beta, capacity, v)
    _, v_capacity, v_load = thelen_velocity(af, flen, beta, capacity, load)
    return load, -v_capacity / v_load, 1.0 / v_load


@kernel
def thelen_velocity(af, flen, beta, capacity, load):
    excess = load - capacity
    if excess < 0.0:
        base = capacity + beta
        if load < 0.0:
            near, far = base + capacity / af, base + SECANT / af
            per = 1.0 / (base * far)
            slope = near * per
            bend = (1.0 + 1.0 / af) * per - slope * (1.0 / base + 1.0 / far)
            return slope * load - capacity / base, load * bend - beta / (base * base), slope
        b = base + load / af
        return excess / b, -(b + excess) / (b * b), (b - excess / af) / (b * b)
    steep = (2.0 + 2.0 / af) / (flen - 1.0)
    if load < TOP * flen * capacity:
        b = steep * (capacity * flen - load) + beta
        return (
            excess / b,
            -(b + excess * steep * flen) / (b * b),
            (b + excess * steep) / (b * b),
        )
    part = TOP * flen
    rest, rest_far = steep * flen * (1.0 - TOP), steep * flen * (1.0 - TOP - SECANT)
    b, b_far = rest * capacity + beta, rest_far * capacity + beta
    per = 1.0 / (b * b_far)
    slope = (b + (part - 1.0) * capacity * steep) * per
    bend = (rest + (part - 1.0) * steep) * per - slope * (rest / b + rest_far / b_far)
    v = (part - 1.0) * capacity / b
    v_capacity = (part - 1.0) * beta / (b * b)
    beyond = load - part * capacity
    return v + slope * beyond, v_capacity + bend * beyond - slope * part, slope


@kernel
def thelen_load(af, flen, beta, capacity, v):
    least, _, slope = thelen_velocity(af, flen, beta, capacity, 0.0)
    if v <= 0.0:
        if v < least:
            _, _, slope = thelen_velocity(af, flen, beta, capacity, -1.0)
            return (v - least) / slope
        return (capacity + v * (capacity + beta)) / (1.0 - v / af)
    top = TOP * flen * capacity
    most, _, slope = thelen_velocity(af, flen, beta, capacity, top)
    if v > most:
        return top + (v - most) / slope
    steep = (2.0 + 2.0 / af) / (flen - 1.0)
    return (capacity + v * (steep * capacity * flen + beta)) / (1.0 + v * steep)


@kernel
def schutte_velocity(beta, capacity, load):
    bears = max(load, 0.0)
    excess = bears - capacity
    # Of both roots of the quadratic equation in v, without loss of digits at small velocities.
    if excess < 0.0:
        p = bears + K * (capacity + beta)
        v = 2.0 * K * excess / (p + math.sqrt(p * p - 4.0 * beta * K * excess))
    else:
        p = bears - M * capacity - S * beta
        root = math.sqrt(p * p + 4.0 * beta * S * excess)
        v = 0.5 * (p + root) / beta if p > 0.0 else 2.0 * S * excess / (root - p)
    f_v, slope = schutte_multiplier(v)
    v_load = 1.0 / (capacity * slope + beta)
    return v, -f_v * v_load, v_load if load > 0.0 else 0.0


@kernel
def schutte_multiplier(v):
    """f_v and its slope."""
    if v < 0.0:
        per = 1.0 / (K - v)
        return K * (1.0 + v) * per, K * (1.0 + K) * per * per
    per = 1.0 / (S + v)
    return (S + M * v) * per, S * (M - 1.0) * per * per
