// The filters of family.hpp, from the lists.
#pragma once

// Calls, where the library forces inlining: more than half of the time to compile.
#include "auvest/config.hpp"
#undef AUVEST_INLINE
#define AUVEST_INLINE inline

#include <cstring>
#include <limits>
#include <type_traits>

#include "auvest/filters/adaptive_interval.hpp"
#include "auvest/filters/late_updates.hpp"
#include "auvest/filters/robust.hpp"
#include "auvest/registry.hpp"
#include "auvest/robust/rejection_streak.hpp"
#include "auvest/runtime/any_interval.hpp"
#include "auvest/runtime/any_kernel.hpp"
#include "auvest/runtime/any_linearisation.hpp"
#include "every_filter/family.hpp"

namespace every_filter {

template <class Scalar, int Rows, int Cols>
Numbers numbers(const auvest::Matrix<Scalar, Rows, Cols>& m) {
  Numbers result;
  for (int i = 0; i < Rows * Cols; ++i) result.push_back(double(m.data()[i]));
  return result;
}

template <class Matrix>
Matrix matrix(const double* values) {
  Matrix m;
  for (int i = 0; i < int(Matrix::SizeAtCompileTime); ++i) {
    m.data()[i] = typename Matrix::Scalar(values[i]);
  }
  return m;
}

inline void append(const Numbers& more, Numbers& numbers) {
  numbers.insert(numbers.end(), more.begin(), more.end());
}

// ---- Models.

template <class Model, class = Status>
struct InputOf {
  static constexpr int size() { return 0; }
  static void set(Model&, const Numbers&) {}
  static Numbers get(const Model&) { return Numbers(); }
  template <class Filter>
  static Status predict(Filter& filter, typename Model::Scalar dt, const Numbers&) {
    return filter.predict(dt);
  }
  template <class Filter>
  static void drive(Filter&, const Model&) {}
};

template <class Model>
struct InputOf<Model, decltype(Model().input, Status())> {
  using Input = typename Model::Input;
  static constexpr int size() { return int(Input::SizeAtCompileTime); }
  static void set(Model& model, const Numbers& values) {
    model.input = matrix<Input>(values.data());
  }
  static Numbers get(const Model& model) { return numbers(model.input); }
  template <class Filter>
  static Status predict(Filter& filter, typename Model::Scalar dt, const Numbers& values) {
    return filter.predict(dt, matrix<Input>(values.data()));
  }
  template <class Filter>
  static void drive(Filter& filter, const Model& as) {
    filter.drive(as.input);
  }
};

/// Sets one of the parameters that are visited.
template <class Scalar>
struct SetOne {
  int left;
  Scalar value;
  std::string name;

  void operator()(const char* parameter, Scalar& number) {
    if (left-- != 0) return;
    number = value;
    name = parameter;
  }
};

template <class Model>
std::vector<Checked> check_each(double value) {
  std::vector<Checked> result;
  for (int i = 0;; ++i) {
    typename Model::Params params;
    SetOne<typename Model::Scalar> set{i, typename Model::Scalar(value), std::string()};
    params.visit(set);
    if (set.name.empty()) return result;
    result.push_back({set.name, Model(params).check()});
  }
}

template <class Model>
struct ProcessOf final : Process {
  using Scalar = typename Model::Scalar;

  ProcessOf() {
    states = Model::kStates;
    position_states = Model::kPosition;
    inputs = InputOf<Model>::size();
    linear = Model::kLinear;
  }

  Status check() const override { return Model{}.check(); }
  std::vector<Checked> check_with(double value) const override { return check_each<Model>(value); }
  Eigen::VectorXd f(const Eigen::VectorXd& x, double dt, const Numbers& input) const override {
    return driven(input)
        .f(matrix<typename Model::State>(x.data()), Scalar(dt))
        .template cast<double>();
  }
  Eigen::MatrixXd Phi(const Eigen::VectorXd& x, double dt, const Numbers& input) const override {
    return driven(input)
        .Phi(matrix<typename Model::State>(x.data()), Scalar(dt))
        .template cast<double>();
  }
  Eigen::MatrixXd Q(double dt, const Numbers& input) const override {
    return driven(input).Q(Scalar(dt)).template cast<double>();
  }

