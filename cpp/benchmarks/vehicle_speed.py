"""Speed of a hull: one RK4 step in six degrees of freedom beside NumPy and Numba, one thread.

    OPENBLAS_NUM_THREADS=1 python cpp/benchmarks/vehicle_speed.py build/measure/cpp/benchmarks \
        [--write docs/speed_vehicle.md]

All fly the torpedo ``remus100`` with all its loads, from the same start with the same commands, and
must end at the same states. The times are the processor's, taken in turn, round by round, so that
their ratios hold when the machine's speed drifts; only the ratios travel to another machine, and
not exactly (checks.py). Exit code 1 if a bound is missed.
"""

from __future__ import annotations

import argparse
import math
import subprocess
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any, TypeAlias

import numba
import numpy as np
import numpy.typing as npt
from checks import MARGIN, Check, judge
from checks import table as ratio_table
from rich.console import Console
from rich.progress import track as progress

from auvest import vehicle

Floats: TypeAlias = npt.NDArray[Any]
#: From a start, a command, a current, a step and a number of steps to the last state.
Fly: TypeAlias = Callable[[Floats, Floats, Floats, float, int], Floats]

RUNS = 16
STEP_S = 0.05
START = np.array([0, 0, 0, 0, 0, 0, 1.5, 0, 0, 0, 0, 0, 0, 0, 15.0])
CURRENT = np.array([0.3, -0.2, 0.0])
COMMANDS = np.array([[0.01 * (run - 8), 0.017, 16.6] for run in range(RUNS)])

SCALAR = "hull_step"
LANES = ("hull_step_sse2", "hull_step_avx2", "hull_step_avx512f")
NOT_ON_THIS_PROCESSOR = 3

STEPS, PASSES = 2000, 3
STEPS_NUMPY = 20  # of one run

TARGET_NUMPY = 100.0
TARGET_NUMBA = 1.0
TARGET_LANES = 2.0

PAGE = """# Speed of a hull

Made by `make bench`. One RK4 step of the torpedo `remus100` in six degrees of freedom: added mass,
Coriolis, lift and drag, cross flow, fading linear damping, restoring, fins and propeller with their
lags, a current; one thread. NumPy: the textbook's vectors and matrices, one hull. Numba: the same
in scalars, for double and for float32, its parameters compiled in. Its mass matrix and the inverse
come at run time, as they do here; or every product with a 0 of this hull is left out of the
program ("own zeros left out"), which is then a program for this hull alone, and has no target. The
lanes are as many runs at once as a register holds, one program per instruction set
(cpp/benchmarks/hull_step.cpp, chosen when it is compiled), and have the bits of the scalar program
in float. The times are the processor's, medians of rounds in which all take their turn; only the
ratios travel to another machine.

| hull | ns per step and run |
| --- | ---: |
{times}

Ratios, of the times of the same round. The targets are for the machine that these numbers are
from; `make bench` fails {margin} beyond them.

{ratios}
"""


# ---- The peers -----------------------------------------------------------------------------------


