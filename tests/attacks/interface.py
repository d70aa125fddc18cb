"""Random calls on the Python interface: filters, SLAT, models, kernels, policies, hulls, the pilot.

    python -m tests.attacks.interface --calls 500000 --seed 1

Whatever is called with whatever: the answer, or an exception that is documented. A call that was
refused has changed nothing. After one that was not, all numbers are finite and P is a covariance.
"""

from __future__ import annotations

import copy
import inspect
import math
import pickle
import random
import warnings
from collections import Counter
from typing import Any, ClassVar

import numpy as np

import auvest
from auvest import _core, _state
from auvest.models import SENSORS
from auvest.registry import FILTERS
from auvest.slat._base import Steps
from auvest.vehicle import NAMES, Hull
from tests.attacks.frame import Case, Failed, main
from tests.attacks.values import Values
from tests.python.family_support import BUILT_IN, glider, turner

FUNCTIONS = {"glider()": glider(), "turner()": turner()}
KERNELS = (auvest.Igg, auvest.Huber, auvest.Hampel, auvest.Unit)
POLICIES = (auvest.FixedInterval, auvest.MahalanobisInterval, auvest.CovarianceBudget)
MASTERS = (auvest.PiecewiseAcceleration, auvest.Imm)
MOTIONS = (auvest.CompassMotion, auvest.UnicycleMotion)
PILOT = (
    "period_s", "speed_m_s", "depth_m", "end_m", "hold_s", "compass_s", "lost_m", "switch_m",
    "lookahead_m", "station_x_m", "station_y_m", "sigma_range_m", "sigma_bearing_rad",
)  # fmt: skip

#: What the interface says that it raises.
DOCUMENTED = (ValueError, TypeError, auvest.FilterError)


def spread(size: int, scale: float, seed: int) -> np.ndarray:
    """A covariance with correlations."""
    root = np.random.default_rng(seed).normal(size=(size, size))
    return scale * (root @ root.T + 1e-3 * np.eye(size))


NAMES_IN_CASES: dict[str, Any] = {
    **{name: getattr(auvest, name) for name in auvest.__all__},
    "Hull": Hull,
    "Pilot": _core.Pilot_float32,
    "np": np,
    "nan": math.nan,
    "inf": math.inf,
    "spread": spread,
    "glider": glider,
    "turner": turner,
    "copy": copy,
    "pickle": pickle,
}


