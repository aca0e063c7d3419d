"""Motions: the pendulum's of the paper, smoothness, filtering, interpolation, files, bad input."""

import numpy as np
import pytest

import exudyn_muscles as em
from exudyn_muscles.motion import check_motion
from models import pendulum

from ..differences import difference
from ..make_opensim import noisy
from ..own_models import FOLDER

TIMES = np.linspace(0.0, 1.0, 11)
ROWS = np.arange(11)
SAMPLES = np.column_stack([np.sin(3.0 * TIMES), np.cos(2.0 * TIMES)])


# -- the paper's motion ---------------------------------------------------------------------------


def test_pendulum_goes_through_table_1():
    q, _, _ = pendulum.motion()([0.0, 1.0 / 3.0, 2.0 / 3.0, 1.0])
    np.testing.assert_allclose(np.degrees(q[:, 0]), [180.0, 120.0, 240.0, 180.0], rtol=1e-13)


def test_pendulum_is_at_rest_at_both_ends():
    _, v, a = pendulum.motion()([0.0, 1.0])
    np.testing.assert_allclose(v, 0.0, rtol=0, atol=1e-12)
    np.testing.assert_allclose(a, 0.0, rtol=0, atol=1e-10)


def test_pendulum_extremes():
    """|q'| <= 9.355 rad/s and |q''| <= 78.12 rad/s^2, to the digits given, and both are reached."""
    _, v, a = pendulum.motion()(np.linspace(0.0, 1.0, 100001))
    assert abs(v).max() == pytest.approx(9.355, abs=5e-4)
    assert abs(a).max() == pytest.approx(78.12, abs=5e-3)


def test_pendulum_is_smooth_to_the_fourth_derivative():
    """C4 across the inner way points; the fifth derivative of a quintic jumps."""
    motion = pendulum.motion()
    for knot in (1.0 / 3.0, 2.0 / 3.0):
        # q, q' and q'' are continuous, and so are the next two derivatives, by one-sided
        # polynomials: on each side q'' is an exact cubic.
        sides = []
        for side in (-1.0, 1.0):
            s = side * np.linspace(0.0, 0.1, 12)
            sides.append(np.polyfit(s, motion(knot + s)[2][:, 0], 3)[::-1])
        for k, scale in enumerate((1e2, 1e3, 1e4)):
            assert sides[0][k] == pytest.approx(sides[1][k], abs=1e-8 * scale)
        assert abs(sides[0][3] - sides[1][3]) > 100.0


@pytest.mark.parametrize(
    "motion",
    [
        pendulum.motion(),
        em.Motion.from_samples(TIMES, SAMPLES),
        em.Motion.from_arrays(TIMES, SAMPLES, 0.0 * SAMPLES, 0.0 * SAMPLES),
    ],
)
def test_speeds_and_accelerations_are_the_derivatives(motion):
    for t in (0.113, 0.377, 0.741):
        q, v, a = motion(t)
        assert q.shape == v.shape == a.shape == (len(motion),)
        np.testing.assert_allclose(
            v, difference(lambda x: motion(x)[0], t, 1e-4), rtol=0, atol=1e-7
        )
        np.testing.assert_allclose(
            a, difference(lambda x: motion(x)[1], t, 1e-4), rtol=0, atol=1e-5
        )


# -- way points -----------------------------------------------------------------------------------


def test_end_conditions():
    motion = em.Motion.from_waypoints(
        [0.0, 0.4, 1.0],
        [[0.0, 1.0], [0.5, 0.5], [1.0, 0.0]],
        speeds=([0.1, 0.2], 0.3),
        accelerations=(-1.0, [2.0, 3.0]),
    )
    _, v, a = motion([0.0, 1.0])
    np.testing.assert_allclose(v, [[0.1, 0.2], [0.3, 0.3]], rtol=0, atol=1e-12)
    np.testing.assert_allclose(a, [[-1.0, -1.0], [2.0, 3.0]], rtol=0, atol=1e-11)


def test_two_waypoints_are_the_minimum_jerk_motion():
    motion = em.Motion.from_waypoints([0.0, 2.0], [1.0, 3.0])
    for t in (0.3, 1.0, 1.7):
        s = t / 2.0
        assert motion(t)[0][0] == pytest.approx(1.0 + 2.0 * s**3 * (10.0 - 15.0 * s + 6.0 * s * s))


