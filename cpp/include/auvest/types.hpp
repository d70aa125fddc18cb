// The vocabulary types: fixed-size vectors and matrices, and the Gaussian belief of a filter.
#pragma once

#include "auvest/eigen.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

/// Fixed-size matrix; row-major, without alignment requirements, so that it can be a member, an
/// array element or a value argument anywhere (C++11 has no aligned new) and looks like NumPy's.
template <class Scalar, int Rows, int Cols>
using Matrix =
    Eigen::Matrix<Scalar, Rows, Cols,
                  static_cast<int>(Eigen::DontAlign) |
                      static_cast<int>(Cols == 1 && Rows != 1 ? Eigen::ColMajor : Eigen::RowMajor)>;

/// Fixed-size column vector.
template <class Scalar, int Rows>
using Vector = Matrix<Scalar, Rows, 1>;

/// Whether two types are one (avr-gcc has no <type_traits>).
template <class A, class B>
struct IsSame {
  static constexpr bool value = false;
};
template <class A>
struct IsSame<A, A> {
  static constexpr bool value = true;
};

/// Gaussian belief N(x, P). Filters read and write only the lower triangle of P: there is one
/// number per pair of states, so P cannot become asymmetric.
template <class Scalar, int N>
struct Belief {
  Vector<Scalar, N> x;
  Matrix<Scalar, N, N> P;
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