class Calls:
    """Writes cases: an object and calls on it."""

    def __init__(self, rng: random.Random) -> None:
        self.rng, self.v = rng, Values(rng)

    def case(self) -> Case:
        kinds = (self.gaussian, self.gaussian, self.slat, self.hull, self.pilot, self.models)
        subject, calls = self.rng.choice(kinds)()
        return Case(subject, tuple(calls))

    def repeated(self, one: Any, most: int = 25) -> list[str]:
        return [one() for _ in range(self.rng.randrange(1, most))]

    # ---- Gaussian filters.

    def process(self) -> tuple[str, auvest.ProcessModel]:
        if self.rng.random() < 0.1:
            text = self.rng.choice(list(FUNCTIONS))
            return text, FUNCTIONS[text]
        process = self.rng.choice(list(BUILT_IN.values()))
        fixed = {name: repr(getattr(process, name)) for name in process.structural}
        return self.v.made(type(process), fixed), process

    def sensor(self) -> str:
        return self.v.made(self.rng.choice(list(SENSORS.values())))

    def kernel(self) -> str:
        if self.rng.random() < 0.5:
            return repr(self.rng.choice(("igg", "huber", "hampel", "unit")))
        return self.v.made(self.rng.choice(KERNELS))

    def policy(self) -> str:
        return self.v.made(self.rng.choice(POLICIES))

    def gaussian(self) -> tuple[str, list[str]]:
        v, rng = self.v, self.rng
        entry = rng.choice([e for e in FILTERS.values() if e.family == "gaussian"])
        text, process = self.process()
        n, inputs = len(process.state), len(process.input)
        sensors = [name for name in SENSORS if suits(name, process)]
        given = [v.made(SENSORS[rng.choice(sensors)]) for _ in range(rng.randrange(1, 3))]
        scale = rng.choice((1.0, 10.0, 100.0))
        options = {
            "process": text,
            "sensors": given[0] if len(given) == 1 else f"[{', '.join(given)}]",
        }
        optional = {
            "kernel": self.kernel,
            "recovery": lambda: v.made(auvest.RejectionStreak),
            "policy": self.policy,
            "late_s": lambda: v.positive(5),
            "residual": lambda: repr(rng.choice(("innovation", "post-fit"))),
            "max_iterations": lambda: str(rng.randrange(1, 12)),
            "tolerance": lambda: v.positive(0.1),
            "components": lambda: rng.choice(("1", "8", "16", v.number(20))),
            "headings": lambda: rng.choice(("1", "1", "2", v.number(3))),
            "dtype": v.dtype,
        }
        if "Ukf" in entry.cls or "ukf" in entry.cls:
            optional["alpha"] = lambda: rng.choice(("1e-6", "1e-3", "1.0", v.positive(1)))
            optional["kappa"] = lambda: rng.choice(("0", "-1", v.number(8)))
        for name, make in optional.items():
            if rng.random() < (0.9 if name == "dtype" else 0.3):
                options[name] = make()
        if text in FUNCTIONS:
            options["dtype"] = "'float64'"
        arguments = ", ".join(f"{name}={value}" for name, value in options.items())
        subject = f"f = {entry.cls}({v.vector(n, scale)}, {v.covariance(n)}, {arguments})"
        return subject, self.repeated(lambda: self.gaussian_call(inputs, sensors))

    def gaussian_call(self, inputs: int, sensors: list[str]) -> str:
        v, rng = self.v, self.rng

        def driven(rows: int | None = None) -> str:
            if inputs == 0 and not v.is_odd():
                return ""
            size = inputs or 2
            return v.vector(size, 2) if rows is None else v.rows(rows, size, 2)

        def predict() -> str:
            dt = rng.choice((v.positive(3), v.positive(3), v.positive(5000), "None"))
            given = driven()
            return f"f.predict({dt}{', ' + given if given else ''})"

        def update() -> str:
            name = rng.choice(sensors)
            size = len(SENSORS[name]().measures)
            z = v.vector(size, rng.choice((3.0, 60.0))) if rng.random() < 0.9 else "None"
            sensor = f"'{name}'" if rng.random() < 0.5 else v.made(SENSORS[name])
            more = f", place={v.vector(2, 50)}" if rng.random() < 0.2 else ""
            more += f", age_s={v.positive(3)}" if rng.random() < 0.2 else ""
            return f"f.update({z}, {sensor}{more})"

        def record() -> str:
            rows = rng.choice((1, 2, 5))
            name = rng.choice(sensors)
            z = v.rows(rows, len(SENSORS[name]().measures), 60)
            given = driven(rows)
            more = f", input={given}" if given else ""
            more += f", age_s={v.positive(2)}" if rng.random() < 0.1 else ""
            more += f", place={v.rows(rows, 2, 50)}" if rng.random() < 0.1 else ""
            return f"f.run({z}, dt={v.positive(2)}, sensor={v.made(SENSORS[name])}{more})"

        def feedback() -> str:
            return f"f.feedback({v.vector(2, 50) if rng.random() < 0.7 else ''})"

        kind = rng.randrange(12)
        if kind <= 3:
            return predict()
        if kind <= 7:
            return update()
        if kind == 8:
            return record()
        return feedback() if kind == 9 else kept(rng)

    # ---- SLAT.

    def sonar(self) -> str:
        return self.v.made(auvest.Sonar)

    def slat(self) -> tuple[str, list[str]]:
        v, rng = self.v, self.rng
        entry = rng.choice([e for e in FILTERS.values() if e.family == "slat"])
        motion = rng.choice(MOTIONS)
        n = motion.pose_states
        options = {"motion": v.made(motion), "dtype": v.dtype()}
        if entry.cls != "DeadReckoning":
            options["sonar"] = self.sonar()
            options["gate"] = rng.choice(("0", "16", v.positive(20)))
        if entry.cls.startswith("Slatf"):
            options["particles"] = rng.choice(("1", "7", "16", "33", v.number(20)))
            options["resampling"] = repr(
                rng.choice(("systematic", "stratified", "residual", "multinomial"))
            )
            options["resample_below"] = v.positive(1)
            options["seed"] = rng.choice(("1", "2**64 - 1", v.number(5)))
        if entry.name.startswith("slatf") and entry.cls == "Slatf":
            options["version"] = entry.name[-1]
            options["carry_covariance"] = str(rng.random() < 0.5)
            options["birth_velocity_m_s"] = rng.choice(("0", "1", v.positive(3)))
        if entry.cls in ("Slatf", "EkfSlat"):
            options["master"] = v.made(rng.choice(MASTERS))
        if entry.cls == "SlatfJoint":
            options["kept"] = v.positive(1)
            options["max_masters"] = rng.choice(("1", "2"))
            if "covariance" in inspect.signature(auvest.SlatfJoint).parameters:
                options["covariance"] = rng.choice(("'shared'", "'particle'"))
        arguments = ", ".join(f"{name}={value}" for name, value in options.items())
        made = f"{entry.cls}({v.vector(n, 20)}, {v.covariance(n)}, {arguments})"
        calls = self.repeated(lambda: self.slat_call(n))
        if rng.random() < 0.15:
            masters = f"[({v.vector(6)}, {v.covariance(6)})]" if rng.random() < 0.7 else "[]"
            made = f"Outage({made})"
            calls = [f"f.share({v.vector(n, 20)}, {v.covariance(n)}, {masters})", *calls]
        elif rng.random() < 0.9:
            calls = [f"f.add_master([100, 50, 1, 1, 0, 0], {v.covariance(6)})", *calls]
        return f"f = {made}", calls

    def slat_call(self, n: int) -> str:
        v, rng = self.v, self.rng
        kind = rng.randrange(12)
        u = v.vector(2, 3)
        z = v.array([v.plain(0, 300), v.plain(-3.2, 3.2)])
        master = rng.choice(("None", "None", "0", "-1", "1", v.any_object()))
        if kind <= 2:
            changes = f", changes={v.rows(1, 2)}" if rng.random() < 0.2 else ""
            return f"f.predict({v.positive(3)}, {u}{changes})"
        if kind <= 6:
            z = z if rng.random() < 0.8 else v.rows(2, 2, 200)
            sonar = f", sonar={self.sonar()}" if rng.random() < 0.3 else ""
            return f"f.update({z}, {master}{sonar})"
        if kind == 7:
            return f"f.step({v.positive(3)}, {u}, {z}, {master})"
        if kind == 8:
            return f"f.add_master({v.vector(6, 100)}, {v.covariance(6)})"
        if kind == 9:
            times = f"[0, {v.plain(0, 2)}, {v.plain(2, 4)}]"
            return f"f.run({times}, {v.rows(2, 2, 3)}, z=[{z}], z_time_s=[{v.positive(3)}])"
        if kind == 10 and rng.random() < 0.3:
            return f"f.share({v.vector(n, 20)}, {v.covariance(n)})"
        return kept(rng)

    # ---- Vehicles.

    def hull(self) -> tuple[str, list[str]]:
        v, rng = self.v, self.rng
        name = rng.choice(NAMES)
        size = 3 if name == "remus100" else 8
        path: list[str] = []
        inner: Any = _core.vehicle_parameters(name)
        while isinstance(inner, dict) and inner:
            path.append(rng.choice(list(inner)))
            inner = inner[path[-1]]
        changes = ""
        if rng.random() < 0.5:
            opened = "".join(f"{{'{key}': " for key in path)
            changes = f", changes={opened}{v.number(3)}{'}' * len(path)}"
        freedom = rng.choice((6, 6, 5, 4, 3))
        subject = f"f = Hull('{name}', degrees_of_freedom={freedom}, dtype={v.dtype()}{changes})"

        def call() -> str:
            commands = v.rows(rng.choice((1, 3, 20)), size, rng.choice((0.3, 30.0)))
            start = f", pose={v.vector(6, 1)}" if rng.random() < 0.5 else ""
            start += f", velocity={v.vector(6, 2)}" if rng.random() < 0.5 else ""
            method = f", method={rng.choice(('rk4', 'semi-implicit', 'rk4'))!r}"
            if rng.random() < 0.3:
                return f"f.largest_stable_step({v.vector(size, 1)}{method})"
            return f"f.run({commands}, {v.positive(0.1)}{start}{method})"

        return subject, self.repeated(call, 5)

    def pilot(self) -> tuple[str, list[str]]:
        v, rng = self.v, self.rng

        def single(items: list[str], shape: str) -> str:
            return f"np.array([{', '.join(items)}], 'f4').reshape({shape})"

        def plain_or_odd(low: float, high: float) -> str:
            return v.choice(("nan", "inf", "1e30", "-1e9")) if v.is_odd() else v.plain(low, high)

        corners = [plain_or_odd(-100, 100) for _ in range(2 * rng.randrange(0, 7))]
        settings = {name: plain_or_odd(0, 20) for name in rng.sample(PILOT, rng.randrange(0, 4))}
        texts = ", ".join(f"'{name}': {value}" for name, value in settings.items())
        subject = f"f = Pilot({single(corners, '-1, 2')}, {{{texts}}}, {plain_or_odd(0.1, 5)})"

        def call() -> str:
            kind = rng.randrange(8)
            if kind <= 2:
                values = [plain_or_odd(-1.5, 1.5) for _ in range(7)]
                heard = rng.choice((15, 15, 15, 0, rng.randrange(256)))
                return f"f.predict({single(values, '7')}, {heard}, {plain_or_odd(0, 0.5)})"
            if kind <= 4:
                return (
                    f"f.update({plain_or_odd(0, 150)}, {plain_or_odd(-4, 4)}, {plain_or_odd(0, 1)})"
                )
            if kind <= 6:
                return "f.steer()"
            return "f.asked() if f.wants_fix() else None"

        start = f"f.start({plain_or_odd(-20, 20)}, {plain_or_odd(-20, 20)}, {plain_or_odd(-4, 4)})"
        return subject, [start, *self.repeated(call, 40)]

    # ---- Models, kernels and policies by themselves.

    def models(self) -> tuple[str, list[str]]:
        v, rng = self.v, self.rng
        kind = rng.randrange(4)
        if kind == 0:
            text, process = self.process()
            n, inputs = len(process.state), len(process.input)
            driven = f", {v.vector(inputs, 2)}" if inputs else ""
            return f"f = {text}", self.repeated(
                lambda: rng.choice(
                    (
                        f"f.f({v.vector(n, 50)}, {v.positive(5)}{driven})",
                        f"f.Phi({v.positive(5)}, {v.vector(n, 50)}{driven})",
                        f"f.Q({v.positive(5)}{driven})",
                    )
                ),
                6,
            )
        if kind == 1:
            return f"f = {self.sensor()}", self.repeated(
                lambda: f"f.h({v.vector(rng.choice((2, 3, 4, 6)), 50)})", 6
            )
        if kind == 2:
            made = v.made(rng.choice(KERNELS))
            return f"f = {made}", self.repeated(
                lambda: f"f.{rng.choice(('weight', 'rho'))}({v.vector(4, 6)})", 6
            )
        cls = rng.choice((*POLICIES, *MASTERS, *MOTIONS, auvest.Sonar, auvest.RejectionStreak))
        return f"f = {v.made(cls)}", ["repr(f)", "copy.deepcopy(f)", "pickle.dumps(f)"]


