// A row of many runs in the lanes of an instruction set: lane_steps<Arch, Scalar>(), for a file
// that is compiled for the set (an architecture of xsimd, such as xsimd::avx2).
//
// The statements are those of GaussianFilter, RobustUpdate and RuntimeGaussian in their order, so
// that a lane has the bits of a run by itself. What those answer with a status is a mask here, and
// what they do about it is left to the run (lanes.hpp).
#pragma once

#include "desk/lane_models.hpp"

// Behind it, because their templates find the functions of lanes:
#include "auvest/filters/ekf.hpp"
#include "auvest/filters/ukf.hpp"
#include "auvest/robust/rejection_streak.hpp"
#include "auvest/runtime/any_kernel.hpp"
#include "desk/arrived.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

/// The steps of runs whose numbers lie in batches of this type.
template <class Value>
class LaneStep {
 public:
  using Scalar = typename math::ScalarOf<Value>::Type;
  using Block = desk::LaneBlock<Scalar>;
  using Filter = desk::LaneFilter<Scalar>;
  using Mask = math::Mask<Value>;

  static void predict(const Filter& filter, Block& block) {
    switch (filter.process) {
      case desk::LaneProcess::kEuler:
        return propagate<EulerAcceleration<Value>, AccelerationNoise<Scalar>>(filter, block);
      case desk::LaneProcess::kExact:
        return propagate<ExactAcceleration<Value>, AccelerationNoise<Scalar>>(filter, block);
      case desk::LaneProcess::kSpeedHeading:
        return propagate<SpeedHeading<Value>, SpeedHeadingParams<Scalar>>(filter, block);
      case desk::LaneProcess::kNone:
        break;
    }
  }

  static void update(const Filter& filter, const desk::LaneModel& sensor, Block& block) {
    if (filter.states == 6) return update_states<6>(filter, sensor, block);
    return update_states<2>(filter, sensor, block);
  }

 private:
  template <int N>
  using State = Belief<Value, N>;

  static AUVEST_INLINE Value load(const Scalar* from) {
    return Value(Value::Batch::load_unaligned(from));
  }
  static AUVEST_INLINE void store(Scalar* to, const Value& value) { value.v.store_unaligned(to); }
  static AUVEST_INLINE void store(Scalar* to, const Mask& mask) {
    store(to, select(mask, Value(1), Value(0)));
  }

  template <int N>
  static AUVEST_INLINE void load_belief(const Block& block, int lane, State<N>& belief) {
    AUVEST_UNROLL
    for (int i = 0; i < N; ++i) {
      belief.x(i) = load(block.rows.x[i] + lane);
      AUVEST_UNROLL
      for (int j = 0; j <= i; ++j) {
        belief.P(i, j) = load(block.rows.P[i * (i + 1) / 2 + j] + lane);
      }
    }
  }
  template <int N>
  static AUVEST_INLINE void store_belief(const State<N>& belief, Block& block, int lane) {
    AUVEST_UNROLL
    for (int i = 0; i < N; ++i) {
      store(block.rows.x[i] + lane, belief.x(i));
      AUVEST_UNROLL
      for (int j = 0; j <= i; ++j) {
        store(block.rows.P[i * (i + 1) / 2 + j] + lane, belief.P(i, j));
      }
    }
  }

  /// The numbers of Params in all lanes.
  template <class Params, class WideParams>
  static AUVEST_INLINE void spread(const void* bytes, WideParams& wide) {
    auto params = arrived<Params>(bytes);
    Scalar numbers[16];
    int count = 0;
    params.visit([&](const char*, Scalar& number) { numbers[count++] = number; });
    count = 0;
    wide.visit([&](const char*, Value& number) { number = Value(numbers[count++]); });
  }

  /// As GaussianFilter::check_belief(), and finite.
  template <int N>
  static AUVEST_INLINE Mask is_belief(const State<N>& belief) {
    Mask finite = math::all_finite(belief.x);
    AUVEST_UNROLL
    for (int i = 0; i < N; ++i) finite = finite && math::all_finite(&belief.P(i, 0), i + 1);
    Matrix<Value, N, N> p = belief.P;
    const Mask definite = math::ldlt(p);
    return finite && definite && is_finite(p(N - 1, N - 1));
  }

