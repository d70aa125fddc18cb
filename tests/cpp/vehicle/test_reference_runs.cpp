// Published runs, digit by digit: PVS's by the peer's form, and ours. Both columns differ by the
// corrections that peer_hull.hpp names, and by nothing else.
#include <array>
#include <vector>

#include "auvest/vehicle/allocation.hpp"
#include "peer_hull.hpp"
#include "support.hpp"

namespace {

using namespace vehicle;

/// x y z | phi theta psi [deg] | u v w | p q r.
using Row = std::array<double, 12>;

/// Half a unit in the last printed digit, and what rounding the table itself may have done.
void check_row(const Row& found, const Row& printed, int velocity_digits, double rate_unit) {
  for (std::size_t i = 0; i < 12; ++i) {
    CAPTURE(i);
    double unit = 1e-4;
    if (i >= 6) unit = std::pow(10.0, -velocity_digits);
    if (i >= 9) unit = rate_unit;
    CHECK(std::fabs(found[i] - printed[i]) <= 0.5001 * unit);
  }
}

template <class Hull>
Row row(const Hull& hull, const typename Hull::State& x, const typename Hull::Current& stream,
        double rate_scale) {
  const auto ground = hull.ground_velocity(x, stream);
  Row r;
  for (int i = 0; i < 3; ++i) {
    r[std::size_t(i)] = double(x(i));
    r[std::size_t(3 + i)] = double(x(3 + i)) / kDegree;
    r[std::size_t(6 + i)] = double(ground(i));
    r[std::size_t(9 + i)] = double(ground(3 + i)) * rate_scale;
  }
  return r;
}

struct Run {
  const char* name;
  double rudder, stern, stern_until, rpm, speed, towards, down;  // deg, deg, s, rpm, m/s, deg, m/s
};

const Run kRuns[] = {
    {"P1", 0, 0, 0, 1200, 0, 0, 0},   {"P2", 10, 0, 0, 1200, 0, 0, 0},
    {"P3", 0, 2, 20, 1200, 0, 0, 0},  {"P4", 5, 0, 0, 1525, 0.5, 90, 0},
    {"P5", 0, 0, 0, 0, 0.5, 45, 0.1},
};

struct Printed {
  int run;
  double t;
  Row row;
};

const Printed kOurs[] = {
    {0,
     5,
     {{5.7471, -0.0016, 0.2160, 0.6267, -1.9932, -0.0133, 1.94332, -0.00001, 0.00719, -0.0093,
       0.8692, 0.0003}}},
    {0, 20, {{35.6716, 0.0014, 0.3572, 0.6172, 0, 0.0087, 1.99868, 0, 0, 0, 0, 0}}},
    {0, 200, {{395.4336, 0.0559, 0.3572, 0.6172, 0, 0.0087, 1.99868, 0, 0, 0, 0, 0}}},
    {1,
     5,
     {{5.6974, 0.4376, 0.2205, 1.8362, -2.2060, 15.0855, 1.92955, -0.09497, 0.00891, 0.4033, 0.9643,
       6.5804}}},
    {1,
     20,
     {{17.6485, 23.5491, 0.5997, 1.9805, -0.4908, 116.1338, 1.98212, -0.10342, 0.00373, 0.0578,
       0.2331, 6.7399}}},
    {1,
     100,
     {{-13.4142, 10.4208, 1.9700, 1.9805, -0.4908, 655.6656, 1.98212, -0.10342, 0.00373, 0.0578,
       0.2331, 6.7399}}},
    {2,
     5,
     {{5.7418, -0.0026, 0.2979, 0.6287, -4.8980, -0.0471, 1.94280, 0, -0.01640, -0.0093, -0.2228,
       -0.0001}}},
    {2, 20, {{35.5613, -0.0258, 2.7311, 0.6197, -4.9228, -0.0475, 1.99817, 0, -0.00922, 0, 0, 0}}},
    {2, 50, {{95.5088, -0.0244, 3.1527, 0.6172, 0, 0.0057, 1.99868, 0, 0, 0, 0, 0}}},
    {3,
     10,
     {{19.0501, 10.4363, 0.7072, 2.5049, -0.5507, 42.2159, 2.86846, 0.27827, -0.01386, 0.0572,
       0.2994, 5.8455}}},
    {3,
     50,
     {{-21.6906, 47.5705, 1.6288, 2.5057, -0.5190, 276.3082, 2.03583, -0.03648, 0.00615, 0.0530,
       0.2558, 5.8465}}},
    {3,
     100,
     {{-8.1531, 96.5399, 2.7784, 2.5057, -0.5190, 568.9229, 2.29097, -0.52869, 0.02538, 0.0530,
       0.2558, 5.8465}}},
    {4,
     10,
     {{0.9064, 2.9602, 0.7194, 0.0109, -0.0809, -0.0009, 0.17001, 0.34260, 0.09187, -0.0025, 0.0073,
       0}}},
    {4, 100, {{29.4541, 34.6833, 9.6471, 0, -0.0005, -0.0009, 0.35186, 0.35354, 0.09998, 0, 0, 0}}},
};

const Printed kPvs[] = {
    {0,
     5,
     {{5.8530, -0.0019, 0.2316, 0.6392, -1.9996, -0.0132, 1.9586, -0.0001, 0.0084, -0.0087, 0.9645,
       0.0003}}},
    {0, 20, {{35.9423, 0.0002, 0.3615, 0.6309, 0, 0.0093, 2.0093, -0.0001, 0, 0, 0, 0}}},
    {0, 200, {{397.6126, 0.0434, 0.3613, 0.6309, 0, 0.0093, 2.0093, -0.0001, 0, 0, 0, 0}}},
    {1,
     5,
     {{5.8160, 0.2997, 0.2319, 1.4051, -2.1271, 13.1182, 1.9367, -0.1671, 0.0099, 0.2907, 1.0252,
       4.6027}}},
    {1,
     20,
     {{27.1167, 18.7696, 0.4510, 1.5243, -0.2886, 79.2575, 1.9813, -0.1862, 0.0018, 0.0221, 0.1170,
       4.3944}}},
    {1,
     100,
     {{25.8098, 15.2397, 0.9948, 1.5243, -0.2886, 430.9353, 1.9813, -0.1862, 0.0018, 0.0221, 0.1169,
       4.3944}}},
    {2,
     5,
     {{5.8463, -0.0030, 0.3275, 0.6417, -5.2684, -0.0522, 1.9580, -0.0001, -0.0167, -0.0087,
       -0.1580, -0.0001}}},
    {2, 20, {{35.8221, -0.0286, 2.8676, 0.6335, -5.0716, -0.0501, 2.0088, 0, -0.0091, 0, 0, 0}}},
    {2, 50, {{96.0872, -0.0282, 3.2675, 0.6309, 0, 0.0059, 2.0093, 0, 0, 0, 0, 0}}},
    {3,
     10,
     {{19.7472, 7.6192, 0.7606, 1.8131, -0.1605, 26.8644, 2.6652, 0.2682, 0.0025, -0.0065, 0.1151,
       3.4328}}},
    {3,
     50,
     {{22.0333, 102.6079, 1.0134, 1.7815, -0.2993, 157.9991, 2.6026, -0.6381, 0.0015, 0.0328,
       0.0997, 3.3957}}},
    {3,
     100,
     {{-7.2118, 53.8608, 1.3213, 2.0280, -0.2284, 347.9135, 2.4820, 0.2993, 0.0020, -0.0066, 0.1369,
       3.6931}}},
    {4,
     10,
     {{3.5450, 2.8152, 0.0949, 0.0156, 0.0048, -0.0145, 0.3597, 0.3315, 0.0017, -0.0029, -0.0026,
       0}}},
    {4, 100, {{35.4807, 34.3587, 0.1212, 0, 0, -0.0145, 0.3535, 0.3535, 0, 0, 0, 0}}},
};

template <class Scalar, class Method>
Row fly(const Run& run, double t, double h) {
  using Hull = Remus<Scalar>;
  const Hull hull(auvest::remus100<Scalar>());
  const auto stream = current<Hull>(run.speed * std::cos(run.towards * kDegree),
                                    run.speed * std::sin(run.towards * kDegree), run.down);
  typename Hull::State x = hull.at_rest(stream);
  const int steps = int(std::lround(t / h));
  for (int k = 0; k < steps; ++k) {
    const double stern = k * h < run.stern_until - 1e-9 ? run.stern : 0;
    Method::step(hull, x, command<Hull>(run.rudder, stern, run.rpm), stream, Scalar(h));
  }
  return row(hull, x, stream, 1 / kDegree);
}

TEST_CASE("hull: runs P1 to P5 to every printed digit") {
  for (const Printed& printed : kOurs) {
    CAPTURE(kRuns[printed.run].name);
    CAPTURE(printed.t);
    check_row(fly<double, auvest::Rk4>(kRuns[printed.run], printed.t, 0.02), printed.row, 5, 1e-4);
  }
}

TEST_CASE("hull: in float the runs are the same within a fraction of a millimetre per second") {
  // Rounding of the state adds up along the track: 1e-7 of 400 m per step of 0.02 s, and in the
  // heading of a turning hull. 0.03 m after 10,000 steps; attitude and velocities settle.
  for (const Printed& printed : kOurs) {
    CAPTURE(kRuns[printed.run].name);
    CAPTURE(printed.t);
    const Row found = fly<float, auvest::Rk4>(kRuns[printed.run], printed.t, 0.02);
    for (std::size_t i = 0; i < 12; ++i) {
      CAPTURE(i);
      const double bound = i < 3    ? 3e-4 * printed.t
                           : i == 5 ? 5e-4 * printed.t
                           : i < 6  ? 2e-4
                                    : 3e-4;
      CHECK(std::fabs(found[i] - printed.row[i]) <= bound);
    }
  }
}

TEST_CASE("hull: a step of 0.1 s is good to a millimetre") {
  const Row coarse = fly<double, auvest::Rk4>(kRuns[1], 20, 0.1);
  const Row fine = fly<double, auvest::Rk4>(kRuns[1], 20, 0.02);
  for (std::size_t i = 0; i < 6; ++i) CHECK(std::fabs(coarse[i] - fine[i]) < 1e-3);
}

TEST_CASE("hull: semi-implicit steps of 0.02 s are 0.02 m and 0.15 degrees off after 20 s") {
  const Row cheap = fly<double, auvest::SemiImplicit>(kRuns[1], 20, 0.02);
  const Row exact = fly<double, auvest::Rk4>(kRuns[1], 20, 0.02);
  const double off = std::hypot(cheap[0] - exact[0], cheap[1] - exact[1]);
  CHECK(off > 0.01);
  CHECK(off < 0.03);
  CHECK(std::fabs(cheap[5] - exact[5]) == doctest::Approx(0.15).epsilon(0.1));
}

Row fly_peer(const peer::Torpedo& hull, const Run& run, double t, bool rk4 = false) {
  const double h = 0.02;
  const bool corrected = !hull.form.yaw_only_current;
  const peer::Vec3 stream(run.speed * std::cos(run.towards * kDegree),
                          run.speed * std::sin(run.towards * kDegree), corrected ? run.down : 0);
  Eigen::Matrix<double, 15, 1> x = Eigen::Matrix<double, 15, 1>::Zero();
  const int steps = int(std::lround(t / h));
  for (int k = 0; k < steps; ++k) {
    const double stern = k * h < run.stern_until - 1e-9 ? run.stern : 0;
    const peer::Vec3 command(run.rudder * kDegree, stern * kDegree, run.rpm / 60);
    if (rk4) {
      hull.rk4(x, command, stream, h);
      continue;
    }
    peer::Vec6 eta = x.head<6>(), nu = x.segment<6>(6);
    peer::Vec3 actuators = x.tail<3>();
    hull.euler(eta, nu, actuators, command, stream, h);
    x << eta, nu, actuators;
  }
  Row r;
  for (int i = 0; i < 12; ++i) {
    const bool angle = (i >= 3 && i < 6) || i >= 9;
    r[std::size_t(i)] = x(i) / (angle ? kDegree : 1);
  }
  return r;
}

TEST_CASE("peer: its form reproduces PVS to every printed digit") {
  const peer::Torpedo pvs(peer::Form::pvs());
  CHECK(pvs.M(0, 0) - 31.0 < 0.9);  // 31.03 kg and added mass
  for (const Printed& printed : kPvs) {
    CAPTURE(kRuns[printed.run].name);
    CAPTURE(printed.t);
    check_row(fly_peer(pvs, kRuns[printed.run], printed.t), printed.row, 4, 1e-4);
  }
}

TEST_CASE("peer: corrected, it flies ours") {
  const peer::Torpedo corrected;
  for (const Printed& printed : kOurs) {
    if (printed.t > 50) continue;
    CAPTURE(kRuns[printed.run].name);
    CAPTURE(printed.t);
    check_row(fly_peer(corrected, kRuns[printed.run], printed.t, true), printed.row, 5, 1e-4);
  }
}

// ---- Steady motion ------------------------------------------------------------------------------

TEST_CASE("hull: steady speed and roll, ours and PVS's") {
  const double rpm[] = {300, 600, 900, 1200, 1525};
  const double speed[] = {0.48298, 0.99576, 1.49833, 1.99868, 2.54018};
  const double roll[] = {0.0402, 0.1550, 0.3474, 0.6172, 0.9968};
  const double pvs_speed[] = {0.48603, 1.00117, 1.50631, 2.00928, 2.55365};
  const double pvs_roll[] = {0.0411, 0.1584, 0.3551, 0.6309, 1.0188};
  const peer::Torpedo pvs(peer::Form::pvs());
  for (int i = 0; i < 5; ++i) {
    CAPTURE(rpm[i]);
    const Run run = {"steady", 0, 0, 0, rpm[i], 0, 0, 0};
    const Row found = fly<double, auvest::Rk4>(run, 300, 0.02);
    CHECK(std::fabs(found[6] - speed[i]) <= 0.5001e-5);
    CHECK(std::fabs(found[3] - roll[i]) <= 0.5001e-4);
    const Row peers = fly_peer(pvs, run, 300);
    CHECK(std::fabs(peers[6] - pvs_speed[i]) <= 0.5001e-5);
    CHECK(std::fabs(peers[3] - pvs_roll[i]) <= 0.5001e-4);

    // Closed form: thrust = drag, a quadratic in u but for the low-speed linear term; roll =
    // asin(K / (W z_g)).
    const auto p = auvest::remus100<double>();
    const Remus<double> hull(p);
    const double n = rpm[i] / 60;
    const double nu[6] = {found[6], 0, 0, 0, 0, 0};
    const double actuators[3] = {0, 0, n};
    const auto tau = forces(hull, nu, nullptr, actuators);
    CHECK(std::fabs(tau(0)) < 1e-9);
    CHECK(std::asin(tau(3) / (p.restoring.weight_n * 0.02)) / kDegree ==
          doctest::Approx(found[3]).epsilon(1e-9));
  }
}

struct Turn {
  double rudder, rpm;
  double pvs[5], ours[5];  // U, dpsi/dt [deg/s], radius, roll and drift angle [deg]
};

TEST_CASE("hull: steady turns, ours and PVS's") {
  const Turn turns[] = {
      {5, 900, {1.5015, 1.8138, 47.43, 0.633, -3.945}, {1.4956, 2.6833, 31.93, 0.757, -1.758}},
      {5, 1525, {2.5443, 3.6116, 40.36, 1.956, -4.167}, {2.5344, 5.8523, 24.81, 2.506, -2.070}},
      {10, 900, {1.4926, 3.0413, 28.12, 0.819, -5.237}, {1.4887, 4.4818, 19.03, 1.029, -2.790}},
      {15, 900, {1.4803, 4.0619, 20.88, 0.971, -6.165}, {1.4782, 5.9326, 14.28, 1.244, -3.576}},
      {15, 1525, {2.5067, 7.7788, 18.46, 3.005, -6.386}, {2.5028, 12.0505, 11.89, 4.045, -3.917}},
  };
  const double unit[5] = {1e-4, 1e-4, 1e-2, 1e-3, 1e-3};
  const peer::Torpedo pvs(peer::Form::pvs());
  for (const Turn& turn : turns) {
    CAPTURE(turn.rudder);
    CAPTURE(turn.rpm);
    const Run run = {"turn", turn.rudder, 0, 0, turn.rpm, 0, 0, 0};
    const Row rows[2] = {fly_peer(pvs, run, 200), fly<double, auvest::Rk4>(run, 200, 0.02)};
    for (int i = 0; i < 2; ++i) {
      CAPTURE(i);
      const Row& r = rows[i];
      const double* const printed = i == 0 ? turn.pvs : turn.ours;
      const double phi = r[3] * kDegree, theta = r[4] * kDegree;
      const double rate = (r[10] * std::sin(phi) + r[11] * std::cos(phi)) / std::cos(theta);
      const double speed = std::sqrt(r[6] * r[6] + r[7] * r[7] + r[8] * r[8]);
      // The radius is that of the track in the plane: a banked turn also sinks.
      const peer::Vec3 way = peer::rotation(phi, theta, 0) * peer::Vec3(r[6], r[7], r[8]);
      const double found[5] = {speed, rate, std::hypot(way(0), way(1)) / (rate * kDegree), r[3],
                               std::atan2(r[7], r[6]) / kDegree};
      for (int k = 0; k < 5; ++k) {
        CAPTURE(k);
        CHECK(std::fabs(found[k] - printed[k]) <= 0.5001 * unit[k]);
      }
    }
  }
}

TEST_CASE("hull: zig-zag 10/10") {
  using Hull = Remus<double>;
  const Hull hull(auvest::remus100<double>());
  const auto still = current<Hull>(0, 0, 0);
  Hull::State x = hull.at_rest(still);
  x(6) = 1.49833;
  x(12 + auvest::kPropeller) = 15;
  std::vector<double> reversals, peaks;
  double side = 1, peak = 0;
  for (int k = 0; k <= 1600; ++k) {
    const double heading = x(5) / kDegree;
    if (heading * side > 10) {
      reversals.push_back(k * 0.02);
      side = -side;
      if (reversals.size() > 1) peaks.push_back(peak);
      peak = 0;
    }
    // The largest heading on the side that the hull is leaving.
    peak = std::max(peak, -side * heading);
    auvest::Rk4::step(hull, x, command<Hull>(10 * side, 0, 900), still, 0.02);
  }
  const double printed[] = {2.64, 8.14, 13.60, 19.06, 24.52, 29.98};
  REQUIRE(reversals.size() == 6);
  for (std::size_t i = 0; i < 6; ++i) CHECK(reversals[i] == doctest::Approx(printed[i]));
  REQUIRE(peaks.size() == 5);
  CHECK(std::fabs(peaks[0] - 11.36) <= 0.00501);
  for (std::size_t i = 1; i < 5; ++i) {
    CHECK(peaks[i] >= 11.245);
    CHECK(peaks[i] <= 11.285);
  }
}

TEST_CASE("hull: coasting from 2 m/s") {
  using Hull = Remus<double>;
  const Hull hull(auvest::remus100<double>());
  const auto still = current<Hull>(0, 0, 0);
  Hull::State x = hull.at_rest(still);
  x(6) = 2;
  const int t[] = {1, 5, 10, 20};
  const double speed[] = {1.44883, 0.68274, 0.39577, 0.18830};
  const double way[] = {1.69491, 5.59111, 8.17387, 10.90873};
  int done = 0;
  for (int i = 0; i < 4; ++i) {
    run(hull, x, command<Hull>(0, 0, 0), still, 0.02, 50 * t[i] - done);
    done = 50 * t[i];
    CHECK(std::fabs(x(6) - speed[i]) <= 0.5001e-5);
    CHECK(std::fabs(x(0) - way[i]) <= 0.5001e-5);
  }
}

// ---- The ROV ------------------------------------------------------------------------------------

struct RovRun {
  const char* name;
  double tau[6];
  double stream[3];
  double at_2[12], at_20[12];
};

const RovRun kRovRuns[] = {
    {"V1",
     {20, 0, 0, 0, 0, 0},
     {0, 0, 0},
     {0.55137, 0, 0.02168, 0, 4.3708, 0, 0.33004, 0, 0.03103, 0, 0.04983, 0},
     {6.51713, 0, 0.00599, 0, 4.5817, 0, 0.33043, 0, 0.02582, 0, 0, 0}},
    {"V2",
     {10, 5, 2, 0, 0, 0.3},
     {0, 0, 0},
     {0.29831, 0.27689, 0.06875, -4.7790, 7.9829, 32.1727, 0.23068, 0.11508, 0.07287, -0.10810,
      0.06558, 0.41889},
     {0.08591, 1.13089, 0.45208, -3.4975, 9.0394, 123.7954, 0.23378, 0.11328, 0.06615, -0.07096,
      -0.02520, 0.43206}},
    {"V3",
     {10, 5, 2, 0, 0, 0.3},
     {0.3, -0.2, 0.1},
     {0.75824, -0.03505, 0.21810, -2.2251, 3.6722, 33.1445, 0.36708, -0.21864, 0.16306, -0.20118,
      0.10012, 0.41887},
     {5.93666, -2.78394, 2.41028, -3.3988, 8.9591, 124.0384, -0.11136, -0.02590, 0.10479, -0.07458,
      -0.02433, 0.43205}},
    {"V4",
     {0, 0, 0, 0, 0, 0},
     {0.3, -0.2, 0.1},
     {0.43066, -0.24337, 0.16650, 0.8631, 0.6510, 2.0417, 0.26905, -0.16932, 0.12203, -0.11946,
      -0.04467, 0.02245},
     {5.77893, -3.65278, 2.42391, 0.8211, -0.0077, 18.6218, 0.22053, -0.27873, 0.12994, -0.02681,
      0.00012, 0.01140}},
};

template <class Scalar>
void check_rov_runs(double slack) {
  using Hull = Rov<Scalar>;
  const Hull hull(auvest::bluerov2_heavy<Scalar>());
  REQUIRE(hull.check() == auvest::Status::kOk);
  const auto& thrusters = hull.vehicle().thrusters;
  const auto allocation = auvest::allocation_of(thrusters);
  for (const RovRun& rov : kRovRuns) {
    CAPTURE(rov.name);
    const auto stream = current<Hull>(rov.stream[0], rov.stream[1], rov.stream[2]);
    auvest::Vector<Scalar, 6> demand;
    for (int i = 0; i < 6; ++i) demand(i) = Scalar(rov.tau[i]);
    const auto result = allocation.allocate(demand);
    CHECK(!result.saturated);
    typename Hull::Command inputs;
    for (int i = 0; i < 8; ++i) inputs(i) = thrusters.curve.input(result.thrust(i));
    typename Hull::State x = hull.at_rest(stream);
    run(hull, x, inputs, stream, 0.01, 200);
    for (int half = 0; half < 2; ++half) {
      CAPTURE(half);
      const Row found = row(hull, x, stream, 1);
      const double* const printed = half == 0 ? rov.at_2 : rov.at_20;
      for (std::size_t i = 0; i < 12; ++i) {
        CAPTURE(i);
        double error = found[i] - printed[i];
        if (i == 5) error -= 360 * std::round(error / 360);
        CHECK(std::fabs(error) <= 0.5001 * (i >= 3 && i < 6 ? 1e-4 : 1e-5) + slack);
      }
      if (half == 0) run(hull, x, inputs, stream, 0.01, 1800);
    }
  }
}

TEST_CASE("ROV: runs V1 to V4 to every printed digit") { check_rov_runs<double>(0); }

// 2,000 steps: half an epsilon of a heading of 484 degrees each, 1e-3 degrees at most; of positions
// up to 7 m, 2,000 times 2.4e-7 m at most.
TEST_CASE("ROV: the same in float") { check_rov_runs<float>(1e-3); }

}  // namespace
