// Slave and masters in one Gaussian: how it moves, what an echo makes of it, whose echo it is, and
// how a share of it is drawn. EkfSlat is one such Gaussian, SlatfJoint a mixture of them.
//
// State: the slave's pose, then six numbers per master. Only the lower triangle of P is kept; of
// masters that were not added all is zero.
#pragma once

#include "auvest/filters/square_root_update.hpp"
#include "auvest/math/angle.hpp"
#include "auvest/math/basic.hpp"
#include "auvest/math/linear_algebra.hpp"
#include "auvest/models/sonar.hpp"
#include "auvest/particles/log_weights.hpp"
#include "auvest/slat/association.hpp"
#include "auvest/slat/definite.hpp"
#include "auvest/slat/echo.hpp"
#include "auvest/slat/likelihood.hpp"
#include "auvest/slat/safeguards.hpp"
#include "auvest/types.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

template <class Motion_, class Master_, int Masters>
struct JointGaussian {
  using Motion = Motion_;
  using Master = Master_;
  using Scalar = typename Motion::Scalar;
  static constexpr int kPose = Motion::kStates;
  static constexpr int kStates = kPose + 6 * Masters;
  static constexpr int kObserved = kPose + 2;  ///< what the sonar sees: pose, a master's position
  using Joint = Belief<Scalar, kStates>;
  using SlaveBelief = Belief<Scalar, kPose>;
  using MasterBelief = Belief<Scalar, 6>;

  Motion motion;
  Master master[Masters];  ///< the process model of each

  explicit JointGaussian(const Motion& slave = Motion(), const Master& landmark = Master())
      : motion(slave) {
    for (Master& each : master) each = landmark;
  }

  Status check() const {
    Status status = motion.check();
    for (int n = 0; n < Masters && status == Status::kOk; ++n) status = master[n].check();
    return status;
  }

  /// Where the six states of master n begin.
  static constexpr int first_of(int n) { return kPose + 6 * n; }

  /// N states from `first` on; both triangles of P.
  template <int N>
  static Belief<Scalar, N> part(const Joint& joint, int first) {
    Belief<Scalar, N> belief;
    for (int i = 0; i < N; ++i) {
      belief.x(i) = joint.x(first + i);
      for (int j = 0; j <= i; ++j) {
        belief.P(i, j) = belief.P(j, i) = joint.P(first + i, first + j);
      }
    }
    return belief;
  }

  /// Overwrites them; their covariances with the other states stay.
  template <int N>
  static void put(const Belief<Scalar, N>& belief, int first, Joint& joint) {
    for (int i = 0; i < N; ++i) {
      joint.x(first + i) = belief.x(i);
      for (int j = 0; j <= i; ++j) joint.P(first + i, first + j) = belief.P(i, j);
    }
  }

  /// The slave at a pose, and no master.
  static void start(const SlaveBelief& pose, Joint& joint) {
    math::set_zero(joint.x);
    math::set_zero(joint.P);
    put(pose, 0, joint);
  }

  /// [SLATF 15], [SLATF 16] and [SLATF 50], block by block: P_ij <- Phi_i P_ij Phi_j' + (i = j)
  /// Q_i.
  void predict(const typename Motion::Step& step, Scalar dt, const Vector<Scalar, 2>* changes,
               int masters, Joint& joint) const {
    SlaveBelief pose = part<kPose>(joint, 0);
    const typename Motion::Covariance by_pose = motion.transition(step, pose.x);
    motion.propagate(step, pose);  // [SLATF 11] [SLATF 50]
    put(pose, 0, joint);
    Matrix<Scalar, 6, 6> by_master[Masters];
    for (int n = 0; n < masters; ++n) {
      MasterBelief moved = part<6>(joint, first_of(n));
      by_master[n] = master[n].Phi(moved.x, dt);
      master[n].propagate(moved, dt);  // [SLATF 15] [SLATF 16]
      if (changes != nullptr) add_planned_change(changes[n], dt, moved.x);
      put(moved, first_of(n), joint);
      move_block(by_master[n], first_of(n), by_pose, 0, joint);
      for (int m = 0; m < n; ++m) {
        move_block(by_master[n], first_of(n), by_master[m], first_of(m), joint);
      }
    }
    if (heading_is_open(pose.P)) raise_pivots(joint.P);
  }

