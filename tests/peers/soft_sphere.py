"""A soft sphere between two rigid plates without friction, by finite elements: what a shell of springs leaves out.

    pip install numpy==2.4.6 scipy==1.17.1 scikit-fem==12.0.2
    python tests/peers/soft_sphere.py            # a minute; writes results/soft_sphere.csv

Radius 20 mm, modulus 50 kPa, Poisson's ratio 0.3; a soft shell on a rigid core, or soft to the middle. Linear
elasticity, rotationally symmetric, quadratic elements; nodes of the surface are held back by the plate by an active
set. Nothing of Palpate is used. Soft to the middle the force tends to Hertz, 4/3 E* sqrt(R) d^1.5, which is printed
beside it.
"""

import pathlib

import numpy as np
from skfem import Basis, BilinearForm, ElementQuad2, ElementVector, MeshQuad, condense, solve
from skfem.helpers import ddot, eye, sym_grad, trace  # noqa: F401

RADIUS, MODULUS, POISSON = 0.020, 5e4, 0.3
SHELLS = [0.020, 0.010, 0.005]  # thickness (m); the first is soft to the middle
DEPTHS = [0.0002, 0.0005, 0.001, 0.002]  # by which each plate is pushed in (m)
ALONG, ROUND = 40, 90  # elements from core to surface, and from pole to equator

LAME = MODULUS * POISSON / ((1 + POISSON) * (1 - 2 * POISSON))
SHEAR = MODULUS / (2 * (1 + POISSON))


@BilinearForm
def stiffness(u, v, w):
    r = np.maximum(w.x[0], 1e-12)
    a, b = sym_grad(u), sym_grad(v)
    hoop_u, hoop_v = u[0] / r, v[0] / r
    spread_u, spread_v = a[0, 0] + a[1, 1] + hoop_u, b[0, 0] + b[1, 1] + hoop_v
    return 2 * np.pi * r * (LAME * spread_u * spread_v + 2 * SHEAR * (ddot(a, b) + hoop_u * hoop_v))


def press(shell, depths):
    core = max(RADIUS - shell, 0.01 * RADIUS)
    grown = np.linspace(0, 1, ALONG + 1) ** 0.7  # finer towards the surface
    turned = np.linspace(0, 1, ROUND + 1) ** 1.8  # finer towards the pole
    mesh = MeshQuad.init_tensor(core + (RADIUS - core) * grown, 0.5 * np.pi * turned)
    rho, theta = mesh.p
    mesh = MeshQuad(np.array([rho * np.sin(theta), rho * np.cos(theta)]), mesh.t)
    basis = Basis(mesh, ElementVector(ElementQuad2()), intorder=5)
    matrix = stiffness.assemble(basis)
    r, z = basis.doflocs
    component = np.zeros(basis.N, dtype=int)
    component[basis.get_dofs(elements=True).all(["u^2"])] = 1
    names = [set(basis.get_dofs(elements=True).all([f"u^{k}"])) for k in (1, 2)]
    assert len(names[0]) + len(names[1]) == basis.N
    rho = np.hypot(r, z)
    held = (rho < core * (1 + 1e-6)) | ((component == 0) & (r < 1e-9)) | ((component == 1) & (z < 1e-9))
    outer = np.flatnonzero((component == 1) & (rho > RADIUS * (1 - 1e-6)) & ~held)
    forces = []
    for depth in depths:
        gap = RADIUS - depth - z[outer]  # room above each node of the surface
        active = gap < 0
        for _ in range(100):
            x = np.zeros(basis.N)
            x[outer[active]] = gap[active]
            fixed = np.concatenate([np.flatnonzero(held), outer[active]])
            u = solve(*condense(matrix, np.zeros(basis.N), x=x, D=fixed))
            reaction = matrix @ u
            now = (active & (reaction[outer] <= 0)) | (u[outer] > gap + 1e-12)
            if (now == active).all():
                break
            active = now
        else:
            raise RuntimeError("the contact did not settle")
        forces.append(-reaction[outer[active]].sum())
    return forces


def main():
    rows = ["shell_m,depth_m,force_n"]
    for shell in SHELLS:
        for depth, force in zip(DEPTHS, press(shell, DEPTHS)):
            hertz = 4 / 3 * MODULUS / (1 - POISSON**2) * np.sqrt(RADIUS) * depth**1.5
            springs = np.pi * RADIUS * MODULUS * depth**2 / shell
            print(f"shell {shell * 1e3:4.1f} mm, {depth * 1e3:.1f} mm: {force:.4f} N; Hertz {hertz:.4f}, springs {springs:.4f}")
            rows.append(f"{shell},{depth},{force:.6e}")
    out = pathlib.Path(__file__).parent / "results" / "soft_sphere.csv"
    out.write_text("\n".join(rows) + "\n")


main()