  /// False wherever math::is_coarse() may be true: it asks for the exponents of x^2 and of the
  /// variance, and so for their quotient to within a factor of 4.
  static AUVEST_INLINE Mask is_fine(const Value& x, const Value& variance) {
    constexpr Scalar epsilon = std::numeric_limits<Scalar>::epsilon();
    const Value known = larger(variance, Value(9.5367431640625e-7));  // 2^kFinestExponent
    return x * x < Value(Scalar(0.0625) / (epsilon * epsilon)) * known;
  }

  template <class Process, class Params>
  static void propagate(const Filter& filter, Block& block) {
    constexpr int N = Process::kStates;
    static_assert(Process::kLinear, "all linearisations predict it alike");
    Process process;
    spread<Params>(filter.process_params, process.params);
    for (int lane = 0; lane < block.runs; lane += Value::kWidth) {
      State<N> belief;
      load_belief(block, lane, belief);
      const Value dt = load(block.dt + lane);
      Mask ordinary = dt >= Value(0) && dt <= Value(filter.longest_step_s);
      if constexpr (InputOf<Process>::kExists) {
        for (int i = 0; i < Process::Input::RowsAtCompileTime; ++i) {
          process.input(i) = load(block.input[i] + lane);
        }
        ordinary = ordinary && math::all_finite(process.input);
      }
      process.propagate(belief, dt);
      ordinary = ordinary && is_belief(belief);
      for (int i = 0; i < Process::kPosition; ++i) {
        ordinary = ordinary && is_fine(belief.x(i), belief.P(i, i));
      }
      store_belief(belief, block, lane);
      store(block.ordinary + lane, ordinary);
    }
  }

  template <int N>
  static void update_states(const Filter& filter, const desk::LaneModel& sensor, Block& block) {
    if (sensor.kind == desk::LaneSensor::kRangeBearing) {
      using Params = typename RangeBearing<Scalar, N>::Params;
      return correct<LaneRangeBearing<Value, N>, Params>(filter, sensor, block);
    }
    return correct<LaneLeaderRange<Value, N>, LeaderRangeParams<Scalar>>(filter, sensor, block);
  }

  template <class Model, class Params>
  static void correct(const Filter& filter, const desk::LaneModel& sensor, Block& block) {
    constexpr int N = Model::kStates;
    constexpr int M = Model::kSize;
    constexpr int O = Model::kObserved;
    Model model;
    spread<Params>(sensor.params, model.params);
    using Points = SigmaPoints<Scalar>;
    Points points(typename Points::Params(), N);
    if (filter.points != nullptr) points = arrived<Points>(filter.points, points);
    const Value station[2] = {model.station()[0], model.station()[1]};
    for (int lane = 0; lane < block.runs; lane += Value::kWidth) {
      typename Model::Measurement z;
      for (int m = 0; m < M; ++m) z(m) = load(block.z[m] + lane);
      const Mask missing = !(z(0) <= Value(std::numeric_limits<Scalar>::infinity()));
      if (all(missing)) continue;
      for (int m = 0; m < M; ++m) z(m) = select(missing, Value(0), z(m));
      Mask ordinary = math::all_finite(z) && model.admits(z);
      if (sensor.moved) ordinary = ordinary && place(station, model, block, lane);

      State<N> belief;
      load_belief(block, lane, belief);
      const State<N> before = belief;
      Matrix<Value, O, O> root;
      Matrix<Value, math::other_states(N, O), O> slope;
      ordinary = ordinary && math::factor_leading(belief.P, root, slope);

      Correction<Value, M> correction;
      Matrix<Value, M, O> a;
      Matrix<Value, M, M> noise;
      const auto point = model.about(belief.x);
      typename Model::Measurement near_innovation;
      typename Model::Noise near_noise;
      const Mask near = model.near_field(point, belief.P, z, near_innovation, near_noise);
      if (filter.points != nullptr) {
        linearise_by_points(points, model, point, root, z, correction.innovation, a, noise);
      } else {
        linearise_by_jacobian(model, point, root, z, correction.innovation, a, noise);
      }
      if constexpr (M == O) {
        if (any(near)) {
          math::copy_where<Value>(near, near_innovation, correction.innovation);
          math::copy_where<Value>(near, near_noise, noise);
          math::copy_where<Value>(near, root, a);
        }
      }
      ordinary = ordinary && move_robustly(filter, block, lane, missing, belief, root, slope, a,
                                           noise, correction);
      ordinary = missing || (ordinary && is_belief(belief));
      math::copy_where<Value>(missing, before, belief);
      store_belief(belief, block, lane);
      store(block.ordinary + lane, ordinary && load(block.ordinary + lane) > Value(0));
      store(block.rows.near_field + lane, near);
      store(block.rows.nis + lane, correction.nis);
      for (int m = 0; m < M; ++m) store(block.rows.innovation[m] + lane, correction.innovation(m));
      for (int i = 0; i < M * M; ++i) store(block.rows.S[i] + lane, correction.S.data()[i]);
    }
  }

