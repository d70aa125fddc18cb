"""Models of one's own in C++: load_models, its cache, and what it says of wrong headers."""

import copy
import json
import multiprocessing
import os
import pickle
import shutil
import subprocess
import sys
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from conftest import ROOT

import auvest
from tests.slow import SLOW

EXAMPLE = ROOT / "cpp" / "examples" / "my_models.hpp"

#: A process of five states, of which no model of the package has filters in float32; no Phi. A
#: sensor for any number of states; no H, no Params, no names.
SMALL = """#pragma once
#include "auvest/auvest.hpp"
#include "constants.hpp"

namespace mine {

// struct Ghost : auvest::ProcessModel<Ghost, float, 2> in a comment is no model.
template <class Scalar_>
struct Drift : auvest::ProcessModel<Drift<Scalar_>, Scalar_, 5> {
  using Base = auvest::ProcessModel<Drift<Scalar_>, Scalar_, 5>;
  using Scalar = Scalar_;
  using typename Base::Covariance;
  using typename Base::State;
  using Input = auvest::Vector<Scalar, 2>;
  struct Params {
    Scalar psd = Scalar(kPsd);
    template <class Visitor>
    void visit(Visitor&& v) { v("psd", psd); }
  };
  Params params;
  Input input = Input::Zero();
  State f(const State& x, Scalar dt) const {
    State next = x;
    next(0) = x(0) + dt * input(0);
    next(1) = x(1) + dt * input(1);
    return next;
  }
  Covariance Q(Scalar dt) const { return Covariance::Identity() * (params.psd * dt); }
  auvest::Status check() const {
    return params.psd > Scalar(0) ? auvest::Status::kOk : auvest::Status::kBadParameter;
  }
};

template <class Scalar_, int N>
struct RangeOnly : auvest::MeasurementModel<RangeOnly<Scalar_, N>, Scalar_, N, 1, 2> {
  using Base = auvest::MeasurementModel<RangeOnly<Scalar_, N>, Scalar_, N, 1, 2>;
  using typename Base::Measurement;
  using typename Base::Noise;
  using typename Base::State;
  Measurement h(const State& x) const {
    return Measurement(auvest::math::sqrt(x(0) * x(0) + x(1) * x(1)));
  }
  Noise R() const { return Noise(Scalar_(0.01)); }
};

}  // namespace mine
"""


@pytest.fixture(scope="module")
def cache(tmp_path_factory):
    """Give the folder of the compiled libraries of this file, empty at its start."""
    return tmp_path_factory.mktemp("cache")


@pytest.fixture(autouse=True)
def _own_cache(cache, monkeypatch):
    monkeypatch.setenv("AUVEST_CACHE", str(cache))
    monkeypatch.delenv("CXX", raising=False)


@pytest.fixture
def quick_compiler(tmp_path_factory, monkeypatch):
    """Compile without optimisation: a third of the time, where the library's speed is no matter."""
    script = tmp_path_factory.getbasetemp() / "quick-g++"
    script.write_text('#!/bin/sh\nexec g++ "$@" -O0\n')
    script.chmod(0o755)
    monkeypatch.setenv("CXX", str(script))


@pytest.fixture(scope="module")
def first_load(cache):
    """Load the example in an interpreter of its own; give what that cost."""
    return load_apart(cache)


def load_apart(cache):
    code = (
        "import json, resource, sys, time, auvest\n"
        "auvest.Ukf\n"
        "start = time.process_time()\n"
        "auvest.load_models(sys.argv[1])\n"
        "own = time.process_time() - start\n"
        "rest = resource.getrusage(resource.RUSAGE_CHILDREN)\n"
        "print(json.dumps([own, rest.ru_utime + rest.ru_stime, rest.ru_maxrss / 1e6]))"
    )

    environment = {**os.environ, "AUVEST_CACHE": str(cache)}
    command = [sys.executable, "-c", code, str(EXAMPLE)]
    done = subprocess.run(command, env=environment, capture_output=True, text=True)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout)


