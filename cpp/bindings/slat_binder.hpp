// The Python classes of the filters of slat/ and of their outage switch, the same for every filter,
// motion and precision.
#pragma once

#include <algorithm>
#include <limits>
#include <string>
#include <type_traits>
#include <vector>

#include "any_slat.hpp"
#include "auvest/records/run.hpp"
#include "binders.hpp"
#include "plain.hpp"
#include "simulation/slat.hpp"
#include "slat_params.hpp"
#include "slatf_setup.hpp"

namespace auvest {
namespace bindings {

AnyResampling resampling_named(const std::string& name);

template <class Motion>
class SlatBinder {
 public:
  using Scalar = typename Motion::Scalar;
  static constexpr int kPose = Motion::kStates;
  using Any = AnySlat<Scalar, kPose>;
  using Switch = AnyOutage<Scalar, kPose>;
  using Steps = SlatSteps<Scalar, kPose>;
  using Master = PiecewiseAcceleration<Scalar>;
  using Echo = auvest::Echo<Scalar>;
  using Change = typename Any::VelocityChange;
  using Device = Sonar<Scalar>;
  using Integers = Array<std::int64_t>;
  using Doubles = Array<double>;

  static void bind(py::module_& m, const std::string& motion) {
    bind_steps(py::class_<Steps>(m, named<Scalar>("SlatSteps_" + motion).c_str()));
    py::class_<Any, Steps>(m, named<Scalar>("Slat_" + motion).c_str())
        .def_static("slatf",
                    static_cast<Any (*)(const py::dict&, const py::dict&, const py::dict&,
                                        const std::string&, int, int, const std::string&)>(&slatf),
                    py::arg("motion"), py::arg("master"), py::arg("params"), py::arg("resampling"),
                    py::arg("version"), py::arg("particles"), py::arg("lanes"))
        .def_static("slatf_joint", &slatf_joint, py::arg("motion"), py::arg("master"),
                    py::arg("params"), py::arg("resampling"), py::arg("particles"),
                    py::arg("max_masters"), py::arg("shared"))
        .def_static(
            "ekf_slat",
            [](const py::dict& motion_params, const py::dict& master, const py::dict& params) {
              const Motion slave = model<Motion>(motion_params);
              const auto values = from_dict<EkfSlatParams<Scalar>>(params);
              return Any(is_imm(master) ? make_ekf_slat(slave, imm(master), values)
                                        : make_ekf_slat(slave, model<Master>(master), values));
            },
            py::arg("motion"), py::arg("master"), py::arg("params"))
        .def_static(
            "dead_reckoning",
            [](const py::dict& motion_params, Scalar longest_step_s) {
              return Any(make_dead_reckoning(model<Motion>(motion_params), longest_step_s));
            },
            py::arg("motion"), py::arg("longest_step_s"))
        .def("copy", [](const Any& f) { return Any(f); })
        .def(
            "reset",
            [](Any& f, const Array<Scalar>& x, const Array<Scalar>& p, math::Random& random) {
              require_ok(f.reset(belief<kPose>(x, p), random));
            },
            py::arg("x").noconvert(), py::arg("P").noconvert(), py::arg("random"))
        .def(
            "add_master",
            [](Any& f, const Array<Scalar>& x, const Array<Scalar>& p) {
              require_ok(f.add_master(belief<6>(x, p)));
            },
            py::arg("x").noconvert(), py::arg("P").noconvert())
        .def("step", &step, py::arg("dt"), py::arg("u"), py::arg("changes"), py::arg("z"),
             py::arg("master"), py::arg("unknown"), py::arg("sonar"), py::arg("random"))
        .def("particles", &particles)
        .def("mode_probabilities", &Any::mode_probabilities, py::arg("n"))
        .def("simulate", &simulate, py::arg("sonar"), py::arg("scenario"), py::arg("seed"),
             py::arg("first_run"), py::arg("runs"));
    py::class_<Switch, Steps>(m, named<Scalar>("SlatOutage_" + motion).c_str())
        .def(py::init([](const Any& f) { return Switch(f); }), py::arg("prototype"))
        .def("copy", [](const Switch& f) { return Switch(f); })
        .def("share", &share, py::arg("x").noconvert(), py::arg("P").noconvert(),
             py::arg("masters_x").noconvert(), py::arg("masters_P").noconvert())
        .def_property_readonly("communication", [](const Switch& f) {
          const Communication mode = f.mode();
          return mode == Communication::kUp     ? "up"
                 : mode == Communication::kDown ? "down"
                                                : "never";
        });
  }