  /// Moves the stations, or leaders, of the lanes that say where. False where one is too far away
  /// for the format, or may be.
  template <class Model>
  static AUVEST_INLINE Mask place(const Value (&own)[2], Model& model, const Block& block,
                                  int lane) {
    Mask fine = Value(0) < Value(1);
    for (int i = 0; i < 2; ++i) {
      const Value there = load(block.place[i] + lane);
      const Mask given = there >= there;
      model.station()[i] = select(given, there, own[i]);
      fine = fine && is_fine(model.station()[i], model.R()(0, 0));
    }
    return fine;
  }

  /// RobustUpdate by the weights of innovations.
  template <int M, int O, int U, int N>
  static AUVEST_INLINE Mask move_robustly(const Filter& filter, Block& block, int lane,
                                          const Mask& missing, State<N>& belief,
                                          Matrix<Value, O, O>& root,
                                          const Matrix<Value, U, O>& slope, Matrix<Value, M, O>& a,
                                          Matrix<Value, M, M>& noise,
                                          Correction<Value, M>& correction) {
    innovation_covariance(a, noise, correction.S);
    Vector<Value, M> standardised, weight;
    for (int m = 0; m < M; ++m) {
      standardised(m) = correction.innovation(m) / sqrt(correction.S(m, m));
      store(block.rows.standardised[m] + lane, standardised(m));
      store(block.rows.weight[m] + lane, Value(1));
    }
    if (filter.kernel == nullptr) {
      return move(belief, root, slope, a, noise, correction.innovation, correction.S,
                  correction.nis);
    }
    const auto kernel = arrived<AnyKernel<Scalar>>(filter.kernel);
    for (int m = 0; m < M; ++m) {
      Scalar* const weights = block.rows.weight[m] + lane;
      for (int i = 0; i < Value::kWidth; ++i) {
        weights[i] = kernel.weight(block.rows.standardised[m][lane + i]);
      }
      weight(m) = load(weights);
    }
    Mask full = Value(0) < Value(1);
    Mask zero = full;
    for (int m = 0; m < M; ++m) {
      full = full && !(weight(m) < Value(1));
      zero = zero && !(weight(m) > Value(0));
    }
    const State<N> before = belief;
    const Matrix<Value, O, O> first_root = root;
    const Matrix<Value, M, O> first_a = a;
    Mask ordinary;
    if (all(full || missing)) {
      ordinary =
          move(belief, root, slope, a, noise, correction.innovation, correction.S, correction.nis);
    } else {
      Value weighted_nis;
      const Mask known = nis_of(noise, standardised, correction, weighted_nis);
      Vector<Value, M> innovation = correction.innovation;
      Matrix<Value, M, M> s = correction.S;
      weigh(weight, a, noise, innovation, s);
      Value nis;
      const Mask moved = move(belief, root, slope, a, noise, innovation, s, nis);
      ordinary = (full || known) && (zero || moved);
      math::copy_where<Value>(zero, before, belief);
      correction.nis = select(full, nis, weighted_nis);
    }
    if (filter.streak != nullptr) {
      recover(filter, first_a, first_root, correction, block, lane, missing, belief);
    }
    return ordinary;
  }