@pytest.fixture
def example(first_load):  # noqa: ARG001
    """Load the example, which is in the cache by then."""
    return auvest.load_models(EXAMPLE)


@pytest.fixture(scope="module")
def written_header(tmp_path_factory):
    """Write SMALL and the header that it includes."""
    header = tmp_path_factory.mktemp("small") / "small.hpp"
    header.write_text(SMALL)
    (header.parent / "constants.hpp").write_text("#pragma once\nconst double kPsd = 0.25;\n")
    return header


@pytest.fixture
def small_header(written_header, quick_compiler):  # noqa: ARG001
    """Give SMALL, and the compiler that it is compiled with."""
    return written_header


def positions(count=10_000):
    """Give measurements of an ellipse around the station that comes close to it."""
    rng = np.random.default_rng(3)
    turn = 0.01 * np.arange(count)
    track = np.column_stack([0.2 + 10 * np.cos(turn), 2 + 0.05 * np.sin(turn)])
    z = auvest.RangeBearing().h(track) + rng.normal(size=(count, 2)) * [0.05, 0.01]
    z[:, 0] = np.abs(z[:, 0])  # no sonar reports a range below 0
    z[:, 1] = (z[:, 1] + np.pi) % (2 * np.pi) - np.pi
    return z


X0 = np.array([9.0, 1, 0, 0, 0, 0])
COLUMNS = ("x", "P", "innovation", "S", "nis", "near_field")


# ---- The same bits -----------------------------------------------------------------------------


@pytest.mark.parametrize("dtype", ["float32", "float64"])
@pytest.mark.parametrize("kind", [auvest.Ekf, auvest.Ukf])
def test_the_example_gives_the_bits_of_the_built_in_models(example, kind, dtype):
    own = kind(
        X0,
        np.eye(6),
        process=example.MyAcceleration(),
        sensors=example.MyRangeBearing(),
        dtype=dtype,
    )
    built_in = kind(
        X0,
        np.eye(6),
        process=auvest.ConstantAcceleration(),
        sensors=auvest.RangeBearing(),
        dtype=dtype,
    )
    z = positions()
    found, expected = own.run(z, dt=0.1), built_in.run(z, dt=0.1)
    for name in COLUMNS:
        assert getattr(found, name).tobytes() == getattr(expected, name).tobytes()
    assert found.near_field.sum() > 10


def test_classes_are_like_the_built_in_ones(example):
    sensor = example.MyRangeBearing(sigma_range_m=0.5)
    assert example.MyAcceleration.state == auvest.ConstantAcceleration.state
    assert example.MyAcceleration() == example.MyAcceleration(velocity_psd=1e-4)
    assert sensor.observes == ("x_m", "y_m")
    assert sensor.measures == ("range_m", "bearing_rad")
    assert sensor.h([3.2, 6]) == pytest.approx([5, np.arctan2(4, 3)])
    assert repr(example.MyAcceleration()).startswith("MyAcceleration(position_psd=1e-06, ")
    with pytest.raises(AttributeError):
        sensor.sigma_range_m = 1.0  # frozen
    with pytest.raises(ValueError, match=r"check\(\) of the model refuses MyRangeBearing\("):
        example.MyRangeBearing(sigma_range_m=-1)
    with pytest.raises(ValueError, match="near_field must be finite"):
        example.MyRangeBearing(near_field=np.nan)
    with pytest.raises(AttributeError, match="no model Other, but MyAcceleration, MyRangeBearing"):
        _ = example.Other


