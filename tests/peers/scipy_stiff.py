"""The matched scenes solved by SciPy's Radau (fifth order, implicit) in a formulation of its own.

    pip install numpy==2.4.6 scipy==1.17.1
    python tests/peers/scipy_stiff.py            # some minutes; writes results/scipy_*.csv

One finger, absolute positions and Jacobians in NumPy, q'' = M^-1 (tau - K q - D q' - bias + J' f). A free ball has its
height as a further unknown and every taxel its shear xi, a spring with a slip limit:

    xi' = v_t - (|xi| - mu f_n / k_t)+ sign(xi) / T,   T = 0.1 ms,   |f_t| = min(k_t |xi|, mu f_n)

The ODE is restarted at each step of the line pressure. Nothing of Palpate is used.
"""

import sys
import time

import numpy as np
from scipy.integrate import solve_ivp

import matched as m

LINKS = m.lengths()
MASS, INERTIA = m.masses(), m.inertias()
ROOT_MASS = np.sqrt(MASS)
TAXEL = [(j, s) for j, s in m.taxels() if j > 0]  # those on the fixed half segment touch nothing
SEGMENT = np.array([j for j, _ in TAXEL])
FEET, AXES, HEIGHTS = (column[-len(TAXEL):] for column in m.skin())
SLIP_TIME = 1e-4


def quarter_turn(r):
    """Velocity of r per unit of turning from y towards x."""
    return np.stack([r[..., 1], -r[..., 0]], axis=-1)


