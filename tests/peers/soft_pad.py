"""A rubber pad pressed by rigid bodies, by finite elements: what a field of separate springs leaves out.

    pip install numpy==2.4.6 scipy==1.17.1 scikit-fem==12.0.2
    python tests/peers/soft_pad.py               # some minutes; writes results/soft_pad.csv
    python tests/peers/soft_pad.py ball plate    # some bodies; prints only
    python tests/peers/soft_pad.py --check       # half a minute; prints closed forms beside two cases

A layer of 8 mm, bonded below, of incompressible neo-Hookean rubber with modulus 100 kPa, in large deformation: quadratic
displacements and a continuous bilinear pressure (Taylor-Hood), total Lagrangian, Newton's method. The rigid body is a
signed distance. A penalty holds the surface back. The surface slides without friction, or sticks where it first touched
for as long as it is pressed. Depth grows in steps, halved where Newton's method fails. Nothing of Palpate is used.

The ball is rotationally symmetric; all else is plane strain in the section along the finger, on a layer so wide that its
sides do not matter. "plate" is the section across the finger: a pad of 20 mm with free sides under a wider plate.
Straight motion of a symmetric body is computed on one half. Without friction a slanted way gives what a straight one
gives on a wide layer, so those cases are left out.

A row holds forces (N for the ball, N/m for all others; `along` is signed), width of the contact and peak pressure on the
finer of two meshes, and by how much the normal force changes between them: empty where only one of them came so deep.
"""

import pathlib
import sys

import numpy as np
from scipy.sparse import csc_matrix
from scipy.sparse.linalg import splu
from skfem import Basis, ElementQuad1, ElementQuad2, FacetBasis, MeshQuad

HEIGHT, MODULUS = 0.008, 1e5
SHEAR = MODULUS / 3
PENALTY = 4000 * MODULUS / HEIGHT  # Pa per m of overlap: 2 um at 100 kPa
BLEND = 1e-6  # half the width of the gap over which the penalty sets in (m)
DEPTHS = [0.0005, 0.001, 0.002]
SLANT = np.radians(30)
LEAST_STEP, MOST_SOLVES = 2e-6, 800  # of a case (m): where it is given up


class Ball:
    """A ball, or a cylinder seen from its end."""

    def __init__(self, radius):
        self.radius = radius

    def gap(self, x, foot):
        """Distance of points x from the body whose lowest point is at `foot`, outward normal, curvature."""
        d = x - spread(foot + np.array([0, self.radius]), x)
        r = np.hypot(*d)
        return r - self.radius, d / r, 1 / r


class Edge:
    """A right angle with a fillet, turned from the vertical."""

    def __init__(self, fillet, turn=0.0):
        self.fillet, self.turn = fillet, turn

    def gap(self, x, foot):
        d = x - spread(foot + np.array([0, self.fillet]), x)
        r = np.maximum(np.hypot(*d), 1e-12)
        gap, normal, bent = r - self.fillet, d / r, 1 / r
        axis = np.array([np.sin(self.turn), np.cos(self.turn)])  # into the body
        for side in (1, -1):
            along, aside, out = (turned(axis, side * eighths * np.pi / 4) for eighths in (1, 2, 3))
            on_face = (np.tensordot(along, d, 1) > 0) & (np.tensordot(aside, d, 1) > 0)
            gap = np.where(on_face, np.tensordot(out, d, 1) - self.fillet, gap)
            normal = np.where(on_face, spread(out, x), normal)
            bent = np.where(on_face, 0.0, bent)
        return gap, normal, bent


class Block:
    """A flat face between two corners with a fillet."""

    def __init__(self, width, fillet):
        self.half, self.fillet = 0.5 * width - fillet, fillet

    def gap(self, x, foot):
        d = x - spread(foot + np.array([0, self.fillet]), x)
        beside = np.maximum(np.abs(d[0]) - self.half, 0) * np.sign(d[0])
        below = np.minimum(d[1], 0)
        r = np.maximum(np.hypot(beside, below), 1e-12)
        return r - self.fillet, np.array([beside, below]) / r, np.where(beside != 0, 1 / r, 0.0)


def spread(v, like):
    return np.asarray(v, float).reshape(2, *[1] * (like.ndim - 1)) + 0 * like


def turned(v, angle):
    c, s = np.cos(angle), np.sin(angle)
    return np.array([c * v[0] - s * v[1], s * v[0] + c * v[1]])