def test_all_that_a_filter_has_goes_with_them(example):
    """Kernel, recovery, policy, late measurements, several sensors, places: as the built-in do."""
    options = {
        "kernel": "igg",
        "recovery": auvest.RejectionStreak(),
        "policy": auvest.CovarianceBudget(),
        "late_s": 3.0,
    }
    own = auvest.Ukf(
        X0,
        np.eye(6),
        process=example.MyAcceleration(),
        sensors=[example.MyRangeBearing(), auvest.Position()],
        **options,
    )
    built_in = auvest.Ukf(
        X0,
        np.eye(6),
        process=auvest.ConstantAcceleration(),
        sensors={"MyRangeBearing": auvest.RangeBearing(), "Position": auvest.Position()},
        **options,
    )
    z = positions(400)
    z[50:55] += [500, 0]
    names = np.where(np.arange(400) % 3 == 2, "Position", "MyRangeBearing")
    z[names == "Position"] = [10, 2]
    place = np.full((400, 2), np.nan)
    place[names != "Position"] = [0.5, 2.5]
    record = {
        "dt": 0.1,
        "sensor": names,
        "age_s": np.where(np.arange(400) % 7 == 6, 0.25, 0.0),
        "place": place,
    }
    found, expected = own.run(z, **record), built_in.run(z, **record)
    for name in (*COLUMNS, "weight", "decision", "recovered", "interval_s"):
        assert getattr(found, name).tobytes() == getattr(expected, name).tobytes()
    assert own.sensors["MyRangeBearing"].place == "place"
    for twin in (copy.deepcopy(own), pickle.loads(pickle.dumps(own))):
        twin.predict(0.1)
        twin.update([9.0, 0.1], "MyRangeBearing", age_s=2)
    own.predict(0.1)
    own.update([9.0, 0.1], "MyRangeBearing", age_s=2)
    assert twin.x.tobytes() == own.x.tobytes()


# ---- States and processes ----------------------------------------------------------------------


def small_filter(models, dtype="float32"):
    filter_ = auvest.Ukf(
        [1, 2, 0, 0, 0],
        np.eye(5),
        process=models.Drift(psd=0.5),
        sensors=models.RangeOnly(),
        late_s=1,
        dtype=dtype,
    )
    filter_.predict(0.5, [1, 0])
    filter_.update(2.0)
    return filter_


def go_on(pickled):
    filter_ = pickle.loads(pickled)
    filter_.predict(0.5, [0, 1])
    filter_.update(2.5, age_s=0.25)
    return filter_.x.tobytes()


def test_pickles_go_to_a_new_process_and_states_name_the_header(small_header):
    models = auvest.load_models(small_header)
    filter_ = small_filter(models)
    pickled, state = pickle.dumps(filter_), filter_.save()
    with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as pool:
        elsewhere = pool.submit(go_on, pickled).result()
    assert elsewhere == go_on(pickled)
    assert models.digest.encode() in state
    twin = small_filter(models)
    twin.restore(state)
    assert twin.x.tobytes() == filter_.x.tobytes()


def test_a_model_that_is_not_complete_for_an_ekf_serves_the_others(small_header):
    models = auvest.load_models(small_header)
    assert models.Drift().psd == 0.25
    assert models.Drift.state == ("x_0", "x_1", "x_2", "x_3", "x_4")
    assert models.Drift.input == ("u_0", "u_1")
    start = {"x0": [3, 4, 0, 0, 0], "P0": np.eye(5), "process": models.Drift()}
    with pytest.raises(ValueError, match=r"^Drift has no Phi\(x, dt\): an Ekf needs it; use Ukf"):
        auvest.Ekf(**start)
    plain = auvest.FunctionProcess(lambda x, _: x, np.eye(5), state=5)
    ekf = auvest.Ekf([3, 4, 0, 0, 0], np.eye(5), process=plain)
    with pytest.raises(ValueError, match=r"^RangeOnly has no H\(x\): an Ekf needs it; use Ukf"):
        ekf.update(5.0, models.RangeOnly())
    with pytest.raises(ValueError, match=r"Drift has no Phi\(x, dt\)"):
        models.Drift().Phi(1.0)
    start["P0"] = np.diag([1.0, 1.5, 1.0, 1.0, 1.0])
    for kind in (auvest.Ukf, auvest.Ckf):
        # The budget asks for P_xx + P_yy = 2.5 + 2 T psd; it must come to 3.5 after 2 s.
        budget = auvest.CovarianceBudget(position_sigma_m=3.5**0.5, min_s=0.5, max_s=10)
        filter_ = kind(**start, policy=budget)
        assert filter_.feedback() == pytest.approx(2, rel=1e-2)
        filter_.predict(2.0, [1, 0])
        assert filter_.x == pytest.approx([5, 4, 0, 0, 0])
        assert pytest.approx(start["P0"] + 0.5 * np.eye(5)) == filter_.P
        filter_.update(6.0, models.RangeOnly())
        assert filter_.innovation[0] == pytest.approx(6 - np.hypot(5, 4), abs=0.2)


