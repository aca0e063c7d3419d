"""The muscle equations once more, in plain Python and written from the formulas of their sources.

An independent oracle: nothing here comes from the package except a muscle's parameters.
"""

import math
from fractions import Fraction
from functools import cache

import numpy as np
from scipy.integrate import solve_ivp
from scipy.interpolate import make_interp_spline
from scipy.optimize import brentq

import exudyn_muscles as em

WINDOW = 0.010
# The allowed box: fibre lengths over the optimal one, highest speed in optimal lengths/s.
SHORTEST, LONGEST, FASTEST = 0.3, 1.8, 15.0

# -- curves by law --------------------------------------------------------------------------------


class Law:
    """What a law has unless it says otherwise."""

    damping = shortest = 0.0

    def borne(self, strength, v):
        """Load of a damped fibre with a velocity, beside its passive force."""
        return strength * self.multiplier(v) + self.damping * v

    def fastest(self, a):
        """Part of the maximum velocity that the activation leaves."""
        return 1.0


class DeGroote(Law):
    """OpenSim's constants; f_v and its inverse go on along tangents beyond ten v_max."""

    gaussians = (
        (0.8150671134243542, 1.055033428970575, 0.162384573599574, 0.063303448465465),
        (0.433004984392647, 0.716775413397760, -0.029947116970696, 0.200356847296188),
        (0.1, 1.0, 0.353553390593274, 0.0),
    )
    d1, d2, d3, d4 = -0.3211346127989808, -8.149, -0.374, 0.8825327733249912
    shortest = 0.2

    def __init__(self, law, strain, rigid):
        self.damping = law.fiber_damping
        self.scale = law.active_force_width_scale
        self.k_pe = 4.0 / law.passive_fiber_strain_at_one_norm_force
        self.k_t = math.log(6.0) / strain

    def active(self, x):
        s = 1.0 + (min(max(x, 0.0), 3.0) - 1.0) / self.scale
        return sum(
            b1 * math.exp(-0.5 * ((s - b2) / (b3 + b4 * s)) ** 2)
            for b1, b2, b3, b4 in self.gaussians
        )

    def passive(self, x):
        offset = math.exp(self.k_pe * (0.2 - 1.0))
        return (math.exp(self.k_pe * (x - 1.0)) - offset) / (math.exp(4.0) - offset)

    def tendon(self, strain):
        return 0.2 * math.exp(self.k_t * strain) - 0.2

    def slope(self, v):
        return self.d1 * self.d2 / math.hypot(self.d2 * v + self.d3, 1.0)

    def multiplier(self, v):
        end = min(max(v, -10.0), 10.0)
        f = self.d1 * math.asinh(self.d2 * end + self.d3) + self.d4
        return f + self.slope(end) * (v - end)

    def velocity(self, f):
        for end in (-10.0, 10.0):
            beyond = f - self.multiplier(end)
            if beyond * end > 0.0:
                return end + beyond / self.slope(end)
        return (math.sinh((f - self.d4) / self.d1) - self.d3) / self.d2

    def damped(self, strength, load):
        """Velocity of a fibre beside a damper."""
        bound = (strength + abs(load)) / self.damping

        def excess(v):
            return strength * self.multiplier(v) + self.damping * v - load

        return brentq(excess, -bound, bound, xtol=1e-15, rtol=1e-15)


class Published(DeGroote):
    """The constants of the authors' code."""

    gaussians = (
        (0.814483478343008, 1.05503342897057, 0.162384573599574, 0.0633034484654646),
        (0.433004984392647, 0.716775413397760, -0.0299471169706956, 0.200356847296188),
        (0.1, 1.0, 0.5 * math.sqrt(0.5), 0.0),
    )
    d1, d2, d3, d4 = -0.318323436899127, -8.14915604347525, -0.374121508647863, 0.885644059915004
    scale = 1.0

    def __init__(self, law, strain, rigid):
        self.k_t = law.tendon_stiffness

    def passive(self, x):
        offset = math.exp(4.0 * (0.2 - 1.0) / 0.6)
        return (math.exp(4.0 * (x - 1.0) / 0.6) - offset) / (math.exp(4.0) - 1.0)

    def tendon(self, strain):
        return 0.2 * math.exp(self.k_t * (1.0 + strain - 0.995)) - 0.25


