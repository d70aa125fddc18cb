// A torpedo given by hydrodynamic coefficients, as theses and towing tanks publish them: each term
// is its coefficient times the velocities in its name, on the side of the forces. Y_uv, for
// example, gives Y = Y_uv u v, and Y_v|v| gives Y_v|v| v|v|. Body lift, fin lift and the Coriolis
// forces of the added mass are among the coefficients, so the hull adds none of its own.
#pragma once

#include "auvest/math/basic.hpp"
#include "auvest/status.hpp"
#include "auvest/vehicle/hull.hpp"
#include "auvest/vehicle/lag.hpp"
#include "auvest/vehicle/torpedo.hpp"

namespace auvest {

/// Command and state as those of Torpedo: rudder, stern planes [rad], shaft [rev/s].
template <class Scalar_>
struct CoefficientTorpedo {
  using Scalar = Scalar_;
  static constexpr int kActuators = 3;
  static constexpr bool kNeedsSpeed = false;
  static constexpr bool kAddedCoriolis = false;

  /// Units: N, m and s, as the velocities in the name ask.
  struct Params : HullParams<Scalar> {
    Scalar x_uu = Scalar(0), x_wq = Scalar(0), x_qq = Scalar(0), x_vr = Scalar(0), x_rr = Scalar(0);
    Scalar y_vv = Scalar(0), y_rr = Scalar(0), y_uv = Scalar(0), y_ur = Scalar(0), y_wp = Scalar(0),
           y_pq = Scalar(0), y_uu_rudder = Scalar(0);
    Scalar z_ww = Scalar(0), z_qq = Scalar(0), z_uw = Scalar(0), z_uq = Scalar(0), z_vp = Scalar(0),
           z_rp = Scalar(0), z_uu_stern = Scalar(0);
    Scalar k_pp = Scalar(0);
    Scalar m_ww = Scalar(0), m_qq = Scalar(0), m_uw = Scalar(0), m_uq = Scalar(0), m_vp = Scalar(0),
           m_rp = Scalar(0), m_uu_stern = Scalar(0);
    Scalar n_vv = Scalar(0), n_rr = Scalar(0), n_uv = Scalar(0), n_ur = Scalar(0), n_wp = Scalar(0),
           n_pq = Scalar(0), n_uu_rudder = Scalar(0);
    Scalar thrust_n_s2 = Scalar(0);    ///< surge force per n|n| of the shaft
    Scalar torque_n_m_s2 = Scalar(0);  ///< roll moment per n|n|
    typename Lag<Scalar>::Params rudder, stern_planes, shaft;

    /// Names every member, in the order of stored records.
    template <class Visitor>
    void visit(Visitor&& v) {
      HullParams<Scalar>::visit(v);
      v("x_uu", x_uu), v("x_wq", x_wq), v("x_qq", x_qq), v("x_vr", x_vr), v("x_rr", x_rr);
      v("y_vv", y_vv), v("y_rr", y_rr), v("y_uv", y_uv), v("y_ur", y_ur), v("y_wp", y_wp);
      v("y_pq", y_pq), v("y_uu_rudder", y_uu_rudder);
      v("z_ww", z_ww), v("z_qq", z_qq), v("z_uw", z_uw), v("z_uq", z_uq), v("z_vp", z_vp);
      v("z_rp", z_rp), v("z_uu_stern", z_uu_stern);
      v("k_pp", k_pp);
      v("m_ww", m_ww), v("m_qq", m_qq), v("m_uw", m_uw), v("m_uq", m_uq), v("m_vp", m_vp);
      v("m_rp", m_rp), v("m_uu_stern", m_uu_stern);
      v("n_vv", n_vv), v("n_rr", n_rr), v("n_uv", n_uv), v("n_ur", n_ur), v("n_wp", n_wp);
      v("n_pq", n_pq), v("n_uu_rudder", n_uu_rudder);
      v("thrust_n_s2", thrust_n_s2);
      v("torque_n_m_s2", torque_n_m_s2);
      v("rudder", rudder);
      v("stern_planes", stern_planes);
      v("shaft", shaft);
    }
  };

  Params params;
  Lag<Scalar> rudder, stern_planes, shaft;