def test_sensors_for_other_numbers_of_states(small_header, example):
    models = auvest.load_models(small_header)
    with pytest.raises(
        ValueError,
        match=r"made for 5 states, not for 7; load_models\('small.hpp', states=\[7\]\) makes it",
    ):
        models.RangeOnly().core(7, np.dtype("float64"))
    with pytest.raises(ValueError, match=r"in the struct RangeOnly: .* kStateNames = \"x_m y_m\";"):
        auvest.Ukf(X0, np.eye(6), process=example.MyAcceleration(), sensors=models.RangeOnly())
    with pytest.raises(ValueError, match=r"in the struct Drift: .* kStateNames = \"x_m y_m\";"):
        auvest.Ukf(np.zeros(5), np.eye(5), process=models.Drift(), sensors=example.MyRangeBearing())


# ---- The cache ---------------------------------------------------------------------------------


def test_what_a_load_costs(first_load, cache):
    """At most 30 s of processor time and 1.5 GB, then 0.2 s; here with room for slow machines."""
    own, compiler, gigabytes = first_load
    assert own + compiler < 3 * 30
    assert compiler > 0.5  # it was not in the cache
    assert gigabytes < 1.5
    own, compiler, _ = load_apart(cache)
    assert own + compiler < 4 * 0.2


def test_a_header_that_changed_is_compiled_anew(small_header, tmp_path, cache):
    first = auvest.load_models(small_header)
    assert auvest.load_models(small_header) is first
    shutil.copytree(small_header.parent, tmp_path / "moved")
    before = sorted(cache.glob("*.so"))
    moved = auvest.load_models(tmp_path / "moved" / "small.hpp")
    assert sorted(cache.glob("*.so")) == before  # the same contents
    assert moved.Drift is first.Drift
    kept = pickle.dumps(first.Drift())
    (small_header.parent / "constants.hpp").write_text("#pragma once\nconst double kPsd = 4;\n")
    changed = auvest.load_models(small_header)
    assert changed.digest != first.digest
    assert changed.Drift().psd == 4
    assert first.Drift().psd == 0.25
    assert pickle.loads(kept) == first.Drift()  # loaded already
    with pytest.raises(ValueError, match=r"state is that of another Ukf: process\.header is"):
        small_filter(changed).restore(small_filter(first).save())
    code = f"import pickle; pickle.loads({kept!r})"

    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert f"Drift was pickled when {small_header} had other contents" in done.stderr


# ---- Headers that are wrong --------------------------------------------------------------------


def refused(tmp_path, old, new):
    """Load SMALL with one place changed; give the message's lines and the number of that line."""
    assert SMALL.count(old) == 1
    header = tmp_path / "wrong.hpp"
    header.write_text(SMALL.replace(old, new))
    (tmp_path / "constants.hpp").write_text("const double kPsd = 1;\n")
    with pytest.raises(auvest.ModelError) as caught:
        auvest.load_models(header)
    lines = str(caught.value).splitlines()
    assert len(lines) <= 25
    assert max(len(line) for line in lines) <= 300
    log = Path(lines[-1].removeprefix("All that the compiler said: "))
    assert "error: " in log.read_text()
    return lines, SMALL[: SMALL.index(old)].count("\n") + 1