def fly_numpy(x: Floats, command: Floats, current: Floats, h: float, steps: int) -> Floats:
    """Fly the hull in plain NumPy."""
    p = vehicle.parameters("remus100")
    body, added, damping = p["body"], p["added_mass"], p["linear_damping"]
    foil, flow, screw = p["lift_drag"], p["cross_flow"], p["propeller"]
    density = p["density_kg_m3"]

    def cross_matrix(a: Floats) -> Floats:
        return np.array([[0, -a[2], a[1]], [a[2], 0, -a[0]], [-a[1], a[0], 0]])

    mass = body["mass_kg"]
    arm = cross_matrix(np.array([body["xg_m"], body["yg_m"], body["zg_m"]]))
    inertia = np.diag([body["ixx_kg_m2"], body["iyy_kg_m2"], body["izz_kg_m2"]])
    rigid = np.block([[mass * np.eye(3), -mass * arm], [mass * arm, inertia - mass * arm @ arm]])
    names = ("surge_kg", "sway_kg", "heave_kg", "roll_kg_m2", "pitch_kg_m2", "yaw_kg_m2")
    a = np.array([added[name] for name in names])
    inverse = np.linalg.inv(rigid + np.diag(a))
    linear = np.array([value for name, value in damping.items() if name != "fading_s_m"])
    half = 0.5 * density * foil["area_m2"]
    induced = foil["lift_slope"] ** 2 / (np.pi * foil["oswald"] * foil["aspect_ratio"])
    length = flow["length_m"]
    drag = 0.5 * density * flow["diameter_m"] * flow["drag"]
    weight = p["restoring"]["weight_n"]
    centre = np.array([body["xg_m"], body["yg_m"], body["zg_m"]])
    diameter = screw["diameter_m"]
    low = np.array([p["rudder"]["servo"]["low"], p["stern_planes"]["servo"]["low"]])
    low = np.append(low, screw["shaft"]["low"])
    lags = np.array([p["rudder"]["servo"]["time_constant_s"], 0.0, 0.0])
    lags[1] = p["stern_planes"]["servo"]["time_constant_s"]
    lags[2] = screw["shaft"]["time_constant_s"]

    def across(v: float, r: float) -> tuple[float, float]:
        if abs(v) >= abs(r) * length / 2:
            force = np.sign(v) * (v * v * length + r * r * length**3 / 12)
            return force, abs(v) * r * length**3 / 6
        force = 2 / 3 * v**3 / abs(r) + v * abs(r) * length**2 / 2
        quartic = r * r * length**4 / 32 + v * v * length**2 / 4 - v**4 / (6 * r * r)
        return force, np.sign(r) * quartic

    def rate(state: Floats, demand: Floats) -> Floats:
        phi, theta, psi = state[3:6]
        nu, actuators = state[6:12], state[12:]
        sf, cf, st, ct = np.sin(phi), np.cos(phi), np.sin(theta), np.cos(theta)
        sy, cy = np.sin(psi), np.cos(psi)
        rotation = np.array(
            [
                [cy * ct, -sy * cf + cy * st * sf, sy * sf + cy * cf * st],
                [sy * ct, cy * cf + sf * st * sy, -cy * sf + st * sy * cf],
                [-st, ct * sf, ct * cf],
            ]
        )
        angles = np.array([[1, sf * st / ct, cf * st / ct], [0, cf, -sf], [0, sf / ct, cf / ct]])
        u, v, w, roll, q, r = nu
        momentum = rigid @ nu
        coriolis = np.concatenate(
            [
                -np.cross(momentum[:3], nu[3:]),
                -np.cross(momentum[:3], nu[:3]) - np.cross(momentum[3:], nu[3:]),
            ]
        )
        pitch, yaw = (a[3] - a[5]) * roll * r, (a[4] - a[3]) * roll * q
        coriolis += np.array([0, -a[2] * w * roll, a[1] * v * roll, 0, pitch, yaw])
        speed = np.sqrt(nu[:3] @ nu[:3])
        tau = -linear * nu
        tau[:3] *= np.exp(-damping["fading_s_m"] * speed)
        cosine = u / max(speed, 1e-6)
        square = (v * v + w * w) / max(speed, 1e-6) ** 2
        resistance = half * (foil["drag"] + induced * square * cosine**2) * speed
        lift = half * foil["lift_slope"] * cosine
        tau[:3] += lift * np.array([v * v + w * w, -u * v, -u * w]) - resistance * nu[:3]
        force, moment = across(v, r)
        tau[[1, 5]] -= drag * np.array([force, moment])
        force, moment = across(w, -q)
        tau[[2, 4]] += drag * np.array([-force, moment])
        for fin, angle, row in (("rudder", actuators[0], 1), ("stern_planes", actuators[1], 2)):
            f = p[fin]
            slope = 0.5 * density * u * abs(u) * f["area_m2"] * f["lift_slope"]
            tau[0] -= abs(slope) * angle**2
            tau[row] -= slope * angle
            tau[6 - row] += (1 if row == 1 else -1) * f["x_m"] * -slope * angle
        n = actuators[2]
        advance = screw["wake"] * u if n > 0 and u > 0 else 0.0
        ratio = advance / diameter / screw["advance_1"]
        thrust = screw["thrust_0"] * n * abs(n)
        thrust += (screw["thrust_1"] - screw["thrust_0"]) * ratio * abs(n)
        torque = screw["torque_0"] * n * abs(n)
        torque += (screw["torque_1"] - screw["torque_0"]) * ratio * abs(n)
        tau[0] += screw["thrust_deduction"] * density * diameter**4 * thrust
        tau[3] += screw["roll_torque"] * density * diameter**5 * torque
        tau[3:] += weight * np.cross(centre, rotation[2])
        return np.concatenate(
            [
                rotation @ nu[:3] + current,
                angles @ nu[3:],
                inverse @ (tau - coriolis),
                (demand - actuators) / lags,
            ]
        )

    demand = np.clip(command, low, -low)
    for _ in range(steps):
        k1 = rate(x, demand)
        k2 = rate(x + h / 2 * k1, demand)
        k3 = rate(x + h / 2 * k2, demand)
        k4 = rate(x + h * k3, demand)
        x = x + h / 6 * (k1 + 2 * k2 + 2 * k3 + k4)
        x[12:] = np.clip(x[12:], low, -low)
    return x


