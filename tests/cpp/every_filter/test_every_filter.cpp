// What every filter of the family does, whatever its kind, process, sensors and precision.
#include <doctest/doctest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <limits>

#include "auvest/math/random.hpp"
#include "auvest/robust/robust_correction.hpp"
#include "every_filter/family.hpp"

namespace {

using namespace every_filter;
using Eigen::MatrixXd;
using Eigen::VectorXd;

const double kNan = std::numeric_limits<double>::quiet_NaN();
const double kInfinity = std::numeric_limits<double>::infinity();

const std::vector<Member>& all_members() {
  static const std::vector<Member> all = [] {
    std::vector<Member> found = members_float();
    const std::vector<Member> more = members_double();
    found.insert(found.end(), more.begin(), more.end());
    return found;
  }();
  return all;
}

/// To the precision of a member, so that nothing is rounded on the way in.
double rounded(const Member& member, double value) {
  return member.most < 1e39 ? double(static_cast<float>(value)) : value;
}

VectorXd mean(const Member& member) {
  const int n = member.process->states;
  VectorXd x(n);
  for (int i = 0; i < n; ++i) x(i) = rounded(member, i < 2 ? 40 - 15 * i : 0.3 - 0.05 * i);
  return x;
}

/// With correlations; what is not a position is known to 0.1.
MatrixXd covariance(const Member& member) {
  const int n = member.process->states;
  MatrixXd root = MatrixXd::Zero(n, n);
  for (int i = 0; i < n; ++i) {
    root(i, i) = i < 2 ? 1.5 : 0.1;
    if (i > 0) root(i, i - 1) = 0.3 * root(i, i);
  }
  MatrixXd p = root * root.transpose();
  for (int i = 0; i < n * n; ++i) p.data()[i] = rounded(member, p.data()[i]);
  return p;
}

Numbers numbers(const MatrixXd& m) {  // symmetric or a column: the order does not matter
  return Numbers(m.data(), m.data() + m.size());
}
Numbers start(const Member& member) { return numbers(mean(member)); }
Numbers prior(const Member& member) { return numbers(covariance(member)); }

VectorXd vector(const Numbers& values) {
  return Eigen::Map<const VectorXd>(values.data(), Eigen::Index(values.size()));
}
MatrixXd square(const Numbers& values, int n) {
  return Eigen::Map<const MatrixXd>(values.data(), n, n).transpose();
}

// ---- Records.

struct Row {
  double dt;
  Numbers input;
  int sensor;
  bool missing;
  Numbers z;
};

/// Uneven times, all sensors in turn, missing rows, outliers alone and in a row.
std::vector<Row> record(const Member& member, int rows = 60) {
  auvest::math::Random random(1);
  const Process& process = *member.process;
  REQUIRE(process.check() == Status::kOk);
  VectorXd truth = mean(member);
  truth(0) += 0.7;
  std::vector<Row> result;
  for (int k = 0; k < rows; ++k) {
    Row row;
    row.dt = 0.5 + 0.25 * (k % 3);
    for (int i = 0; i < process.inputs; ++i) {
      row.input.push_back(rounded(member, 0.4 * (1 + 0.5 * std::sin(0.2 * k + i))));
    }
    row.sensor = k % static_cast<int>(member.sensors.size());
    row.missing = k % 5 == 4;
    truth = process.f(truth, row.dt, row.input);
    const Sensor& sensor = *member.sensors[static_cast<std::size_t>(row.sensor)];
    REQUIRE(sensor.check() == Status::kOk);
    const VectorXd h = sensor.h(truth);
    const MatrixXd r = sensor.R();
    const double off = k % 7 == 3 || (k >= 40 && k < 47) ? 12 : k % 7 == 5 ? 2.5 : 0;
    for (int i = 0; i < kMaxSize; ++i) {
      const double noise = off + random.normal<double>();
      row.z.push_back(i < sensor.size ? rounded(member, h(i) + std::sqrt(r(i, i)) * noise) : 0);
    }
    result.push_back(row);
  }
  return result;
}

std::unique_ptr<Filter> begun(const Member& member, std::unique_ptr<Filter> filter) {
  REQUIRE(filter->check() == Status::kOk);
  REQUIRE(filter->reset(start(member), prior(member)) == Status::kOk);
  return filter;
}

/// One row of a filter with all that it can have: the prediction, the update, the choice of the
/// next interval. All that can be read after it.
Numbers step(Filter& filter, const Row& row) {
  REQUIRE(filter.predict(row.dt, row.input) == Status::kOk);
  Numbers seen;
  if (!row.missing) {
    const Report report = filter.update(row.sensor, row.z, 0);
    REQUIRE(report.status == Status::kOk);
    seen = report.plain;
    seen.insert(seen.end(), report.robust.begin(), report.robust.end());
  }
  Numbers reference = filter.x();
  reference.resize(2);
  reference[0] += 0.01;
  REQUIRE(filter.feedback(reference) == Status::kOk);
  const Numbers state = filter.state();
  seen.insert(seen.end(), state.begin(), state.end());
  return seen;
}

// ---- Models.

template <class Model>
void check_parameters(const Model& model) {
  REQUIRE(model.check() == Status::kOk);
  CHECK(model.check_with(0.25).size() > 0);
  for (const double bad : {kNan, kInfinity, -kInfinity}) {
    for (const Checked& checked : model.check_with(bad)) {
      CAPTURE(checked.parameter);
      const bool no_limit = checked.parameter == "largest_range_m" && bad == kInfinity;
      CHECK(checked.status == (no_limit ? Status::kOk : Status::kBadParameter));
    }
  }
  // But for where something stands, and for correlations, all are sizes.
  for (const Checked& checked : model.check_with(-0.25)) {
    const std::string& name = checked.parameter;
    CAPTURE(name);
    const auto begins = [&](const char* word) { return name.find(word) == 0; };
    const bool signed_number = begins("station_") || begins("leader_") || begins("heading_") ||
                               begins("cov_") || begins("smallest_range");
    CHECK(checked.status == (signed_number ? Status::kOk : Status::kBadParameter));
  }
}

TEST_CASE("every model refuses parameters that are not finite, and sizes below zero") {
  for (const Member& member : all_members()) {
    CAPTURE(member.name);
    check_parameters(*member.process);
    for (std::size_t k = 0; k < member.sensors.size(); ++k) {
      CAPTURE(k);
      check_parameters(*member.sensors[k]);
    }
  }
}

// ---- Equivalences.

TEST_CASE("every filter: a kernel that doubts nothing gives the bits of the plain filter") {
  for (const Member& member : all_members()) {
    CAPTURE(member.name);
    for (const Doubts doubts : {Doubts::kNothing, Doubts::kInfiniteHuber, Doubts::kInfiniteHampel,
                                Doubts::kInfiniteIgg}) {
      const auto plain = begun(member, member.plain());
      const auto robust = begun(member, member.robust(doubts));
      for (const Row& row : record(member)) {
        REQUIRE(plain->predict(row.dt, row.input) == Status::kOk);
        REQUIRE(robust->predict(row.dt, row.input) == Status::kOk);
        if (row.missing) continue;
        const Report a = plain->update(row.sensor, row.z, 0);
        const Report b = robust->update(row.sensor, row.z, 0);
        REQUIRE(a.status == Status::kOk);
        REQUIRE(b.status == Status::kOk);
        REQUIRE(a.plain == b.plain);
        REQUIRE(b.robust[0] == double(auvest::Decision::kAccepted));
        REQUIRE(b.robust[1] == 0);  // recovered
        REQUIRE(plain->x() == robust->x());
        REQUIRE(plain->P() == robust->P());
      }
    }
  }
}

/// One update of the Kalman filter of textbooks, in the form of Joseph.
void update_textbook(const VectorXd& innovation, const MatrixXd& H, const MatrixXd& R, VectorXd& x,
                     MatrixXd& P) {
  const MatrixXd S = H * P * H.transpose() + R;
  const MatrixXd gain = P * H.transpose() * S.inverse();
  const MatrixXd rest = MatrixXd::Identity(P.rows(), P.rows()) - gain * H;
  x += gain * innovation;
  P = (rest * P * rest.transpose() + gain * R * gain.transpose()).eval();
}

/// As far as three points can say.
bool is_linear(const Sensor& sensor, int states) {
  auvest::math::Random random(3);
  MatrixXd slopes[3];
  for (MatrixXd& slope : slopes) {
    VectorXd x(states);
    for (int i = 0; i < states; ++i) x(i) = 50 * random.normal<double>();
    slope = sensor.H(x);
  }
  return slopes[0] == slopes[1] && slopes[0] == slopes[2];
}

TEST_CASE("every filter: linear models give the Kalman filter of textbooks, to 1e-10") {
  for (const Member& member : members_double()) {
    if (!member.exact) continue;
    CAPTURE(member.name);
    const int n = member.process->states;
    const auto filter = begun(member, member.plain());
    VectorXd x = mean(member);
    MatrixXd P = covariance(member);
    VectorXd size = VectorXd::Zero(n);
    int updates = 0;
    for (const Row& row : record(member, 120)) {
      REQUIRE(filter->predict(row.dt, row.input) == Status::kOk);
      const MatrixXd phi = member.process->Phi(x, row.dt, row.input);
      P = (phi * P * phi.transpose() + member.process->Q(row.dt, row.input)).eval();
      x = member.process->f(x, row.dt, row.input);
      const Sensor& sensor = *member.sensors[static_cast<std::size_t>(row.sensor)];
      if (!row.missing && is_linear(sensor, n)) {
        const VectorXd innovation = vector(row.z).head(sensor.size) - sensor.h(x);
        const MatrixXd S = sensor.H(x) * P * sensor.H(x).transpose() + sensor.R();
        update_textbook(innovation, sensor.H(x), sensor.R(), x, P);
        const Report report = filter->update(row.sensor, row.z, 0);
        REQUIRE(report.status == Status::kOk);
        const double nis = innovation.dot(S.inverse() * innovation);
        REQUIRE(std::fabs(report.plain[report.plain.size() - 2] - nis) < 1e-9 * (1 + nis));
        ++updates;
      }
      const VectorXd own_x = vector(filter->x());
      const MatrixXd own_P = square(filter->P(), n);
      const VectorXd sigma = P.diagonal().cwiseSqrt();
      size = size.cwiseMax(x.cwiseAbs());
      for (int i = 0; i < n; ++i) {
        REQUIRE(std::fabs(own_x(i) - x(i)) < 1e-10 * (size(i) + sigma(i)));
        for (int j = 0; j < n; ++j) {
          REQUIRE(std::fabs(own_P(i, j) - P(i, j)) < 1e-10 * sigma(i) * sigma(j));
        }
      }
    }
    CHECK(updates > 20);  // each number of states has linear sensors
  }
}

TEST_CASE("every filter: a row without a measurement only predicts") {
  for (const Member& member : all_members()) {
    CAPTURE(member.name);
    const auto whole = begun(member, member.whole());
    const auto refusing = begun(member, member.whole());
    const auto plain = begun(member, member.plain());
    const Numbers nothing(kMaxSize, kNan);
    VectorXd x = mean(member);
    MatrixXd P = covariance(member);
    for (Row row : record(member, 30)) {
      row.missing = true;
      step(*whole, row);
      CHECK(refusing->update(row.sensor, nothing, 0).status == Status::kNotFinite);
      step(*refusing, row);
      REQUIRE(whole->state() == refusing->state());
      REQUIRE(plain->predict(row.dt, row.input) == Status::kOk);
      REQUIRE(plain->x() == whole->x());
      REQUIRE(plain->P() == whole->P());
      if (!member.exact) continue;
      const Process& process = *member.process;
      const MatrixXd phi = process.Phi(x, row.dt, row.input);
      P = (phi * P * phi.transpose() + process.Q(row.dt, row.input)).eval();
      x = process.f(x, row.dt, row.input);
      const double tolerance = member.most > 1e39 ? 1e-12 : 2e-5;
      const VectorXd sigma = P.diagonal().cwiseSqrt();
      const VectorXd off_x = vector(plain->x()) - x;
      const MatrixXd off_P = square(plain->P(), process.states) - P;
      for (int i = 0; i < process.states; ++i) {
        REQUIRE(std::fabs(off_x(i)) <= tolerance * (sigma(i) + std::fabs(x(i))));
        for (int j = 0; j < process.states; ++j) {
          REQUIRE(std::fabs(off_P(i, j)) <= tolerance * sigma(i) * sigma(j));
        }
      }
    }
  }
}

// ---- States.

TEST_CASE(
    "every filter: same inputs give the same bits; copies and what was saved go on with them") {
  for (const Member& member : all_members()) {
    CAPTURE(member.name);
    const auto rows = record(member, 40);
    const auto filter = begun(member, member.whole());
    const auto again = begun(member, member.whole());
    const double at_first = filter->interval();
    std::vector<Numbers> expected;
    for (const Row& row : rows) {
      expected.push_back(step(*filter, row));
      REQUIRE(step(*again, row) == expected.back());
    }
    REQUIRE(filter->reset(start(member), prior(member)) == Status::kOk);
    REQUIRE(filter->interval() == at_first);
    const auto assigned = member.whole();
    for (std::size_t k = 0; k < rows.size(); ++k) {
      if (k == 20) {
        const std::string before = filter->bytes();
        const auto copy = filter->clone();
        const auto restored = member.whole();
        const Saved saved = filter->save();
        REQUIRE(restored->restore_rule(saved) == Status::kOk);
        REQUIRE(restored->restore(saved) == Status::kOk);
        REQUIRE(restored->state() == filter->state());
        assigned->assign(*filter);
        for (std::size_t j = k; j < rows.size(); ++j) {
          REQUIRE(step(*copy, rows[j]) == expected[j]);
          REQUIRE(step(*restored, rows[j]) == expected[j]);
        }
        const bool shares = filter->bytes() != before;
        REQUIRE_FALSE(shares);
      }
      REQUIRE(step(*filter, rows[k]) == expected[k]);
      if (k >= 20) REQUIRE(step(*assigned, rows[k]) == expected[k]);
    }
  }
}

TEST_CASE("every filter: over many steps P stays symmetric and positive definite") {
  for (const Member& member : all_members()) {
    CAPTURE(member.name);
    const auto filter = begun(member, member.whole());
    int rejected = 0;
    int recovered = 0;
    for (const Row& row : record(member, 300)) {
      REQUIRE(filter->predict(row.dt, row.input) == Status::kOk);
      if (!row.missing) {
        const Report report = filter->update(row.sensor, row.z, 0);
        REQUIRE(report.status == Status::kOk);
        rejected += report.robust[0] == double(auvest::Decision::kRejected) ? 1 : 0;
        recovered += report.robust[1] != 0 ? 1 : 0;
      }
      const MatrixXd p = square(filter->P(), member.process->states);
      REQUIRE(p == p.transpose());
      REQUIRE(p.llt().info() == Eigen::Success);
      REQUIRE(vector(filter->x()).allFinite());
    }
    CHECK(rejected > 0);
    CHECK(recovered > 0);
  }
}

// ---- Refusals.

/// What `call` says is as wanted, and not a bit of the filter has changed.
template <class Call>
void refuses(Filter& filter, Status wanted, Call call) {
  const std::string before = filter.bytes();
  CHECK(call() == wanted);
  const bool unchanged = filter.bytes() == before;
  CHECK(unchanged);
}

void refuses_resets(const Member& member, Filter& filter) {
  const std::size_t n = static_cast<std::size_t>(member.process->states);
  const Numbers x = start(member);
  const Numbers p = prior(member);
  const auto with = [&](Status wanted, const Numbers& x0, const Numbers& P0) {
    refuses(filter, wanted, [&] { return filter.reset(x0, P0); });
  };
  for (const double bad : {kNan, kInfinity, -kInfinity}) {
    for (std::size_t i = 0; i < n; ++i) {
      Numbers x0 = x;
      x0[i] = bad;
      with(Status::kNotFinite, x0, p);
      for (std::size_t j = 0; j <= i; ++j) {
        Numbers p0 = p;
        p0[i * n + j] = bad;
        with(Status::kNotFinite, x, p0);
      }
    }
  }
  for (std::size_t i = 0; i < n; ++i) {
    for (const double bad : {0.0, -p[i * n + i]}) {
      Numbers p0 = p;
      p0[i * n + i] = bad;
      with(Status::kNotPositiveDefinite, x, p0);
    }
    if (i == 0) continue;
    Numbers p0 = p;
    p0[i * n] = 1.1 * std::sqrt(p[0] * p[i * n + i]);  // a correlation of 1.1
    with(Status::kNotPositiveDefinite, x, p0);
  }
}

void refuses_references(const Member& member, Filter& filter) {
  for (const double bad : {kNan, kInfinity, -kInfinity}) {
    for (const Numbers& reference : {Numbers{bad, 2}, Numbers{1, bad}}) {
      const auto reset = [&] { return filter.reset(start(member), prior(member), reference); };
      refuses(filter, Status::kNotFinite, reset);
      if (!filter.initialised()) continue;
      refuses(filter, Status::kNotFinite, [&] { return filter.feedback(reference); });
    }
  }
}

void refuses_to_be_restored(Filter& filter) {
  const Saved good = filter.save();
  const auto with = [&](Status wanted, const Saved& saved) {
    refuses(filter, wanted, [&] { return filter.restore(saved); });
  };
  const auto with_rule = [&](Status wanted, const Saved& saved) {
    refuses(filter, wanted, [&] { return filter.restore_rule(saved); });
  };
  Saved saved = good;
  for (const double bad : {kNan, kInfinity, 0.0, -1.0}) {
    saved.interval = bad;
    with(std::isfinite(bad) ? Status::kBadParameter : Status::kNotFinite, saved);
  }
  saved = good;
  saved.tau_max = 2;
  with(Status::kBadParameter, saved);
  saved = good;
  saved.rejections = 0;
  with_rule(Status::kBadParameter, saved);
  saved = good;
  saved.x.back() = kNan;
  with(Status::kNotFinite, saved);
  with_rule(Status::kNotFinite, saved);
  saved = good;
  saved.P.back() = -saved.P.back();
  with(Status::kNotPositiveDefinite, saved);
  with_rule(Status::kNotPositiveDefinite, saved);
}

void refuses_predictions(const Member& member, Filter& filter, const Row& row) {
  const auto with = [&](Status wanted, double dt, const Numbers& input) {
    refuses(filter, wanted, [&] { return filter.predict(dt, input); });
  };
  with(Status::kNotFinite, kNan, row.input);
  with(Status::kNotFinite, kInfinity, row.input);
  with(Status::kTimeBackwards, -1e-6, row.input);
  with(Status::kStepTooLong, 3600.001, row.input);
  with(Status::kStepTooLong, member.most, row.input);
  for (std::size_t i = 0; i < row.input.size(); ++i) {
    Numbers input = row.input;
    input[i] = kNan;
    with(Status::kNotFinite, row.dt, input);
    input[i] = -kInfinity;
    with(Status::kNotFinite, row.dt, input);
  }
  // A speed or a distance, or else the time, beyond what can be represented.
  Numbers input = row.input;
  if (!input.empty()) input[0] = member.most;
  const auto unlimited = filter.clone();
  REQUIRE(unlimited->limit_steps(kInfinity) == Status::kOk);
  const auto too_far = [&] { return unlimited->predict(input.empty() ? member.most : 10, input); };
  refuses(*unlimited, Status::kOverflow, too_far);
}

void refuses_updates(const Member& member, Filter& filter, const Row& row, double age) {
  for (std::size_t k = 0; k < member.sensors.size(); ++k) {
    const int sensor = static_cast<int>(k);
    CAPTURE(sensor);
    const auto with = [&](Status wanted, const Numbers& z) {
      refuses(filter, wanted, [&] {
        const Report report = filter.update(sensor, z, age);
        for (const double number : report.plain) CHECK(number == 0);
        for (const double number : report.robust) CHECK(number == 0);
        return report.status;
      });
    };
    for (int i = 0; i < member.sensors[k]->size; ++i) {
      for (const double bad : {kNan, kInfinity, -kInfinity}) {
        Numbers z = row.z;
        z[static_cast<std::size_t>(i)] = bad;
        with(Status::kNotFinite, z);
      }
    }
    with(Status::kOverflow, Numbers(kMaxSize, member.most));
  }
}

TEST_CASE("every filter: a call that is refused says why and changes nothing") {
  for (const Member& member : all_members()) {
    CAPTURE(member.name);
    const auto rows = record(member, 20);
    const auto filter = member.whole();
    const Row& row = rows[0];
    const auto not_yet = Status::kNotInitialised;
    refuses(*filter, not_yet, [&] { return filter->predict(row.dt, row.input); });
    refuses(*filter, not_yet, [&] { return filter->update(row.sensor, row.z, 0).status; });
    refuses(*filter, not_yet, [&] { return filter->feedback({1, 2}); });
    refuses_resets(member, *filter);
    refuses_references(member, *filter);
    CHECK_FALSE(filter->initialised());

    REQUIRE(filter->reset(start(member), prior(member)) == Status::kOk);
    for (const Row& taken : rows) step(*filter, taken);
    const auto twin = filter->clone();
    refuses_resets(member, *filter);
    refuses_references(member, *filter);
    refuses_to_be_restored(*filter);
    refuses_predictions(member, *filter, row);
    refuses_updates(member, *filter, row, 0);
    for (const Row& taken : rows) REQUIRE(step(*filter, taken) == step(*twin, taken));
  }
}

TEST_CASE("every filter: a prediction is as long as longest_step_s at most") {
  for (const Member& member : all_members()) {
    CAPTURE(member.name);
    const Numbers still(static_cast<std::size_t>(member.process->inputs), 0.0);
    for (const double limit : {0.25, 30.0, 3600.0}) {
      const auto filter = begun(member, member.whole());
      for (const double none : {0.0, -1.0, kNan}) {
        refuses(*filter, Status::kBadParameter, [&] { return filter->limit_steps(none); });
      }
      REQUIRE(filter->limit_steps(limit) == Status::kOk);
      refuses(*filter, Status::kStepTooLong, [&] { return filter->predict(1.001 * limit, still); });
      CHECK(filter->predict(limit, still) == Status::kOk);
      CHECK(filter->predict(0, still) == Status::kOk);
    }
    const auto filter = begun(member, member.whole());
    REQUIRE(filter->limit_steps(kInfinity) == Status::kOk);
    refuses(*filter, Status::kNotFinite, [&] { return filter->predict(kInfinity, still); });
    CHECK(filter->predict(7200, still) == Status::kOk);
  }
}

TEST_CASE("every filter: a position so large that the format is coarse against P is refused") {
  for (const Member& member : all_members()) {
    CAPTURE(member.name);
    // A sigma of 1: coarse where half a unit in the last place is above 1/8 (resolution.hpp).
    const bool single = member.most < 1e39;
    const double far = std::ldexp(1.0, single ? 22 : 51);
    const std::size_t n = static_cast<std::size_t>(member.process->states);
    Numbers p0 = prior(member);
    const std::size_t axes = static_cast<std::size_t>(member.process->position_states);
    for (std::size_t i = 0; i < axes; ++i) {
      for (std::size_t j = 0; j < n; ++j) p0[i * n + j] = p0[j * n + i] = i == j ? 1 : 0;
    }
    for (std::size_t axis = 0; axis < axes; ++axis) {
      Numbers x0 = start(member);
      x0[axis] = -far;
      const auto filter = begun(member, member.whole());
      refuses(*filter, Status::kFarFromOrigin, [&] { return filter->reset(x0, p0); });
      x0[axis] = 0.49 * far;
      CHECK(filter->reset(x0, p0) == Status::kOk);
    }
  }
}

TEST_CASE("every filter: only the lower triangle of P0 is read") {
  for (const Member& member : all_members()) {
    CAPTURE(member.name);
    const std::size_t n = static_cast<std::size_t>(member.process->states);
    Numbers p0 = prior(member);
    for (std::size_t i = 0; i < n; ++i) {
      for (std::size_t j = i + 1; j < n; ++j) p0[i * n + j] = kNan;
    }
    const auto expected = begun(member, member.whole());
    const auto filter = member.whole();
    REQUIRE(filter->reset(start(member), p0) == Status::kOk);
    CHECK(filter->P() == prior(member));
    for (const Row& row : record(member, 20)) {
      REQUIRE(step(*filter, row) == step(*expected, row));
    }
  }
}

// ---- Measurements of an earlier time.

TEST_CASE("every filter: late measurements are those in time, to the bit") {
  int members = 0;
  for (const Member& member : all_members()) {
    CAPTURE(member.name);
    CHECK((member.late == nullptr) == (member.process->inputs == 0));
    if (member.late == nullptr) continue;
    ++members;
    const auto rows = record(member);
    const auto in_time = begun(member, member.robust(Doubts::kOutliers));
    const auto late = begun(member, member.late());
    int differed = 0;
    for (std::size_t k = 0; k < rows.size(); ++k) {
      const Row& row = rows[k];
      REQUIRE(in_time->predict(row.dt, row.input) == Status::kOk);
      REQUIRE(late->predict(row.dt, row.input) == Status::kOk);
      if (!row.missing) REQUIRE(in_time->update(row.sensor, row.z, 0).status == Status::kOk);
      if (k % 2 == 0) {
        const bool same = late->state() == in_time->state();  // what was measured now is not here
        differed += same ? 0 : 1;
        CHECK((same ? row.missing : true));
      } else {
        // The measurement of the row before comes now, as if after that of this row.
        if (!row.missing) REQUIRE(late->update(row.sensor, row.z, 0).status == Status::kOk);
        const Row& before = rows[k - 1];
        if (!before.missing) {
          REQUIRE(late->update(before.sensor, before.z, row.dt).status == Status::kOk);
        }
        REQUIRE(late->state() == in_time->state());
      }
    }
    CHECK(differed > 20);
  }
  CHECK(members > 0);
}

TEST_CASE("every filter: with a memory, too, a call that is refused changes nothing") {
  for (const Member& member : all_members()) {
    if (member.late == nullptr) continue;
    CAPTURE(member.name);
    const auto rows = record(member, 20);
    const auto filter = begun(member, member.late());
    for (const Row& row : rows) {
      REQUIRE(filter->predict(row.dt, row.input) == Status::kOk);
      REQUIRE(filter->update(row.sensor, row.z, 0).status == Status::kOk);
    }
    const auto twin = filter->clone();
    const Row& row = rows.back();
    const auto with = [&](Status wanted, double age) {
      refuses(*filter, wanted, [&] { return filter->update(row.sensor, row.z, age).status; });
    };
    with(Status::kNotFinite, kNan);
    with(Status::kNotFinite, kInfinity);
    with(Status::kTimeBackwards, -1e-6);
    with(Status::kTimeBackwards, 100);
    refuses_resets(member, *filter);
    refuses_predictions(member, *filter, row);
    for (const double age : {0.0, row.dt}) refuses_updates(member, *filter, row, age);
    for (const Row& taken : rows) {
      for (Filter* f : {filter.get(), twin.get()}) {
        REQUIRE(f->predict(taken.dt, taken.input) == Status::kOk);
        REQUIRE(f->update(taken.sensor, taken.z, 0).status == Status::kOk);
      }
      REQUIRE(filter->state() == twin->state());
    }
  }
}

}  // namespace