 private:
  static Model driven(const Numbers& input) {
    Model model{};
    InputOf<Model>::set(model, input);
    return model;
  }
};

template <class Model>
struct SensorOf final : Sensor {
  SensorOf() { size = Model::kSize; }

  Status check() const override { return Model{}.check(); }
  std::vector<Checked> check_with(double value) const override { return check_each<Model>(value); }
  Eigen::VectorXd h(const Eigen::VectorXd& x) const override {
    return Model{}.h(matrix<typename Model::State>(x.data())).template cast<double>();
  }
  Eigen::MatrixXd H(const Eigen::VectorXd& x) const override {
    Eigen::MatrixXd result = Eigen::MatrixXd::Zero(Model::kSize, Model::kStates);
    const auto slope = Model{}.H(matrix<typename Model::State>(x.data()));
    for (int i = 0; i < Model::kSize; ++i) {
      for (int j = 0; j < Model::kObserved; ++j) result(i, j) = double(slope(i, j));
    }
    return result;
  }
  Eigen::MatrixXd R() const override { return Model{}.R().template cast<double>(); }
};

/// visitor.visit<Model>() for every sensor for N states.
template <bool Suits>
struct If {
  template <class Model, class Visitor>
  static void visit(Visitor& visitor) {
    visitor.template visit<Model>();
  }
};
template <>
struct If<false> {
  template <class Model, class Visitor>
  static void visit(Visitor&) {}
};

template <class Scalar, int N, class Visitor>
void for_every_sensor(Visitor& visitor) {
  using namespace auvest;
#define AUVEST_VISIT(name, suits, ...) If<(suits)>::template visit<__VA_ARGS__>(visitor);
  AUVEST_SENSORS(AUVEST_VISIT)
#undef AUVEST_VISIT
}

struct Sensors {
  std::vector<std::shared_ptr<const Sensor>> all;

  template <class Model>
  void visit() {
    static_assert(Model::kSize <= kMaxSize, "rows of the records are too narrow");
    all.push_back(std::make_shared<SensorOf<Model>>());
  }
};

// ---- Updates by number of the sensor.

template <class Scalar, int M>
Numbers robust_numbers(const auvest::Correction<Scalar, M>&) {
  return Numbers();
}
template <class Scalar, int M>
Numbers robust_numbers(const auvest::RobustCorrection<Scalar, M>& correction) {
  Numbers result = {double(correction.decision), double(correction.recovered)};
  append(numbers(correction.standardised), result);
  append(numbers(correction.weight), result);
  return result;
}

template <class Filter>
struct Update {
  Filter& filter;
  const Numbers& z;
  int left;
  Report report;

  template <class Model>
  void visit() {
    if (left-- != 0) return;
    const auto correction = filter.update(matrix<typename Model::Measurement>(z.data()), Model{});
    report.status = correction.status;
    report.plain = numbers(correction.innovation);
    append(numbers(correction.S), report.plain);
    append({double(correction.nis), double(correction.near_field)}, report.plain);
    report.robust = robust_numbers(correction);
  }
};

template <class Filter>
Report update(Filter& filter, int sensor, const Numbers& z) {
  Update<Filter> visitor{filter, z, sensor, Report()};
  for_every_sensor<typename Filter::Scalar, Filter::kStates>(visitor);
  return visitor.report;
}

/// A sensor and what it measured, as LateUpdates asks for them.
template <class Scalar>
struct Numbered {
  using Measurement = auvest::Vector<Scalar, kMaxSize>;
  int number;

  explicit Numbered(int n = 0) : number(n) {}
};

template <class Scalar>
using Rule = auvest::RobustUpdate<auvest::AnyKernel<Scalar>, auvest::RejectionStreak<Scalar>>;

template <class Kind>
class Robust : public auvest::Robust<Kind, Rule<typename Kind::Scalar>> {
 public:
  using Scalar = typename Kind::Scalar;
  using Base = auvest::Robust<Kind, Rule<Scalar>>;
  using Base::Base;
  using Base::update;