class Thelen(Law):
    """Tangents where the fibre carries nothing and at 95 % of the highest force."""

    def __init__(self, law, strain, rigid):
        self.gamma, self.k_pe = law.kshape_active, law.kshape_passive
        self.e_pe, self.e_t = law.fmax_muscle_strain, strain
        self.af, self.flen, self.b = law.af, law.flen, 2.0 + 2.0 / law.af
        self.top = law.fv_linear_extrap_threshold * law.flen

    def active(self, x):
        return math.exp(-((x - 1.0) ** 2) / self.gamma)

    def passive(self, x):
        return max(math.expm1(self.k_pe * (x - 1.0) / self.e_pe) / math.expm1(self.k_pe), 0.0)

    def tendon(self, strain):
        e3 = math.exp(3.0)
        toe = 99.0 * self.e_t * e3 / (166.0 * e3 - 67.0)
        if strain > toe:
            return 0.33 + 0.67 / (self.e_t - toe) * (strain - toe)
        return max(0.33 * math.expm1(3.0 * strain / toe) / (e3 - 1.0), 0.0)

    def fastest(self, a):
        return 0.25 + 0.75 * a

    def slope(self, f):
        """Of the velocity at an end of its curve."""
        if f < 1.0:
            return 1.0 + 1.0 / self.af
        return (self.flen - 1.0) ** 2 / (self.b * (self.flen - f) ** 2)

    def velocity(self, f):
        end = min(max(f, 0.0), self.top)
        if end != f:
            return self.velocity(end) + self.slope(end) * (f - end)
        if f <= 1.0:
            return (f - 1.0) / (1.0 + f / self.af)
        return (f - 1.0) * (self.flen - 1.0) / (self.b * (self.flen - f))

    def multiplier(self, v):
        for end in (0.0, self.top):
            beyond = v - self.velocity(end)
            if beyond * (end - 1.0) > 0.0:
                return end + beyond / self.slope(end)
        if v <= 0.0:
            return (1.0 + v) / (1.0 - v / self.af)
        return (self.flen - 1.0 + self.b * self.flen * v) / (self.flen - 1.0 + self.b * v)


class Millard(Law):
    """Chains of Bezier segments; f_v is flat at its ends, its inverse is that of another curve."""

    def __init__(self, law, strain, rigid):
        self.shortest = law.min_norm_active_fiber_length
        self.damping = law.fiber_damping if law.fiber_damping >= 1e-3 else 0.0
        self.f_l = active_chain(law, 0.0 if rigid or self.damping else 0.1)
        self.f_pe, self.f_se = passive_chain(law), tendon_chain(strain)
        self.f_v, self.inverse = velocity_chain(law, 0.0), velocity_chain(law, 0.5)

    def active(self, x):
        return follow(*self.f_l, x)

    def passive(self, x):
        return follow(*self.f_pe, x)

    def tendon(self, strain):
        return follow(*self.f_se, strain)

    def multiplier(self, v):
        return follow(*self.f_v, v)

    def velocity(self, f):
        return follow(*reversed(self.inverse), f)

    def damped(self, strength, load):
        # strength f_v + damping v over the segments' parameter is once more a chain.
        both = zip(*self.f_v, strict=True)
        sums = [strength * np.array(f) + self.damping * np.array(v) for v, f in both]
        return follow([points.tolist() for points in sums], self.f_v[0], load)


def active_chain(law, floor):
    x_0, x_1 = law.min_norm_active_fiber_length, law.transition_norm_fiber_length
    x_2, slope = law.max_norm_active_fiber_length, law.shallow_ascending_slope
    y_1 = 1.0 - slope * (0.95 - x_1)
    joints = [
        (x_0, floor, 0.0),
        ((x_0 + x_1) / 2.0, y_1 / 2.0, 1.25 * y_1 / (x_1 - x_0)),
        ((x_1 + 0.95) / 2.0, (y_1 + 1.0) / 2.0, slope),
        (1.0, 1.0, 0.0),
        ((1.05 + x_2) / 2.0, 0.5, -1.0 / (x_2 - 0.05 - 1.05)),
        (x_2, floor, 0.0),
    ]
    return chain(joints, (1.0, 1.0, 1.0, 1.0, 1.0))


