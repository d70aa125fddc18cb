// The particles: numbers in storage that the caller owns. Not copyable: a copy needs a storage of
// its own.
//
// First the logarithms of all weights, which much reads that needs nothing else of a particle. Then
// the other fields, whose meaning is the filter's business, in blocks of kBlock particles in which
// each field is an array. The last block is filled up with particles of weight zero, so that
// kernels may always take whole blocks.
#pragma once

#include <cstddef>
#include <cstring>

#include "auvest/config.hpp"
#include "auvest/particles/lanes.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

template <class Scalar_, int Fields>
class ParticleSet {
 public:
  using Scalar = Scalar_;
  static constexpr int kFields = Fields;  ///< beside the weight

  /// Scalars of storage that `capacity` particles take.
  static constexpr std::size_t storage_size(int capacity) {
    return whole_blocks(capacity) * static_cast<std::size_t>(1 + Fields);
  }

  ParticleSet(Scalar* storage, int capacity)
      : log_weights_(storage),
        blocks_(storage + whole_blocks(capacity)),
        capacity_(capacity),
        size_(0) {}

  /// A copy of the particles of `other`, in a storage of the same capacity.
  ParticleSet(const ParticleSet& other, Scalar* storage) : ParticleSet(storage, other.capacity_) {
    size_ = other.size_;
    std::memmove(storage, other.log_weights_, storage_size(capacity_) * sizeof(Scalar));
  }

  ParticleSet(const ParticleSet&) = delete;
  ParticleSet& operator=(const ParticleSet&) = delete;

  int capacity() const { return capacity_; }
  int size() const { return size_; }
  void resize(int size) { size_ = size; }

  /// The logarithms of the weights, by the particles' numbers.
  AUVEST_INLINE const Scalar* log_weights() const { return log_weights_; }
  AUVEST_INLINE Scalar* log_weights() { return log_weights_; }
  AUVEST_INLINE Scalar& log_weight(int i) { return log_weights_[i]; }

  /// Field `field` of particle i; those of the following particles of its block lie behind it.
  AUVEST_INLINE const Scalar* at(int i, int field) const { return blocks_ + offset(i, field); }
  AUVEST_INLINE Scalar* at(int i, int field) { return blocks_ + offset(i, field); }

  /// Overwrites the fields of particle `to` by those of particle `from`; the weights stay.
  void copy(int from, int to) {
    const Scalar* source = at(from, 0);
    Scalar* target = at(to, 0);
    for (int field = 0; field < Fields; ++field) target[field * kBlock] = source[field * kBlock];
  }

  /// Fills the last block up with copies of the last particle.
  void fill_block() {
    for (int i = size_; place_in_block(i) != 0; ++i) copy(size_ - 1, i);
  }

 private:
  static constexpr std::size_t whole_blocks(int capacity) {
    return static_cast<std::size_t>((capacity + kBlock - 1) / kBlock) *
           static_cast<std::size_t>(kBlock);
  }

  static AUVEST_INLINE std::size_t offset(int i, int field) {
    const std::size_t block = static_cast<unsigned>(i) / static_cast<unsigned>(kBlock);
    const std::size_t row = block * static_cast<std::size_t>(Fields);
    return (row + static_cast<std::size_t>(field)) * static_cast<std::size_t>(kBlock) +
           place_in_block(i);
  }

  Scalar* log_weights_;
  Scalar* blocks_;
  int capacity_;
  int size_;
};

/// Storage for at most Capacity particles, as a member or a static object.
template <class Scalar, int Fields, int Capacity>
struct ParticleStorage {
  Scalar numbers[ParticleSet<Scalar, Fields>::storage_size(Capacity)];
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