def test_one_column_or_a_vector():
    vector = em.Motion.from_waypoints(TIMES, SAMPLES[:, 0])
    column = em.Motion.from_waypoints(TIMES, SAMPLES[:, :1])
    assert len(vector) == len(column) == 1
    np.testing.assert_array_equal(vector(TIMES), column(TIMES))
    assert vector(TIMES)[0].shape == (11, 1)
    assert vector(0.5)[0].shape == (1,)


# -- samples --------------------------------------------------------------------------------------

RATE = 200.0  # Hz
RECORD = np.arange(401) / RATE


def sine(frequency):
    return np.sin(2.0 * np.pi * frequency * RECORD)


def test_samples_are_interpolated():
    motion = em.Motion.from_samples(TIMES, SAMPLES)
    np.testing.assert_allclose(motion(TIMES)[0], SAMPLES, rtol=0, atol=1e-14)
    middle = TIMES[3:-4] + 0.05
    np.testing.assert_allclose(motion(middle)[0][:, 0], np.sin(3.0 * middle), rtol=0, atol=1e-5)


def test_filter_keeps_slow_motion_and_removes_tremor():
    """Fourth order at 6 Hz: 1 Hz passes to 0.1 %, 50 Hz is attenuated beyond 1e-3."""
    inner = slice(100, 301)  # away from the ends
    slow = em.Motion.from_samples(RECORD, sine(1.0), cutoff=6.0)(RECORD)[0][inner, 0]
    np.testing.assert_allclose(slow, sine(1.0)[inner], rtol=0, atol=2e-3)
    fast = em.Motion.from_samples(RECORD, sine(50.0), cutoff=6.0)(RECORD)[0][inner, 0]
    assert abs(fast).max() < 2e-4
    both = em.Motion.from_samples(RECORD, sine(1.0) + 0.1 * sine(50.0), cutoff=6.0)
    np.testing.assert_allclose(both(RECORD)[0][inner, 0], slow, rtol=0, atol=2e-5)


def test_filter_is_half_power_squared_at_the_cutoff():
    """A second-order Butterworth forwards and backwards: amplitude 1/2 at its cut-off."""
    inner = slice(100, 301)
    at_cutoff = em.Motion.from_samples(RECORD, sine(10.0), cutoff=10.0)(RECORD)[0][inner, 0]
    gain = at_cutoff @ sine(10.0)[inner] / (sine(10.0)[inner] @ sine(10.0)[inner])
    assert gain == pytest.approx(0.5, abs=1e-9)


def test_filter_has_no_phase():
    """The crossings of zero stay where they are, and reversed time gives the reversed motion."""
    motion = em.Motion.from_samples(RECORD, sine(3.0), cutoff=6.0)
    for k in range(3, 9):
        assert motion(k / 6.0)[0][0] == pytest.approx(0.0, abs=1e-6)  # of the ends
    record = sine(3.0) + 0.3 * sine(17.0)
    forwards = em.Motion.from_samples(RECORD, record, cutoff=6.0)(RECORD)[0]
    backwards = em.Motion.from_samples(RECORD, record[::-1], cutoff=6.0)(RECORD)[0]
    np.testing.assert_allclose(forwards[100:301], backwards[::-1][100:301], rtol=0, atol=1e-6)


@pytest.mark.parametrize("cutoff", [2.0, 6.0, 20.0])
def test_filter_keeps_a_straight_line_up_to_the_ends(cutoff):
    """A motion may begin and end at any speed; 1e-6 of it is left of the filter's start."""
    motion = em.Motion.from_samples(RECORD, 1.0 + 2.0 * RECORD, cutoff=cutoff)
    q, v, _ = motion(RECORD)
    np.testing.assert_allclose(q[:, 0], 1.0 + 2.0 * RECORD, rtol=0, atol=2e-6)
    np.testing.assert_allclose(v[:, 0], 2.0, rtol=0, atol=1.5e-5)


def test_filter_of_a_short_record():
    """One period of the cut-off is enough, less is refused: the ends would be all there is."""
    short = 1.0 + 2.0 * RECORD[:35]
    motion = em.Motion.from_samples(RECORD[:35], short, cutoff=6.0)
    np.testing.assert_allclose(motion(RECORD[:35])[0][:, 0], short, rtol=0, atol=6e-4)
    with pytest.raises(em.MotionError, match=r"at least one period, 0\.166667 s; this one has"):
        em.Motion.from_samples(RECORD[:33], short[:33], cutoff=6.0)


