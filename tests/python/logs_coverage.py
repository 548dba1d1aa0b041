"""Whether intervals hold where the model does not cover the log: logs_coverage.py [--kinds K ...] [--logs N] [--first SEED].

By hand. Vehicles with six thrusters are drawn, flown by a simulator of their own (Fossen's equations in six degrees of freedom by
Runge and Kutta, nothing of it turbidock's), each with something that `identify` is not told: KINDS. Counted by kind: logs refused,
logs fitted but not to be believed, logs whose fit is offered what was planted, and of the others how many of the told intervals hold."""

import argparse
import pathlib
import tempfile
import time

import numpy as np

AXES = ("surge", "sway", "heave", "roll", "pitch", "yaw")
NAMES = ("h_fl", "h_fr", "h_rl", "h_rr", "v_l", "v_r")
PLACES = np.array([[0.16, 0.12, -0.02], [0.16, -0.12, -0.02], [-0.16, 0.12, -0.02], [-0.16, -0.12, -0.02], [0, 0.13, 0],
                   [0, -0.13, 0]])
ALONG = np.array([[np.cos(a), np.sin(a), 0] for a in np.radians([-40, 40, 40, -40])] + [[0, 0, 1.0]] * 2)
MASS, INERTIA, CENTRE, GRAVITY, DENSITY = 13.2, np.array([0.24, 0.31, 0.38]), np.array([0.006, 0, -0.012]), 9.81, 1000.0
NEWTON, INFLOW, DEAD_BAND = 28.0, 0.25, 0.17
# Believed, before the log.
ADDED, LINEAR, QUADRATIC = (np.array(row) for row in ([9, 9, 13, 0.2, 0.25, 0.2], [14, 9, 15, 0.3, 0.35, 0.5],
                                                      [120, 100, 120, 0.8, 0.8, 1.4]))
KINDS = ("clean", "current", "exchanged", "reversed", "speed lag", "lever arm", "swell", "tether", "off-diagonal", "battery", "gyroscope",
         "delay", "trim")
NOISE_M, NOISE_RAD, STEP_S = 0.005, 0.007, 0.025


def vehicle_files(folder):
    """The vehicle as it is believed: MJCF and YAML."""
    quaternions = ["0.9396926 0 0 -0.3420201", "0.9396926 0 0 0.3420201", "0.9396926 0 0 0.3420201", "0.9396926 0 0 -0.3420201"]
    quaternions += ["0.7071068 0 -0.7071068 0"] * 2
    sites = [("camera_head", "0.24 0 0.03", "1 0 0 0"), ("pole_tip", "0.55 0 -0.14", "1 0 0 0"), ("lamp_left", "0.24 0.16 0.03", "1 0 0 0"),
             ("lamp_right", "0.24 -0.16 0.03", "1 0 0 0")]
    sites += [(name, " ".join(map(str, place)), q) for name, place, q in zip(NAMES, PLACES, quaternions)]
    text = ('<mujoco><worldbody><body name="vehicle" pos="-1.5 0 -0.8"><freejoint name="vehicle"/>'
            f'<inertial pos="{" ".join(map(str, CENTRE))}" mass="{MASS}" diaginertia="{" ".join(map(str, INERTIA))}"/>'
            + "".join(f'<site name="{name}" pos="{place}" quat="{q}"/>' for name, place, q in sites)
            + "".join(f'<camera name="{side}" pos="0.24 0 0.03"/>' for side in ("left", "right"))
            + '<geom name="hull_box" class="solid" type="box" size="0.23 0.17 0.125" group="3"/>'
            '<geom name="pole" class="docking" type="cylinder" size="0.0175 0.265" pos="0.285 0 -0.14" euler="0 1.5707963 0"/>'
            "</body></worldbody><actuator>" + "".join(f'<motor name="{name}" site="{name}"/>' for name in NAMES)
            + "</actuator></mujoco>")
    (folder / "six.xml").write_text(text)
    rows = {"rigid_body": {"mass_kg": MASS, "p_BBcm_m": CENTRE.tolist(), "inertia_kg_m2": INERTIA.tolist()},
            "hydrodynamics": {"water_density_kg_m3": DENSITY, "displaced_volume_m3": 0.01325, "p_BBcb_m": [0.006, 0, 0.018],
                              "hull_height_m": 0.25, "added_mass_diagonal": ADDED.tolist(), "linear_damping_diagonal": LINEAR.tolist(),
                              "quadratic_damping_diagonal": QUADRATIC.tolist()},
            "thrusters": {"max_thrust_newton": NEWTON, "reverse_ratio": 0.85, "dead_band_volts": 0.19, "curve_exponent": 1.6,
                          "lag_s": 0.08, "inflow_loss_s_per_m": 0.3}}
    (folder / "six.yaml").write_text("\n".join(f"{group}:\n" + "\n".join(f"  {key}: {value}" for key, value in keys.items())
                                               for group, keys in rows.items()) + "\n")
    return folder / "six.xml"