 private:
  static void bind_steps(py::class_<Steps> c) {
    // False where an argument is not plain: then nothing was done.
    c.def(
         "predict",
         [](Steps& f, py::handle dt, py::handle u, py::handle changes, math::Random& random) {
           Move move;
           if (!move.take(dt, u, changes, f.masters())) return false;
           require_ok(f.predict(move.dt, move.u, random, move.changes()));
           return true;
         },
         py::arg("dt"), py::arg("u"), py::arg("changes"), py::arg("random"))
        .def(
            "update",
            [](Steps& f, py::handle z, py::handle master, bool unknown, const Device& sonar,
               math::Random& random) {
              Echoes echoes;
              if (!echoes.take(z, master, f.masters(), unknown)) return false;
              require_ok(f.update(echoes.heard, echoes.count, sonar, random));
              return true;
            },
            py::arg("z"), py::arg("master"), py::arg("unknown"), py::arg("sonar"),
            py::arg("random"))
        .def_property_readonly("masters", [](const Steps& f) { return f.masters(); })
        .def("run", &run, py::arg("time_s").noconvert(), py::arg("u").noconvert(),
             py::arg("changes").noconvert(), py::arg("echo_time_s").noconvert(),
             py::arg("z").noconvert(), py::arg("master").noconvert(), py::arg("sonar"),
             py::arg("random"))
        .def("slave",
             [](const Steps& f) {
               const auto b = f.slave();
               return py::make_tuple(to_array(b.x), to_array(b.P));
             })
        .def(
            "master",
            [](const Steps& f, int n) {
              const auto b = f.master(n);
              return py::make_tuple(to_array(b.x), to_array(b.P));
            },
            py::arg("n"))
        .def("save",
             [](const Steps& f) {
               SlatState<Scalar> state = {};
               f.save(state);  // counts them
               py::array_t<Scalar> numbers(static_cast<py::ssize_t>(state.number_count));
               py::array_t<std::int64_t> counts(static_cast<py::ssize_t>(state.count_count));
               state.numbers = numbers.mutable_data();
               state.counts = counts.mutable_data();
               f.save(state);
               py::dict result;
               result["numbers"] = numbers;
               result["counts"] = counts;
               return result;
             })
        .def(
            "restore",
            [](Steps& f, const Array<Scalar>& numbers, const Integers& counts) {
              require_shape(numbers, {-1}, "numbers");
              require_shape(counts, {-1}, "counts");
              if (!f.restore({numbers.data(), static_cast<std::size_t>(numbers.size()),
                              counts.data(), static_cast<std::size_t>(counts.size())})) {
                throw py::value_error("numbers and counts are not the state of such a filter");
              }
            },
            py::arg("numbers").noconvert(), py::arg("counts").noconvert());
    const auto reading = [&c](const char* name, auto member) {
      c.def_property_readonly(name, [member](const Steps& f) { return f.readings().*member; });
    };
    using Readings = SlatReadings<Scalar>;
    reading("resamplings", &Readings::resamplings);
    reading("effective_size", &Readings::effective_size);
    reading("log_likelihood", &Readings::log_likelihood);
    reading("nis", &Readings::nis);
    reading("refused", &Readings::refused);
    reading("rebirths", &Readings::rebirths);
    reading("since_rebirth_s", &Readings::since_rebirth_s);
  }

  template <class Model>
  static Model model(const py::dict& params) {
    const Model result(from_dict<typename Model::Params>(params));
    require_ok(result.check());
    return result;
  }

  template <int N>
  static Belief<Scalar, N> belief(const Array<Scalar>& x, const Array<Scalar>& p) {
    Belief<Scalar, N> result;
    result.x = to_matrix<N, 1>(x, "x");
    result.P = to_matrix<N, N>(p, "P");
    return result;
  }

  /// What a prediction is told.
  struct Move {
    Scalar dt;
    typename Any::Control u;

