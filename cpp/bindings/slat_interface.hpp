// A filter of slat/ behind an interface that code for different instruction sets has in common.
//
// All of auvest has other names for each set (AUVEST_INSTRUCTIONS in auvest/config.hpp). What
// stands here has one name for all, so it says no function that would be compiled in several files:
// calls through a table only, of numbers, of Eigen's matrices, and of auvest's plain types as
// bytes.
#pragma once

#include <cstddef>
#include <cstdint>

#include "auvest/types.hpp"
#include "instruction_sets.hpp"

namespace auvest {
namespace bindings {

/// Masters that a filter has room for.
constexpr int kMostMasters = 4;
/// Models in an Imm of a master.
constexpr int kMostModes = 3;

/// What can be read besides the beliefs. What a filter has not is zero.
template <class Scalar>
struct SlatReadings {
  int masters;
  int particles;
  int resamplings;
  Scalar effective_size;
  Scalar log_likelihood;
  Scalar nis;
  int refused;
  int rebirths;
  Scalar since_rebirth_s;  ///< -1: none yet
  Scalar longest_step_s;
};

/// The state of a filter, in the order in which it visits its numbers. Of particles the weights
/// come first, then all fields of one after the other: the same for all lanes.
template <class Number, class Count>
struct SlatNumbers {
  Number* numbers;
  std::size_t number_count;
  Count* counts;
  std::size_t count_count;
};
template <class Scalar>
using SlatState = SlatNumbers<Scalar, std::int64_t>;
template <class Scalar>
using SlatStateView = SlatNumbers<const Scalar, const std::int64_t>;

/// What the sonar heard at one time.
template <class Scalar>
struct SlatEchoes {
  Vector<Scalar, 2> z[kMostMasters];
  int master[kMostMasters];
  int count;
};

/// random: a math::Random. sonar: a Sonar<Scalar>. What returns std::uint8_t returns a Status.
template <class Scalar, int Pose>
struct SlatInterface {
  using Pair = Vector<Scalar, 2>;

  virtual ~SlatInterface();  // in bind_slat.cpp
  virtual SlatInterface* clone() const = 0;
  virtual std::uint8_t reset(const Vector<Scalar, Pose>& x, const Matrix<Scalar, Pose, Pose>& P,
                             void* random) = 0;
  virtual std::uint8_t add_master(const Vector<Scalar, 6>& x, const Matrix<Scalar, 6, 6>& P) = 0;
  /// changes: of each master, or null.
  virtual std::uint8_t predict(Scalar dt, const Pair& u, const Pair* changes, void* random) = 0;
  virtual std::uint8_t update(const SlatEchoes<Scalar>& heard, const void* sonar, void* random) = 0;
  /// predict() and update(), both or, where one is refused, neither.
  virtual std::uint8_t step(Scalar dt, const Pair& u, const Pair* changes,
                            const SlatEchoes<Scalar>& heard, const void* sonar, void* random) = 0;
  virtual void slave(Vector<Scalar, Pose>& x, Matrix<Scalar, Pose, Pose>& P) const = 0;
  virtual void master(int n, Vector<Scalar, 6>& x, Matrix<Scalar, 6, 6>& P) const = 0;
  virtual void read(SlatReadings<Scalar>& readings) const = 0;
  /// Of each model of master n's Imm; returns how many, 0 where there is one model.
  virtual int mode_probabilities(int n, Scalar (&out)[kMostModes]) const = 0;
  /// Weights (particles) and poses (particles x Pose); nothing where there are no particles.
  virtual void particles(Scalar* weights, Scalar* poses) const = 0;
  /// Counts the numbers of the state and, where there are arrays for them, fills these.
  virtual void save(SlatState<Scalar>& state) const = 0;
  /// False where it is not the state of such a filter. Then this one must not be used any more.
  virtual bool restore(const SlatStateView<Scalar>& state) = 0;
};

/// A Slatf in lanes that not every processor has, in wide_<set>.cpp. setup: a SlatfSetup of the
/// motion with a pose of so many numbers.
template <InstructionSet set, int Pose>
SlatInterface<float, Pose>* make_wide_slatf(const void* setup);

}  // namespace bindings
}  // namespace auvest