def velocity_chain(law, part):
    """The slopes at the maximum velocities are this part of those near them."""
    near_s, near_l = law.concentric_slope_near_vmax, law.eccentric_slope_near_vmax
    end_s, end_l, top = part * near_s, part * near_l, law.max_eccentric_velocity_force_multiplier
    joints = [
        (-1.0, 0.0, end_s),
        (-0.9, 0.5 * 0.1 * (near_s + end_s), near_s),
        (0.0, 1.0, law.isometric_slope),
        (0.9, top - 0.5 * 0.1 * (near_l + end_l), near_l),
        (1.0, top, end_l),
    ]
    return chain(joints, (0.6, 0.6, 0.9, 0.9))


def passive_chain(law):
    x_0, x_1 = 1.0 + law.fiber_strain_at_zero_force, 1.0 + law.fiber_strain_at_one_norm_force
    slope = 2.0 / (x_1 - x_0)
    toe = min(0.1 / slope, 0.1 * (x_1 - x_0))
    joints = [(x_0, 0.0, 0.0), (x_0 + toe, 0.2 * 0.5 * toe, 0.2), (x_1, 1.0, slope)]
    return chain(joints, (0.75, 0.75))


def tendon_chain(strain):
    slope, f_toe = 1.375 / strain, 2.0 / 3.0
    toe, middle = strain - (1.0 - f_toe) / slope, strain - (1.0 - 0.5 * f_toe) / slope
    foot = 0.1 * toe
    steep = 0.5 * f_toe / (middle - foot)
    joints = [(0.0, 0.0, 0.0), ((foot + middle) / 2.0, f_toe / 4.0, steep), (toe, f_toe, slope)]
    return chain(joints, (0.5, 0.5))


def chain(joints, curviness):
    """Segments of x and of y through the joints (x, y, slope)."""
    segments = map(segment, joints[:-1], joints[1:], curviness)
    return tuple(zip(*segments, strict=True))


def segment(start, end, curviness):
    """Points of x and of y of a quintic Bezier curve; its two inner points count twice."""
    (x_0, y_0, d_0), (x_1, y_1, d_1) = start, end
    x = (y_1 - y_0 + d_0 * x_0 - d_1 * x_1) / (d_0 - d_1)  # here the end tangents cross
    y = y_0 + d_0 * (x - x_0)
    c = 0.1 + 0.8 * curviness
    return (
        (x_0, x_0 + c * (x - x_0), x_1 + c * (x - x_1), x_1),
        (y_0, y_0 + c * (y - y_0), y_1 + c * (y - y_1), y_1),
    )


def value(points, u):
    p, q, r, s = points
    w = 1.0 - u
    first = w**3 * (w**2 * p + 5.0 * u * (w + 2.0 * u) * q)
    return first + u**3 * (5.0 * w * (u + 2.0 * w) * r + u**2 * s)


def derivative(points, u):
    p, q, r, s = points
    w = 1.0 - u
    return 5.0 * (w**4 * (q - p) + 6.0 * (u * w) ** 2 * (r - q) + u**4 * (s - r))


def follow(xs, ys, x):
    """y of x along a chain, on its end tangents beyond the ends."""
    k = 0
    while k < len(xs) - 1 and x > xs[k][-1]:
        k += 1
    if xs[k][0] < x < xs[k][-1]:
        u = brentq(lambda u: value(xs[k], u) - x, 0.0, 1.0, xtol=1e-10)
    else:
        u = float(x > xs[k][0])
    # Beyond an end this is the tangent; inside, one more step of Newton's method.
    slope = derivative(ys[k], u) / derivative(xs[k], u)
    return value(ys[k], u) + slope * (x - value(xs[k], u))


