// The order in which the kernels of a filter go over its particles. It changes the time, no bit.
//
// A step of a filter is a long chain of roots and quotients that wait for each other. So it is
// taken in parts, the kernels, each for all groups of a tile in turn, and the kernels that wait go
// over two groups side by side (math/twin.hpp): the processor has something to do, and the tile
// stays in the cache. While it works on one tile it asks for the next.
//
// A kernel does one thing to one group of particles, those of one vector register (lanes.hpp), or
// to a pair of groups that lie behind each other:
//
//     template <class Group> void operator()(Group, int i, int g) const
//     static constexpr int kThird
//
// i is the first of the particles, g the number of the group in its tile, and Group says how they
// are read: by the lanes policies Group::Fields and, as the weights lie elsewhere, Group::Weights.
// kThird, 0 to 2, is the third of the next tile that is asked for along with the kernel (thirds, so
// that the way to the cache is never full); -1: none.
#pragma once

#include "auvest/config.hpp"
#include "auvest/particles/lanes.hpp"

namespace auvest {
inline namespace AUVEST_INSTRUCTIONS {

template <class Lanes, class Set>
class Tiles {
 public:
  static constexpr int kGroups = Lanes::kPairs ? 4 : 1;  ///< of a tile
  static constexpr int kParticles = kGroups * Lanes::kWidth;

  struct Single {
    using Fields = Lanes;
    using Weights = Lanes;
    static constexpr int kParticles = Lanes::kWidth;
  };
  struct Pair {
    using Weights = typename Lanes::template Pair<Lanes::kWidth>;
    using Fields = typename Lanes::template Pair<(Lanes::kWidth < kBlock) ? Lanes::kWidth
                                                                          : Set::kFields * kBlock>;
    static constexpr int kParticles = 2 * Lanes::kWidth;
  };

  /// The particles from `begin` to `end`.
  class Tile {
   public:
    AUVEST_ALWAYS_INLINE Tile(const Set& set, int begin, int end)
        : set_(set), begin_(begin), end_(end) {}

    /// One group at a time.
    template <class Kernel>
    AUVEST_ALWAYS_INLINE void run(const Kernel& kernel) const {
      run_from(begin_, kernel);
    }

    /// Two groups side by side, as long as there are two.
    template <class Kernel>
    AUVEST_ALWAYS_INLINE void run_pairs(const Kernel& kernel) const {
      int i = begin_;
      for (; Lanes::kPairs && i + Lanes::kWidth < end_; i += Pair::kParticles) {
        prefetch<Pair, Kernel::kThird>(i);
        kernel(Pair(), i, group(i));
      }
      run_from(i, kernel);
    }

   private:
    template <class Kernel>
    AUVEST_ALWAYS_INLINE void run_from(int i, const Kernel& kernel) const {
      if (kGroups == 1) {  // no loop: it would cost flash and stack
        kernel(Single(), begin_, 0);
        return;
      }
      for (; i < end_; i += Lanes::kWidth) {
        prefetch<Single, Kernel::kThird>(i);
        kernel(Single(), i, group(i));
      }
    }

    AUVEST_ALWAYS_INLINE int group(int i) const { return (i - begin_) / Lanes::kWidth; }

    /// Asks for one third of the fields of the block that lies one tile ahead, for a pair of both
    /// blocks.
    template <class Group, int Third>
    AUVEST_ALWAYS_INLINE void prefetch(int i) const {
      if (!Lanes::kPairs || Third < 0 || set_.size() <= kNear) return;
      for (int k = i; k < i + Group::kParticles; k += Lanes::kWidth) {
        if (place_in_block(k) != 0 || k + kParticles >= set_.size()) continue;
        constexpr int kFirst = Set::kFields * (Third < 0 ? 0 : Third) / 3;
        constexpr int kCount = Set::kFields * (Third + 1) / 3 - kFirst;
        const auto* at = set_.at(k + kParticles, kFirst);
        AUVEST_UNROLL
        for (int f = 0; f < kCount; ++f) Lanes::prefetch(at + f * kBlock);
      }
    }

    const Set& set_;
    int begin_;
    int end_;
  };

  /// Calls visit(tile) for all tiles.
  template <class Visit>
  static AUVEST_ALWAYS_INLINE void for_each(const Set& set, const Visit& visit) {
    for (int begin = 0; begin < set.size(); begin += kParticles) {
      visit(Tile(set, begin, begin + kParticles < set.size() ? begin + kParticles : set.size()));
    }
  }

  /// Calls visit(i) for the first particle i of each group.
  template <class Visit>
  static AUVEST_ALWAYS_INLINE void for_each_group(const Set& set, const Visit& visit) {
    for (int i = 0; i < set.size(); i += Lanes::kWidth) visit(i);
  }

 private:
  /// So many particles fit into a first-level cache.
  static constexpr int kNear =
      32768 / static_cast<int>(sizeof(typename Set::Scalar) * (1 + Set::kFields));
};

}  // namespace AUVEST_INSTRUCTIONS
}  // namespace auvest