@pytest.mark.parametrize("low_pass", em.LowPass)
def test_filter_of_rounded_times(low_pass):
    """The times of a file have so many digits; a tenth of a step would be a gap."""
    exact = np.arange(121) / 120.0
    record = np.sin(4.0 * exact) + 0.1 * np.sin(150.0 * exact)
    ours, expected = (
        em.Motion.from_samples(times, record, cutoff=6.0, low_pass=low_pass)
        for times in (exact.round(8), exact)
    )
    times = np.linspace(0.0, 1.0, 50)
    np.testing.assert_allclose(ours(times)[0], expected(times)[0], rtol=0, atol=1e-6)
    assert (ours.start, ours.end) == (0.0, 1.0)


def test_opensim_filter_keeps_lines_and_removes_tremor():
    options = {"cutoff": 6.0, "low_pass": em.LowPass.OPENSIM}
    line = em.Motion.from_samples(RECORD, 1.0 + 2.0 * RECORD, **options)
    q, v, a = line(RECORD)
    np.testing.assert_allclose(q[:, 0], 1.0 + 2.0 * RECORD, rtol=0, atol=1e-13)
    np.testing.assert_allclose(v, 2.0, rtol=0, atol=1e-11)
    np.testing.assert_allclose(a, 0.0, rtol=0, atol=1e-8)
    inner = slice(100, 301)
    fast = em.Motion.from_samples(RECORD, sine(50.0), **options)(RECORD)[0][inner, 0]
    assert abs(fast).max() < 3e-4
    slow = em.Motion.from_samples(RECORD, sine(1.0), **options)(RECORD)[0][inner, 0]
    np.testing.assert_allclose(slow, sine(1.0)[inner], rtol=0, atol=3e-3)


def test_opensim_filter_is_a_windowed_sinc_of_101_samples():
    """An impulse gives the weights, whose sum is 1."""
    impulse = np.where(np.arange(401) == 200, 1.0, 0.0)
    motion = em.Motion.from_samples(RECORD, impulse, cutoff=6.0, low_pass=em.LowPass.OPENSIM)
    weights = motion(RECORD)[0][:, 0]
    k = np.arange(-200, 201)
    expected = np.where(
        abs(k) <= 50, np.sinc(2.0 * 6.0 / RATE * k) * (0.54 + 0.46 * np.cos(np.pi * k / 50.0)), 0.0
    )
    np.testing.assert_allclose(weights, expected / expected.sum(), rtol=0, atol=1e-15)


# -- files ----------------------------------------------------------------------------------------


@pytest.fixture
def file(tmp_path):
    """Degrees, meters, a column too many, an unusual order."""
    angles, path = np.degrees(SAMPLES[:, 0]), tmp_path / "arm.mot"
    values = np.column_stack([SAMPLES[:, 1], 0.0 * TIMES, angles])
    labels = ["tx", "unused", "/jointset/elbow/flexion/value"]
    em.Storage("arm", labels, TIMES, values, in_degrees=True).write(path)
    return path


def test_a_file_is_its_samples(file):
    motion = em.Motion.from_file(file, ["flexion", "tx"], ["rad", "m"])
    expected = em.Motion.from_samples(TIMES, SAMPLES)
    for ours, theirs in zip(motion(TIMES), expected(TIMES), strict=True):
        np.testing.assert_allclose(ours, theirs, rtol=0, atol=1e-12)


def test_a_file_can_be_filtered(file):
    options = {"cutoff": 2.0, "low_pass": em.LowPass.OPENSIM}
    motion = em.Motion.from_file(file, ["flexion", "tx"], ["rad", "m"], **options)
    expected = em.Motion.from_samples(TIMES, SAMPLES, **options)
    np.testing.assert_allclose(motion(TIMES)[0], expected(TIMES)[0], rtol=0, atol=1e-14)


def test_files_that_cannot_be_a_motion(file, tmp_path):
    with pytest.raises(em.StorageError, match=r"arm\.mot: .*'hip'; the columns are tx, unused, /j"):
        em.Motion.from_file(file, ["flexion", "hip"], ["rad", "rad"])
    with pytest.raises(em.MotionError, match=r"arm\.mot: cutoff = 9\.0 Hz is outside \(0, 5\)"):
        em.Motion.from_file(file, ["tx"], ["m"], cutoff=9.0)
    values = np.where(ROWS == 3, np.nan, SAMPLES[:, 0])[:, None]
    em.Storage("gap", ["tx"], TIMES, values).write(tmp_path / "gap.sto")
    with pytest.raises(em.MotionError, match=r"gap\.sto: coordinate 'tx' is nan at t = 0\.3 s"):
        em.Motion.from_file(tmp_path / "gap.sto", ["tx"], ["m"])
    with pytest.raises(FileNotFoundError):
        em.Motion.from_file(tmp_path / "none.sto", ["tx"], ["m"])