class ThelenDeprecated(Law):
    """Velocity and force of the damped fibre are one formula.

    In fractions: its straight lines run through places that are close together.
    """

    short = Fraction(1e-6)  # over which OpenSim takes their slopes

    def __init__(self, law, strain, rigid):
        self.law, self.damping = law, law.fiber_damping
        self.af, self.flen, self.beta = map(Fraction, (law.af, law.flen, law.fiber_damping))
        self.multiplier = Thelen(em.Thelen2003(af=law.af, flen=law.flen), 0.04, rigid).multiplier

    def active(self, x):
        return math.exp(-((x - 1.0) ** 2) / self.law.kshape_active)

    def passive(self, x):
        k, e = self.law.kshape_passive, self.law.fmax_muscle_strain
        if x > 1.0 + e:
            return 1.0 + k / e * (x - 1.0 - e)
        return math.exp(k * (x - 1.0) / e) / math.exp(k)

    def tendon(self, strain):
        e = self.law.fmax_tendon_strain
        toe, f = 0.609 * e, 0.001 * (1.0 + strain)
        if strain > toe:
            return f + 1.712 / e * (strain - toe) + 0.333333
        return f + max(0.333333 * math.expm1(3.0 * strain / toe) / math.expm1(3.0), 0.0)

    def fastest(self, a):
        rest = self.law.speed_without_activation
        return rest + a * (1.0 - rest)

    def between(self, strength, load):
        """The velocity where there is no straight line."""
        if load < strength:
            resistance = strength + load / self.af
        else:
            resistance = (2 + 2 / self.af) * (strength * self.flen - load) / (self.flen - 1)
        return (load - strength) / (resistance + self.beta)

    def damped(self, strength, load):
        strength, load = Fraction(strength), Fraction(load)
        top = strength * self.flen
        for end, short in ((0, self.short), (Fraction(0.95) * top, self.short * top)):
            if (load - end) * (end - strength) > 0.0:
                v = self.between(strength, end)
                return float(v + (self.between(strength, end + short) - v) * (load - end) / short)
        return float(self.between(strength, load))

    def borne(self, strength, v):
        """Load of a fibre with a velocity, beside its passive force."""

        def excess(load):
            return self.damped(strength, load) - v

        bound = 1.0
        while excess(-bound) > 0.0 or excess(bound) < 0.0:
            bound *= 2.0
        return brentq(excess, -bound, bound, xtol=1e-15, rtol=1e-15)


class Schutte(Law):
    """With the curves that OpenSim's class has without any in the file."""

    K, S, M = 0.15, 0.13 * 0.15 / 1.15, 1.4

    def __init__(self, law, strain, rigid):
        self.damping = law.fiber_damping
        self.splines = (
            cubic_spline(*law.active_force_length),
            cubic_spline(*law.tendon_force_length),
        )

    def active(self, x):
        return max(float(self.splines[0](min(max(x, 0.0), 3.0))), 0.0)

    def passive(self, x):
        return math.exp(8.0 * (x - 1.0)) / math.exp(4.0)

    def tendon(self, strain):
        return float(self.splines[1](strain)) if strain > 0.0 else 0.0

    def multiplier(self, v):
        if v < 0.0:
            return self.K * (1.0 + v) / (self.K - v)
        return (self.S + self.M * v) / (self.S + v)

    def damped(self, strength, load):
        return DeGroote.damped(self, strength, max(load, 0.0))

    def borne(self, strength, v):
        return max(strength * self.multiplier(v) + self.damping * v, 0.0)


def cubic_spline(x, y):
    """SciPy's, with third derivatives at the ends as OpenSim takes them."""
    return make_interp_spline(
        x, y, 3, bc_type=([(3, third(x[:4], y[:4]))], [(3, third(x[-4:], y[-4:]))])
    )


def third(x, y):
    """Third derivative of the cubic through four points."""
    return 6.0 * np.linalg.solve(np.vander(x), y)[0]


LAWS = {
    em.DeGrooteFregly2016: DeGroote,
    em.DeGrooteFregly2016Published: Published,
    em.Thelen2003: Thelen,
    em.Millard2012: Millard,
    em.Thelen2003Deprecated: ThelenDeprecated,
    em.Schutte1993: Schutte,
}


@cache
def curves(muscle):
    law = LAWS[type(muscle.law)]
    return law(muscle.law, muscle.tendon_strain, muscle.ignore_tendon_compliance)


# -- fibre and tendon -----------------------------------------------------------------------------


def width(muscle):
    return muscle.optimal_fiber_length * math.sin(muscle.pennation_angle_at_optimal)


def shortest(muscle):
    """Projection of the shortest fibre: the law's or that of the maximum pennation."""
    fiber = curves(muscle).shortest * muscle.optimal_fiber_length
    if width(muscle) > 0.0:
        fiber = max(fiber, width(muscle) / math.sin(muscle.maximum_pennation_angle))
    return math.sqrt(fiber**2 - width(muscle) ** 2)


def tendon_length(muscle, F):
    """Tendon length [m] at the tension F; in place of a negative one that no tendon of the law
    bears, a slack tendon."""
    tendon, f = curves(muscle).tendon, F / muscle.max_isometric_force
    strain = 0.2 * f
    if f > 0.0 or tendon(-1.0) < 0.0:
        ends = -5.0 * muscle.tendon_strain, 3.0 * muscle.tendon_strain
        strain = brentq(lambda strain: tendon(strain) - f, *ends, xtol=1e-16)
    return muscle.tendon_slack_length * (1.0 + strain)