def compiled(kind: type, *, own_zeros: bool) -> Fly:
    """Compile the hull in scalars by Numba, for float32 or float64.

    With `own_zeros` every product of a coefficient that is 0 in this hull is left out of the
    program; without, it takes the mass matrix and its inverse as they come, as auvest does.
    """
    p = vehicle.parameters("remus100")
    body, added, damping = p["body"], p["added_mass"], p["linear_damping"]
    foil, flow, screw = p["lift_drag"], p["cross_flow"], p["propeller"]
    density = p["density_kg_m3"]
    rudder, planes = p["rudder"], p["stern_planes"]
    m, zg = body["mass_kg"], body["zg_m"]
    ix, iy = body["ixx_kg_m2"] + m * zg * zg, body["iyy_kg_m2"] + m * zg * zg
    iz = body["izz_kg_m2"]
    a = [added[name] for name in ("surge_kg", "sway_kg", "heave_kg")]
    a += [added[name] for name in ("roll_kg_m2", "pitch_kg_m2", "yaw_kg_m2")]
    M = np.diag([m + a[0], m + a[1], m + a[2], ix + a[3], iy + a[4], iz + a[5]])
    M[0, 4] = M[4, 0] = m * zg
    M[1, 3] = M[3, 1] = -m * zg
    rigid = (M - np.diag(a)).astype(kind)
    inverse = np.linalg.inv(M)
    half_area = 0.5 * density * foil["area_m2"]
    drag_0 = half_area * foil["drag"]
    lift_1 = half_area * foil["lift_slope"]
    drag_2 = lift_1 * foil["lift_slope"] / (np.pi * foil["oswald"] * foil["aspect_ratio"])
    d = screw["diameter_m"]
    step = (screw["thrust_1"] - screw["thrust_0"]) / screw["advance_1"]
    twist = (screw["torque_1"] - screw["torque_0"]) / screw["advance_1"]
    zero, one, two, half, third, six = (kind(v) for v in (0, 1, 2, 0.5, 1 / 3, 6))
    eighth, quarter, part_24, tiny = (kind(v) for v in (1 / 8, 1 / 4, 1 / 24, 1e-6))
    mass, mzg, jx, jy, jz = (kind(v) for v in (m, m * zg, ix, iy, iz))
    heave_added, sway_added = kind(a[2]), kind(a[1])
    pitch_pair, yaw_pair = kind(a[3] - a[5]), kind(a[4] - a[3])
    i00, i04, i11, i13 = (kind(inverse[i]) for i in ((0, 0), (0, 4), (1, 1), (1, 3)))
    i22, i33, i44, i55 = (kind(inverse[i]) for i in ((2, 2), (3, 3), (4, 4), (5, 5)))
    d0, d1, d2, d3, d4, d5, fading = (kind(v) for v in damping.values())
    c_drag, c_lift, c_induced = kind(drag_0), kind(lift_1), kind(drag_2)
    length = kind(flow["length_m"])
    half_length, square_length = kind(length / 2), kind(flow["length_m"] ** 2)
    slab = kind(0.5 * density * flow["diameter_m"] * flow["drag"])
    slope_r = kind(0.5 * density * rudder["area_m2"] * rudder["lift_slope"])
    slope_s = kind(0.5 * density * planes["area_m2"] * planes["lift_slope"])
    x_r, x_s = kind(rudder["x_m"]), kind(planes["x_m"])
    wake = kind(screw["wake"])
    push = screw["thrust_deduction"] * density
    roll = screw["roll_torque"] * density
    push_n, push_v = kind(push * d**4 * screw["thrust_0"]), kind(push * d**3 * step)
    roll_n, roll_v = kind(roll * d**5 * screw["torque_0"]), kind(roll * d**4 * twist)
    righting = kind(zg * p["restoring"]["weight_n"])
    lag_r, lag_s = (kind(f["servo"]["time_constant_s"]) for f in (rudder, planes))
    lag_n = kind(screw["shaft"]["time_constant_s"])
    top_r, top_s = (kind(f["servo"]["high"]) for f in (rudder, planes))
    top_n = kind(screw["shaft"]["high"])
    compile_it = numba.njit(error_model="numpy", inline="always")

    @compile_it
    def across(v, r):  # type: ignore[no-untyped-def]
        a = abs(v)
        b = abs(r) * half_length
        if a < b:
            q = a / b
            qq = q * q
            force = length * a * b * (one + qq * third)
            moment = square_length * b * b * (eighth + qq * (quarter - qq * part_24))
        else:
            force = length * (a * a + b * b * third)
            moment = square_length * a * b * third
        return math.copysign(force, v), math.copysign(moment, r)

    @compile_it
    def rate(x, demand, current, dx, rigid, inverse, row):  # type: ignore[no-untyped-def]
        sf, cf = math.sin(x[3]), math.cos(x[3])
        st, ct = math.sin(x[4]), math.cos(x[4])
        sy, cy = math.sin(x[5]), math.cos(x[5])
        u, v, w, p, q, r = x[6], x[7], x[8], x[9], x[10], x[11]
        y = cf * v - sf * w
        z = sf * v + cf * w
        ahead = ct * u + st * z
        dx[0] = cy * ahead - sy * y + current[0]
        dx[1] = sy * ahead + cy * y + current[1]
        dx[2] = ct * z - st * u + current[2]
        turn = (sf * q + cf * r) / ct
        dx[3] = p + st * turn
        dx[4] = cf * q - sf * r
        dx[5] = turn

        cross_square = v * v + w * w
        speed = math.sqrt(u * u + cross_square)
        faded = math.exp(-fading * speed)
        inverse_speed = one / max(speed, tiny)
        cosine = u * inverse_speed
        sine_square = cross_square * inverse_speed * inverse_speed
        drag = speed * (c_drag + c_induced * sine_square * (cosine * cosine))
        lift = c_lift * cosine
        side = -(drag + lift * u)
        slope_1 = slope_r * u * abs(u)
        slope_2 = slope_s * u * abs(u)
        force_1, moment_1 = across(v, r)
        force_2, moment_2 = across(w, -q)
        n = abs(x[14])
        advance = wake * u if x[14] > zero and u > zero else zero
        fin_1 = slope_1 * x[12]
        fin_2 = slope_2 * x[13]
        X = lift * cross_square - drag * u - d0 * faded * u
        X += n * (push_n * x[14] + push_v * advance) - abs(fin_1 * x[12]) - abs(fin_2 * x[13])
        Y = (side - d1 * faded) * v - slab * force_1 - fin_1
        Z = (side - d2 * faded) * w - slab * force_2 - fin_2
        K = n * (roll_n * x[14] + roll_v * advance) - d3 * p - righting * ct * sf
        M = slab * moment_2 - d4 * q + x_s * fin_2 - righting * st
        N = -slab * moment_1 - d5 * r - x_r * fin_1
        # The rigid body's momenta, and what is left of the added mass's.
        if own_zeros:
            P0 = mass * u + mzg * q
            P1 = mass * v - mzg * p
            P2 = mass * w
            H0 = jx * p - mzg * v
            H1 = jy * q + mzg * u
            H2 = jz * r
        else:
            for i in range(6):
                row[i] = zero
                for j in range(6):
                    row[i] += rigid[i, j] * x[6 + j]
            P0, P1, P2, H0, H1, H2 = row[0], row[1], row[2], row[3], row[4], row[5]
        X += P1 * r - P2 * q
        Y += P2 * p - P0 * r + heave_added * w * p
        Z += P0 * q - P1 * p - sway_added * v * p
        K += P1 * w - P2 * v + H1 * r - H2 * q
        M += P2 * u - P0 * w + H2 * p - H0 * r - pitch_pair * p * r
        N += P0 * v - P1 * u + H0 * q - H1 * p - yaw_pair * p * q
        if own_zeros:
            dx[6] = i00 * X + i04 * M
            dx[7] = i11 * Y + i13 * K
            dx[8] = i22 * Z
            dx[9] = i13 * Y + i33 * K
            dx[10] = i04 * X + i44 * M
            dx[11] = i55 * N
        else:
            row[0], row[1], row[2], row[3], row[4], row[5] = X, Y, Z, K, M, N
            for i in range(6):
                dx[6 + i] = zero
                for j in range(6):
                    dx[6 + i] += inverse[i, j] * row[j]
        dx[12] = (demand[0] - x[12]) / lag_r
        dx[13] = (demand[1] - x[13]) / lag_s
        dx[14] = (demand[2] - x[14]) / lag_n

    @numba.njit(error_model="numpy")
    def fly(x0, command, current, h, steps, rigid, inverse):  # type: ignore[no-untyped-def]
        x = x0.copy()
        demand = np.empty(3, x.dtype)
        row = np.empty(6, x.dtype)
        slope = np.empty(15, x.dtype)
        total = np.empty(15, x.dtype)
        stage = np.empty(15, x.dtype)
        demand[0] = min(max(command[0], -top_r), top_r)
        demand[1] = min(max(command[1], -top_s), top_s)
        demand[2] = min(max(command[2], -top_n), top_n)
        for _ in range(steps):
            rate(x, demand, current, slope, rigid, inverse, row)
            for i in range(15):
                total[i] = slope[i]
                stage[i] = x[i] + half * h * slope[i]
            rate(stage, demand, current, slope, rigid, inverse, row)
            for i in range(15):
                total[i] += two * slope[i]
                stage[i] = x[i] + half * h * slope[i]
            rate(stage, demand, current, slope, rigid, inverse, row)
            for i in range(15):
                total[i] += two * slope[i]
                stage[i] = x[i] + h * slope[i]
            rate(stage, demand, current, slope, rigid, inverse, row)
            for i in range(15):
                x[i] += h / six * (total[i] + slope[i])
            x[12] = min(max(x[12], -top_r), top_r)
            x[13] = min(max(x[13], -top_s), top_s)
            x[14] = min(max(x[14], -top_n), top_n)
        return x

    def typed(x0: Floats, command: Floats, current: Floats, h: float, steps: int) -> Floats:
        arrays = (np.asarray(array, kind) for array in (x0, command, current))
        result: Floats = fly(*arrays, kind(h), steps, rigid, inverse.astype(kind))
        return result

    return typed