def test_filter_of_opensim():
    """Values and second derivatives that OpenSim 4.6 makes of noisy samples: pad(60),
    lowpassFIR(50, 6), GCVSplineSet(5)."""
    motion = em.Motion.from_samples(*noisy(), cutoff=6.0, low_pass=em.LowPass.OPENSIM)
    with np.load(FOLDER / "filtered.npz") as stored:
        q, _, a = motion(stored["at"])
        np.testing.assert_allclose(q, stored["q"], rtol=0.0, atol=1e-9)
        np.testing.assert_allclose(a, stored["a"], rtol=0.0, atol=1e-6)


def test_arrays_are_interpolated():
    times = np.array([0.0, 0.2, 0.5, 1.0])
    q, v, a = np.random.default_rng(3).normal(size=(3, 4, 2))
    motion = em.Motion.from_arrays(times, q, v, a)
    assert len(motion) == 2
    for ours, given in zip(motion(times), (q, v, a), strict=True):
        np.testing.assert_allclose(ours, given, rtol=0, atol=1e-11)


def test_arrays_of_a_quintic_are_that_quintic():
    p = np.polynomial.Polynomial([0.1, -0.4, 2.0, 1.0, -3.0, 0.7])
    times = np.array([0.0, 0.3, 1.0])
    motion = em.Motion.from_arrays(times, p(times), p.deriv()(times), p.deriv(2)(times))
    t = np.linspace(0.0, 1.0, 21)
    for ours, exact in zip(motion(t), (p, p.deriv(), p.deriv(2)), strict=True):
        np.testing.assert_allclose(ours[:, 0], exact(t), rtol=0, atol=1e-11)


# -- bad input ------------------------------------------------------------------------------------


def from_arrays(times, coordinates):
    return em.Motion.from_arrays(times, coordinates, coordinates, coordinates)


ALL = pytest.mark.parametrize(
    "build", [em.Motion.from_waypoints, em.Motion.from_samples, from_arrays]
)


@ALL
@pytest.mark.parametrize(
    ("times", "message"),
    [
        (TIMES[::-1], r"times must increase: t\[0\] = 1 s is followed by t\[1\] = 0.9 s"),
        (np.where(ROWS == 5, TIMES[4], TIMES), r"t\[4\] = 0.4 s is followed by t\[5\] = 0.4 s"),
        (np.where(ROWS == 5, np.nan, TIMES), "must be finite; row 5"),
        (np.where(ROWS == 10, np.inf, TIMES), "must be finite; row 10"),
        (TIMES[:5], "do not fit"),
        (TIMES[:, None], "do not fit"),
        (0.5, "do not fit"),
        ([*"abcdefghijk"], "must be arrays of numbers"),
        (None, r"must be finite|do not fit|arrays of numbers"),
    ],
)
def test_bad_times(build, times, message):
    with pytest.raises(em.MotionError, match=message):
        build(times, SAMPLES)


@ALL
@pytest.mark.parametrize(
    ("samples", "message"),
    [
        (np.where(ROWS == 3, np.nan, SAMPLES[:, 0]), "must be finite; row 3"),
        (np.where(ROWS == 3, np.inf, SAMPLES[:, 0]), "must be finite; row 3"),
        (SAMPLES[:7], "do not fit"),
        (SAMPLES.T, "do not fit"),
        (SAMPLES[:, :, None], "do not fit"),
        (SAMPLES[:, :0], "do not fit"),
        (1.0, "do not fit"),
        ([[1.0, 2.0], [3.0]], "must be arrays of numbers"),
        (["x"] * 11, "must be arrays of numbers"),
    ],
)
def test_bad_coordinates(build, samples, message):
    with pytest.raises(em.MotionError, match=message):
        build(TIMES, samples)


