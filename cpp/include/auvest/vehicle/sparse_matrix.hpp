// A matrix by its coefficients that are not 0. Of a hull with planes of symmetry most are: they
// cost no arithmetic, and to find them again at every product would cost more than the product.
#pragma once

#include <cstdint>

#include "auvest/math/basic.hpp"
#include "auvest/math/select.hpp"
#include "auvest/types.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

template <class Scalar, int Rows, int Cols = Rows>
class SparseMatrix {
 public:
  SparseMatrix() : rows_(0), count_(0) { start(); }

  SparseMatrix(const Matrix<Scalar, Rows, Cols>& dense) : rows_(0), count_(0) {  // implicit
    start();
    for (int i = 0; i < Rows; ++i) {
      for (int j = 0; j < Cols; ++j) put(j, dense(i, j));
      end_row();
    }
  }

  /// The next coefficient of the row that is being filled, from left to right.
  void put(int column, Scalar number) {
    if (number == Scalar(0)) return;
    keep(column, number);
    column_[count_] = static_cast<std::uint8_t>(column);
    number_[count_] = number;
    ++count_;
  }
  /// The row is full; there are `Rows` of them.
  void end_row() { end_[rows_++] = count_; }

  /// The first `rows` numbers of the product with v, each sum from left to right.
  template <class Value>
  AUVEST_OUTLINE void times(const Value* v, int rows, Value* product) const {
#if !defined(__AVR__)
    // Written out for a hull with a plane of symmetry through its length, in which the axes x, z
    // and pitch meet, and y, roll and yaw: to add 0 to a finite sum leaves its bits.
    if (chequered_ && rows == Rows && math::is_number<Value>()) {
      AUVEST_UNROLL
      for (int i = 0; i < Rows; ++i) {
        Value sum = Value(0);
        AUVEST_UNROLL
        for (int j = i % 2; j < Cols; j += 2) sum = sum + Value(full_[i * Cols + j]) * v[j];
        product[i] = sum;
      }
      return;
    }
#endif
    int k = 0;
    for (int i = 0; i < rows; ++i) {
      Value sum = Value(0);
      for (; k < end_[i]; ++k) sum = sum + Value(number_[k]) * v[column_[k]];
      product[i] = sum;
    }
  }

 private:
#if defined(__AVR__)
  void start() {}
  void keep(int, Scalar) {}
#else
  void start() {
    chequered_ = Rows == Cols;
    for (Scalar& number : full_) number = Scalar(0);
  }
  void keep(int column, Scalar number) {
    full_[rows_ * Cols + column] = number;
    chequered_ = chequered_ && column % 2 == rows_ % 2;
  }

  bool chequered_;  // 0 wherever row and column are not both even or both odd
  Scalar full_[Rows * Cols];
#endif
  std::uint8_t rows_, count_;
  std::uint8_t end_[Rows];
  std::uint8_t column_[Rows * Cols];
  Scalar number_[Rows * Cols];
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