# ---- Measure -------------------------------------------------------------------------------------


def nanoseconds(fly: Fly, runs: int, steps: int) -> float:
    """Return the processor's time per run and step of the fastest pass."""
    times = []
    for _ in range(PASSES):
        start = time.process_time()
        for command in COMMANDS[:runs]:
            fly(START, command, CURRENT, STEP_S, steps)
        times.append(time.process_time() - start)
    return min(times) * 1e9 / (runs * steps)


def program(path: Path, precision: str, steps: int) -> tuple[float, Floats] | None:
    """Return time and last states of a program; None where the processor has no such lanes."""
    command = [str(path), precision, str(steps), str(PASSES)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    if done.returncode == NOT_ON_THIS_PROCESSOR:
        return None
    done.check_returncode()
    head, *rows = done.stdout.splitlines()
    return float(head), np.array([list(map(float, row.split())) for row in rows])


def agree(folder: Path, lanes: list[str], peers: dict[str, Fly]) -> str | None:
    """Say who does not end where the others do: after 200 steps, to rounding; None if all do."""
    steps = 200
    found = program(folder / SCALAR, "double", steps)
    single = program(folder / SCALAR, "float", steps)
    if found is None or single is None:
        raise RuntimeError(f"{SCALAR} has no double")
    states = found[1]
    if not np.allclose(single[1], states, rtol=1e-4, atol=1e-4):
        return "float"
    for name in lanes:
        other = program(folder / name, "lanes", steps)
        if other is None or not np.array_equal(other[1], single[1]):
            return name
    for name, fly in peers.items():
        tolerance = 1e-4 if "float32" in name else 1e-7
        ends = np.stack([fly(START, c, CURRENT, STEP_S, steps) for c in COMMANDS])
        if not np.allclose(ends, states, rtol=tolerance, atol=tolerance):
            return name
    return None


def main() -> int:
    """Measure, print, and compare with the bounds."""
    assert __doc__ is not None
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("programs", type=Path, help="the folder of the compiled hull_step")
    parser.add_argument("--rounds", type=int, default=9, help="rounds of timing (default 9)")
    parser.add_argument("--write", type=Path, help="write the page to this file")
    arguments = parser.parse_args()
    folder = arguments.programs
    built = [name for name in LANES if (folder / name).exists()]
    lanes = [name for name in built if program(folder / name, "lanes", 1) is not None]
    peers: dict[str, Fly] = {
        "NumPy": fly_numpy,
        "Numba, double": compiled(np.float64, own_zeros=False),
        "Numba, float32": compiled(np.float32, own_zeros=False),
        "Numba, double, own zeros left out": compiled(np.float64, own_zeros=True),
        "Numba, float32, own zeros left out": compiled(np.float32, own_zeros=True),
    }
    odd_one = agree(folder, lanes, peers)
    if odd_one is not None:
        print(f"{odd_one} does not end where the others do", file=sys.stderr)
        return 1

    ours = {"auvest, double": (SCALAR, "double"), "auvest, float32": (SCALAR, "float")}
    ours.update({f"auvest, float32, lanes of {n[10:]}": (n, "lanes") for n in lanes})
    times: dict[str, list[float]] = {name: [] for name in (*ours, *peers)}
    for _ in progress(range(arguments.rounds), "timing", console=Console(stderr=True)):
        for name, (file, precision) in ours.items():
            measured = program(folder / file, precision, STEPS)
            assert measured is not None
            times[name].append(measured[0])
        for name, fly in peers.items():
            few = name == "NumPy"
            times[name].append(nanoseconds(fly, 1 if few else RUNS, STEPS_NUMPY if few else STEPS))

    def ratio(above: str, below: str) -> float:
        return float(np.median(np.array(times[above]) / np.array(times[below])))

    widest = f"auvest, float32, lanes of {lanes[-1][10:]}" if lanes else "auvest, float32"
    checks = [
        Check("NumPy / auvest, double", ratio("NumPy", "auvest, double"), target=TARGET_NUMPY),
        Check(
            "Numba, double / auvest, double",
            ratio("Numba, double", "auvest, double"),
            target=TARGET_NUMBA,
        ),
        Check(
            "Numba, float32 / auvest, float32",
            ratio("Numba, float32", "auvest, float32"),
            target=TARGET_NUMBA,
        ),
        Check(
            "Numba, double, own zeros left out / auvest, double",
            ratio("Numba, double, own zeros left out", "auvest, double"),
        ),
        Check(
            "Numba, float32, own zeros left out / lanes",
            ratio("Numba, float32, own zeros left out", widest),
        ),
        Check("auvest, float32 / its lanes", ratio("auvest, float32", widest), target=TARGET_LANES),
    ]
    text = PAGE.format(
        times="\n".join(f"| {name} | {np.median(found):,.3g} |" for name, found in times.items()),
        margin=f"{MARGIN:.0%}".replace("%", " %"),
        ratios=ratio_table(checks),
    )
    print(text)
    if arguments.write:
        arguments.write.write_text(text, encoding="utf-8")
    return judge(checks)


if __name__ == "__main__":
    sys.exit(main())