def suits(name: str, process: auvest.ProcessModel) -> bool:
    try:
        SENSORS[name]().check_process(process)
    except ValueError:
        return False
    return True


#: Calls that leave the object as it was, and are never refused.
KEEPING = (
    "f.restore(f.save())",
    "f = pickle.loads(pickle.dumps(f))",
    "f = copy.deepcopy(f)",
    "repr(f)",
)


def kept(rng: random.Random) -> str:
    return rng.choice(KEEPING)


# ---- What must hold.


def state_of(f: Any) -> Any:
    """All that goes on from call to call, to be compared; None where nothing does."""
    if isinstance(f, (auvest.filters.GaussianFilter, Steps)):
        arrays = _state.unpack(f.save(), type(f).__name__, f._description())
        arrays.pop("status", None)
        return {name: (array.dtype, array.tobytes()) for name, array in arrays.items()}
    if isinstance(f, _core.Pilot_float32):
        return (f.x.tobytes(), f.P.tobytes(), f.mode, f.leg)
    return None


def require_belief(name: str, x: np.ndarray, P: np.ndarray, slack: float) -> None:
    """Raise where a belief is none: `slack` is how negative an eigenvalue may be by rounding."""
    if not (np.isfinite(x).all() and np.isfinite(P).all()):
        raise Failed(f"{name}: not finite after ok", f"x = {x}, P = {P.tolist()}")
    if (P != P.T).any():
        raise Failed(f"{name}: P is not symmetric after ok", f"P = {P.tolist()}")
    variances = np.diagonal(P).astype(float)
    if (variances < 0).any():
        raise Failed(f"{name}: negative variance after ok", f"{variances}")
    if (variances > 0).all():
        sigma = np.sqrt(variances)
        smallest = np.linalg.eigvalsh(P.astype(float) / np.outer(sigma, sigma))[0]
        if smallest < -slack:
            raise Failed(
                f"{name}: P indefinite after ok", f"smallest eigenvalue {smallest:.3g} of 1"
            )