    /// False where something is not plain. `planned` is None or (masters, 2), at least one row.
    bool take(py::handle seconds, py::handle reading, py::handle planned, int masters) {
      if (!plain::take(seconds, dt) || dt < Scalar(0) || !plain::take(reading, u)) return false;
      if (planned.is_none()) return true;
      if (!plain::is_array(planned) || !py::isinstance<Array<Scalar>>(planned)) return false;
      const auto array = py::reinterpret_borrow<Array<Scalar>>(planned);
      const int rows = std::max(1, masters);
      if (array.ndim() != 2 || array.shape(0) != rows || array.shape(1) != 2) return false;
      // Masters that are born have none.
      for (Change& change : plan_) math::set_zero(change);
      for (int n = 0; n < rows; ++n) {
        for (int i = 0; i < 2; ++i) plan_[n](i) = array.data()[2 * n + i];
        if (!math::all_finite(plan_[n])) return false;
      }
      planned_ = true;
      return true;
    }
    const Change* changes() const { return planned_ ? plan_ : nullptr; }

   private:
    Change plan_[Any::kMasters];
    bool planned_ = false;
  };

  /// What the sonar heard at one time.
  struct Echoes {
    Echo heard[Any::kMasters];
    int count = 0;

    /// False where something is not plain, or not right. `z` is None, (2,) or (K, 2); rows of NaN
    /// are missing. `master` is None, an int or (K,); None: nobody knows, if `unknown`, or the only
    /// one.
    bool take(py::handle z, py::handle master, int masters, bool unknown) {
      if (z.is_none()) return true;
      double numbers[2 * Any::kMasters];
      py::ssize_t rows = 1;
      if (plain::is_array(z) && py::reinterpret_borrow<py::array>(z).ndim() == 2) {
        const auto array = py::reinterpret_borrow<py::array>(z);
        rows = array.shape(0);
        if (rows < 1 || rows > Any::kMasters || array.shape(1) != 2) return false;
        if (!plain::take_elements<double>(z, 2 * rows, numbers) &&
            !plain::take_elements<float>(z, 2 * rows, numbers)) {
          return false;
        }
      } else if (!plain::take_any(z, 2, numbers)) {
        return false;
      }
      std::int64_t who[Any::kMasters];
      if (!take_masters(master, rows, masters, unknown, who)) return false;
      for (py::ssize_t row = 0; row < rows; ++row) {
        const double* one = numbers + 2 * row;
        if (std::isnan(one[0]) && std::isnan(one[1])) continue;
        Echo& echo = heard[count++];
        echo.master = static_cast<int>(who[row]);
        for (int i = 0; i < 2; ++i) {
          if (!(std::fabs(one[i]) <= 1e9) || !plain::narrow(one[i], echo.z(i))) return false;
        }
        for (int earlier = 0; earlier + 1 < count; ++earlier) {
          if (echo.master != kUnknownMaster && heard[earlier].master == echo.master) return false;
        }
      }
      return true;
    }

   private:
    static bool take_masters(py::handle master, py::ssize_t rows, int masters, bool unknown,
                             std::int64_t* who) {
      if (master.is_none()) {
        std::fill_n(who, rows, unknown ? kUnknownMaster : 0);
        return unknown || masters <= 1;
      }
      if (plain::is_array(master) && py::isinstance<Integers>(master)) {
        const auto array = py::reinterpret_borrow<Integers>(master);
        if (array.ndim() != 1 || array.shape(0) != rows) return false;
        std::copy_n(array.data(), rows, who);
      } else {
        double number;
        if (!PyLong_CheckExact(master.ptr()) || !plain::take_any(master, number)) return false;
        if (!(std::fabs(number) < 1e9)) return false;
        std::fill_n(who, rows, static_cast<std::int64_t>(number));
      }
      return std::all_of(who, who + rows, [masters](std::int64_t n) {
        return n == kUnknownMaster || (n >= 0 && n < masters);
      });
    }
  };

  using Models = ThreeModels<Scalar>;

  static bool is_imm(const py::dict& master) { return master.contains("switch_rate_hz"); }