LACKING = {
    "no Q": ("Covariance Q(", "Covariance noise(", "Drift", "your model has no Q(dt): "),
    "no h": (
        "Measurement h(const",
        "Measurement value(const",
        "RangeOnly",
        "your model has no h(x): ",
    ),
    "size of H": (
        "  Noise R()",
        "  auvest::Matrix<Scalar_, 2, 1> H(const State&) const { return {}; }\n  Noise R()",
        "RangeOnly",
        "H(x) of your model must give a Jacobian, a Matrix<Scalar, M, Observed>",
    ),
}


def lacking():
    """All with g++; clang++ has one form of saying so: one, but where slow tests are asked for."""
    for compiler in ("g++", "clang++"):
        for name, case in LACKING.items():
            marks = () if compiler == "g++" or name == "no h" else SLOW
            yield pytest.param(compiler, *case, id=f"{name}-{compiler}", marks=marks)


@pytest.mark.parametrize(("compiler", "old", "new", "struct", "words"), list(lacking()))
def test_an_incomplete_model(tmp_path, monkeypatch, compiler, old, new, struct, words):
    if shutil.which(compiler) is None:
        pytest.skip(f"{compiler} is not installed")
    monkeypatch.setenv("CXX", compiler)
    lines, _ = refused(tmp_path, old, new)
    line = SMALL[: SMALL.index(f"struct {struct} :")].count("\n") + 1
    assert lines[0].startswith(f"wrong.hpp:{line}: {words}")
    assert lines[1].strip().startswith(f"struct {struct} : auvest::")
    assert len(lines) == 3


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("State next = x;", "State next = x", "expected ',' or ';'"),
        ("return Noise(Scalar_(0.01));", "return Nose(Scalar_(0.01));", "'Nose' was not declared"),
    ],
    ids=["syntax", "name"],
)
def test_a_syntax_error(tmp_path, old, new, words):
    lines, line = refused(tmp_path, old, new)
    where, text = (
        lines[0].split(": error: ") if ": error: " in lines[0] else lines[0].split(": ", 1)
    )
    assert where in (f"wrong.hpp:{line}", f"wrong.hpp:{line + 1}")
    assert words in text


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("int answer() { return 42; }", "no model found. A model is a struct like"),
        (
            "struct Outer {\n"
            "  template <class S> struct A : auvest::ProcessModel<A<S>, S, 2> {};\n};",
            "no model found",
        ),
        (
            "struct Flat : auvest::ProcessModel<Flat, float, 2> {};",
            ":1: Flat must begin with template <class Scalar>",
        ),
        (
            "template <class S> struct A : auvest::ProcessModel<A<S>, S, 2> {};\n"
            "namespace b {\n"
            "template <class S> struct A : auvest::ProcessModel<A<S>, S, 2> {};\n}",
            ":1: there are two models called A",
        ),
    ],
    ids=["foreign", "inner", "no template", "twice"],
)
def test_a_header_without_models_for_us(tmp_path, text, words):
    header = tmp_path / "other.hpp"
    header.write_text(text)
    with pytest.raises(auvest.ModelError) as caught:
        auvest.load_models(header)
    assert str(caught.value).startswith(str(header))
    assert words in str(caught.value)


def test_what_is_missing(tmp_path, monkeypatch):
    with pytest.raises(FileNotFoundError, match=r"nowhere\.hpp"):
        auvest.load_models(tmp_path / "nowhere.hpp")
    monkeypatch.setenv("PATH", "")
    with pytest.raises(auvest.ModelError, match=r"none in PATH: install g\+\+ .*apt install g\+\+"):
        auvest.load_models(EXAMPLE, states=[7])
    monkeypatch.setenv("CXX", "g++-of-old")
    with pytest.raises(auvest.ModelError, match=r"CXX names 'g\+\+-of-old', which is not there"):
        auvest.load_models(EXAMPLE, states=[7])