def is_below_format(f: Any) -> bool:
    """Whether all variances are so small that their last digits are subnormal: 0 may be left."""
    if not isinstance(f, auvest.filters.GaussianFilter):
        return False
    limits = np.finfo(f.dtype)
    return bool((np.diagonal(f.P) < limits.tiny / (4 * limits.eps)).all())


def require_sound(f: Any) -> None:
    """Raise where what the object says of itself cannot be."""
    name = type(f).__name__
    if isinstance(f, auvest.filters.GaussianFilter):
        eps = float(np.finfo(f.dtype).eps)
        require_belief(name, f.x, f.P, 8 * len(f.x) * eps)
        if not (np.diagonal(f.P) > 0).all() and not is_below_format(f):
            raise Failed(f"{name}: variance of 0 after ok", f"{np.diagonal(f.P)}")
        if f.policy is not None and not (math.isfinite(f.interval) and f.interval > 0):
            raise Failed(f"{name}: interval out of range", f"{f.interval}")
    elif isinstance(f, Steps):
        # A summary of particles is a difference of sums.
        slack = 1e-4 if f.dtype == np.float32 else 1e-12
        try:
            require_belief(name, f.x, f.P, slack)
        except auvest.FilterError:  # an Outage that was told nothing yet
            return
        for n in range(getattr(f, "masters", 0)):
            require_belief(f"{name} (master)", *f.master(n), slack)
    elif isinstance(f, _core.Pilot_float32):
        require_belief(name, f.x, f.P, 8 * len(f.x) * float(np.finfo(np.float32).eps))