  static Models imm(const py::dict& master) {
    typename Models::Params params;
    params.switch_rate_hz = master["switch_rate_hz"].template cast<Scalar>();
    const auto share = master["share"].template cast<std::vector<Scalar>>();
    if (share.size() != Models::kModes) throw py::value_error("share must have 3 elements");
    for (int k = 0; k < Models::kModes; ++k) params.share(k) = share[static_cast<std::size_t>(k)];
    const Models result(
        params, model<ConstantVelocity<Scalar>>(master["straight"].template cast<py::dict>()),
        model<ExactAcceleration<Scalar>>(master["accelerated"].template cast<py::dict>()),
        model<CoordinatedTurn<Scalar>>(master["turning"].template cast<py::dict>()));
    require_ok(result.check());
    return result;
  }

  static Any slatf(const py::dict& motion, const py::dict& master, const py::dict& params,
                   const std::string& resampling, int version, int particles,
                   const std::string& lanes) {
    if (!is_imm(master)) {
      return slatf(motion, model<Master>(master), params, resampling, version, particles, lanes);
    }
    if (lanes != "scalar") throw py::value_error("lanes must be 'scalar' with an Imm");
    return slatf(motion, imm(master), params, resampling, version, particles, lanes);
  }

  template <class Landmark>
  static Any slatf(const py::dict& motion, const Landmark& master, const py::dict& params,
                   const std::string& resampling, int version, int particles,
                   const std::string& lanes) {
    SlatfSetup<Motion, Landmark> setup;
    setup.motion = model<Motion>(motion);
    setup.master = master;
    setup.params = from_dict<SlatfParams<Scalar>>(params);
    setup.resampling = resampling_named(resampling);
    setup.version = version;
    setup.particles = particles;
    if (version != 1 && version != 2) throw py::value_error("version must be 1 or 2");
    if (particles < 1) throw py::value_error("particles must be positive");
    const std::vector<std::string> sets = instruction_sets(std::is_same<Scalar, float>::value);
    if (std::find(sets.begin(), sets.end(), lanes) == sets.end()) {
      throw py::value_error("lanes must be one of slat_lanes()");
    }
#if AUVEST_VECTOR_LANES
    if constexpr (std::is_same<Scalar, float>::value && std::is_same<Landmark, Master>::value) {
      if (lanes == "sse2") return Any(make_slatf<InstructionSet::kSse2>(setup));
      if (lanes == "avx2") return Any(make_wide_slatf<InstructionSet::kAvx2, kPose>(&setup));
      if (lanes == "avx512") return Any(make_wide_slatf<InstructionSet::kAvx512, kPose>(&setup));
    }
#endif
    return Any(make_slatf<InstructionSet::kScalar>(setup));
  }

  static Any slatf_joint(const py::dict& motion, const py::dict& master, const py::dict& params,
                         const std::string& resampling, int particles, int max_masters,
                         bool shared) {
    if (shared) {
      SlatfSharedSetup<Motion> setup;
      fill(motion, master, params, resampling, particles, max_masters, setup);
      return Any(make_slatf_shared(setup));
    }
    SlatfJointSetup<Motion> setup;
    fill(motion, master, params, resampling, particles, max_masters, setup);
    return Any(make_slatf_joint(setup));
  }

  template <class Params>
  static void fill(const py::dict& motion, const py::dict& master, const py::dict& params,
                   const std::string& resampling, int particles, int max_masters,
                   JointSetup<Motion, Params>& setup) {
    setup.motion = model<Motion>(motion);
    setup.master = model<Master>(master);
    setup.params = from_dict<Params>(params);
    setup.resampling = resampling_named(resampling);
    setup.particles = particles;
    setup.max_masters = max_masters;
    if (particles < 1) throw py::value_error("particles must be positive");
    if (max_masters < 1 || max_masters > Any::kMasters) {
      throw py::value_error("max_masters must be 1 to slat_max_masters");
    }
  }