  /// correct_belief() with E as it is.
  template <int M, int O, int U, int N>
  static AUVEST_INLINE Mask move(State<N>& belief, Matrix<Value, O, O>& root,
                                 const Matrix<Value, U, O>& slope, Matrix<Value, M, O>& a,
                                 Matrix<Value, M, M>& noise, const Vector<Value, M>& innovation,
                                 const Matrix<Value, M, M>&, Value& nis) {
    const Mask definite = math::ldlt(noise);
    Posterior<Value, O> posterior;
    const Mask finite = potter(a, noise, innovation, posterior);
    nis = posterior.nis;
    return definite && finite && move_belief(belief, root, slope, posterior);
  }

  /// The same for one number seen through the only two states, as correct_belief() has it.
  static AUVEST_INLINE Mask move(State<2>& belief, Matrix<Value, 2, 2>& root,
                                 const Matrix<Value, 1, 2>&, Matrix<Value, 1, 2>& a,
                                 Matrix<Value, 1, 1>& noise, const Vector<Value, 1>& innovation,
                                 const Matrix<Value, 1, 1>& s, Value& nis) {
    const Value spread = s(0, 0);
    const Value inverse = Value(1) / spread;
    const Value step = innovation(0) * inverse;
    nis = step * innovation(0);
    const Value f0 = a(0, 0);
    const Value f1 = a(0, 1);
    belief.x(0) = belief.x(0) + root(0, 0) * f0 * step;
    belief.x(1) = belief.x(1) + (root(1, 0) * f0 + root(1, 1) * f1) * step;
    const Value left = noise(0, 0) * inverse;
    const Value u0 = root(0, 0) * f1;
    const Value u1 = root(1, 0) * f1 - root(1, 1) * f0;
    const Value u1_scaled = u1 * inverse;
    belief.P(0, 0) = left * belief.P(0, 0) + u0 * (u0 * inverse);
    belief.P(1, 0) = left * belief.P(1, 0) + u0 * u1_scaled;
    belief.P(1, 1) = left * belief.P(1, 1) + u1 * u1_scaled;
    return noise(0, 0) > Value(0) && is_finite(spread) &&
           inverse >= Value((std::numeric_limits<Scalar>::min)()) && is_finite(inverse) &&
           is_finite(nis);  // and x, as is_belief() says
  }

  /// The NIS without weights, where they are not all 1.
  template <int M>
  static AUVEST_INLINE Mask nis_of(const Matrix<Value, M, M>& noise, const Vector<Value, M>&,
                                   const Correction<Value, M>& correction, Value& nis) {
    Matrix<Value, M, M> e = noise;
    Matrix<Value, M, M> s = correction.S;
    const Mask definite = math::ldlt(e) && math::ldlt(s);
    Vector<Value, M> residual;
    nis = Value(0);
    for (int m = 0; m < M; ++m) {
      residual(m) = math::minus_dot(correction.innovation(m), &s(m, 0), residual.data(), m);
      nis = nis + residual(m) / s(m, m) * residual(m);
    }
    return definite && is_finite(nis);
  }
  static AUVEST_INLINE Mask nis_of(const Matrix<Value, 1, 1>& noise,
                                   const Vector<Value, 1>& standardised,
                                   const Correction<Value, 1>&, Value& nis) {
    nis = standardised(0) * standardised(0);
    return noise(0, 0) > Value(0) && is_finite(nis);
  }