def length(muscle, F, fiber):
    """Musculotendon length [m] of a unit with the tension `F` and the fibre length `fiber`."""
    p = math.sqrt(max(fiber**2 - width(muscle) ** 2, shortest(muscle) ** 2))
    return p + tendon_length(muscle, F)


def fiber(muscle, l_t, l):
    """Fibre length over the optimal one, and cos(alpha)."""
    p = max(l - l_t, shortest(muscle))
    l_m = math.hypot(p, width(muscle))
    return l_m / muscle.optimal_fiber_length, p / l_m if width(muscle) > 0.0 else 1.0


def tension(muscle, l_t):
    """Tendon force over F0."""
    return curves(muscle).tendon(l_t / muscle.tendon_slack_length - 1.0)


def projection_rate(muscle, a, l_t, l):
    """Speed [m/s] of the fibre's projection p at which fibre and tendon balance."""
    law, (x, cos) = curves(muscle), fiber(muscle, l_t, l)
    strength = a * law.active(x)
    load = tension(muscle, l_t) / cos - law.passive(x)
    if law.damping:
        v = law.fastest(a) * law.damped(strength, load)
    else:
        v = law.fastest(a) * law.velocity(load / strength)
    return v * muscle.max_contraction_velocity * muscle.optimal_fiber_length / cos


def rate(muscle, a, l_t, l, v):
    """l_t' [m/s]."""
    p_t = projection_rate(muscle, a, l_t, l)
    if l - l_t <= shortest(muscle):
        p_t = max(p_t, 0.0)
    return v - p_t


def force(muscle, a, l_t, l, v):
    """Tension [N]; of the tendon, or of the fibre if the tendon is rigid."""
    F0, law = muscle.max_isometric_force, curves(muscle)
    if not muscle.ignore_tendon_compliance:
        return F0 * tension(muscle, l_t)
    p = l - muscle.tendon_slack_length
    if p <= shortest(muscle):
        return 0.0
    x, cos = fiber(muscle, muscle.tendon_slack_length, l)
    v_m = v * cos / (muscle.max_contraction_velocity * muscle.optimal_fiber_length)
    f = law.borne(a * law.active(x), v_m / law.fastest(a))
    return F0 * max(f + law.passive(x), 0.0) * cos


# -- activation -----------------------------------------------------------------------------------


def activation_rate(muscle, a, u):
    """a' [1/s]."""
    tau_a, tau_d = muscle.activation_time_constant, muscle.deactivation_time_constant
    z = 0.5 + 1.5 * a
    match muscle.activation_dynamics:
        case em.ActivationDynamics.LINEAR_FILTER:
            return (u - a) / (tau_a if u > a else tau_d)
        case em.ActivationDynamics.FIRST_ORDER:
            return (u - a) / (tau_a * z if u > a else tau_d / z)
        case em.ActivationDynamics.SMOOTH:
            f = 0.5 * math.tanh(muscle.activation_dynamics_smoothing * (u - a))
            return ((f + 0.5) / (tau_a * z) + (0.5 - f) * z / tau_d) * (u - a)
        case em.ActivationDynamics.BILINEAR:
            return (u - a) * (u / tau_a + (1.0 - u) / tau_d if u > a else 1.0 / tau_d)


def activation(muscle, a, u, t):
    """Activation after the time t with held excitation."""
    if muscle.activation_dynamics is em.ActivationDynamics.LINEAR_FILTER:
        tau = muscle.activation_time_constant if u > a else muscle.deactivation_time_constant
        return u + (a - u) * math.exp(-t / tau)

    def slope(t, a):
        return [activation_rate(muscle, a[0], u)]

    return solve_ivp(slope, (0.0, t), [a], "DOP853", rtol=1e-13, atol=1e-15).y[0, -1]


# -- windows --------------------------------------------------------------------------------------


def cubic(t, h, l_0, v_0, l_1, v_1):
    """Length and speed at the time `t` of the cubic through both ends."""
    s = t / h
    l = (
        l_0 * (1 + 2 * s) * (1 - s) ** 2
        + h * v_0 * s * (1 - s) ** 2
        + l_1 * s * s * (3 - 2 * s)
        + h * v_1 * s * s * (s - 1)
    )
    v = 6 * s * (1 - s) * (l_1 - l_0) / h + v_0 * (1 - s) * (1 - 3 * s) + v_1 * s * (3 * s - 2)
    return l, v