  Report update(const typename Numbered<Scalar>::Measurement& z, const Numbered<Scalar>& sensor) {
    return every_filter::update(static_cast<Base&>(*this), sensor.number, numbers(z));
  }
};

template <class Kind>
Report numbered(Robust<Kind>& filter, int sensor, const Numbers& z) {
  using Scalar = typename Kind::Scalar;
  return filter.update(matrix<typename Numbered<Scalar>::Measurement>(z.data()),
                       Numbered<Scalar>(sensor));
}

template <class Scalar>
Rule<Scalar> rule(Doubts doubts) {
  const Scalar infinite = std::numeric_limits<Scalar>::infinity();
  Rule<Scalar> result;
  auto& kernel = result.kernel;
  using Kind = typename auvest::AnyKernel<Scalar>::Kind;
  kernel.kind = Kind::kUnit;
  if (doubts == Doubts::kInfiniteHuber) {
    kernel.kind = Kind::kHuber;
    kernel.huber.params.k = infinite;
  } else if (doubts == Doubts::kInfiniteHampel) {
    kernel.kind = Kind::kHampel;
    auto& params = kernel.hampel.params;
    params.a = params.b = params.c = infinite;
  } else if (doubts == Doubts::kInfiniteIgg) {
    kernel.kind = Kind::kIgg;
    kernel.igg.params.k0 = kernel.igg.params.k1 = infinite;
  } else if (doubts == Doubts::kOutliers) {
    kernel.kind = Kind::kIgg;
    result.recovery.params.rejections = 2;
  }
  return result;
}

// ---- Filters.

/// What all have; `Inner` is a filter of the core.
template <class Inner>
class FilterOf : public Filter {
 public:
  using Scalar = typename Inner::Scalar;

  explicit FilterOf(const Inner& inner) : inner_(inner) {}

  void assign(const Filter& other) override { inner_ = static_cast<const FilterOf&>(other).inner_; }
  Status check() const override { return inner_.check(); }
  bool initialised() const override { return inner_.initialised(); }
  Status reset(const Numbers& x0, const Numbers& P0) override {
    return inner_.reset(matrix<typename Inner::State>(x0.data()),
                        matrix<typename Inner::Covariance>(P0.data()));
  }
  Status limit_steps(double longest_step_s) override {
    return inner_.limit_steps(Scalar(longest_step_s));
  }
  Status predict(double dt, const Numbers& input) override {
    return InputOf<typename Inner::Process>::predict(inner_, Scalar(dt), input);
  }
  Numbers x() const override { return numbers(inner_.x()); }
  Numbers P() const override { return numbers(inner_.P()); }
  std::string bytes() const override {
    std::string result(sizeof inner_, 0);
    std::memcpy(&result[0], &inner_, sizeof inner_);
    return result;
  }

 protected:
  static Numbers belief_of(const Inner& inner) {
    Numbers result = numbers(inner.x());
    append(numbers(inner.P()), result);
    append(InputOf<typename Inner::Process>::get(inner.process()), result);
    return result;
  }

  Inner inner_;
};

template <class Kind>
class Plain final : public FilterOf<Kind> {
 public:
  using FilterOf<Kind>::FilterOf;

  std::unique_ptr<Filter> clone() const override {
    return std::unique_ptr<Filter>(new Plain(*this));
  }
  Report update(int sensor, const Numbers& z, double) override {
    return every_filter::update(this->inner_, sensor, z);
  }
  Numbers state() const override { return this->belief_of(this->inner_); }
};

template <class Filter>
Numbers rule_of(const Filter& filter) {
  const auto& streak = filter.rule().recovery;
  Numbers result = {double(streak.count), double(streak.variance)};
  append(numbers(streak.recent), result);
  return result;
}

template <class Kind>
class WithKernel final : public FilterOf<Robust<Kind>> {
 public:
  using FilterOf<Robust<Kind>>::FilterOf;

