"""The matched scenes in MuJoCo, and what accuracy costs there and in Palpate.

    pip install mujoco==4.0.0 numpy==2.4.6 scipy==1.17.1
    cargo build --release
    python tests/peers/mujoco_discrete.py target/release/palpate          # writes results/mujoco_*.csv, results/cost.json

MuJoCo's contact is a spring of k_eff = k / ((1 - d) A) N/m, with d the constant impedance, -k the first number of
`solref` and A the inverse inertia of the pair as the solver sees it. With `integrator="discrete"` that is the inertia
M + h D + h^2 K, so that A changes with the step and with the pose (54, 34, 18, 2 1/kg at h = 0 .. 1/150 s): a stiffness
in N/m cannot be asked for, only found. Here k of every pair is set from the mean A over its time of contact, anew for
each step length; what remains is MuJoCo's. Its contact is that of two balls; the force of a
piece of skin (`matched.pressing`) as a share of that of a spring at the same depth is averaged over the time of contact. Every contact also adds an inertia of d / ((1 - d) A): d = 0.001 makes that
negligible. Friction in MuJoCo is a damper tied to the same d, so that the free sphere, which friction has to carry, needs
d = 0.9 and impratio 100, the settings that hold best; the normal stiffness is matched all the same.

Both programs run in turns, several times, and the median of their CPU time counts. Errors are root mean squares over all
joints of one finger and all 300 samples, release included, against the engine's own run at a far smaller step and
against SciPy's solution (`scipy_stiff.py`).
"""

import json
import statistics
import sys
import time

import mujoco
import numpy as np

import matched as m

IMPEDANCE = {"fixed_sphere": 0.001, "free_sphere": 0.9}
RUNS = 5
STEPS = (1 / 150, 1 / 300, 1 / 600, 1 / 1200, 1 / 2400)
TOLERANCES = (1e-3, 3e-4, 1e-4, 3e-5, 1e-5, 1e-6)
CONVERGED = "1e-8"
FINEST = 1 / 9600
BASE = 0.156  # height of the palm: pedestal 50 mm, half the ball, 86 mm


def finger(side, sign):
    """Nested bodies; the hinge axis turns the tip towards the other finger."""
    lengths, masses, inertias = m.lengths(), m.masses(), m.inertias()
    feet, axes, heights = m.skin()
    tips = np.stack([feet, np.zeros(m.TAXELS)], axis=1) + axes * (heights - m.SKIN)[:, None]
    balls = {}
    for (j, _), tip in zip(m.taxels(), tips):
        balls.setdefault(j, []).append(tip)
    text, close = "", ""
    for j in range(1, m.N + 1):
        text += f'<body name="{side}{j}" pos="0 0 {-lengths[j - 1]}">'
        text += f'<joint type="hinge" axis="0 {-sign} 0" stiffness="{m.STIFFNESS}" damping="{m.DAMPING}"/>'
        i = inertias[j]
        text += f'<inertial pos="0 0 {-lengths[j] / 2}" mass="{masses[j]}" diaginertia="{i} {i} {i}"/>'
        for k, (along, above) in enumerate(balls.get(j, [])):
            text += f'<geom name="{side}{j}_{k}" type="sphere" size="{m.SKIN}" pos="{sign * above} 0 {-along}" '
            text += 'mass="0"/>'
        close += "</body>"
    return f'<body name="{side}0" pos="{-sign * m.HALF_GAP} 0 {BASE}">' + text + close + "</body>"


def model(name):
    """The scene; `solref` of its pairs is still to be set."""
    gravity = 0 if name == "free_bend" else -m.GRAVITY
    d = IMPEDANCE.get(name, 0.9)
    contact = f'solref="-1 -1" solimp="{d} {d} 0.001 0.5 2"'
    world = finger("left", 1) + finger("right", -1)
    pairs = ""
    if name != "free_bend":
        geom = f'<geom name="ball" type="sphere" size="{m.BALL}" mass="0"/>'
        if name == "free_sphere":
            i = 0.4 * m.BALL_MASS * m.BALL**2
            world += f'<body name="ball" pos="0 0 {BASE - m.DROP}"><freejoint/>'
            world += f'<inertial pos="0 0 0" mass="{m.BALL_MASS}" diaginertia="{i} {i} {i}"/>{geom}</body>'
            world += f'<geom name="pin" type="plane" size="1 1 1" pos="0 0 {BASE - m.DROP - m.BALL}"/>'
            pairs += f'<pair geom1="pin" geom2="ball" condim="1" {contact}/>'
        else:
            world += geom.replace("/>", f' pos="0 0 {BASE - m.DROP}"/>')
        mu = m.FRICTION if name == "free_sphere" else 0
        count = {}
        for j, _ in m.taxels():
            k = count.get(j, 0)
            count[j] = k + 1
            for side in ("left", "right") if j > 0 else ():
                pairs += f'<pair geom1="{side}{j}_{k}" geom2="ball" condim="{3 if mu else 1}" {contact} '
                pairs += f'friction="{mu} {mu} 0 0 0"/>'
    xml = f"""<mujoco><option gravity="0 0 {gravity}" integrator="discrete" cone="elliptic" impratio="100"
      tolerance="1e-10" iterations="100"/><default><geom contype="0" conaffinity="0"/></default>
      <worldbody>{world}</worldbody><contact>{pairs}</contact></mujoco>"""
    return mujoco.MjModel.from_xml_string(xml)