  /// Corrects by an echo z of master n. False, with `joint` as it was, where the result would not
  /// be finite. `score` is what the echo says: its NIS, and its density within the gate (0: no
  /// gate).
  static bool correct(const Vector<Scalar, 2>& z, int n, const Sonar<Scalar>& sonar, Scalar gate,
                      Joint& joint, Score<Scalar>& score) {
    Joint ordered;
    Matrix<Scalar, kObserved, kObserved> root;
    Slope slope;
    factor(joint, n, ordered, root, slope);
    Matrix<Scalar, 2, kObserved> a;
    Vector<Scalar, 2> innovation;
    look(ordered, root, z, sonar, a, innovation);
    Matrix<Scalar, 2, 2> noise = sonar.template R<Scalar>();
    Posterior<Scalar, kObserved> posterior;
    const bool valid = potter(a, noise, innovation, posterior);
    score.nis = posterior.nis;
    if (gate > Scalar(0)) saturate(gate, posterior);
    score.log_density = log_density(valid, posterior, noise);
    return valid && move(root, slope, posterior, n, ordered, joint);
  }

  /// What an echo of master n that a share `accepted` in (0, 1] of a set takes in makes of the
  /// set's covariance: P <- P - (2 g - g^2) P H' S^-1 H P with g = accepted, which is
  /// (I - K H) P (I - K H)' + K R K' with the gain K = g P H' S^-1. The mean stays.
  ///
  /// That is the update by a measurement with the noise R / c + (1 / c - 1) H P H', c = 2 g - g^2,
  /// and as such a square.
  static void narrow(int n, const Sonar<Scalar>& sonar, Scalar accepted, Joint& joint) {
    Joint ordered;
    Matrix<Scalar, kObserved, kObserved> root;
    Slope slope;
    factor(joint, n, ordered, root, slope);
    Matrix<Scalar, 2, kObserved> a;
    Vector<Scalar, 2> nothing;
    Vector<Scalar, 2> innovation;
    math::set_zero(nothing);
    look(ordered, root, nothing, sonar, a, innovation);
    math::set_zero(innovation);
    Matrix<Scalar, 2, 2> noise = sonar.template R<Scalar>();
    if (accepted < Scalar(1)) {
      const Scalar c = accepted * (Scalar(2) - accepted);
      Matrix<Scalar, 2, 2> s;
      innovation_covariance(a, noise, s);
      for (int i = 0; i < 2; ++i) {
        for (int j = 0; j <= i; ++j) noise(i, j) = s(i, j) / c - (s(i, j) - noise(i, j));
      }
      if (!math::ldlt(noise)) return;  // c is so small that nothing would come of it
    }
    Posterior<Scalar, kObserved> posterior;
    if (potter(a, noise, innovation, posterior)) move(root, slope, posterior, n, ordered, joint);
  }

  /// Master n is born where an echo z comes from: the covariance of range and bearing there plus
  /// G P_s G', with G the Jacobian of that place by the pose, and the covariances G P_s with the
  /// pose and G P_sj with the other masters, without which the next echo would harm the slave.
  /// Velocity and acceleration: zero with their variances of a rebirth. The slave stays as it
  /// is.
  static AUVEST_COLD void give_rebirth(const Vector<Scalar, 2>& z, int n,
                                       const Sonar<Scalar>& sonar, const EchoParams<Scalar>& params,
                                       Joint& joint) {
    const SlaveBelief pose = part<kPose>(joint, 0);
    MasterBelief born;
    give_birth(sonar, z, pose, false, params.rebirth_velocity_variance(),
               params.rebirth_acceleration_variance(), born);
    Matrix<Scalar, 2, kPose> g;
    jacobian_of_place(sonar, born.x(0) - pose.x(0), born.x(1) - pose.x(1), g);
    const int first = first_of(n);
    Matrix<Scalar, 2, kPose> by_pose;  // G P_s
    for (int i = 0; i < 2; ++i) {
      for (int j = 0; j < kPose; ++j) by_pose(i, j) = math::dot(&g(i, 0), &pose.P(j, 0), kPose);
    }
    for (int i = 0; i < 2; ++i) {
      for (int j = 0; j <= i; ++j) {
        born.P(i, j) = math::plus_dot(born.P(i, j), &by_pose(i, 0), &g(j, 0), kPose);
      }
    }
    for (int j = 0; j < kStates; ++j) {  // with all but itself
      if (j >= first && j < first + 6) continue;
      Vector<Scalar, kPose> with_pose;
      for (int k = 0; k < kPose; ++k) with_pose(k) = j > k ? joint.P(j, k) : joint.P(k, j);
      for (int i = 0; i < 6; ++i) {
        const Scalar covariance = i < 2 ? math::dot(&g(i, 0), with_pose.data(), kPose) : Scalar(0);
        (j > first ? joint.P(j, first + i) : joint.P(first + i, j)) = covariance;
      }
    }
    put(born, first, joint);
  }