  static void share(Switch& outage, const Array<Scalar>& x, const Array<Scalar>& p,
                    const Array<Scalar>& masters_x, const Array<Scalar>& masters_p) {
    require_shape(masters_x, {-1, 6}, "masters_x");
    const py::ssize_t count = masters_x.shape(0);
    require_shape(masters_p, {count, 6, 6}, "masters_P");
    if (count > Any::kMasters) throw py::value_error("masters_x has too many masters");
    typename Any::MasterBelief masters[Any::kMasters];
    for (py::ssize_t n = 0; n < count; ++n) {
      for (int i = 0; i < 6; ++i) {
        masters[n].x(i) = masters_x.data()[n * 6 + i];
        for (int j = 0; j < 6; ++j) masters[n].P(i, j) = masters_p.data()[(n * 6 + i) * 6 + j];
      }
    }
    require_ok(outage.share(belief<kPose>(x, p), masters, static_cast<int>(count)));
  }

  static bool step(Any& filter, py::handle dt, py::handle u, py::handle changes, py::handle z,
                   py::handle master, bool unknown, const Device& sonar, math::Random& random) {
    Move move;
    Echoes echoes;
    const int masters = filter.masters();
    if (!move.take(dt, u, changes, masters) || !echoes.take(z, master, masters, unknown)) {
      return false;
    }
    require_ok(
        filter.step(move.dt, move.u, move.changes(), echoes.heard, echoes.count, sonar, random));
    return true;
  }

  static py::tuple particles(const Any& filter) {
    const py::ssize_t n = filter.readings().particles;
    py::array_t<Scalar> weights(n);
    py::array_t<Scalar> poses({n, py::ssize_t(kPose)});
    filter.particles(weights.mutable_data(), poses.mutable_data());
    return py::make_tuple(weights, poses);
  }

  using Row = SlatRow<Scalar, Any::kMasters, double>;