def dissected(at, which):
    """An order of unknowns on half lines of a grid that keeps the factors of the matrix sparse; pressures come last."""
    low, high = at[:, which].min(1), at[:, which].max(1)
    k = np.argmax(high - low)
    if high[k] - low[k] < 4:
        return which
    place, cut = at[k, which], 2 * round((low[k] + high[k]) / 4)
    return np.concatenate([dissected(at, which[place < cut]), dissected(at, which[place > cut]), which[place == cut]])


class Layer:
    """The rubber: finite elements on a rectangle, whose lower side is held."""

    def __init__(self, xs, zs, axisymmetric=False, symmetric=False, rollers=False):
        mesh = MeshQuad.init_tensor(xs, zs)
        self.axisymmetric = axisymmetric
        self.halves = 2 if symmetric else 1
        basis = Basis(mesh, ElementQuad2(), intorder=5)
        pressure = basis.with_element(ElementQuad1())
        top = mesh.facets_satisfying(lambda x: np.abs(x[1] - zs[-1]) < 1e-9)
        face = FacetBasis(mesh, ElementQuad2(), facets=top, intorder=5)
        shapes = lambda b: np.array([f[0].value * np.ones_like(b.dx) for f in b.basis])  # [a, e, q]
        slopes = lambda b: np.array([f[0].grad * np.ones_like(b.dx) for f in b.basis])  # [a, k, e, q]
        self.N, self.B, self.M = shapes(basis), slopes(basis), shapes(pressure)
        self.r = np.array(basis.global_coordinates())[0]
        self.weight = basis.dx * (2 * np.pi * self.r if axisymmetric else 1)
        self.face_N, self.face_B = shapes(face), slopes(face)
        self.face_X = np.array(face.global_coordinates())
        self.face_weight = face.dx * (2 * np.pi * self.face_X[0] if axisymmetric else 1)
        self.face_elements = mesh.f2t[0, top]
        self.nodes, self.corners = basis.element_dofs, pressure.element_dofs
        self.count = basis.N
        x, z = basis.doflocs
        held = [2 * np.flatnonzero(np.abs(z - zs[0]) < 1e-9) + k for k in ((1,) if rollers else (0, 1))]
        if axisymmetric or symmetric:
            held.append(2 * np.flatnonzero(np.abs(x - xs[0]) < 1e-9))
        places = np.concatenate([np.repeat(basis.doflocs, 2, axis=1), pressure.doflocs], 1)
        lines = (np.sort(np.concatenate([a, 0.5 * (a[1:] + a[:-1])])) for a in (xs, zs))
        at = np.array([np.searchsorted(line, place - 1e-9) for line, place in zip(lines, places)])
        self.size = 2 * basis.N + pressure.N
        self.free = free = dissected(at, np.setdiff1d(np.arange(self.size), np.concatenate(held)))
        # Where each entry of the element matrices goes in the sparse matrix of the free unknowns.
        number = np.full(self.size, -1)
        number[free] = np.arange(len(free))
        u = np.stack([2 * self.nodes, 2 * self.nodes + 1], 1).reshape(-1, self.nodes.shape[1])  # (a, i)
        self.dofs = np.concatenate([u, 2 * self.count + self.corners]).T  # [e, 22]
        n = number[self.dofs]
        rows, cols = np.broadcast_arrays(n[:, :, None], n[:, None, :])
        self.kept = ((rows >= 0) & (cols >= 0)).ravel()
        key = cols.ravel()[self.kept].astype(np.int64) * len(free) + rows.ravel()[self.kept]
        unique, self.slot = np.unique(key, return_inverse=True)
        self.indices = (unique % len(free)).astype(np.int32)
        self.indptr = np.searchsorted(unique // len(free), np.arange(len(free) + 1)).astype(np.int32)

    def elements(self, state):
        """Residuals [e, 22] and matrices [e, 22, 22] of all elements."""
        w, N, B, M = self.weight, self.N, self.B, self.M
        U = state[: 2 * self.count].reshape(-1, 2)[self.nodes]  # [a, e, i]
        p = np.einsum("ce,ceq->eq", state[2 * self.count :][self.corners], M)
        F = np.einsum("aei,akeq->ikeq", U, B) + np.eye(2)[:, :, None, None]
        cof = np.array([[F[1, 1], -F[1, 0]], [-F[0, 1], F[0, 0]]])
        area = F[0, 0] * F[1, 1] - F[0, 1] * F[1, 0]
        hoop = 1 + np.einsum("ae,aeq->eq", U[..., 0], N) / self.r if self.axisymmetric else np.ones_like(self.r)
        count, nodes = w.shape[0], len(N)
        D = np.einsum("ikeq,akeq->aieq", cof, B)  # slope of the area ratio
        V = hoop * D  # slope of the volume ratio
        stress = SHEAR * np.einsum("ikeq,akeq->aieq", F, B) + p * V
        if self.axisymmetric:
            Q = N / self.r
            V[:, 0] += area * Q
            stress[:, 0] += (SHEAR * hoop + p * area) * Q
        swelling = np.einsum("ceq,eq->ec", M, w * (area * hoop - 1))
        f = np.concatenate([np.einsum("aieq,eq->eai", stress, w).reshape(count, -1), swelling], 1)
        first, second = (np.ascontiguousarray(B[:, k].transpose(1, 0, 2)) for k in (0, 1))  # [e, a, q]
        gram = lambda a, b, s: (a * s[:, None]) @ b.transpose(0, 2, 1)
        K = np.zeros((count, nodes, 2, nodes, 2))
        same = gram(first, first, w * SHEAR) + gram(second, second, w * SHEAR)
        cross = gram(first, second, w * p * hoop)
        K[:, :, 0, :, 0] = K[:, :, 1, :, 1] = same
        K[:, :, 0, :, 1] = cross - cross.transpose(0, 2, 1)
        K[:, :, 1, :, 0] = -K[:, :, 0, :, 1]
        if self.axisymmetric:
            Q = np.ascontiguousarray(Q.transpose(1, 0, 2))
            K[:, :, 0, :, 0] += gram(Q, Q, w * SHEAR)
            for i in (0, 1):
                mixed = gram(np.ascontiguousarray(D[:, i].transpose(1, 0, 2)), Q, w * p)
                K[:, :, i, :, 0] += mixed
                K[:, :, 0, :, i] += mixed.transpose(0, 2, 1)
        whole = np.zeros((count, 2 * nodes + len(M), 2 * nodes + len(M)))
        whole[:, : 2 * nodes, : 2 * nodes] = K.reshape(count, 2 * nodes, -1)
        C = np.einsum("aieq,ceq,eq->eaic", V, M, w, optimize=True).reshape(count, 2 * nodes, -1)
        whole[:, : 2 * nodes, 2 * nodes :] = C
        whole[:, 2 * nodes :, : 2 * nodes] = C.transpose(0, 2, 1)
        return f, whole

    def step(self, f, K, load=0.0):
        """A step of Newton's method from the residuals and matrices of all elements, without pivoting."""
        rest = np.bincount(self.dofs.ravel(), f.ravel(), self.size) - load
        data = np.bincount(self.slot, K.ravel()[self.kept], len(self.indices))
        matrix = csc_matrix((data, self.indices, self.indptr), shape=[len(self.free)] * 2)
        factors = splu(matrix, permc_spec="NATURAL", diag_pivot_thresh=0, options={"SymmetricMode": True})
        step = np.zeros(self.size)
        step[self.free] = factors.solve(-rest[self.free])
        return step

    def surface(self, state):
        """Places of the points of the skin [i, f, q], and by how much it is stretched there."""
        U = state[: 2 * self.count].reshape(-1, 2)[self.nodes[:, self.face_elements]]
        y = self.face_X + np.einsum("aei,aeq->ieq", U, self.face_N)
        t = np.einsum("aei,aeq->ieq", U, self.face_B[:, 0])
        return y, np.hypot(1 + t[0], t[1]) * (y[0] / self.face_X[0] if self.axisymmetric else 1)


class Press:
    """A body that is pressed into a layer step by step."""

    def __init__(self, layer, body, sticks):
        self.layer, self.body, self.sticks = layer, body, sticks
        self.state = np.zeros(layer.size)
        self.state[2 * layer.count :] = -SHEAR
        self.foot = np.array([0, HEIGHT])
        self.gone, self.way = 0.0, None  # the last step, from which the next is guessed
        self.stuck = np.full(layer.face_X.shape, np.nan)  # place on the body, from its foot
        self.solves, self.depth, self.step = 0, 0.0, np.inf

    def contact(self, state, foot):
        """Pressure on the undeformed area [f, q], its slope, force on the skin [i, f, q], gap, normal and curvature."""
        y, stretch = self.layer.surface(state)
        gap, normal, bent = self.body.gap(y, foot)
        rise = np.clip((BLEND - gap) / (2 * BLEND), 0, 1)
        pressure = PENALTY * np.where(gap < -BLEND, -gap, BLEND * rise**2)
        force = pressure * normal
        held = np.isfinite(self.stuck[0])
        if self.sticks:
            off = np.where(held, y - spread(foot, y) - self.stuck, 0.0)
            off -= normal * (off * normal).sum(0)
            force = force - 0.5 * PENALTY * off
        return pressure, PENALTY * rise, force, (y, stretch, gap, normal, bent, held)

    def newton(self, foot, state):
        """The state with the foot of the body at a place, from a guess; None where it is not found."""
        layer = self.layer
        for iteration in range(30):
            f, K = layer.elements(state)
            pressure, slope, force, (_, _, _, normal, bent, held) = self.contact(state, foot)
            w, N, at, nodes = layer.face_weight, layer.face_N, layer.face_elements, len(layer.face_N)
            f[at, : 2 * nodes] -= np.einsum("ieq,aeq,eq->eai", force, N, w, optimize=True).reshape(len(at), -1)
            tangent = np.array([-normal[1], normal[0]])
            aside = 0.5 * PENALTY * held * self.sticks - pressure * bent
            k = np.einsum("ieq,jeq,eq->eqij", normal, normal, slope * w)
            k += np.einsum("ieq,jeq,eq->eqij", tangent, tangent, aside * w)
            k = np.einsum("aeq,beq,eqij->eaibj", N, N, k, optimize=True).reshape(len(at), 2 * nodes, -1)
            K[at, : 2 * nodes, : 2 * nodes] += k
            self.solves += 1
            try:
                step = layer.step(f, K)
            except RuntimeError:  # singular
                return None
            size = np.abs(step[: 2 * layer.count]).max()
            if not size < (0.05 if iteration < 8 else 1e-4 if iteration < 13 else 1e-5):
                return None
            state += min(1.0, 1e-3 / max(size, 1e-30)) * step
            if size < 1e-8:
                return state
        return None

    def to(self, depth, direction, most):
        """Presses on to a depth (m) along a direction in steps of at most a length (m); False where it fails."""
        self.step = min(self.step, 0.25 * most)
        while self.depth < depth - 1e-12:
            step, left = min(self.step, most), depth - self.depth
            go = left if left < 1.01 * step else (0.5 * left if left < 2 * step else step)
            down = self.depth + go
            foot = np.array([down * np.tan(direction), HEIGHT - down])
            state = self.newton(foot, self.state + (go / self.gone) * self.way) if self.gone else None
            if state is None:
                state = self.newton(foot, self.state.copy())
            if state is None:
                self.step = 0.5 * go
                if self.step < LEAST_STEP or self.solves > MOST_SOLVES:
                    return False
                continue
            before, (y_before, _) = self.foot, self.layer.surface(self.state)
            self.gone, self.way = go, state - self.state
            self.state, self.foot, self.depth, self.step = state, foot, down, 1.3 * go
            self.found = self.contact(state, foot)
            if self.sticks:
                y, _, gap, normal, _, held = self.found[3]
                place = y - spread(foot, y)
                slid = place - (y_before - spread(before, y))
                place -= 0.5 * (slid - normal * (slid * normal).sum(0))  # touched, on average, in the middle of the step
                self.stuck = np.where(gap < BLEND, np.where(held, self.stuck, place), np.nan)
        return True

    def measured(self):
        """Force normal to the layer and along it (N, N/m), width of the contact (m), peak pressure (Pa)."""
        layer = self.layer
        pressure, _, force, (y, stretch, gap, _, _, _) = self.found
        along, down = -(force * layer.face_weight).sum((1, 2))
        touching = y[0][gap < BLEND] - self.foot[0]
        half = layer.halves == 2 or layer.axisymmetric
        width = 2 * touching.max() if half else touching.max() - touching.min()
        mean = lambda a: (a * layer.face_weight).sum(1) / layer.face_weight.sum(1)
        return down * layer.halves, 0.0 if half else along, width, (mean(pressure) / mean(stretch)).max()


def spaced(points, sizes):
    """Coordinates from the first to the last of some points, with the sizes of elements there."""
    out = [points[0]]
    while out[-1] < points[-1]:
        out.append(out[-1] + np.interp(out[-1], points, sizes))
    out = np.array(out)
    return points[0] + (out - out[0]) * (points[-1] - points[0]) / (out[-1] - out[0])


def layer_for(kind, size, whole):
    """The layer for a body; `size` is that of the elements under it, relative to the coarse mesh."""
    ball = kind in ("ball", "cylinder")
    fine = (0.0006 if ball else 0.0002 if kind.startswith("edge") else 0.0003) * size
    zs = HEIGHT - spaced([0, 0.001 if not ball else 0.002, HEIGHT], [fine, fine, 0.0012 * size])[::-1]
    if kind == "plate":
        half = spaced([0, 0.008, 0.0095, 0.010], [0.0012 * size, 0.0006 * size, fine, fine])
    elif kind == "flat":
        sizes = np.array([0.0015, 0.001, 0.0003, 0.0003, 0.001, 0.004]) * size
        half = spaced([0, 0.007, 0.009, 0.0115, 0.014, 0.040], sizes)
    elif ball:
        half = spaced([0, 0.010, 0.040], [fine, fine, 0.004 * size])
    else:
        half = spaced([0, 0.0035, 0.007, 0.035], [fine, 1.5 * fine, 0.001 * size, 0.004 * size])
    xs = np.concatenate([-half[:0:-1], half]) if whole else half
    return Layer(xs, zs, axisymmetric=kind == "ball", symmetric=kind != "ball" and not whole)


BODIES = {
    "ball": Ball(0.020),
    "cylinder": Ball(0.010),
    "edge": Edge(0.0005),
    "edge turned": Edge(0.0005, SLANT),
    "flat": Block(0.020, 0.0005),
    "plate": Block(0.060, 0.0005),
}
MESHES = [1.4, 1.0]


def pressed(kind, size, slant, sticks):
    """Forces, width and peak pressure of a case at all depths that it gets to."""
    press = Press(layer_for(kind, size, whole=slant != 0 or kind == "edge turned"), BODIES[kind], sticks)
    most = (6e-5 if sticks else 1e-4 if kind.startswith("edge") else 2e-4) * size
    found = []
    for depth in DEPTHS:
        if not press.to(depth, np.radians(slant), most):
            name = f"{kind}, {slant} degrees, sticks {sticks:d}, mesh {size}"
            print(f"{name}: only to {press.depth * 1e3:.3f} mm", file=sys.stderr, flush=True)
            break
        found.append(press.measured())
    return found


def check():
    """Closed forms: a block between plates, and a shallow ball on the layer (Dimitriadis et al. 2002)."""
    layer = Layer(spaced([0, 0.010], [0.002] * 2), spaced([0, HEIGHT], [0.002] * 2), symmetric=True, rollers=True)
    press = Press(layer, BODIES["plate"], False)
    for depth in (0.0005, 0.002):
        press.to(depth, 0, 2e-4)
        force, stretch = press.measured()[0], 1 - depth / HEIGHT
        want = SHEAR * (stretch**-3 - stretch) * 0.020  # without friction on both plates the strain is uniform
        print(f"block, {depth * 1e3} mm: {force:.3f} N/m, closed form {want:.3f}, {force / want - 1:+.2%}")
    fine, body = 0.00012, BODIES["ball"]
    zs = HEIGHT - spaced([0, 0.001, HEIGHT], [fine, fine, 0.0006])[::-1]
    press = Press(Layer(spaced([0, 0.003, 0.06], [fine, fine, 0.0024]), zs, axisymmetric=True), body, False)
    for depth in (0.0001, 0.0002):
        press.to(depth, 0, 5e-5)
        force, chi = press.measured()[0], np.sqrt(body.radius * depth) / HEIGHT
        hertz = 16 / 9 * MODULUS * np.sqrt(body.radius) * depth**1.5
        want = hertz * (1 + 1.133 * chi + 1.283 * chi**2 + 0.769 * chi**3 + 0.0975 * chi**4)
        print(f"ball, {depth * 1e3} mm: {force:.5f} N, Dimitriadis {want:.5f}, {force / want - 1:+.2%}; Hertz {hertz:.5f}")


def main():
    if "--check" in sys.argv:
        return check()
    rows = ["body,slant_deg,sticks,depth_mm,normal,along,width_mm,peak_kpa,mesh_error_percent"]
    for kind in sys.argv[1:] or BODIES:
        for slant, sticks in ((0, False), (0, True), (30, True)):
            if slant and kind in ("ball", "edge turned"):
                continue
            coarse, fine = (pressed(kind, size, slant, sticks) for size in MESHES)
            for k, depth in enumerate(DEPTHS[: max(len(coarse), len(fine))]):
                normal, along, width, peak = (fine if k < len(fine) else coarse)[k]
                change = f"{100 * abs(coarse[k][0] / normal - 1):.4g}" if k < min(len(coarse), len(fine)) else ""
                numbers = ",".join(f"{a:.4g}" for a in (depth * 1e3, normal, along, width * 1e3, peak / 1e3))
                rows.append(f"{kind},{slant},{sticks:d},{numbers},{change}")
                print(rows[-1], flush=True)
    if len(sys.argv) == 1:
        (pathlib.Path(__file__).parent / "results" / "soft_pad.csv").write_text("\n".join(rows) + "\n")


if __name__ == "__main__":
    main()