  /// The Jacobian of the place where an echo comes from, (dx, dy) from the slave, by the pose.
  template <class Value>
  static AUVEST_INLINE void jacobian_of_place(const Sonar<Scalar>& sonar, const Value& dx,
                                              const Value& dy, Matrix<Value, 2, kPose>& g) {
    math::set_zero(g);
    g(0, 0) = g(1, 1) = Value(1);
    if (sonar.params.bearing == Bearing::kFromHeading) {
      g(0, kPose - 1) = -dy;
      g(1, kPose - 1) = dx;
    }
  }

  /// Whose echoes they are. Unknown ones are those of the masters that make all echoes of the ping
  /// together the likeliest, each master at most once.
  static void identify(const Joint& joint, const Echo<Scalar>* echoes, int count, int masters,
                       const Sonar<Scalar>& sonar, Scalar gate, int (&who)[Masters]) {
    bool known = true;
    for (int s = 0; s < Masters; ++s) {
      who[s] = s < count ? echoes[s].master : kUnknownMaster;
      known = known && (s >= count || who[s] != kUnknownMaster);
    }
    if (!known) identify_from(0, joint, echoes, count, masters, sonar, gate, who);
  }

  /// Draws a share of what is uncertain in H x, the range and the bearing of master n, linearised:
  /// with S = H P H' the covariance of H x before, a share `kept` in [0, 1) of S remains, and
  /// over e ~ N(0, I) the results are a mixture with the moments of the belief before.
  ///
  /// That is the update by a measurement of H x with noise E = kept / (1 - kept) S that is drawn
  /// from what the belief expects of it: its innovation has the covariance S + E = S / (1 - kept).
  static void draw(int n, const Sonar<Scalar>& sonar, Scalar kept, const Scalar (&e)[2],
                   Joint& joint) {
    Joint ordered;
    Matrix<Scalar, kObserved, kObserved> root;
    Slope slope;
    factor(joint, n, ordered, root, slope);
    Matrix<Scalar, 2, kObserved> a;
    Vector<Scalar, 2> nothing;
    Vector<Scalar, 2> innovation;
    math::set_zero(nothing);
    look(ordered, root, nothing, sonar, a, innovation);
    Matrix<Scalar, 2, 2> noise;
    Matrix<Scalar, 2, 2> s;
    Matrix<Scalar, 2, 2> spread;
    Matrix<Scalar, 1, 2> no_others;
    math::set_zero(noise);
    innovation_covariance(a, noise, s);
    math::factor_leading<math::DropLostPivots>(s, spread, no_others);
    const Scalar drawn = Scalar(1) - kept;
    for (int k = 0; k < 2; ++k) {
      innovation(k) = math::dot(&spread(k, 0), e, k + 1) / math::sqrt(drawn);
      // E = U D U' as potter() takes it. What is certain is measured with any noise: no effect.
      const bool certain = !(spread(k, k) > Scalar(0));
      noise(k, k) = certain ? Scalar(1) : kept / drawn * (spread(k, k) * spread(k, k));
      if (k == 0) noise(1, 0) = certain ? Scalar(0) : spread(1, 0) / spread(0, 0);
    }
    Posterior<Scalar, kObserved> posterior;
    if (potter(a, noise, innovation, posterior)) move(root, slope, posterior, n, ordered, joint);
  }

 private:
  using Slope = Matrix<Scalar, math::other_states(kStates, kObserved), kObserved>;

  /// Identifies the echoes from `s` on, of which `joint` does not know yet, and returns their log
  /// density. `who` holds the masters that are known.
  static Scalar identify_from(int s, const Joint& joint, const Echo<Scalar>* echoes, int count,
                              int masters, const Sonar<Scalar>& sonar, Scalar gate,
                              int (&who)[Masters]) {
    if (s == count || s == Masters) return Scalar(0);  // count <= Masters
    Scalar greatest = no_log_weight<Scalar>();
    int likeliest[Masters];
    for (int other = 0; other < Masters; ++other) likeliest[other] = who[other];
    for (int n = 0; n < masters; ++n) {
      bool possible = who[s] == kUnknownMaster || who[s] == n;
      int trial[Masters];
      for (int other = 0; other < Masters; ++other) {
        possible = possible && (other == s || who[other] != n);
        trial[other] = other == s ? n : who[other];
      }
      if (!possible) continue;
      Joint after = joint;
      Score<Scalar> score;
      correct(echoes[s].z, n, sonar, gate, after, score);
      const Scalar density = score.log_density + identify_from(s + 1, after, echoes, count, masters,
                                                               sonar, gate, trial);
      if (density > greatest) {
        greatest = density;
        for (int other = 0; other < Masters; ++other) likeliest[other] = trial[other];
      }
    }
    for (int other = 0; other < Masters; ++other) who[other] = likeliest[other];
    return greatest;
  }