  /// A record of T readings: reading k, u[k], holds from time_s[k] to time_s[k + 1]. Echoes come in
  /// the order of their times, all within the record; those of the same time are one update. Row k
  /// of what is returned is the state of affairs at time_s[k + 1]. `changes` (T, masters, 2): the
  /// planned velocity changes of each interval, of which an echo in between takes its share; T = 0:
  /// no plan.
  static py::dict run(Steps& filter, const Doubles& time_s, const Array<Scalar>& u,
                      const Array<Scalar>& changes, const Doubles& echo_time_s,
                      const Array<Scalar>& z, const Integers& master, const Device& sonar,
                      math::Random& random) {
    require_shape(u, {-1, 2}, "u");
    const py::ssize_t rows = u.shape(0);
    require_shape(time_s, {rows + 1}, "time_s");
    require_shape(z, {-1, 2}, "z");
    const py::ssize_t echoes = z.shape(0);
    require_shape(echo_time_s, {echoes}, "echo_time_s");
    require_shape(master, {echoes}, "master");
    require_shape(changes, {-1, -1, 2}, "changes");
    const bool planned = changes.shape(0) > 0;
    const py::ssize_t plans = changes.shape(1);
    if ((planned && changes.shape(0) != rows) || plans > Any::kMasters) {
      throw py::value_error("changes has the wrong shape");
    }

    const py::ssize_t width = Any::kMasters;
    py::array_t<Scalar> x({rows, py::ssize_t(kPose)});
    py::array_t<Scalar> p({rows, py::ssize_t(kPose), py::ssize_t(kPose)});
    py::array_t<Scalar> masters_x({rows, width, py::ssize_t(6)});
    py::array_t<Scalar> masters_p({rows, width, py::ssize_t(6), py::ssize_t(6)});
    py::array_t<std::int64_t> masters(rows);
    py::array_t<Scalar> effective_size(rows);
    py::array_t<std::int64_t> resamplings(rows);
    py::array_t<Scalar> log_likelihood(rows);
    py::array_t<Scalar> nis(rows);
    py::array_t<std::int64_t> refused(rows), rebirths(rows);
    Scalar* x_out = x.mutable_data();
    Scalar* p_out = p.mutable_data();
    Scalar* masters_x_out = masters_x.mutable_data();
    Scalar* masters_p_out = masters_p.mutable_data();
    std::int64_t* masters_out = masters.mutable_data();
    Scalar* size_out = effective_size.mutable_data();
    std::int64_t* resamplings_out = resamplings.mutable_data();
    Scalar* likelihood_out = log_likelihood.mutable_data();
    Scalar* nis_out = nis.mutable_data();
    std::int64_t* refused_out = refused.mutable_data();
    std::int64_t* rebirths_out = rebirths.mutable_data();
    const double* time = time_s.data();

    std::vector<TimedEcho<Scalar, double>> heard(static_cast<std::size_t>(echoes));
    for (py::ssize_t k = 0; k < echoes; ++k) {
      TimedEcho<Scalar, double>& one = heard[static_cast<std::size_t>(k)];
      one.time_s = echo_time_s.data()[k];
      for (int i = 0; i < 2; ++i) one.echo.z(i) = z.data()[2 * k + i];
      one.echo.master = static_cast<int>(master.data()[k]);
    }
    const auto* left = heard.data();
    const auto* const end = left + echoes;
    py::ssize_t done = 0;
    Status status = Status::kOk;
    {
      py::gil_scoped_release release;
      const Scalar nan = std::numeric_limits<Scalar>::quiet_NaN();
      std::fill_n(masters_x_out, masters_x.size(), nan);
      std::fill_n(masters_p_out, masters_p.size(), nan);
      const auto next = [&](Row& row) {
        if (done == rows) return false;
        row.from_s = time[done];
        row.to_s = time[done + 1];
        row.planned = planned;
        for (int i = 0; i < 2; ++i) {
          row.u(i) = u.data()[2 * done + i];
          for (int n = 0; n < Any::kMasters; ++n) {
            const bool known = planned && n < plans;
            row.changes[n](i) = known ? changes.data()[(done * plans + n) * 2 + i] : Scalar(0);
          }
        }
        // An echo between two readings is of the first.
        row.echoes = left;
        while (left != end && left->time_s <= row.to_s) ++left;
        row.count = static_cast<int>(left - row.echoes);
        return true;
      };
      status = run_record<Row>(filter, next, sonar, random, [&](const Row&, Status taken) {
        if (taken != Status::kOk) return;
        const SlatReadings<Scalar> readings = filter.readings();
        const auto slave = filter.slave();
        copy_to(slave.x, x_out + done * kPose);
        copy_to(slave.P, p_out + done * kPose * kPose);
        for (int n = 0; n < readings.masters; ++n) {
          const auto seen = filter.master(n);
          copy_to(seen.x, masters_x_out + (done * width + n) * 6);
          copy_to(seen.P, masters_p_out + (done * width + n) * 36);
        }
        masters_out[done] = readings.masters;
        size_out[done] = readings.effective_size;
        resamplings_out[done] = readings.resamplings;
        likelihood_out[done] = readings.log_likelihood;
        nis_out[done] = readings.nis;
        refused_out[done] = readings.refused;
        rebirths_out[done] = readings.rebirths;
        ++done;
      });
    }
    py::dict result;
    result["done"] = done;
    result["status"] = status;
    result["x"] = x;
    result["P"] = p;
    result["masters"] = masters;
    result["masters_x"] = masters_x;
    result["masters_P"] = masters_p;
    result["effective_size"] = effective_size;
    result["resamplings"] = resamplings;
    result["log_likelihood"] = log_likelihood;
    result["nis"] = nis;
    result["refused"] = refused;
    result["rebirths"] = rebirths;
    return result;
  }