@pytest.mark.parametrize(
    ("build", "fewest"),
    [(em.Motion.from_waypoints, 2), (em.Motion.from_samples, 6), (from_arrays, 2)],
)
def test_too_few_points(build, fewest):
    build(TIMES[:fewest], SAMPLES[:fewest])
    with pytest.raises(em.MotionError, match=f"at least {fewest} points, got {fewest - 1}"):
        build(TIMES[: fewest - 1], SAMPLES[: fewest - 1])
    with pytest.raises(em.MotionError, match=r"at least|do not fit"):
        build([], [])


@pytest.mark.parametrize("bad", [(np.nan, 0.0), (0.0, np.inf)])
@pytest.mark.parametrize("name", ["speeds", "accelerations"])
def test_end_conditions_that_are_not_finite(name, bad):
    with pytest.raises(em.MotionError, match=f"{name} must be finite"):
        em.Motion.from_waypoints(TIMES, SAMPLES, **{name: bad})


@pytest.mark.parametrize("bad", [0.0, (0.0,), (0.0, 0.0, 0.0), ([1.0, 2.0, 3.0], 0.0), ("x", 0.0)])
@pytest.mark.parametrize("name", ["speeds", "accelerations"])
def test_end_conditions_that_do_not_fit(name, bad):
    with pytest.raises(em.MotionError, match=f"{name}: expected a pair"):
        em.Motion.from_waypoints(TIMES, SAMPLES, **{name: bad})


@pytest.mark.parametrize("cutoff", [0.0, -6.0, 100.0, 500.0, np.nan, np.inf])
def test_bad_cutoff(cutoff):
    with pytest.raises(em.MotionError, match=r"cutoff = .* Hz is outside \(0, 100\) Hz"):
        em.Motion.from_samples(RECORD, sine(1.0), cutoff=cutoff)


def test_a_filter_that_is_none():
    with pytest.raises(em.MotionError, match="low_pass = 'opensim' is not a LowPass"):
        em.Motion.from_samples(RECORD, sine(1.0), cutoff=6.0, low_pass="opensim")


UNEQUAL = {
    "a lost frame": np.delete(RECORD, 50),
    "times of three digits at 240 Hz": (np.arange(480) / 240.0).round(3),
    "adaptive steps": np.cumsum(np.geomspace(5e-4, 8e-3, 690)),
}


@pytest.mark.parametrize("low_pass", em.LowPass)
@pytest.mark.parametrize("times", UNEQUAL.values(), ids=UNEQUAL)
def test_filtering_unequal_steps(times, low_pass):
    """The spline is taken at equal steps, each as long as the smallest one, as OpenSim does."""
    motion = em.Motion.from_samples(
        times, np.sin(2.0 * np.pi * times), cutoff=6.0, low_pass=low_pass
    )
    assert (motion.start, motion.end) == (times[0], times[-1])
    inner = np.linspace(times[0] + 0.5, times[-1] - 0.5, 50)
    expected = np.sin(2.0 * np.pi * inner)
    np.testing.assert_allclose(motion(inner)[0][:, 0], expected, rtol=0, atol=8e-3)


def gait(t, seed):
    """A periodic motion with as much at higher frequencies as gait has, and noise of 1 mrad."""
    rng = np.random.default_rng(seed)
    n = np.arange(1, 8)
    size, phase = (
        0.4 / n**2.2 * rng.uniform(0.5, 1.5, n.size),
        rng.uniform(0.0, 2.0 * np.pi, n.size),
    )
    pure = np.sin(2.0 * np.pi * np.outer(t, n) + phase) @ size
    return pure + 1e-3 * rng.standard_normal(t.size)