  /// P_ij <- Phi_i P_ij Phi_j' for a block below the diagonal.
  template <int Rows, int Columns>
  static void move_block(const Matrix<Scalar, Rows, Rows>& by_row, int row,
                         const Matrix<Scalar, Columns, Columns>& by_column, int column,
                         Joint& joint) {
    Matrix<Scalar, Rows, Columns> half;
    for (int i = 0; i < Rows; ++i) {
      for (int j = 0; j < Columns; ++j) {
        half(i, j) = by_row(i, 0) * joint.P(row, column + j);
        for (int k = 1; k < Rows; ++k) {
          half(i, j) = half(i, j) + by_row(i, k) * joint.P(row + k, column + j);
        }
      }
    }
    for (int i = 0; i < Rows; ++i) {
      for (int j = 0; j < Columns; ++j) {
        joint.P(row + i, column + j) = math::dot(&half(i, 0), &by_column(j, 0), Columns);
      }
    }
  }

  /// Moves `ordered` to the posterior, and `joint` with it where it is finite.
  static bool move(Matrix<Scalar, kObserved, kObserved>& root, const Slope& slope,
                   const Posterior<Scalar, kObserved>& posterior, int n, Joint& ordered,
                   Joint& joint) {
    const auto before = unseen_variances<kObserved>(ordered.P);
    const Scalar few = Scalar(1e5) * math::machine_epsilon<Scalar>();
    // The slave across the line that an echo has left of it, or the master's place relative to the
    // slave, beside their drift: the parts of B cancel.
    bool faint = false;
    for (int i = 1; i < kObserved; ++i) {
      faint = faint || root(i, i) * root(i, i) < few * ordered.P(i, i);
    }
    if (!move_belief(ordered, root, slope, posterior)) return false;
    keep_definite<kObserved>(before, slope, ordered.P);
    put_back(ordered, n, joint);
    if (faint) raise_pivots(joint.P);
    return true;
  }

  /// The place of state i when master n stands first among the masters: the update factors the
  /// leading states that the sonar sees.
  static int swapped(int i, int n) {
    const int own = (i - kPose) / 6;
    if (i < kPose || (own != 0 && own != n)) return i;
    return own == 0 ? i + 6 * n : i - 6 * n;
  }

  /// `joint` with master n first, and the factors of the states that the sonar sees.
  static void factor(const Joint& joint, int n, Joint& ordered,
                     Matrix<Scalar, kObserved, kObserved>& root, Slope& slope) {
    for (int i = 0; i < kStates; ++i) {
      const int row = swapped(i, n);
      ordered.x(i) = joint.x(row);
      for (int j = 0; j <= i; ++j) {
        const int column = swapped(j, n);
        ordered.P(i, j) = row > column ? joint.P(row, column) : joint.P(column, row);
      }
    }
    math::factor_leading<math::DropLostPivots>(ordered.P, root, slope);
  }

  static void put_back(const Joint& ordered, int n, Joint& joint) {
    for (int i = 0; i < kStates; ++i) {
      const int row = swapped(i, n);
      joint.x(row) = ordered.x(i);
      for (int j = 0; j <= i; ++j) {
        const int column = swapped(j, n);
        (row > column ? joint.P(row, column) : joint.P(column, row)) = ordered.P(i, j);
      }
    }
    for (int k = 2; k < kPose; ++k) joint.x(k) = math::wrap(joint.x(k));  // the heading
  }

  /// The innovation of z, and A = H L with H = [G_S, G_M] of [SLATF 51] and [SLATF 20].
  static void look(const Joint& ordered, const Matrix<Scalar, kObserved, kObserved>& root,
                   const Vector<Scalar, 2>& z, const Sonar<Scalar>& sonar,
                   Matrix<Scalar, 2, kObserved>& a, Vector<Scalar, 2>& innovation) {
    Vector<Scalar, kPose> pose;
    for (int i = 0; i < kPose; ++i) pose(i) = ordered.x(i);
    typename Sonar<Scalar>::template View<Scalar, kPose> view;
    sonar.look(pose, ordered.x(kPose), ordered.x(kPose + 1), z, view);
    Matrix<Scalar, 2, kObserved> h;
    for (int m = 0; m < 2; ++m) {
      for (int i = 0; i < kPose; ++i) h(m, i) = view.by_slave(m, i);
      for (int i = 0; i < 2; ++i) h(m, kPose + i) = view.by_master(m, i);
      innovation(m) = view.innovation(m);
    }
    project(h, root, a);
  }
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
