// The family of filters as its tests go through it: every kind of AUVEST_LINEARISATIONS over every
// process of AUVEST_PROCESSES with every sensor of AUVEST_SENSORS, behind interfaces that know
// neither types nor precision, so that each filter is compiled once and the checks are not
// compiled per filter. Numbers are doubles; those of a float filter are floats.
#pragma once

#include <Eigen/Core>
#include <memory>
#include <string>
#include <vector>

#include "auvest/status.hpp"

namespace every_filter {

using auvest::Status;
using Numbers = std::vector<double>;

const int kMaxSize = 6;  ///< numbers in a measurement; those of a smaller one are the first

/// A parameter, and what the model says where it is some number and all others are as usual.
struct Checked {
  std::string parameter;
  Status status;
};

/// A process of the registry with its default parameters.
struct Process {
  int states = 0;
  int position_states = 0;
  int inputs = 0;
  bool linear = false;  ///< f is linear in x, says the model

  virtual ~Process() = default;
  virtual Status check() const = 0;
  virtual std::vector<Checked> check_with(double value) const = 0;
  virtual Eigen::VectorXd f(const Eigen::VectorXd& x, double dt, const Numbers& input) const = 0;
  virtual Eigen::MatrixXd Phi(const Eigen::VectorXd& x, double dt, const Numbers& input) const = 0;
  virtual Eigen::MatrixXd Q(double dt, const Numbers& input) const = 0;
};

/// A sensor of the registry with its default parameters.
struct Sensor {
  int size = 0;

  virtual ~Sensor() = default;
  virtual Status check() const = 0;
  virtual std::vector<Checked> check_with(double value) const = 0;
  virtual Eigen::VectorXd h(const Eigen::VectorXd& x) const = 0;
  virtual Eigen::MatrixXd H(const Eigen::VectorXd& x) const = 0;  ///< for all states
  virtual Eigen::MatrixXd R() const = 0;
};

/// What an update reports.
struct Report {
  Status status;
  Numbers plain;   ///< innovation, S, NIS, and whether the near field was taken
  Numbers robust;  ///< decision, recovered; a residual and a weight for each number

  explicit Report(Status s = Status::kOk) : status(s) {}
};

enum class Doubts { kNothing, kInfiniteHuber, kInfiniteHampel, kInfiniteIgg, kOutliers };

class Filter;

/// What a filter is restored from: all of `filter`, but for these numbers.
struct Saved {
  const Filter* filter;
  Numbers x, P;  ///< of its belief
  double interval;
  double tau_max;  ///< a parameter of its interval policy
  int rejections;  ///< a parameter of its recovery
};

class Filter {
 public:
  virtual ~Filter() = default;
  virtual std::unique_ptr<Filter> clone() const = 0;
  virtual void assign(const Filter& other) = 0;

  virtual Status check() const = 0;
  virtual bool initialised() const = 0;
  virtual Status reset(const Numbers& x0, const Numbers& P0) = 0;
  virtual Status limit_steps(double longest_step_s) = 0;
  virtual Status predict(double dt, const Numbers& input) = 0;
  /// `age` is for filters with a memory, whose updates may come late.
  virtual Report update(int sensor, const Numbers& z, double age) = 0;

  virtual Numbers x() const = 0;
  virtual Numbers P() const = 0;
  virtual Numbers state() const = 0;  ///< all that goes on from step to step
  virtual std::string bytes() const = 0;

  // Of filters with a kernel, a recovery and an interval policy.
  virtual Status reset(const Numbers&, const Numbers&, const Numbers&) { return Status::kOk; }
  virtual Status feedback(const Numbers&) { return Status::kOk; }
  virtual double interval() const { return 0; }
  virtual Saved save() const { return Saved(); }
  virtual Status restore_rule(const Saved&) { return Status::kOk; }
  virtual Status restore(const Saved&) { return Status::kOk; }
};

/// A kind of filter over a process, with all sensors for its number of states.
struct Member {
  std::string name;
  bool exact;   ///< its prediction is that of Phi and Q, whatever the state
  double most;  ///< greatest number of its precision
  std::shared_ptr<const Process> process;
  std::vector<std::shared_ptr<const Sensor>> sensors;

  std::unique_ptr<Filter> (*plain)();
  std::unique_ptr<Filter> (*robust)(Doubts);
  /// With a kernel, a recovery and an interval policy.
  std::unique_ptr<Filter> (*whole)();
  /// With a kernel, a recovery and a memory; null where the process has no input.
  std::unique_ptr<Filter> (*late)();
};

std::vector<Member> members_float();
std::vector<Member> members_double();

}  // namespace every_filter