def cross_of(v):
    made = np.zeros((*v.shape[:-1], 3, 3))
    for i, j, k, sign in ((2, 1, 0, 1), (0, 2, 1, 1), (1, 0, 2, 1), (1, 2, 0, -1), (2, 0, 1, -1), (0, 1, 2, -1)):
        made[..., i, j] = sign * v[..., k]
    return made


def draw(kind, seed):
    """What is true of a vehicle and its log, by this seed."""
    rng = np.random.default_rng([KINDS.index(kind), seed])
    truth = {"kind": kind, "rng": rng}
    for name, before, spread in (("added", ADDED, 0.25), ("linear", LINEAR, 0.35), ("quadratic", QUADRATIC, 0.35)):
        truth[name] = before * np.exp(np.clip(spread * rng.standard_normal(6), -2 * spread, 2 * spread))
    far = 3 if kind == "trim" else 1
    truth["buoyancy"] = 0.5 + far * rng.uniform(-1, 1)
    truth["offset"] = np.array([0, 0, 0.03]) + far * rng.uniform(-0.003, 0.003, 3) + [0, 0, 0.005 * rng.uniform(-1, 1)]
    truth["reverse"], truth["exponent"] = rng.uniform(0.77, 0.93), rng.uniform(1.5, 2.1)
    truth["lag"], truth["late"] = rng.uniform(0.06, 0.15), rng.uniform(0, 0.03)
    truth["couplings"] = np.zeros((6, 6))
    direction = rng.uniform(0, 2 * np.pi)
    unit = np.array([np.cos(direction), np.sin(direction), 0])
    truth["current"] = rng.uniform(0.03, 0.2) * unit if kind == "current" else np.zeros(3)
    truth["swell"] = (rng.uniform(0.01, 0.08), rng.uniform(2.5, 6), unit + [0, 0, 0.5]) if kind == "swell" else None
    truth["tether"] = (rng.uniform(2, 15), rng.uniform(0.2, 2) * (unit + [0, 0, 1])) if kind == "tether" else None
    truth["sag"] = rng.uniform(0.05, 0.25) if kind == "battery" else 0.0
    truth["lever"] = 0.15 * unit + [0, 0, rng.uniform(-0.1, 0.1)] if kind == "lever arm" else np.zeros(3)
    truth["bias"] = rng.uniform(0.005, 0.05, 3) * rng.choice([-1, 1], 3)
    if kind == "delay":
        truth["late"] = rng.uniform(0.05, 0.3)
    if kind == "off-diagonal":
        for i, j in ((0, 4), (1, 3), (1, 5), (2, 4)):
            share = rng.uniform(0.1, 0.4) * rng.choice([-1, 1])
            truth["couplings"][[i, j], [j, i]] = share * np.sqrt(truth["added"][i] * truth["added"][j])
    return truth


