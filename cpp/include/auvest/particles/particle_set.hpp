// The particles: numbers in storage that the caller owns, in blocks of kBlock particles.
//
// Field 0 is the logarithm of the weight; what the others mean is the filter's business. The last
// block is filled up with particles of weight zero, so that kernels may always take whole blocks.
#pragma once

#include <cstddef>

#include "auvest/config.hpp"
#include "auvest/particles/lanes.hpp"

namespace auvest {

template <class Scalar_, int Fields>
class ParticleSet {
 public:
  using Scalar = Scalar_;
  static constexpr int kFields = Fields;
  static constexpr int kLogWeight = 0;

  /// Scalars of storage that `capacity` particles take.
  static constexpr std::size_t storage_size(int capacity) {
    return static_cast<std::size_t>((capacity + kBlock - 1) / kBlock) *
           static_cast<std::size_t>(kBlock * Fields);
  }

  ParticleSet(Scalar* storage, int capacity) : storage_(storage), capacity_(capacity), size_(0) {}

  int capacity() const { return capacity_; }
  int size() const { return size_; }
  void resize(int size) { size_ = size; }

  /// Field `field` of particle i; those of the following particles of its block lie behind it.
  AUVEST_INLINE Scalar* at(int i, int field) const {
    const std::size_t block = static_cast<unsigned>(i) / static_cast<unsigned>(kBlock);
    const std::size_t row = block * static_cast<std::size_t>(Fields);
    return storage_ + (row + static_cast<std::size_t>(field)) * static_cast<std::size_t>(kBlock) +
           place_in_block(i);
  }

  /// One field of all particles, by their numbers.
  class Field {
   public:
    using value_type = Scalar;
    Scalar& operator[](int i) const { return *set_.at(i, number_); }

   private:
    friend class ParticleSet;
    Field(const ParticleSet& set, int number) : set_(set), number_(number) {}
    const ParticleSet& set_;
    int number_;
  };
  Field field(int number) const { return Field(*this, number); }
  AUVEST_INLINE Scalar& log_weight(int i) const { return *at(i, kLogWeight); }

  /// Overwrites particle `to` by particle `from`, its weight included.
  void copy(int from, int to) const {
    const Scalar* source = at(from, 0);
    Scalar* target = at(to, 0);
    for (int field = 0; field < Fields; ++field) target[field * kBlock] = source[field * kBlock];
  }

  /// Fills the last block up with copies of the last particle.
  void fill_block() const {
    for (int i = size_; place_in_block(i) != 0; ++i) copy(size_ - 1, i);
  }

 private:
  Scalar* storage_;
  int capacity_;
  int size_;
};

/// Storage for at most Capacity particles, as a member or a static object.
template <class Scalar, int Fields, int Capacity>
struct ParticleStorage {
  Scalar numbers[ParticleSet<Scalar, Fields>::storage_size(Capacity)];
};

}  // namespace auvest