def piece_of(name):
    """Number of a piece of skin by the name of its ball, as in left7_1."""
    segment, k = name.lstrip("leftrigh").split("_")
    return [j for j, _ in m.taxels()].index(int(segment)) + int(k)


def skin_share(mj, data, pair, depth):
    """Force of a piece of skin as a share of that of a spring of m.CONTACT at this depth."""
    both = mj.pair_geom1[pair], mj.pair_geom2[pair]
    ball, taxel = both if mj.geom(both[0]).name == "ball" else both[::-1]
    side = 1 if mj.geom(taxel).name.startswith("left") else -1
    inward, _, up = (data.xmat[mj.geom_bodyid[taxel]].reshape(3, 3) * [side, 1, 1]).T
    _, axes, heights = (column[piece_of(mj.geom(taxel).name)] for column in m.skin())
    axis = axes[1] * inward - axes[0] * up
    foot = data.geom_xpos[taxel] - (heights - m.SKIN) * axis
    _, force = m.pressing(foot[None], axis[None], heights, data.geom_xpos[ball])
    return force[0] / (m.CONTACT * max(depth, 1e-6))


def matched(name, h):
    """The model with each pair's stiffness set so that its contact is m.CONTACT N/m at steps of h."""
    mj = model(name)
    mj.opt.timestep = h
    if name == "free_bend":
        return mj
    d = IMPEDANCE[name]
    pair_of = {frozenset(pair): k for k, pair in enumerate(zip(mj.pair_geom1, mj.pair_geom2))}
    weight = mj.body_invweight0[:, 0]
    inverse = weight[mj.geom_bodyid[mj.pair_geom1]] + weight[mj.geom_bodyid[mj.pair_geom2]]
    wanted = np.array([m.SUPPORT if "pin" in (mj.geom(a).name, mj.geom(b).name) else m.CONTACT
                       for a, b in zip(mj.pair_geom1, mj.pair_geom2)])
    slant = np.ones(mj.npair)
    on_skin = wanted == m.CONTACT
    for _ in range(3):
        k = wanted * slant * (1 - d) * inverse
        mj.pair_solref[:, 0] = -k
        # The pads have no damper of their own; friction needs one, and so does the pin.
        mj.pair_solref[:, 1] = -2 * np.sqrt(k) if name == "free_sphere" else -1e-9
        data, sums = mujoco.MjData(mj), np.zeros((mj.npair, 3))
        for step in range(round(m.DURATION / h)):
            if step % round(0.1 / h) == 0:
                data.qfrc_applied[: 2 * m.N] = m.TORQUE * m.line_bar(step // round(0.1 / h))
            mujoco.mj_step(mj, data)
            if step % max(round(1 / 150 / h), 1) == 0:
                for c in range(data.ncon):
                    pair = pair_of[frozenset(data.contact[c].geom)]
                    share = skin_share(mj, data, pair, -data.contact[c].dist) if on_skin[pair] else 1.0
                    sums[pair] += data.efc_R[data.contact[c].efc_address] * d / (1 - d), share, 1
        seen = sums[:, 2] > 0
        inverse[seen] = sums[seen, 0] / sums[seen, 2]
        slant[seen] = sums[seen, 1] / sums[seen, 2]
    return mj


def run(mj, h):
    """Angles of the left finger, and the horizontal force on it."""
    data = mujoco.MjData(mj)
    per_sample, per_tick = round(1 / 75 / h), round(0.1 / h)
    assert abs(per_sample * h - 1 / 75) < 1e-12 and abs(per_tick * h - 0.1) < 1e-12
    q, force, wrench = [], [], np.zeros(6)
    for step in range(round(m.DURATION / h)):
        if step % per_tick == 0:
            data.qfrc_applied[: 2 * m.N] = m.TORQUE * m.line_bar(step // per_tick)
        mujoco.mj_step(mj, data)
        if (step + 1) % per_sample == 0:
            q.append(data.qpos[: m.N].copy())
            total = 0.0
            for c in range(data.ncon):
                if any(mj.geom(g).name.startswith("left") for g in data.contact[c].geom):
                    mujoco.mj_contactForce(mj, data, c, wrench)
                    total += abs(wrench[:3] @ data.contact[c].frame.reshape(3, 3)[:, 0])
            force.append(total)
    return np.array(q), np.array(force)


def stepping_ms(mj, h):
    """CPU time of the steps alone, as fast as MuJoCo goes: no sampling, one call for each tick of 0.1 s."""
    data = mujoco.MjData(mj)
    per_tick = round(0.1 / h)
    start = time.process_time()
    for tick in range(40):
        data.qfrc_applied[: 2 * m.N] = m.TORQUE * m.line_bar(tick)
        mujoco.mj_step(mj, data, per_tick)
    return (time.process_time() - start) * 1e3


def common(name):
    """SciPy's angles at every fifth sample."""
    table = np.loadtxt(m.RESULTS / f"scipy_{name}.csv", delimiter=",", skiprows=1)
    return table[:, 1 : m.N + 1], table[:, m.N + 1]


def euler(h):
    """Palpate's Euler steps at the common measure of its two rates: sampling faster makes steps shorter."""
    hz = round(1 / h)
    changed = [f"timing.sample_hz={hz if hz > 300 else 75}", "solver.integrator=euler"]
    return changed, "draft" if hz != 300 else "standard"


def ours(program, name):
    """Everything that Palpate is asked for: Euler over step lengths, and tolerances."""
    for h in STEPS:
        yield "palpate euler", h, *euler(h)
    for tolerance in TOLERANCES:
        yield "palpate tolerance", tolerance, [], f"{tolerance:g}"


def row(setting, samples, q, force, own, truth):
    return {
        "setting": setting,
        "cpu_ms": round(statistics.median(samples), 3),
        "error_own_deg": float(f"{m.rms_deg(q, own):.3g}"),
        "error_scipy_deg": float(f"{m.rms_deg(q[4::5], truth):.3g}"),
        "hold_force_n": round(float(force[219]), 5),
    }


def compare(program, name):
    truth, truth_force = common(name)
    mujoco_q, mujoco_force = run(matched(name, FINEST), FINEST)
    m.write(f"mujoco_{name}", mujoco_q, mujoco_force)
    palpate_q, palpate_force, _ = m.palpate(program, name, [], CONVERGED)
    models = {h: matched(name, h) for h in STEPS}
    asked = list(ours(program, name))
    cpu = {k: [] for k in [*models, *range(len(asked))]}
    last = {}
    for _ in range(RUNS):
        for h, mj in models.items():
            cpu[h].append(stepping_ms(mj, h))
        for k, (_, _, changed, accuracy) in enumerate(asked):
            *last[k], ms = m.palpate(program, name, changed, accuracy)
            cpu[k].append(ms)
    rows = {}
    for h, mj in models.items():
        rows.setdefault("mujoco discrete", []).append(row(h, cpu[h], *run(mj, h), mujoco_q, truth))
    for k, (method, setting, *_) in enumerate(asked):
        rows.setdefault(method, []).append(row(setting, cpu[k], *last[k], palpate_q, truth))
    for method, table in rows.items():
        for line in table:
            print(name, method, line, flush=True)
    converged = {
        "mujoco_scipy_deg": m.rms_deg(mujoco_q[4::5], truth),
        "palpate_scipy_deg": m.rms_deg(palpate_q[4::5], truth),
        "mujoco_palpate_deg": m.rms_deg(mujoco_q, palpate_q),
        "hold_force_n": {
            "mujoco": float(mujoco_force[219]),
            "palpate": float(palpate_force[219]),
            "scipy": float(truth_force[43]),
        },
    }
    print(name, converged, flush=True)
    return {"converged": converged, **rows}


def main(program):
    scenes = {name: compare(program, name) for name in m.SCENES}
    out = {"mujoco": mujoco.__version__, "runs": RUNS, "scenes": scenes}
    (m.RESULTS / "cost.json").write_text(json.dumps(out, indent=1) + "\n")


if __name__ == "__main__":
    main(sys.argv[1])
