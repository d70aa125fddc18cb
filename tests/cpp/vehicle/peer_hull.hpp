// The torpedo written a second time, another way: state nu over ground, matrices C and D, angles of
// attack by arc tangents, cross flow by quadrature. Corrected in every point it must agree with
// auvest::Hull to rounding. Each point can be left as PythonVehicleSimulator (PVS, T. I. Fossen, at
// the commit of May 2025) has it: one at a time they are negative controls, all together they are
// PVS, whose published runs the form must reproduce.
#pragma once

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace peer {

using Vec3 = Eigen::Vector3d;
using Vec6 = Eigen::Matrix<double, 6, 1>;
using Mat3 = Eigen::Matrix3d;
using Mat6 = Eigen::Matrix<double, 6, 6>;

constexpr double kPi = 3.14159265358979323846;

/// What is left as in PVS.
struct Form {
  bool short_spheroid = false;    // semi-axes L/2 and d/2: 31.03 kg
  bool ground_thrust = false;     // propeller inflow from the speed over ground
  bool yaw_only_current = false;  // current turned by the heading alone
  bool one_strip_more = false;    // 21 strips of L/20, in the sway plane only
  bool linear_lift = false;       // lift linear in atan2(w, u), in the heave plane only
  bool heave_unfaded = false;     // linear heave damping at every speed
  bool fins_on_plane = false;     // fins on u^2 + v^2 and u^2 + w^2

  static Form pvs() {
    Form f;
    f.short_spheroid = f.ground_thrust = f.yaw_only_current = f.one_strip_more = f.linear_lift =
        f.heave_unfaded = f.fins_on_plane = true;
    return f;
  }
};

inline Mat3 skew(const Vec3& a) {
  Mat3 s;
  s << 0, -a(2), a(1), a(2), 0, -a(0), -a(1), a(0), 0;
  return s;
}

inline Mat6 coriolis(const Mat6& M, const Vec6& nu) {
  const Vec3 p = M.topLeftCorner<3, 3>() * nu.head<3>() + M.topRightCorner<3, 3>() * nu.tail<3>();
  const Vec3 h =
      M.bottomLeftCorner<3, 3>() * nu.head<3>() + M.bottomRightCorner<3, 3>() * nu.tail<3>();
  Mat6 C = Mat6::Zero();
  C.topRightCorner<3, 3>() = -skew(p);
  C.bottomLeftCorner<3, 3>() = -skew(p);
  C.bottomRightCorner<3, 3>() = -skew(h);
  return C;
}

inline Mat3 rotation(double phi, double theta, double psi) {
  using Eigen::AngleAxisd;
  return (AngleAxisd(psi, Vec3::UnitZ()) * AngleAxisd(theta, Vec3::UnitY()) *
          AngleAxisd(phi, Vec3::UnitX()))
      .toRotationMatrix();
}

inline Mat3 euler_rates(double phi, double theta) {
  Mat3 T;
  T << 1, std::sin(phi) * std::tan(theta), std::cos(phi) * std::tan(theta), 0, std::cos(phi),
      -std::sin(phi), 0, std::sin(phi) / std::cos(theta), std::cos(phi) / std::cos(theta);
  return T;
}

/// Integrals of s|s| and x s|s| with s = v + x r over [-L/2, L/2]: Simpson's rule, exact for the
/// quadratic and cubic pieces on both sides of the zero of s.
inline void cross_flow_quadrature(double length, double v, double r, double& i0, double& i1) {
  const double end = 0.5 * length;
  double cut = r != 0 ? -v / r : 2 * end;
  if (!(std::fabs(cut) < end)) cut = end;
  i0 = i1 = 0;
  const double pieces[2][2] = {{-end, cut}, {cut, end}};
  for (const auto& piece : pieces) {
    const double width = piece[1] - piece[0];
    if (width <= 0) continue;
    const double middle = 0.5 * (piece[0] + piece[1]);
    const double sign = v + middle * r < 0 ? -1 : 1;
    const auto f = [&](double x) { return sign * (v + x * r) * (v + x * r); };
    i0 += width / 6 * (f(piece[0]) + 4 * f(middle) + f(piece[1]));
    i1 += width / 6 * (piece[0] * f(piece[0]) + 4 * middle * f(middle) + piece[1] * f(piece[1]));
  }
}

class Torpedo {
 public:
  Form form;
  double zg = 0.02;
  Mat6 M;

  explicit Torpedo(const Form& f = Form()) : form(f) {
    const double factor = f.short_spheroid ? 1 : 1.0096;
    a_ = factor * L / 2;
    const double b = factor * d / 2;
    m_ = 4.0 / 3 * kPi * rho * a_ * b * b;
    const double ix = 0.4 * m_ * b * b;
    const double iy = 0.2 * m_ * (a_ * a_ + b * b);
    const double e = std::sqrt(1 - (b / a_) * (b / a_));
    const double l = std::log((1 + e) / (1 - e));
    const double alpha = 2 * (1 - e * e) / std::pow(e, 3) * (l / 2 - e);
    const double beta = 1 / (e * e) - (1 - e * e) * l / (2 * std::pow(e, 3));
    const double k1 = alpha / (2 - alpha);
    const double k2 = beta / (2 - beta);
    const double k3 = std::pow(e, 4) * (beta - alpha) /
                      ((2 - e * e) * (2 * e * e - (2 - e * e) * (beta - alpha)));
    MA_ = Mat6::Zero();
    MA_.diagonal() << m_ * k1, m_ * k2, m_ * k2, 0.3 * ix, k3 * iy, k3 * iy;
    const Mat3 S = skew(Vec3(0, 0, zg));
    MRB_ = Mat6::Zero();
    MRB_.topLeftCorner<3, 3>() = m_ * Mat3::Identity();
    MRB_.topRightCorner<3, 3>() = -m_ * S;
    MRB_.bottomLeftCorner<3, 3>() = m_ * S;
    MRB_.bottomRightCorner<3, 3>() = Vec3(ix, iy, iy).asDiagonal().toDenseMatrix() - m_ * S * S;
    M = MRB_ + MA_;
    W_ = m_ * 9.81;
    const double w4 = std::sqrt(W_ * zg / M(3, 3));
    const double w5 = std::sqrt(W_ * zg / M(4, 4));
    D_ << M(0, 0) / 20, M(1, 1) / 20, M(2, 2) / 20, 0.6 * w4 * M(3, 3), 1.6 * w5 * M(4, 4), M(5, 5);
    drag_ = 0.42 * kPi * b * b / S_area;
  }

  /// d(nu)/dt; actuators: rudder, stern planes [rad], shaft [rev/s].
  Vec6 acceleration(const Vec6& eta, const Vec6& nu, const Vec3& actuators,
                    const Vec3& current) const {
    const Vec3 angles = form.yaw_only_current ? Vec3(0, 0, eta(5)) : Vec3(eta.tail<3>());
    const Vec3 stream = rotation(angles(0), angles(1), angles(2)).transpose() * current;
    Vec6 nu_c = Vec6::Zero();
    nu_c.head<3>() = stream;
    Vec6 dnu_c = Vec6::Zero();
    const Vec3 turning = form.yaw_only_current ? Vec3(0, 0, nu(5)) : Vec3(nu.tail<3>());
    dnu_c.head<3>() = -turning.cross(stream);
    return dnu_c + M.ldlt().solve(force(eta, nu, nu - nu_c, actuators));
  }

  /// All but the inertia.
  Vec6 force(const Vec6& eta, const Vec6& nu, const Vec6& nu_r, const Vec3& actuators) const {
    const double u = nu_r(0), v = nu_r(1), w = nu_r(2);
    const double U = nu_r.head<3>().norm();
    Vec6 tau = Vec6::Zero();

    Mat6 CA = coriolis(MA_, nu_r);
    for (const auto& pair : {std::make_pair(4, 0), {4, 2}, {5, 0}, {5, 1}}) {
      CA(pair.first, pair.second) = CA(pair.second, pair.first) = 0;
    }
    tau -= (coriolis(MRB_, nu_r) + CA) * nu_r;

    const double fading = std::exp(-3 * U);
    Vec6 faded(fading, fading, form.heave_unfaded ? 1 : fading, 1, 1, 1);
    tau -= D_.cwiseProduct(faded).cwiseProduct(nu_r);

    const double A = d * d / S_area;
    const double slope = kPi * A / (1 + std::sqrt(1 + A * A / 4));
    const double q = 0.5 * rho * U * U * S_area;
    if (form.linear_lift) {
      const double angle = std::atan2(w, u);
      const double CL = slope * angle;
      const double CD = drag_ + CL * CL / (kPi * 0.7 * A);
      tau(0) += q * (-CD * std::cos(angle) + CL * std::sin(angle));
      tau(2) += q * (-CD * std::sin(angle) - CL * std::cos(angle));
    } else {
      const double across = std::hypot(v, w);
      const double angle = std::atan2(across, u);
      const double CL = slope * std::sin(angle) * std::cos(angle);
      const double CD = drag_ + CL * CL / (kPi * 0.7 * A);
      tau(0) += q * (-CD * std::cos(angle) + CL * std::sin(angle));
      const double side = q * (-CD * std::sin(angle) - CL * std::cos(angle));
      if (across > 0) {
        tau(1) += side * v / across;
        tau(2) += side * w / across;
      }
    }

    const double hoerner = 1.2108 + (1.0836 - 1.2108) * (0.5 - 0.4933) / (0.5585 - 0.4933);
    const double k = 0.5 * rho * d * hoerner;
    double i0 = 0, i1 = 0;
    if (form.one_strip_more) {
      for (int i = 0; i <= 20; ++i) {
        const double x = -L / 2 + i * L / 20;
        const double s = v + x * nu_r(5);
        i0 += s * std::fabs(s) * L / 20;
        i1 += x * s * std::fabs(s) * L / 20;
      }
      tau(1) -= k * i0;
      tau(5) -= k * i1;
    } else {
      cross_flow_quadrature(L, v, nu_r(5), i0, i1);
      tau(1) -= k * i0;
      tau(5) -= k * i1;
      cross_flow_quadrature(L, w, -nu_r(4), i0, i1);
      tau(2) -= k * i0;
      tau(4) += k * i1;
    }

    const double n = actuators(2);
    const double inflow =
        form.ground_thrust ? 0.944 * nu.head<3>().norm() : 0.944 * std::max(u, 0.0);
    const double J_term = n > 0 ? inflow / D_prop * std::fabs(n) / 0.6632 : 0;
    const double turns = n * std::fabs(n);
    tau(0) += 0.9 * rho * std::pow(D_prop, 4) * (0.4566 * turns + (0.1798 - 0.4566) * J_term);
    tau(3) += 0.1 * rho * std::pow(D_prop, 5) * (0.0700 * turns + (0.0312 - 0.0700) * J_term);

    const double dr = actuators(0), ds = actuators(1);
    const double horizontal = form.fins_on_plane ? u * u + v * v : u * std::fabs(u);
    const double vertical = form.fins_on_plane ? u * u + w * w : u * std::fabs(u);
    const double qr = 0.5 * rho * 0.0133 * 0.5 * horizontal;
    const double qs = 0.5 * rho * 0.0133 * 0.7 * vertical;
    tau(0) -= std::fabs(qr) * dr * dr + std::fabs(qs) * ds * ds;
    tau(1) -= qr * dr;
    tau(2) -= qs * ds;
    tau(4) += -a_ * qs * ds;
    tau(5) += a_ * qr * dr;

    tau(3) -= zg * W_ * std::cos(eta(4)) * std::sin(eta(3));
    tau(4) -= zg * W_ * std::sin(eta(4));
    return tau;
  }

  /// PVS's own step: velocities and actuators from the old state, then the pose.
  void euler(Vec6& eta, Vec6& nu, Vec3& actuators, const Vec3& command, const Vec3& current,
             double h) const {
    const Vec6 rate = acceleration(eta, nu, actuators, current);
    const Vec3 lag(0.1, 0.1, 1);
    nu += h * rate;
    actuators += h * (command - actuators).cwiseQuotient(lag);
    const Vec3 velocity = rotation(eta(3), eta(4), eta(5)) * nu.head<3>();
    const Vec3 turning = euler_rates(eta(3), eta(4)) * nu.tail<3>();
    eta.head<3>() += h * velocity;
    eta.tail<3>() += h * turning;
  }

  /// [eta, nu, actuators] one step on by the fourth-order rule.
  void rk4(Eigen::Matrix<double, 15, 1>& x, const Vec3& command, const Vec3& current,
           double h) const {
    using State = Eigen::Matrix<double, 15, 1>;
    const auto f = [&](const State& y) {
      const Vec6 eta = y.head<6>(), nu = y.segment<6>(6);
      const Vec3 actuators = y.tail<3>();
      State dy;
      dy.head<3>() = rotation(eta(3), eta(4), eta(5)) * nu.head<3>();
      dy.segment<3>(3) = euler_rates(eta(3), eta(4)) * nu.tail<3>();
      dy.segment<6>(6) = acceleration(eta, nu, actuators, current);
      dy.tail<3>() = (command - actuators).cwiseQuotient(Vec3(0.1, 0.1, 1));
      return dy;
    };
    const State k1 = f(x), k2 = f(x + 0.5 * h * k1), k3 = f(x + 0.5 * h * k2), k4 = f(x + h * k3);
    x += h / 6 * (k1 + 2 * k2 + 2 * k3 + k4);
  }

  static constexpr double L = 1.6, d = 0.19, rho = 1026, D_prop = 0.14;
  static constexpr double S_area = 0.7 * L * d;

 private:
  double a_, m_, W_, drag_;
  Mat6 MRB_, MA_;
  Vec6 D_;
};

}  // namespace peer