  std::unique_ptr<Filter> clone() const override {
    return std::unique_ptr<Filter>(new WithKernel(*this));
  }
  Report update(int sensor, const Numbers& z, double) override {
    return numbered(this->inner_, sensor, z);
  }
  Numbers state() const override {
    Numbers result = this->belief_of(this->inner_);
    append(rule_of(this->inner_), result);
    return result;
  }
};

template <class Kind>
using Adaptive = auvest::AdaptiveInterval<Robust<Kind>, auvest::AnyInterval<typename Kind::Scalar>>;

template <class Kind>
class Whole final : public FilterOf<Adaptive<Kind>> {
 public:
  using Base = FilterOf<Adaptive<Kind>>;
  using typename Base::Scalar;
  using Position = auvest::Vector<Scalar, 2>;
  using Base::Base;
  using Base::inner_;
  using Base::reset;

  std::unique_ptr<Filter> clone() const override {
    return std::unique_ptr<Filter>(new Whole(*this));
  }
  Report update(int sensor, const Numbers& z, double) override {
    return numbered(inner_, sensor, z);
  }
  Status reset(const Numbers& x0, const Numbers& P0, const Numbers& reference) override {
    return inner_.reset(matrix<typename Kind::State>(x0.data()),
                        matrix<typename Kind::Covariance>(P0.data()),
                        matrix<Position>(reference.data()));
  }
  Status feedback(const Numbers& reference) override {
    return inner_.feedback(matrix<Position>(reference.data()));
  }
  double interval() const override { return double(inner_.interval()); }
  Numbers state() const override {
    Numbers result = this->belief_of(inner_);
    append(rule_of(inner_), result);
    const auto& law = inner_.policy().mahalanobis.memory;
    append({double(inner_.interval()), double(law.tau), double(law.interval), double(law.ratio),
            double(law.mahalanobis_squared)},
           result);
    append(numbers(law.last_estimate), result);
    append(numbers(law.last_reference), result);
    return result;
  }
  Saved save() const override {
    Saved saved;
    saved.filter = this;
    saved.x = numbers(inner_.belief().x);
    saved.P = numbers(inner_.belief().P);
    saved.interval = interval();
    saved.tau_max = double(inner_.policy().mahalanobis.params.tau_max);
    saved.rejections = inner_.rule().recovery.params.rejections;
    return saved;
  }
  Status restore_rule(const Saved& saved) override {
    auto rule = static_cast<const Whole*>(saved.filter)->inner_.rule();
    rule.recovery.params.rejections = static_cast<std::uint8_t>(saved.rejections);
    return static_cast<Robust<Kind>&>(inner_).restore(belief(saved), rule);
  }
  Status restore(const Saved& saved) override {
    const auto& other = static_cast<const Whole*>(saved.filter)->inner_;
    auto policy = other.policy();
    policy.mahalanobis.params.tau_max = Scalar(saved.tau_max);
    const Status status = inner_.restore(belief(saved), policy, Scalar(saved.interval));
    if (status == Status::kOk) InputOf<typename Kind::Process>::drive(inner_, other.process());
    return status;
  }

 private:
  static typename Kind::BeliefType belief(const Saved& saved) {
    typename Kind::BeliefType result;
    result.x = matrix<typename Kind::State>(saved.x.data());
    result.P = matrix<typename Kind::Covariance>(saved.P.data());
    return result;
  }
};

template <class Kind>
class Late final : public Filter {
 public:
  using Scalar = typename Kind::Scalar;
  using Input = typename Kind::Process::Input;

  explicit Late(const Robust<Kind>& filter) : late_(filter) {}