def commands_of(rng, seconds):
    """Volts of a log at 20 Hz: sums of sines by axis, and steps."""
    t = np.arange(0, seconds, 0.05)
    wanted = np.zeros((len(t), 6))
    for axis, most in ((0, 28), (1, 25), (2, 22), (5, 4)):
        for period in rng.uniform(1.2, 9, 4):
            wanted[:, axis] += most * rng.uniform(0.1, 0.4) * np.sin(2 * np.pi * t / period + rng.uniform(0, 2 * np.pi))
        wanted[:, axis] += most * np.repeat(rng.choice([-0.5, 0, 0, 0.5], len(t) // 30 + 1), 30)[:len(t)]
    each = np.concatenate([ALONG, np.cross(PLACES, ALONG)], axis=1).T
    newton = wanted[:, [0, 1, 2, 5]] @ np.linalg.pinv(each[[0, 1, 2, 5]]).T
    share = np.clip(np.abs(newton) / np.where(newton < 0, 0.85 * NEWTON, NEWTON), 0, 1)
    return t, 2.5 + np.sign(newton) * np.where(share > 0.003, 0.19 + share ** (1 / 1.6) * 2.31, 0)


def fly(truths, times, volts, seconds):
    """States of all of them at once, (steps, vehicles, 13), every STEP_S from rest at 12 m of depth."""
    def every(key):
        return np.array([truth[key] for truth in truths])

    count = len(truths)
    added = every("couplings") + np.einsum("ni,ij->nij", every("added"), np.eye(6))
    linear, quadratic = every("linear"), every("quadratic")
    off = cross_of(CENTRE)
    rigid = np.block([[MASS * np.eye(3), -MASS * off], [MASS * off, np.diag(INERTIA) - MASS * off @ off]])
    inverse = np.linalg.inv(rigid + added)
    weight = MASS * GRAVITY
    lift, buoyed = weight + every("buoyancy"), CENTRE + every("offset")
    reverse, exponent, lag, sag, current = (every(key) for key in ("reverse", "exponent", "lag", "sag", "current"))
    power = np.array([0.5 if truth["kind"] == "speed lag" else 1.0 for truth in truths])[:, None]
    tether = np.array([truth["tether"][0] if truth["tether"] else 0 for truth in truths])[:, None]
    pull = np.array([truth["tether"][1] if truth["tether"] else np.zeros(3) for truth in truths])
    swell = np.array([truth["swell"][0] * truth["swell"][2] if truth["swell"] else np.zeros(3) for truth in truths])
    often = np.array([2 * np.pi / truth["swell"][1] if truth["swell"] else 1 for truth in truths])[:, None]
    at_Q = np.array([-0.2, 0, 0.1])

    def momentum_rate(momentum, v, w):
        return np.concatenate([np.cross(w, momentum[:, :3]), np.cross(w, momentum[:, 3:]) + np.cross(v, momentum[:, :3])], axis=1)

    def rate(t, x, target):
        q, v, w, lagged = x[:, 3:7], x[:, 7:10], x[:, 10:13], x[:, 13:]
        q = q / np.linalg.norm(q, axis=1, keepdims=True)
        s, u = q[:, :1], q[:, 1:]
        cross = cross_of(u)
        turn = np.eye(3) + 2 * s[:, :, None] * cross + 2 * cross @ cross
        water = current + swell * np.sin(often * t)
        drawn = swell * often * np.cos(often * t)
        water_B, drawn_B = (np.einsum("nij,ni->nj", turn, each) for each in (water, drawn))
        relative = v - water_B
        thrust = np.sign(lagged) * np.abs(lagged) ** (1 / power) * (1 - sag[:, None] * t / seconds)
        inflow = np.einsum("nki,ki->nk", relative[:, None] + np.cross(w[:, None], PLACES), ALONG)
        thrust = thrust * np.maximum(0, 1 - INFLOW * np.maximum(0, np.sign(thrust) * inflow))
        down = -turn[:, 2]
        force = thrust @ ALONG + (weight - lift)[:, None] * down
        moment = thrust @ np.cross(PLACES, ALONG) + np.cross(CENTRE, weight * down) - np.cross(buoyed, lift[:, None] * down)
        end = np.einsum("nij,nj->ni", turn, relative + np.cross(w, at_Q))
        line = np.einsum("nij,ni->nj", turn, pull - tether * np.linalg.norm(end, axis=1, keepdims=True) * end) * (tether > 0)
        carried = DENSITY * 0.0133 * drawn_B
        total = np.concatenate([force + line + carried, moment + np.cross(at_Q, line) + np.cross(buoyed, carried)], axis=1)
        nu, nu_r = np.concatenate([v, w], axis=1), np.concatenate([relative, w], axis=1)
        total -= (linear + quadratic * np.abs(nu_r)) * nu_r + momentum_rate(nu @ rigid, v, w)
        total -= momentum_rate(np.einsum("nij,nj->ni", added, nu_r), relative, w)
        total -= np.einsum("nij,nj->ni", added[:, :, :3], np.cross(w, water_B) - drawn_B)
        spin = 0.5 * np.concatenate([-(u * w).sum(axis=1, keepdims=True), s * w + np.cross(u, w)], axis=1)
        return np.concatenate([np.einsum("nij,nj->ni", turn, v), spin, np.einsum("nij,nj->ni", inverse, total),
                               (target - lagged) / lag[:, None]], axis=1)

    x = np.zeros((count, 19))
    x[:, 2], x[:, 3] = -12, 1
    states = []
    for step in range(int(round(seconds / STEP_S))):
        states.append(x[:, :13].copy())
        t = step * STEP_S
        row = np.minimum(np.searchsorted(times, t + 1e-9, side="right") - 1, len(times) - 1)
        beyond = np.clip((np.abs(volts[:, row] - 2.5) - DEAD_BAND) / (2.5 - DEAD_BAND), 0, 1)
        newton = np.sign(volts[:, row] - 2.5) * NEWTON * beyond ** exponent[:, None] * np.where(volts[:, row] < 2.5, reverse[:, None], 1)
        target = np.sign(newton) * np.abs(newton) ** power
        a = rate(t, x, target)
        b = rate(t + STEP_S / 2, x + STEP_S / 2 * a, target)
        c = rate(t + STEP_S / 2, x + STEP_S / 2 * b, target)
        d = rate(t + STEP_S, x + STEP_S * c, target)
        x = x + STEP_S / 6 * (a + 2 * b + 2 * c + d)
        x[:, 3:7] /= np.linalg.norm(x[:, 3:7], axis=1, keepdims=True)
    return np.array(states)


def table_of(truth, times, volts, states):
    """The log: commands at 20 Hz, poses at 13 Hz or so with noise, of the point that was tracked, late."""
    rng, kind = truth["rng"], truth["kind"]
    row = np.cumsum(rng.integers(2, 5, len(states) // 2))
    row = row[row < len(states) - 1]
    q = states[row, 3:7]
    turn = np.eye(3) + 2 * q[:, :1, None] * cross_of(q[:, 1:]) + 2 * cross_of(q[:, 1:]) @ cross_of(q[:, 1:])
    place = states[row, :3] + np.einsum("nij,j->ni", turn, truth["lever"]) + NOISE_M * rng.standard_normal((len(row), 3))
    half = 0.5 * NOISE_RAD * rng.standard_normal((len(row), 3))
    seen = np.concatenate([q[:, :1] - (q[:, 1:] * half).sum(axis=1, keepdims=True),
                           q[:, 1:] + q[:, :1] * half + np.cross(q[:, 1:], half)], axis=1)
    seen /= np.linalg.norm(seen, axis=1, keepdims=True)
    stamps = row * STEP_S + truth["late"] + 1e-4
    columns = {f"vehicle_{axis}_m": place[:, i] for i, axis in enumerate("xyz")}
    columns |= {f"vehicle_q{axis}": seen[:, i] for i, axis in enumerate("wxyz")}
    if kind == "gyroscope":
        gyro = states[row, 10:13] + truth["bias"] + 0.005 * rng.standard_normal((len(row), 3))
        columns |= {f"{axis}_rate_rad_s": gyro[:, i] for i, axis in enumerate(("roll", "pitch", "yaw"))}
    sent = dict(zip(NAMES, volts.T))
    one, other = rng.choice(6, 2, replace=False)
    if kind == "exchanged":
        sent[NAMES[one]], sent[NAMES[other]] = sent[NAMES[other]], sent[NAMES[one]]
    if kind == "reversed":
        sent[NAMES[one]] = 5 - sent[NAMES[one]]
    table = {"time_s": np.union1d(times, stamps)}
    for at, group in ((times, {f"{name}_v": column for name, column in sent.items()}), (stamps, columns)):
        for name, column in group.items():
            table[name] = np.full(len(table["time_s"]), np.nan)
            table[name][np.searchsorted(table["time_s"], at)] = column
    return table


def true_values(truth):
    """By the names of `identify`."""
    values = {f"{group}.{axis}": truth[key][i] for group, key in (("added_mass", "added"), ("linear_damping", "linear"),
                                                                  ("quadratic_damping", "quadratic")) for i, axis in enumerate(AXES)}
    values |= {"trim.buoyancy": truth["buoyancy"], "trim.centre_ahead": truth["offset"][0], "trim.centre_left": truth["offset"][1],
               "trim.centre_above": truth["offset"][2], "thrust.reverse": truth["reverse"] / 0.85, "thrust.dead_band": DEAD_BAND,
               "thrust.exponent": truth["exponent"], "thrust.lag": truth["lag"], "thrust.inflow_loss": INFLOW,
               "delay.pose": truth["late"], "delay.drift": 0.0, "delay.onboard": truth["late"], "water.x": truth["current"][0],
               "water.y": truth["current"][1], "thrust.lag_power": 2.0 if truth["kind"] == "speed lag" else 1.0,
               "thrust.sag": truth["sag"], "tether.drag": truth["tether"][0] if truth["tether"] else 0.0}
    values |= {f"tether.pull_{axis}": truth["tether"][1][i] if truth["tether"] else 0.0 for i, axis in enumerate("xy")}
    values |= {f"lever.{axis}": truth["lever"][i] for i, axis in enumerate(("ahead", "left", "above"))}
    return values | {f"added_mass.{AXES[i]}_{AXES[j]}": truth["couplings"][i, j] for i, j in ((0, 4), (1, 3), (1, 5), (2, 4))}


def logs_of(kinds, seeds, seconds=60):
    """Truth and table of each kind by each seed."""
    truths = [draw(kind, seed) for kind in kinds for seed in seeds]
    sent = [commands_of(truth["rng"], seconds) for truth in truths]
    volts = np.array([each for _, each in sent])
    states = fly(truths, sent[0][0], volts, seconds)
    return [(truth, table_of(truth, sent[0][0], volts[i], states[:, i])) for i, truth in enumerate(truths)]


def judged(truth, table, scenario, **options):
    """A line on a fit: what came of it, told intervals that hold and all of them, processor seconds, why it is doubted."""
    import turbidock
    from turbidock.logs import identify

    begin = time.process_time()
    try:
        fit = identify.fit(table, scenario, workers=1, **options)
    except turbidock.ConfigError as error:
        return "refused", 0, 0, time.process_time() - begin, str(error)
    values = true_values(truth)
    values["delay.pose"] -= fit.offsets_s[0]  # which is said apart
    told = [parameter.name for parameter in fit.parameters if fit.told(parameter.name)]
    inside = [fit.interval(name)[0] <= values[name] <= fit.interval(name)[1] for name in told]
    out = ", ".join(name for name, good in zip(told, inside) if not good)
    return "doubted" if fit.doubt else "told", sum(inside), len(told), time.process_time() - begin, fit.doubt or out


# What a doubted fit should be offered.
OFFERS = {"current": {"water": "steady"}, "lever arm": {"find": ["lever_arm"]}, "off-diagonal": {"find": ["couplings"]},
          "tether": {"find": ["tether"]}, "battery": {"find": ["sag"]}}


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--kinds", nargs="+", default=list(KINDS), choices=KINDS)
    parser.add_argument("--logs", type=int, default=10)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--follow", action="store_true", help="also fit with what should be offered")
    given = parser.parse_args()
    import turbidock

    with tempfile.TemporaryDirectory() as folder:
        scenario = turbidock.Scenario("pool_active", settings={"vehicle.model": str(vehicle_files(pathlib.Path(folder)))})
        rows = []
        for kind in given.kinds:
            for seed, (truth, table) in zip(range(given.first, given.first + given.logs),
                                            logs_of([kind], range(given.first, given.first + given.logs))):
                for options in ({}, OFFERS[kind]) if given.follow and kind in OFFERS else ({},):
                    came, inside, told, took, why = judged(truth, table, scenario, **options)
                    rows.append((kind, bool(options), came, inside, told, took))
                    print(f"{kind} {seed}{' followed' if options else ''}: {came}, {inside} of {told}, {took:.0f} s: {why}", flush=True)
        print("kind,logs,refused,doubted,intervals told,that hold,processor s (median; most)")
        for kind, followed in dict.fromkeys((row[0], row[1]) for row in rows):
            mine = [row for row in rows if row[:2] == (kind, followed)]
            told = [row for row in mine if row[2] == "told"]
            print(f"{kind}{' followed' if followed else ''},{len(mine)},{sum(row[2] == 'refused' for row in mine)},"
                  f"{sum(row[2] == 'doubted' for row in mine)},{sum(row[4] for row in told)},{sum(row[3] for row in told)},"
                  f"{np.median([row[5] for row in mine]):.0f}; {max(row[5] for row in mine):.0f}")


if __name__ == "__main__":
    main()
