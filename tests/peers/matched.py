"""The three matched scenes as numbers, for the scripts beside this file; `scenes/*.toml` says the same to Palpate.

A finger is N = 10 hinges at the middle of equal segments, each with a linear spring and damper. Its skin is 20 pieces of
rubber without damping, 8 mm high, with feet on the neutral axis and round tips of 4 mm radius, of 1250 N/m each: `pressing`
has their law, with K = 1250 N/m times 8 mm. The scene is a mirror image of itself, so that one finger tells all: lengths in m, x inward from the palm, y from the palm to the tip.
"""

import csv
import json
import subprocess
import tempfile
from pathlib import Path

import numpy as np

HERE = Path(__file__).parent
RESULTS = HERE / "results"
SCENES = ("free_bend", "fixed_sphere", "free_sphere")

N, LENGTH, MASS = 10, 0.1, 0.03
STIFFNESS, DAMPING = 4.2e-3 / 0.01, 0.02 * 4.2e-3 / 0.01  # N m/rad, N m s/rad
DEPTH = 0.020  # bellows and pad, for the inertia of a segment
HALF_GAP, BALL, DROP = 0.050, 0.020, 0.086  # finger to middle, radius of the ball, palm to its centre
TAXELS, SKIN, AHEAD, CONTACT = 20, 0.004, 0.004, 1250.0  # pieces, radius and centre of their tips, N/m
HEIGHT = AHEAD + SKIN
SHEAR, FRICTION = CONTACT / 3, 0.8  # N/m, -
BALL_MASS, SUPPORT = 0.03, 1e4  # kg, N/m
GRAVITY, TORQUE = 9.81, 0.06  # m/s2, N m at 1 bar
DURATION, SAMPLES = 4.0, 300


def lengths():
    """Lengths of the N + 1 segments."""
    whole = LENGTH / N
    return np.array([whole / 2] + [whole] * (N - 1) + [whole / 2])


def masses():
    return MASS * lengths() / LENGTH


def inertias():
    return masses() * (lengths() ** 2 + DEPTH**2) / 12


def taxels():
    """(segment, distance from its start) of every ball of the skin."""
    out = []
    for k in range(TAXELS):
        arc = (k + 0.5) * LENGTH / TAXELS
        segment = min(int(np.floor(arc / (LENGTH / N) + 0.5)), N)
        out.append((segment, arc - max(segment - 0.5, 0) * LENGTH / N))
    return out


def line_bar(tick):
    """Line pressure during a tick of 0.1 s."""
    if tick < 20:
        return 0.05 * (tick + 1)
    return 1.0 if tick < 30 else max(1.0 - 0.1 * (tick - 29), 0.0)


def sample_times():
    return (np.arange(SAMPLES) + 1) / 75


def palpate(program, scene, settings=(), accuracy="draft"):
    """Joint angles of the left finger (300 x 10), horizontal force on it (300), CPU time (ms) of a grasp by Palpate."""
    with tempfile.TemporaryDirectory() as folder:
        out = Path(folder) / "trial.csv"
        command = [program, "grasp", "--scene", str(HERE / "scenes" / f"{scene}.toml"), "--accuracy", accuracy]
        command += ["--no-store", "--json", "--out", str(out), "--layout", "C1+F", "--signals", "contact"]
        for setting in settings:
            command += ["--set", setting]
        report = json.loads(subprocess.run(command, check=True, capture_output=True, text=True).stdout)
        with open(out, newline="") as file:
            rows = list(csv.DictReader(file))
        with open(out.with_suffix(".contacts.csv"), newline="") as file:
            touches = [row for row in csv.DictReader(file) if row["finger"] == "left"]
    q = np.array([[float(row[f"q_left_{j + 1} [rad]"]) for j in range(N)] for row in rows])
    sample_of = {row["t_s"]: k for k, row in enumerate(rows)}
    force = np.zeros(len(rows))
    for row in touches:
        k = sample_of[row["t_s"]]
        angle = q[k, : int(row["segment"])].sum()
        force[k] += float(row["normal_force [N]"]) * np.cos(angle) - float(row["shear_along [N]"]) * np.sin(angle)
    every = len(rows) // SAMPLES
    return q[every - 1 :: every], force[every - 1 :: every], report["cpu_ms"]


def skin():
    """Feet along and above their segments, axes as (along, inward) and heights of all pieces. The feet of the last segment
    stand back from its end, so that the pieces stay within the finger where they are widest."""
    segment, along = (np.array(column) for column in zip(*taxels()))
    room = lengths()[segment] - np.where(segment == N, np.sqrt(SKIN * HEIGHT), 0.0)
    feet = np.minimum(along, room)
    reach = np.stack([along - feet, np.full(TAXELS, HEIGHT)], axis=1)
    heights = np.linalg.norm(reach, axis=1)
    return feet, reach / heights[:, None], heights


def pressing(foot, axis, height, ball):
    """Normal and normal force of pieces of skin pressed by the ball; all (pieces, ..).

    A piece is a spheroid about its foot with half-axes H along its axis and sqrt(rho H) across. It shrinks by one factor
    s until it is clear of the ball, U = K H (1 - s)^2 / 2, and presses with -dU/dd, d its distance from the ball:

        H s^2 = min over z of  z^2 / (H - rho) + phi(z)^2 / rho,   phi(z) = |foot + z axis - ball| - R
    """
    ahead = np.einsum("tx,tx->t", ball - foot, axis)
    aside2 = np.maximum(np.einsum("tx,tx->t", ball - foot, ball - foot) - ahead**2, 0.0)
    stem, most = height - SKIN, np.maximum(ahead, 0.0)
    z = np.zeros_like(ahead)
    for _ in range(30):
        away = np.sqrt(aside2 + (z - ahead) ** 2)
        slope, phi = (z - ahead) / away, away - BALL
        first = z / stem + phi * slope / SKIN
        second = 1 / stem + (slope**2 + phi * aside2 / away**3) / SKIN
        z = np.clip(z - first / second, 0.0, most)
    away = np.sqrt(aside2 + (z - ahead) ** 2)
    phi = np.maximum(away - BALL, 1e-9)
    stretch = np.sqrt((z**2 / stem + phi**2 / SKIN) / height)
    normal = (foot + axis * z[:, None] - ball) / away[:, None]
    return normal, CONTACT * HEIGHT * np.maximum(1 - stretch, 0.0) * phi / (SKIN * stretch)


def rms_deg(a, b):
    return float(np.degrees(np.sqrt(np.mean((a - b) ** 2))))


def write(name, q, force):
    """Every fifth sample: 60 rows."""
    RESULTS.mkdir(exist_ok=True)
    with open(RESULTS / f"{name}.csv", "w") as file:
        file.write("t_s," + ",".join(f"q_{j + 1}_rad" for j in range(N)) + ",force_n\n")
        for t, angles, f in list(zip(sample_times(), q, force))[4::5]:
            file.write(f"{t:.6f}," + ",".join(f"{x:.8f}" for x in angles) + f",{f:.6f}\n")
