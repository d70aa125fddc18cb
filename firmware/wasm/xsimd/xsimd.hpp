// The names of xsimd that auvest/math/simd.hpp uses, on the 128-bit vectors of WebAssembly, which
// Debian's xsimd does not have. Include paths with this folder's parent come first there.
#pragma once

#include <wasm_simd128.h>

#include <cstddef>
#include <cstdint>

namespace xsimd {

struct wasm {};

template <class T, class Arch>
struct batch_bool {
  v128_t data;

  friend batch_bool operator&&(batch_bool a, batch_bool b) {
    return {wasm_v128_and(a.data, b.data)};
  }
  friend batch_bool operator||(batch_bool a, batch_bool b) {
    return {wasm_v128_or(a.data, b.data)};
  }
  friend batch_bool operator!(batch_bool a) { return {wasm_v128_not(a.data)}; }
};

template <class T, class Arch>
bool all(batch_bool<T, Arch> mask) {
  return wasm_i32x4_all_true(mask.data);
}
template <class T, class Arch>
bool any(batch_bool<T, Arch> mask) {
  return wasm_v128_any_true(mask.data);
}

/// Four lanes of 32 bits, whatever they hold.
template <class T>
struct lanes {
  static constexpr std::size_t size = 4;
  v128_t data;

  lanes() = default;
  lanes(v128_t bits) : data(bits) {}
  void store_unaligned(T* to) const { wasm_v128_store(to, data); }
  void store_aligned(T* to) const { wasm_v128_store(to, data); }
};

template <class T, class Arch>
struct batch;

template <class Arch>
struct batch<float, Arch> : lanes<float> {
  using Mask = batch_bool<float, Arch>;

  using lanes<float>::lanes;
  batch(float x) : lanes(wasm_f32x4_splat(x)) {}
  static batch load_unaligned(const float* from) { return wasm_v128_load(from); }
  static batch load_aligned(const float* from) { return wasm_v128_load(from); }

  friend batch operator+(batch a, batch b) { return wasm_f32x4_add(a.data, b.data); }
  friend batch operator-(batch a, batch b) { return wasm_f32x4_sub(a.data, b.data); }
  friend batch operator*(batch a, batch b) { return wasm_f32x4_mul(a.data, b.data); }
  friend batch operator/(batch a, batch b) { return wasm_f32x4_div(a.data, b.data); }
  friend batch operator^(batch a, batch b) { return wasm_v128_xor(a.data, b.data); }
  friend Mask operator<(batch a, batch b) { return {wasm_f32x4_lt(a.data, b.data)}; }
  friend Mask operator>(batch a, batch b) { return {wasm_f32x4_gt(a.data, b.data)}; }
  friend Mask operator<=(batch a, batch b) { return {wasm_f32x4_le(a.data, b.data)}; }
  friend Mask operator>=(batch a, batch b) { return {wasm_f32x4_ge(a.data, b.data)}; }
};

template <class Arch>
struct batch<std::uint32_t, Arch> : lanes<std::uint32_t> {
  using lanes<std::uint32_t>::lanes;
  batch(std::uint32_t word) : lanes(wasm_i32x4_splat(static_cast<std::int32_t>(word))) {}
  static batch load_unaligned(const std::uint32_t* from) { return wasm_v128_load(from); }
  static batch load_aligned(const std::uint32_t* from) { return wasm_v128_load(from); }

  friend batch operator+(batch a, batch b) { return wasm_i32x4_add(a.data, b.data); }
  friend batch operator^(batch a, batch b) { return wasm_v128_xor(a.data, b.data); }
  friend batch operator&(batch a, batch b) { return wasm_v128_and(a.data, b.data); }
  friend batch operator|(batch a, batch b) { return wasm_v128_or(a.data, b.data); }
  friend batch operator<<(batch a, int count) {
    return wasm_i32x4_shl(a.data, static_cast<std::uint32_t>(count));
  }
  friend batch operator>>(batch a, int count) {
    return wasm_u32x4_shr(a.data, static_cast<std::uint32_t>(count));
  }
};

template <class Arch>
struct batch<std::int32_t, Arch> : lanes<std::int32_t> {
  using lanes<std::int32_t>::lanes;
  batch(std::int32_t number) : lanes(wasm_i32x4_splat(number)) {}

  friend batch_bool<std::int32_t, Arch> operator==(batch a, batch b) {
    return {wasm_i32x4_eq(a.data, b.data)};
  }
};

template <class To, class T, class Arch>
To bitwise_cast(batch<T, Arch> from) {
  return To(from.data);
}

template <class Arch>
batch_bool<float, Arch> bool_cast(batch_bool<std::int32_t, Arch> mask) {
  return {mask.data};
}

template <class Arch>
batch<float, Arch> to_float(batch<std::int32_t, Arch> number) {
  return wasm_f32x4_convert_i32x4(number.data);
}

template <class Arch>
batch<float, Arch> sqrt(batch<float, Arch> x) {
  return wasm_f32x4_sqrt(x.data);
}

template <class Arch>
batch<float, Arch> select(batch_bool<float, Arch> condition, batch<float, Arch> yes,
                          batch<float, Arch> no) {
  return wasm_v128_bitselect(yes.data, no.data, condition.data);
}

// As x86 has them: `b` where one of them is NaN, or both are zeros. (f32x4.max would give the NaN.)
template <class Arch>
batch<float, Arch> max(batch<float, Arch> a, batch<float, Arch> b) {
  return wasm_f32x4_pmax(b.data, a.data);
}
template <class Arch>
batch<float, Arch> min(batch<float, Arch> a, batch<float, Arch> b) {
  return wasm_f32x4_pmin(b.data, a.data);
}

}  // namespace xsimd
