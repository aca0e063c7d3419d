"""A recorded motion: noisy samples, a zero-phase low-pass, all methods on an arm, replay, storage.

Motion capture comes as samples. Their second derivative is useless without a filter; with one, the
recruited excitations can be replayed in a plain forward simulation and give the same motion.
"""

import sys
from pathlib import Path

import numpy as np

import exudyn_muscles as em

sys.path.append(str(Path(__file__).resolve().parents[1]))
from models import planar_arm

out = Path("out")
out.mkdir(exist_ok=True)
model = planar_arm.build()

# The recording: 100 frames a second with 0.05 deg of noise.
frames = np.linspace(0.0, 1.0, 101)
noise = np.random.default_rng(1).normal(scale=np.radians(0.05), size=(101, 2))
recorded = planar_arm.motion()(frames)[0] + noise
raw = em.Motion.from_samples(frames, recorded)
motion = em.Motion.from_samples(frames, recorded, cutoff=6.0)
for name, m in (("raw", raw), ("filtered at 6 Hz", motion)):
    print(f"largest acceleration, {name}: {np.abs(m(frames)[2]).max():.0f} rad/s^2")

cmc = em.computed_muscle_control(model, motion, settings=em.CMCSettings(kp=400.0))
replay = em.forward_dynamics(model, cmc.excitations)
print("CMC tracking error (RMS):", np.degrees(cmc.tracking_error_rms()).round(4), "deg")
print("replay differs by", np.abs(replay.coordinates - cmc.coordinates).max(), "rad")

cmc.save(out / "recorded_motion.npz")
again = em.computed_muscle_control(model, motion, settings=em.CMCSettings(kp=400.0))
stored = em.Trajectory.load(out / "recorded_motion.npz")
print("difference from the stored result:", again.compare(stored))