  /// Runs first_run .. first_run + runs - 1 of the scenario. Run r takes streams 2 r (world) and
  /// 2 r + 1 (filter) of the seed, so runs may be shared out to any number of threads, and every
  /// filter meets the same noise. Rows are pings; those after a failure are NaN.
  static py::dict simulate(const Any& prototype, const Device& sonar, const SlatScenario& scenario,
                           std::uint64_t seed, std::uint64_t first_run, py::ssize_t runs) {
    const py::ssize_t steps =
        static_cast<py::ssize_t>(scenario.duration_s / scenario.odometry_s + 0.5);
    const py::ssize_t pings = steps / scenario.odometry_per_ping;
    const py::ssize_t count = scenario.count;
    const std::vector<py::ssize_t> flat{runs, pings};
    py::array_t<double> time(pings);
    py::array_t<double> truth(std::vector<py::ssize_t>{pings, 2});
    py::array_t<double> masters(std::vector<py::ssize_t>{pings, count, 2});
    py::array_t<double> error(std::vector<py::ssize_t>{runs, pings, 2});
    py::array_t<double> covariance(std::vector<py::ssize_t>{runs, pings, 2, 2});
    py::array_t<double> master_error(std::vector<py::ssize_t>{runs, pings, count, 2});
    py::array_t<double> size(flat), nis(flat);
    py::array_t<std::int64_t> resamplings(runs), heard(runs), refused(runs), rebirths(runs);
    py::array_t<double> log_likelihood(runs);
    py::array_t<std::uint8_t> result_status(runs);
    for (auto* array : {&time, &truth, &masters, &error, &covariance, &master_error, &size, &nis}) {
      std::fill_n(array->mutable_data(), array->size(), std::numeric_limits<double>::quiet_NaN());
    }
    double* time_out = time.mutable_data();
    double* truth_out = truth.mutable_data();
    double* masters_out = masters.mutable_data();
    double* error_out = error.mutable_data();
    double* covariance_out = covariance.mutable_data();
    double* master_error_out = master_error.mutable_data();
    double* size_out = size.mutable_data();
    double* nis_out = nis.mutable_data();
    double* likelihood_out = log_likelihood.mutable_data();
    std::int64_t* resamplings_out = resamplings.mutable_data();
    std::int64_t* heard_out = heard.mutable_data();
    std::int64_t* refused_out = refused.mutable_data();
    std::int64_t* rebirths_out = rebirths.mutable_data();
    std::uint8_t* status_out = result_status.mutable_data();
    {
      py::gil_scoped_release release;
      for (py::ssize_t run = 0; run < runs; ++run) {
        Any filter = prototype;
        const std::uint64_t stream = 2 * (first_run + static_cast<std::uint64_t>(run));
        math::Random world(seed, stream);
        math::Random random(seed, stream + 1);
        py::ssize_t ping = 0;
        std::int64_t echoes = 0;
        const Status status =
            run_slat(filter, sonar, scenario, world, random, [&](const SlatStep<Any>& step) {
              const py::ssize_t row = run * pings + ping;
              const SlatReadings<Scalar> readings = step.filter.readings();
              const auto slave = step.filter.slave();
              for (int i = 0; i < 2; ++i) {
                truth_out[ping * 2 + i] = step.slave.position[i];
                error_out[row * 2 + i] = static_cast<double>(slave.x(i)) - step.slave.position[i];
                for (int j = 0; j < 2; ++j) {
                  covariance_out[row * 4 + i * 2 + j] = static_cast<double>(slave.P(i, j));
                }
              }
              for (int n = 0; n < count; ++n) {
                const py::ssize_t at = ping * count + n;
                for (int i = 0; i < 2; ++i) masters_out[at * 2 + i] = step.masters[n].position[i];
                if (n >= readings.masters) continue;
                const auto master = step.filter.master(n);
                for (int i = 0; i < 2; ++i) {
                  master_error_out[(run * pings * count + at) * 2 + i] =
                      static_cast<double>(master.x(i)) - step.masters[n].position[i];
                }
              }
              time_out[ping] = step.time_s;
              size_out[row] = static_cast<double>(readings.effective_size);
              nis_out[row] = static_cast<double>(readings.nis);
              echoes += step.heard;
              ++ping;
            });
        const SlatReadings<Scalar> end = filter.readings();
        resamplings_out[run] = end.resamplings;
        likelihood_out[run] = static_cast<double>(end.log_likelihood);
        heard_out[run] = echoes;
        refused_out[run] = end.refused;
        rebirths_out[run] = end.rebirths;
        status_out[run] = static_cast<std::uint8_t>(status);
      }
    }
    py::dict result;
    result["time_s"] = time;
    result["truth"] = truth;
    result["masters"] = masters;
    result["error"] = error;
    result["covariance"] = covariance;
    result["master_error"] = master_error;
    result["effective_size"] = size;
    result["nis"] = nis;
    result["resamplings"] = resamplings;
    result["heard"] = heard;
    result["refused"] = refused;
    result["rebirths"] = rebirths;
    result["log_likelihood"] = log_likelihood;
    result["status"] = result_status;
    return result;
  }
};

}  // namespace bindings
}  // namespace auvest