def window(muscle, a, l_t, u, l_0, v_0, l_1, v_1, h=WINDOW):
    """(a, l_t, F) at the end of a window with held excitation; F to some 1e-11 F0.

    In phases: the fibre moves until it has its shortest length, and rests until it would lengthen.
    """
    p_min, unit = shortest(muscle), 0.05 * muscle.tendon_slack_length  # its stretch at some F0
    # A fibre that nothing pulls has this velocity but for rounding: it rests.
    still = 1e-12 * muscle.max_contraction_velocity * muscle.optimal_fiber_length

    def at(t, y):
        l, _ = cubic(t, h, l_0, v_0, l_1, v_1)
        return y[1], l - p_min - unit * y[0], l

    def phase(t, y, rests):
        # The state is p - p_min, not l_t: it is exactly zero at the stop.
        def slope(t, y):
            p_t = 0.0 if rests else projection_rate(muscle, *at(t, y))
            return [p_t / unit, activation_rate(muscle, y[1], u)]

        def end(t, y):
            return projection_rate(muscle, *at(t, y)) - still if rests else y[0]

        end.terminal, end.direction = True, 1.0 if rests else -1.0
        # As exact as Radau, which agrees with it to 1e-11, in a tenth of the time.
        run = solve_ivp(slope, (t, h), y, "LSODA", events=end, rtol=1e-13, atol=1e-14)
        assert run.success, run.message
        return run.t[-1], run.y[:, -1]

    if not muscle.ignore_tendon_compliance:
        above = l_0 - l_t - p_min
        y = [above / unit if abs(above) > 1e-12 * l_0 else 0.0, a]
        rests = y[0] <= 0.0 and projection_rate(muscle, *at(0.0, y)) < still
        t, y = phase(0.0, y, rests)
        while t < h:
            rests = not rests
            t, y = phase(t, [0.0, y[1]], rests)
        l_t = at(h, y)[1]
    a = activation(muscle, a, u, h)
    return a, l_t, force(muscle, a, l_t, l_1, v_1)


# -- states ---------------------------------------------------------------------------------------


def course(rng, muscle, l_0, v_0=None, change=2.0):
    """Excitation and path of a window, (u, l_0, v_0, l_1, v_1): the speed is a parabola within the
    box that stays within `change` of its start, in parts of the highest speed."""
    highest, s = FASTEST * muscle.optimal_fiber_length, np.linspace(0.0, 1.0, 101)
    while True:
        start, middle, end = highest * rng.uniform(-1.0, 1.0, 3)
        start = start if v_0 is None else v_0
        speed = start * (1 - s) * (1 - 2 * s) + middle * 4 * s * (1 - s) + end * s * (2 * s - 1)
        if abs(speed).max() <= highest and abs(speed - start).max() <= change * highest:
            break
    u = rng.choice([0.01, 1.0, rng.uniform(0.01, 1.0)])
    return u, l_0, start, l_0 + WINDOW * (start + 4.0 * middle + end) / 6.0, end


def draw(rng, law):
    """A unit and a window somewhere in the allowed box: (muscle, a, l_t, u, l_0, v_0, l_1, v_1)."""
    optimal = rng.uniform(0.04, 0.2)
    muscle = em.Muscle(
        "unit",
        max_isometric_force=10.0 ** rng.uniform(1.5, 4.0),
        optimal_fiber_length=optimal,
        tendon_slack_length=optimal * 10.0 ** rng.uniform(-1.0, 1.0),
        pennation_angle_at_optimal=rng.uniform(0.0, 0.5),
        activation_dynamics=rng.choice(list(em.ActivationDynamics)),
        activation_dynamics_smoothing=rng.choice([0.1, 10.0]),
        law=law,
    )
    # Low activations are the hard ones: a third of the draws is spread over their logarithm.
    a = rng.uniform(0.01, 1.0) if rng.random() < 0.67 else 0.01 ** rng.random()
    F = rng.uniform(-0.1, 2.0) * muscle.max_isometric_force
    l_m = rng.uniform(max(SHORTEST, curves(muscle).shortest), LONGEST) * optimal
    state = a, tendon_length(muscle, F)
    return muscle, *state, *course(rng, muscle, length(muscle, F, l_m))
