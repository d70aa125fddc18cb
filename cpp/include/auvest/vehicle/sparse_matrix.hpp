// A matrix by its coefficients that are not 0. Of a hull with planes of symmetry most are: they
// cost no arithmetic, and to find them again at every product would cost more than the product.
#pragma once

#include <cstdint>

#include "auvest/math/basic.hpp"
#include "auvest/types.hpp"

namespace auvest {

template <class Scalar, int Rows, int Cols = Rows>
class SparseMatrix {
 public:
  SparseMatrix() : rows_(0), count_(0) {}

  SparseMatrix(const Matrix<Scalar, Rows, Cols>& dense) : rows_(0), count_(0) {  // implicit
    for (int i = 0; i < Rows; ++i) {
      for (int j = 0; j < Cols; ++j) put(j, dense(i, j));
      end_row();
    }
  }

  /// The next coefficient of the row that is being filled, from left to right.
  void put(int column, Scalar number) {
    if (number == Scalar(0)) return;
    column_[count_] = static_cast<std::uint8_t>(column);
    number_[count_] = number;
    ++count_;
  }
  /// The row is full; there are `Rows` of them.
  void end_row() { end_[rows_++] = count_; }

  /// The first `rows` numbers of the product with v, each sum from left to right.
  template <class Value>
  AUVEST_OUTLINE void times(const Value* v, int rows, Value* product) const {
    int k = 0;
    for (int i = 0; i < rows; ++i) {
      Value sum = Value(0);
      for (; k < end_[i]; ++k) sum = sum + Value(number_[k]) * v[column_[k]];
      product[i] = sum;
    }
  }

 private:
  std::uint8_t rows_, count_;
  std::uint8_t end_[Rows];
  std::uint8_t column_[Rows * Cols];
  Scalar number_[Rows * Cols];
};

}  // namespace auvest