@pytest.mark.parametrize("low_pass", [em.LowPass.BUTTERWORTH, em.LowPass.WINDOWED_SINC])
@pytest.mark.parametrize("rate", [60, 100, 200])
def test_a_record_that_begins_in_mid_motion(rate, low_pass):
    """Its accelerations up to 50 ms from its first sample are nearer to those of a longer record
    than with OpenSim's continuation, which leaves none at the first one."""
    times = np.arange(0.0, 5.0, 1.0 / rate)
    begin, part = round(2.0 * rate), round(1.2 * rate)
    soon = times[begin : begin + rate // 20 + 1]
    ours, theirs, usual = [], [], []
    for seed in range(40):
        record = gait(times, seed)
        whole = em.Motion.from_samples(times, record, cutoff=6.0, low_pass=low_pass)(times)[2]
        pieces = times[begin : begin + part], record[begin : begin + part]
        for errors, filter_ in ((ours, low_pass), (theirs, em.LowPass.OPENSIM)):
            motion = em.Motion.from_samples(*pieces, cutoff=6.0, low_pass=filter_)
            errors.append(motion(soon)[2] - whole[begin : begin + soon.size])
        usual.append(whole[100:-100])
    ours, theirs, usual = (np.sqrt(np.mean(np.square(each))) for each in (ours, theirs, usual))
    assert theirs > 0.5 * usual and ours < 0.92 * theirs


def test_shapes_of_arrays():
    with pytest.raises(em.MotionError, match="must have the same shape"):
        em.Motion.from_arrays(TIMES, SAMPLES, SAMPLES[:, :1], SAMPLES)
    with pytest.raises(em.MotionError, match=r"speeds .* do not fit"):
        em.Motion.from_arrays(TIMES, SAMPLES, SAMPLES[:5], SAMPLES)
    with pytest.raises(em.MotionError, match="accelerations must be finite"):
        em.Motion.from_arrays(TIMES, SAMPLES, SAMPLES, np.full_like(SAMPLES, np.nan))


@pytest.mark.parametrize("t", [-1e-3, 1.001, np.nan, np.inf, [0.0, 0.5, 2.0]])
def test_times_outside_the_motion(t):
    with pytest.raises(em.MotionError, match=r"the motion spans \[0, 1\] s, asked for t ="):
        pendulum.motion()(t)


def test_accumulated_steps_may_pass_the_end_by_rounding():
    motion = pendulum.motion()
    np.testing.assert_array_equal(motion(1.0 + 1e-12), motion(1.0))
    np.testing.assert_array_equal(motion(-1e-12), motion(0.0))


@pytest.mark.parametrize(
    "motion",
    [
        em.Motion.from_samples(TIMES, SAMPLES),
        em.Motion.from_arrays(TIMES, SAMPLES, np.zeros_like(SAMPLES), np.zeros_like(SAMPLES)),
    ],
)
def test_a_part_of_a_motion_is_the_same_motion(motion):
    part = motion.between(0.25, 0.75)
    assert (part.start, part.end) == (0.25, 0.75) and len(part) == 2
    times = np.linspace(0.25, 0.75, 21)
    np.testing.assert_array_equal(part(times), motion(times))
    np.testing.assert_array_equal(part.between(0.3, 0.4)(0.35), motion(0.35))
    with pytest.raises(em.MotionError, match=r"spans \[0.25, 0.75\] s, asked for t = 0.8 s"):
        part(0.8)


@pytest.mark.parametrize(
    ("span", "message"),
    [
        ((0.5, 0.5), r"a motion from 0\.5 to 0\.5 s is empty"),
        ((0.5, np.nan), r"from 0\.5 to nan s is empty"),
        ((-0.1, 0.5), r"spans \[0, 1\] s, asked for t = -0\.1 s"),
        ((0.5, 1.0000001), r"spans \[0, 1\] s, asked for t = 1\.0000001 s"),
        ((0.5, np.inf), r"spans \[0, 1\] s, asked for t = inf s"),
    ],
)
def test_parts_that_a_motion_has_not(span, message):
    with pytest.raises(em.MotionError, match=message):
        em.Motion.from_samples(TIMES, SAMPLES).between(*span)


def test_number_of_coordinates():
    motion = em.Motion.from_waypoints(TIMES, SAMPLES)
    check_motion(motion, ["a", "b"])
    with pytest.raises(em.MotionError, match="motion has 2 coordinates, the model 3: a, b, c"):
        check_motion(motion, ["a", "b", "c"])


@pytest.mark.parametrize("made", ["waypoints", "samples", "arrays"])
def test_one_time_is_as_many(made):
    """Single times, in a kernel, have the values of arrays of times, which SciPy evaluates."""
    times = np.array([0.0, 0.11, 0.3, 0.34, 0.7, 0.8, 1.0])
    q = np.column_stack([np.sin(3.0 * times), times**2, np.cos(5.0 * times)])
    if made == "arrays":
        motion = em.Motion.from_arrays(times, q, 0.3 * q, -q)
    else:
        motion = getattr(em.Motion, f"from_{made}")(times, q)
    at = np.concatenate([times, np.linspace(0.0, 1.0, 97), [-1e-10, 1.0 + 1e-10]])
    for k, values in enumerate(zip(*motion(at), strict=True)):
        for several, one in zip(values, motion(float(at[k])), strict=True):
            np.testing.assert_allclose(one, several, rtol=1e-14, atol=1e-13)