def require_answer(f: Any, call: str, answer: Any) -> None:
    """Raise where an answer that was given is not finite."""
    numbers: list[Any] = []
    if isinstance(f, Hull):
        numbers = [answer] if isinstance(answer, float) else [answer.pose, answer.velocity]
    elif isinstance(f, _core.Pilot_float32) and call == "f.steer()":
        numbers = list(answer[1:]) if answer[0] == auvest.Status.ok else []
    elif isinstance(f, (auvest.ProcessModel, auvest.MeasurementModel)) and call.startswith("f.h"):
        numbers = [answer]
    for value in numbers:
        # A hull at rest whose actuators do nothing is stable whatever the step.
        if np.isnan(value).any() or (not isinstance(value, float) and not np.isfinite(value).all()):
            raise Failed(f"{type(f).__name__}: not finite after ok", f"{call}: {answer}")


class Interface:
    """The attack."""

    unit: ClassVar[str] = "calls"

    def case(self, rng: random.Random) -> Case:
        return Calls(rng).case()

    def text(self, case: Case) -> str:
        return "\n".join((case.subject, *case.steps))

    def run(self, case: Case, counts: Counter[str]) -> None:
        scope = dict(NAMES_IN_CASES)
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # of NumPy, about arguments that are meant to be odd
            counts["calls"] += 1
            if not self._do(case.subject, scope, counts):
                return
            for call in case.steps:
                counts["calls"] += 1
                self._call(call, scope, counts)

    def _call(self, call: str, scope: dict[str, Any], counts: Counter[str]) -> None:
        f = scope["f"]
        name = f"{type(f).__name__}.{call.split('(')[0].split('.')[-1]}"
        before = state_of(f)
        error: BaseException | None = None
        try:
            if call.startswith("f = "):
                exec(call, scope)
                answer = None
            else:
                answer = eval(call, scope)
        except DOCUMENTED as refused:
            error = refused
        except RuntimeError as refused:
            if not isinstance(f, Hull):
                raise Failed(f"{name}: {type(refused).__name__}", repr(refused)) from None
            error = refused
        except AttributeError as refused:  # what the object has not: also of a policy
            error = refused
        except BaseException as wrong:
            raise Failed(f"{name}: {type(wrong).__name__}", f"{call}: {wrong!r}") from None
        if error is None:
            counts["done"] += 1
            require_answer(f, call, answer)
        else:
            counts["refused"] += 1
            if call in KEEPING and not is_below_format(f):
                raise Failed(f"{name}: its own state is refused", f"{call}: {error!r}")
            stays = not isinstance(error, auvest.FilterError) or error.step is None
            if stays and state_of(f) != before:
                raise Failed(f"{name}: changed by a refusal", f"{call}: {error!r}")
        require_sound(scope["f"])

    def _do(self, subject: str, scope: dict[str, Any], counts: Counter[str]) -> bool:
        try:
            exec(subject, scope)
        except DOCUMENTED:
            counts["constructions refused"] += 1
            return False
        except KeyError:  # of the core's pilot: a setting that it has not
            counts["constructions refused"] += 1
            return False
        except BaseException as wrong:
            made = subject.split("(")[0].removeprefix("f = ")
            raise Failed(f"{made}(): {type(wrong).__name__}", repr(wrong)) from None
        counts["constructions"] += 1
        return True


ATTACK = Interface()

if __name__ == "__main__":
    main(ATTACK, __doc__, 20_000)