class Scene:
    def __init__(self, name):
        self.ball = name != "free_bend"
        self.free = name == "free_sphere"
        self.gravity = 0.0 if name == "free_bend" else m.GRAVITY
        self.torque = 0.0

    def start(self):
        return np.zeros(2 * m.N + (2 + len(TAXEL) if self.free else 0))

    def kinematics(self, q, qd):
        theta = np.concatenate([[0], np.cumsum(q)])
        omega = np.concatenate([[0], np.cumsum(qd)])
        along = np.stack([np.sin(theta), np.cos(theta)], axis=1)
        starts = np.concatenate([[[0, 0]], np.cumsum(along * LINKS[:, None], axis=0)[:-1]])
        return along, starts, omega

    def jacobian(self, points, segments, starts):
        """d point / d q, (points, 2, N): joint i carries segments beyond it."""
        arms = points[:, None, :] - starts[None, 1:, :]
        carried = segments[:, None] > np.arange(m.N)[None, :]
        return np.swapaxes(quarter_turn(arms) * carried[:, :, None], 1, 2)

    def contacts(self, y, along, starts):
        """Where each taxel touches: the ball, the normal there, normal force; all (taxels, ..)."""
        ahead = along[SEGMENT]
        axis = ahead * AXES[:, :1] + quarter_turn(ahead) * AXES[:, 1:]
        foot = starts[SEGMENT] + ahead * FEET[:, None]
        height = y[2 * m.N] if self.free else 0.0
        ball = np.array([m.HALF_GAP, m.DROP - height])
        normal, force = m.pressing(foot, axis, HEIGHTS, ball)
        return ball, normal, force

    def rate(self, _t, y):
        q, qd = y[: m.N], y[m.N : 2 * m.N]
        along, starts, omega = self.kinematics(q, qd)
        centres = starts + along * (LINKS / 2)[:, None]
        jac = self.jacobian(centres, np.arange(m.N + 1), starts)
        flat = (jac * ROOT_MASS[:, None, None]).reshape(-1, m.N)
        mass = flat.T @ flat
        beyond = np.cumsum(INERTIA[::-1])[::-1][1:]
        mass += np.minimum.outer(beyond, beyond)
        # Acceleration at zero joint acceleration: every start swings about the ones before it.
        pull = -along * (omega**2 * LINKS)[:, None]
        at_start = np.concatenate([[[0, 0]], np.cumsum(pull, axis=0)[:-1]])
        inertial = (at_start + pull / 2 - np.array([0, self.gravity])) * MASS[:, None]
        force = self.torque - m.STIFFNESS * q - m.DAMPING * qd - np.einsum("lxi,lx->i", jac, inertial)
        out = np.zeros_like(y)
        if self.ball:
            ball, normal, pressing = self.contacts(y, along, starts)
            on_taxel = normal * pressing[:, None]
            jac_touch = self.jacobian(ball + normal * m.BALL, SEGMENT, starts)
            if self.free:
                tangent = quarter_turn(normal)
                rise = y[2 * m.N + 1]
                velocity = np.einsum("txi,i->tx", jac_touch, qd) - np.array([0, -rise])
                xi = y[2 * m.N + 2 :]
                limit = m.FRICTION * pressing
                shear = np.clip(m.SHEAR * xi, -limit, limit)
                on_taxel = on_taxel - tangent * shear[:, None]
                beyond_limit = np.maximum(np.abs(xi) - limit / m.SHEAR, 0.0) * np.sign(xi)
                sliding = np.einsum("tx,tx->t", velocity, tangent)
                touching = pressing > 0
                out[2 * m.N + 2 :] = np.where(touching, sliding, 0.0) - beyond_limit / SLIP_TIME
                up = 2 * on_taxel[:, 1].sum()  # both fingers; y points down, and the ball feels the opposite
                sunk = max(-y[2 * m.N], 0.0)
                damping = 2 * np.sqrt(m.SUPPORT * m.BALL_MASS) * rise if sunk > 0 else 0.0
                standing = max(m.SUPPORT * sunk - damping, 0.0)
                out[2 * m.N] = rise
                out[2 * m.N + 1] = (up + standing) / m.BALL_MASS - self.gravity
            force = force + np.einsum("txi,tx->i", jac_touch, on_taxel)
        out[: m.N] = qd
        out[m.N : 2 * m.N] = np.linalg.solve(mass, force)
        return out

    def slope(self, t, y):
        """d rate / d y by central differences of a fixed size: SciPy's own choose steps by the size of y, which at rest
        is rounding error."""
        columns = []
        for k in range(len(y)):
            away = np.zeros_like(y)
            away[k] = 1e-7
            columns.append((self.rate(t, y + away) - self.rate(t, y - away)) / 2e-7)
        return np.array(columns).T

    def squeeze(self, y):
        """Horizontal force on the finger (N)."""
        if not self.ball:
            return 0.0
        along, starts, _ = self.kinematics(y[: m.N], y[m.N : 2 * m.N])
        _, normal, pressing = self.contacts(y, along, starts)
        force = normal * pressing[:, None]
        if self.free:
            limit = m.FRICTION * pressing
            force = force - quarter_turn(normal) * np.clip(m.SHEAR * y[2 * m.N + 2 :], -limit, limit)[:, None]
        return -force[:, 0].sum()


def solve(name, rtol):
    scene, y, t = Scene(name), None, 0.0
    y = scene.start()
    times, q, force = m.sample_times(), [], []
    for tick in range(40):
        scene.torque = m.TORQUE * m.line_bar(tick)
        end = (tick + 1) / 10
        inside = times[(times > t + 1e-9) & (times < end - 1e-9)]
        at_end = np.any(np.abs(times - end) < 1e-9)
        run = solve_ivp(scene.rate, (t, end), y, method="Radau", jac=scene.slope, rtol=rtol, atol=rtol * 1e-3, t_eval=[*inside, end])
        assert run.success, run.message
        for state in run.y.T if at_end else run.y.T[:-1]:
            q.append(state[: m.N])
            force.append(scene.squeeze(state))
        y, t = run.y[:, -1], end
    return np.array(q), np.array(force)


if __name__ == "__main__":
    for name in sys.argv[1:] or m.SCENES:
        start = time.process_time()
        coarse, _ = solve(name, 1e-4)
        q, force = solve(name, 1e-6)
        m.write(f"scipy_{name}", q, force)
        print(f"{name}: rtol 1e-4 against 1e-6 {m.rms_deg(coarse, q):.1e} deg, {time.process_time() - start:.0f} s, "
              f"hold force {force[219]:.4f} N, q1 {np.degrees(q[219][0]):.4f} deg")