  std::unique_ptr<Filter> clone() const override {
    return std::unique_ptr<Filter>(new Late(*this));
  }
  void assign(const Filter& other) override { late_ = static_cast<const Late&>(other).late_; }
  Status check() const override { return late_.filter().check(); }
  bool initialised() const override { return late_.filter().initialised(); }
  Status reset(const Numbers& x0, const Numbers& P0) override {
    Robust<Kind> filter = late_.filter();
    const Status status = filter.reset(matrix<typename Kind::State>(x0.data()),
                                       matrix<typename Kind::Covariance>(P0.data()));
    if (status == Status::kOk) late_ = Updates(filter);
    return status;
  }
  Status limit_steps(double longest_step_s) override {  // and forgets what came before
    Robust<Kind> filter = late_.filter();
    const Status status = filter.limit_steps(typename Kind::Scalar(longest_step_s));
    late_ = Updates(filter);
    return status;
  }
  Status predict(double dt, const Numbers& input) override {
    return late_.predict(Scalar(dt), matrix<Input>(input.data()));
  }
  Report update(int sensor, const Numbers& z, double age) override {
    return late_.update(matrix<typename Numbered<Scalar>::Measurement>(z.data()),
                        Numbered<Scalar>(sensor), Scalar(age));
  }
  Numbers x() const override { return numbers(late_.filter().x()); }
  Numbers P() const override { return numbers(late_.filter().P()); }
  Numbers state() const override { return WithKernel<Kind>(late_.filter()).state(); }
  std::string bytes() const override {
    std::string result(sizeof late_, 0);
    std::memcpy(&result[0], &late_, sizeof late_);
    return result;
  }

 private:
  using Updates = auvest::LateUpdates<Robust<Kind>, Numbered<Scalar>, 12>;
  Updates late_;
};

// ---- The lists.

template <class Kind>
std::unique_ptr<Filter> make_plain() {
  return std::unique_ptr<Filter>(new Plain<Kind>(Kind(typename Kind::Process{})));
}
template <class Kind>
Robust<Kind> robust(Doubts doubts) {
  return Robust<Kind>(Kind(typename Kind::Process{}), rule<typename Kind::Scalar>(doubts));
}
template <class Kind>
std::unique_ptr<Filter> make_robust(Doubts doubts) {
  return std::unique_ptr<Filter>(new WithKernel<Kind>(robust<Kind>(doubts)));
}
template <class Kind>
std::unique_ptr<Filter> make_whole() {
  auvest::AnyInterval<typename Kind::Scalar> policy;
  policy.kind = auvest::AnyInterval<typename Kind::Scalar>::Kind::kMahalanobis;
  return std::unique_ptr<Filter>(
      new Whole<Kind>(Adaptive<Kind>(robust<Kind>(Doubts::kOutliers), policy)));
}
/// Null for a process without input.
template <class Kind, bool Driven = (InputOf<typename Kind::Process>::size() > 0)>
struct MakeLate {
  static std::unique_ptr<Filter> make() {
    return std::unique_ptr<Filter>(new Late<Kind>(robust<Kind>(Doubts::kOutliers)));
  }
  static constexpr std::unique_ptr<Filter> (*maker())() { return &make; }
};
template <class Kind>
struct MakeLate<Kind, false> {
  static constexpr std::unique_ptr<Filter> (*maker())() { return nullptr; }
};

template <class Kind>
struct IsEkf : std::false_type {};
template <class Process>
struct IsEkf<auvest::Ekf<Process>> : std::true_type {};

template <class Kind>
void add_member(const std::string& name, std::vector<Member>& members) {
  using Model = typename Kind::Process;
  using Scalar = typename Kind::Scalar;
  Member member;
  member.name = name;
  member.exact = Model::kLinear || IsEkf<Kind>::value;
  member.most = double((std::numeric_limits<Scalar>::max)());
  member.process = std::make_shared<ProcessOf<Model>>();
  Sensors sensors;
  for_every_sensor<Scalar, Model::kStates>(sensors);
  member.sensors = sensors.all;
  member.plain = &make_plain<Kind>;
  member.robust = &make_robust<Kind>;
  member.whole = &make_whole<Kind>;
  member.late = MakeLate<Kind>::maker();
  members.push_back(member);
}

template <class Model>
void add_kinds(const std::string& process, std::vector<Member>& members) {
  using namespace auvest;
#define AUVEST_ADD(name, filter) add_member<filter<Model>>(#filter " of " + process, members);
  AUVEST_LINEARISATIONS(AUVEST_ADD)
#undef AUVEST_ADD
}

template <class Scalar>
std::vector<Member> members() {
  using namespace auvest;
  std::vector<Member> result;
#define AUVEST_ADD(name, ...) add_kinds<__VA_ARGS__>(name, result);
  AUVEST_PROCESSES(AUVEST_ADD)
#undef AUVEST_ADD
  return result;
}

}  // namespace every_filter