  explicit CoefficientTorpedo(const Params& p)
      : params(p), rudder(p.rudder), stern_planes(p.stern_planes), shaft(p.shaft) {}

  template <class Freedom, class Value>
  AUVEST_OUTLINE void add_loads(Value* tau, const Flow<Value>& flow, const Value* actuators,
                                Freedom) const {
    const Value u = flow.nu[kSurge], v = flow.nu[kSway], w = flow.nu[kHeave];
    const Value p = flow.nu[kRoll], q = flow.nu[kPitch], r = flow.nu[kYaw];
    const Value vv = v * math::absolute(v), ww = w * math::absolute(w);
    const Value qq = q * math::absolute(q), rr = r * math::absolute(r);
    const Value n = actuators[kPropeller];
    const Value turns = n * math::absolute(n);
    const Value rudder_uu = u * u * actuators[kRudder];
    const Value stern_uu = u * u * actuators[kSternPlanes];
    const Params& c = params;
    const Value force[6] = {
        Value(c.x_uu) * u * math::absolute(u) + Value(c.x_wq) * w * q + Value(c.x_qq) * q * q +
            Value(c.x_vr) * v * r + Value(c.x_rr) * r * r + Value(c.thrust_n_s2) * turns,
        Value(c.y_vv) * vv + Value(c.y_rr) * rr + Value(c.y_uv) * u * v + Value(c.y_ur) * u * r +
            Value(c.y_wp) * w * p + Value(c.y_pq) * p * q + Value(c.y_uu_rudder) * rudder_uu,
        Value(c.z_ww) * ww + Value(c.z_qq) * qq + Value(c.z_uw) * u * w + Value(c.z_uq) * u * q +
            Value(c.z_vp) * v * p + Value(c.z_rp) * r * p + Value(c.z_uu_stern) * stern_uu,
        Value(c.k_pp) * p * math::absolute(p) + Value(c.torque_n_m_s2) * turns,
        Value(c.m_ww) * ww + Value(c.m_qq) * qq + Value(c.m_uw) * u * w + Value(c.m_uq) * u * q +
            Value(c.m_vp) * v * p + Value(c.m_rp) * r * p + Value(c.m_uu_stern) * stern_uu,
        Value(c.n_vv) * vv + Value(c.n_rr) * rr + Value(c.n_uv) * u * v + Value(c.n_ur) * u * r +
            Value(c.n_wp) * w * p + Value(c.n_pq) * p * q + Value(c.n_uu_rudder) * rudder_uu};
    AUVEST_UNROLL
    for (int i = 0; i < 6; ++i) {
      if (Freedom::keeps(i)) tau[i] = tau[i] + force[i];  // [HULL D7]
    }
  }

  template <class Value>
  void demands(const Value* command, Value* demand) const {
    demand[kRudder] = rudder.demand(command[kRudder]);
    demand[kSternPlanes] = stern_planes.demand(command[kSternPlanes]);
    demand[kPropeller] = shaft.demand(command[kPropeller]);
  }

  template <class Value>
  void actuator_rates(const Value* state, const Value* demand, Value* rate) const {
    rate[kRudder] = rudder.rate(state[kRudder], demand[kRudder]);
    rate[kSternPlanes] = stern_planes.rate(state[kSternPlanes], demand[kSternPlanes]);
    rate[kPropeller] = shaft.rate(state[kPropeller], demand[kPropeller]);
  }

  template <class Value>
  void limit_actuators(Value* state) const {
    state[kRudder] = rudder.limited(state[kRudder]);
    state[kSternPlanes] = stern_planes.limited(state[kSternPlanes]);
    state[kPropeller] = shaft.limited(state[kPropeller]);
  }

  /// Coefficients of any sign are taken if they are finite: no single one must take energy.
  Status check() const {
    Params copy = params;
    Finite finite = {true};
    copy.visit(finite);
    if (!finite.all) return Status::kBadParameter;
    const Status parts[] = {rudder.check(), stern_planes.check(), shaft.check()};
    for (const Status part : parts) {
      if (part != Status::kOk) return part;
    }
    return Status::kOk;
  }

 private:
  struct Finite {
    bool all;
    void operator()(const char*, const Scalar& value) { all = all && math::is_finite(value); }
    template <class Group>
    void operator()(const char*, const Group&) {}
  };
};

}  // namespace auvest