  /// A, E, the innovation and, for one number, S with weights.
  template <int M, int O>
  static AUVEST_INLINE void weigh(const Vector<Value, M>& weight, Matrix<Value, M, O>& a,
                                  Matrix<Value, M, M>& noise, Vector<Value, M>& innovation,
                                  Matrix<Value, M, M>& s) {
    for (int m = 0; m < M; ++m) {
      const Mask counts = weight(m) > Value(0);
      const Mask less = counts && weight(m) < Value(1);
      const Value weighted = select(less, noise(m, m) / weight(m), noise(m, m));
      if (M == 1) s(m, m) = select(less, s(m, m) + (weighted - noise(m, m)), s(m, m));
      noise(m, m) = select(counts, weighted, Value(1));
      for (int k = 0; k < O; ++k) a(m, k) = select(counts, a(m, k), Value(0));
      for (int l = 0; l < m; ++l) noise(m, l) = select(counts, noise(m, l), Value(0));
      for (int l = m + 1; l < M; ++l) noise(l, m) = select(counts, noise(l, m), Value(0));
      innovation(m) = select(counts, innovation(m), Value(0));
    }
  }

  /// Tells the recovery of each run, one by one: it has little to do but after a rejection.
  template <int M, int O, int N>
  static void recover(const Filter& filter, const Matrix<Value, M, O>& a,
                      const Matrix<Value, O, O>& root, const Correction<Value, M>& correction,
                      Block& block, int lane, const Mask& missing, State<N>& belief) {
    alignas(64) Scalar numbers[M * O + O * O + M + M * M + N][Value::kWidth];
    alignas(64) Scalar gone[Value::kWidth];
    bool written = false;
    bool widened = false;
    const auto write = [&] {
      if (written) return;
      written = true;
      int row = 0;
      for (int i = 0; i < M * O; ++i) store(numbers[row++], a.data()[i]);
      for (int i = 0; i < O * O; ++i) store(numbers[row++], root.data()[i]);
      for (int m = 0; m < M; ++m) store(numbers[row++], correction.innovation(m));
      for (int i = 0; i < M * M; ++i) store(numbers[row++], correction.S.data()[i]);
      for (int i = 0; i < N; ++i) store(numbers[row++], belief.P(i, i));
    };
    store(gone, missing);
    for (int i = 0; i < Value::kWidth; ++i) {
      desk::LaneRecovery<Scalar>& carried = block.recovery[lane + i];
      bool rejected = false;
      for (int m = 0; m < M; ++m)
        rejected = rejected || !(block.rows.weight[m][lane + i] > Scalar(0));
      block.rows.recovered[lane + i] = false;
      if (gone[i] > Scalar(0) || (!rejected && carried.count == 0 && carried.widened == 0)) {
        continue;
      }
      write();
      RobustCorrection<Scalar, M> one(Status::kOk);
      Matrix<Scalar, M, O> one_a;
      Matrix<Scalar, O, O> one_root;
      Belief<Scalar, N> one_belief;
      int row = 0;
      for (int k = 0; k < M * O; ++k) one_a.data()[k] = numbers[row++][i];
      for (int k = 0; k < O * O; ++k) one_root.data()[k] = numbers[row++][i];
      for (int m = 0; m < M; ++m) one.innovation(m) = numbers[row++][i];
      for (int k = 0; k < M * M; ++k) one.S.data()[k] = numbers[row++][i];
      for (int k = 0; k < N; ++k) one_belief.P(k, k) = numbers[row++][i];
      for (int m = 0; m < M; ++m) one.weight(m) = block.rows.weight[m][lane + i];
      using Streak = RejectionStreak<Scalar>;
      Streak streak(arrived<typename Streak::Params>(filter.streak));
      take_up(carried, streak);
      block.rows.recovered[lane + i] = streak.after(one, one_a, one_root, one_belief);
      put_away(streak, carried);
      if (!block.rows.recovered[lane + i]) continue;
      widened = true;
      row -= N;
      for (int k = 0; k < N; ++k) numbers[row++][i] = one_belief.P(k, k);
    }
    if (!widened) return;
    for (int i = 0; i < N; ++i) {
      belief.P(i, i) = load(numbers[M * O + O * O + M + M * M + i]);
    }
  }
};

/// The steps of an architecture of xsimd.
template <class Arch, class Scalar>
desk::LaneSteps<Scalar> lane_steps() {
  using Step = LaneStep<math::NumberBatch<Scalar, Arch>>;
  return {&Step::predict, &Step::update};
}

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
