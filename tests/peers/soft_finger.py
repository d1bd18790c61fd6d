"""A finger under a load at its tip: a slender beam beside a solid body.

    pip install numpy==2.4.6 scipy==1.17.1 scikit-fem==12.0.2
    python tests/peers/soft_finger.py    # some seconds; writes results/soft_finger.csv

A dead load across the tip of a straight finger, clamped at its root, in large deformation. The beam is Euler's elastica.
The solid is five times as long as thick, in plane strain, of incompressible neo-Hookean rubber (the elements of
soft_pad.py), as stiff in bending as the beam; its tip is the mean of its end face. Loads are F L² / EI, lengths are over
the finger's length. Nothing of Palpate is used. A load for which the solid finds no rest is left out.
"""

import pathlib
import sys

import numpy as np
from scipy.integrate import solve_bvp
from soft_pad import SHEAR, Layer

LENGTH, THICK = 0.100, 0.020
LOADS = [0.1, 0.25, 0.5]
STEP = 0.05  # by which the load grows
MESHES = [(4, 20), (8, 40)]  # elements across and along; the last one is written


def elastica(load):
    """Tip across and ahead, and its angle."""

    def slope(_, y):
        angle, bend = y[0], y[1]
        return np.array([bend, -load * np.cos(angle), np.sin(angle), np.cos(angle)])

    s = np.linspace(0, 1, 50)
    guess = np.array([load * (s - s**2 / 2), load * (1 - s), load * s**2 / 2, s])
    got = solve_bvp(slope, lambda a, b: np.array([a[0], b[1], a[2], a[3]]), s, guess, tol=1e-9)
    return got.y[2, -1], got.y[3, -1], got.y[0, -1]


class Solid:
    def __init__(self, across, along):
        self.layer = Layer(np.linspace(-THICK / 2, THICK / 2, across + 1), np.linspace(0, LENGTH, along + 1))
        layer = self.layer
        self.state = np.zeros(layer.size)
        self.state[2 * layer.count :] = -SHEAR
        self.pull = np.zeros(layer.size)  # a unit force across the end face
        shares = np.einsum("aeq,eq->ae", layer.face_N, layer.face_weight) / THICK
        np.add.at(self.pull, 2 * layer.nodes[:, layer.face_elements], shares)

    def under(self, load):
        """Tip across and ahead under a load, from the state before; None where it is not found."""
        layer, state = self.layer, self.state
        bending = 4 * SHEAR * THICK**3 / 12  # of plane strain: E / (1 - 0.5²) = 4 G
        for _ in range(30):
            f, K = layer.elements(state)
            step = layer.step(f, K, load * bending / LENGTH**2 * self.pull)
            state = state + step
            if np.abs(step[: 2 * layer.count]).max() < 1e-9:
                self.state = state
                y, _ = layer.surface(state)
                return (y * layer.face_weight).sum((1, 2)) / layer.face_weight.sum() / LENGTH
        return None


def bent(mesh):
    """Tips under all loads that the solid can bear."""
    solid, tips, before = Solid(*mesh), {}, 0.0
    for load in LOADS:
        for now in np.linspace(before, load, round((load - before) / STEP) + 1)[1:]:
            tip = solid.under(now)
            if tip is None:
                print(f"solid {mesh}: no rest at load {now:.2f}", file=sys.stderr)
                return tips
        tips[load], before = tip, load
    return tips


def main():
    coarse, fine = (bent(mesh) for mesh in MESHES)
    rows = ["load,tip_angle_deg,elastica_across,elastica_ahead,solid_across,solid_ahead"]
    for load, tip in fine.items():
        across, ahead, angle = elastica(load)
        numbers = (load, np.degrees(angle), across, ahead, *tip)
        rows.append(",".join(f"{a:.5g}" for a in numbers))
        change = abs(coarse[load][0] / tip[0] - 1) if load in coarse else np.nan
        print(f"{rows[-1]}; between two meshes the solid's way across changes by {change:.2%}")
    (pathlib.Path(__file__).parent / "results" / "soft_finger.csv").write_text("\n".join(rows) + "\n")


if __name__ == "__main__":
    main()
