// Resampling: particles die or multiply, so that all weigh the same again.
//
// A policy turns normalised weights into numbers of offspring, in place:
//
//     template <class Scalar> void count(Scalar* w, int n, math::Random& random) const
//
// (The policies of this file have no state: theirs is static.)
// In: w[i] >= 0, not all zero; out: w[i] = how often particle i goes on, n in all, with expectation
// n w[i] / sum w. redistribute() then copies particles over the dead ones. Neither needs a second
// particle set, nor an index array: the weights, which nobody needs any more, hold the counts.
//
// How the policies compare: Douc, Cappe and Moulines, "Comparison of resampling schemes for
// particle filtering", ISPA 2005.
#pragma once

#include "auvest/math/exponential.hpp"
#include "auvest/math/random.hpp"
#include "auvest/particles/log_weights.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {
namespace detail {

/// w[i] <- base(w[i]) + the number of ascending positions, `draws` in [0, 1), that fall on particle
/// i's share of the line share(w[0]), share(w[1]), ...
template <class Scalar, class Split, class Positions>
inline void count_positions(Scalar* w, int n, Scalar total, int draws, Split split,
                            Positions positions) {
  Scalar reached = Scalar(0);
  Scalar position = Scalar(0);
  int drawn = 0;
  int last = 0;  // the last particle with a share: rounding may leave a position behind it
  if (draws > 0) position = positions(drawn) * total;
  for (int i = 0; i < n; ++i) {
    Scalar base, share;
    split(w[i], base, share);
    reached = reached + share;
    int count = 0;
    while (drawn < draws && position < reached) {
      ++count;
      ++drawn;
      if (drawn < draws) position = positions(drawn) * total;
    }
    w[i] = base + Scalar(count);
    if (count > 0 || share > Scalar(0)) last = i;
  }
  w[last] = w[last] + Scalar(draws - drawn);
}

/// The whole weight is the share.
struct WholeWeight {
  template <class Scalar>
  void operator()(Scalar w, Scalar& base, Scalar& share) const {
    base = Scalar(0);
    share = w;
  }
};

template <class Scalar>
inline Scalar total_weight(const Scalar* w, int n) {
  Scalar total = w[0];
  for (int i = 1; i < n; ++i) total = total + w[i];
  return total;
}

}  // namespace detail

/// One draw for all: positions (k + u) / n. The least variance of the four, and the fastest.
struct SystematicResampling {
  template <class Scalar>
  static void count(Scalar* w, int n, math::Random& random) {
    const Scalar total = detail::total_weight(w, n);
    const Scalar offset = random.uniform<Scalar>();
    const Scalar step = Scalar(1) / Scalar(n);
    detail::count_positions(w, n, total, n, detail::WholeWeight(),
                            [=](int k) { return (Scalar(k) + offset) * step; });
  }
};

/// One draw for each of n equal strata: positions (k + u_k) / n.
struct StratifiedResampling {
  template <class Scalar>
  static void count(Scalar* w, int n, math::Random& random) {
    const Scalar total = detail::total_weight(w, n);
    const Scalar step = Scalar(1) / Scalar(n);
    detail::count_positions(w, n, total, n, detail::WholeWeight(), [&random, step](int k) {
      return (Scalar(k) + random.uniform<Scalar>()) * step;
    });
  }
};

namespace detail {

/// n independent uniform positions in ascending order, one at a time: 1 - the largest of the n - k
/// that are left is distributed as the (n - k)-th root of a uniform deviate.
template <class Scalar>
class SortedUniforms {
 public:
  SortedUniforms(int n, math::Random& random) : n_(n), above_(Scalar(1)), random_(random) {}

  Scalar operator()(int k) {
    using math::exp;
    using math::log;
    const Scalar u = Scalar(1) - random_.uniform<Scalar>();  // (0, 1]
    above_ = above_ * exp(log(u) / Scalar(n_ - k));
    return Scalar(1) - above_;
  }

 private:
  int n_;
  Scalar above_;
  math::Random& random_;
};

/// Whole offspring first, the fraction is the share.
struct FractionOfWeight {
  template <class Scalar>
  void operator()(Scalar expected, Scalar& base, Scalar& share) const {
    base = Scalar(static_cast<int>(expected));
    share = expected - base;
  }
};

}  // namespace detail

/// n independent draws.
struct MultinomialResampling {
  template <class Scalar>
  static void count(Scalar* w, int n, math::Random& random) {
    const Scalar total = detail::total_weight(w, n);
    detail::count_positions(w, n, total, n, detail::WholeWeight(),
                            detail::SortedUniforms<Scalar>(n, random));
  }
};

/// The whole part of n w for certain, the rest by independent draws from the fractions.
struct ResidualResampling {
  template <class Scalar>
  static void count(Scalar* w, int n, math::Random& random) {
    const Scalar total = detail::total_weight(w, n);
    const Scalar scale = Scalar(n) / total;
    Scalar fractions = Scalar(0);
    int draws = n;
    for (int i = 0; i < n; ++i) {
      w[i] = w[i] * scale;
      Scalar base, share;
      detail::FractionOfWeight()(Scalar(w[i]), base, share);
      fractions = fractions + share;
      draws -= static_cast<int>(base);
    }
    detail::count_positions(w, n, fractions, draws, detail::FractionOfWeight(),
                            detail::SortedUniforms<Scalar>(draws, random));
  }
};

/// Copies each particle over the dead as often as its count says. A particle that goes on stays
/// where it is. In: the places of the log weights hold the counts. Out: equal weights.
template <class Set>
inline void redistribute(Set& set) {
  using Scalar = typename Set::Scalar;
  Scalar* counts = set.log_weights();
  int dead = 0;
  for (int i = 0; i < set.size(); ++i) {
    for (Scalar count = counts[i]; count > Scalar(1); count = count - Scalar(1)) {
      while (counts[dead] > Scalar(0)) ++dead;
      set.copy(i, dead);
      counts[dead] = Scalar(1);
    }
  }
  set.fill_block();
  equal_weights(set);
}

/// Resamples the normalised set by the policy.
template <class Lanes, class Policy, class Set>
inline void resample(const Policy& policy, Set& set, math::Random& random) {
  typename Set::Scalar* weights = set.log_weights();
  for (int i = 0; i < set.size(); i += Lanes::kWidth) {
    Lanes::store(weights + i, weight_of(Lanes::load(weights + i)));
  }
  policy.count(weights, set.size(), random);
  redistribute(set);
}

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
