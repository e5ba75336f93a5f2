// A register's worth of numbers side by side, worked on together: four floats or two doubles.
#pragma once

#include <cstring>

#if defined(__SSE2__) || defined(_M_X64)
#define FIELDALIGN_SSE2
#include <emmintrin.h>
#endif

namespace fieldalign {

// GCC and Clang turn their vector types into one register of SSE or NEON; elsewhere a plain loop does the same.
template <class Real>
struct Lanes {
  static constexpr int kCount = 16 / sizeof(Real);
#if defined(__GNUC__)
  typedef Real Register __attribute__((vector_size(16)));
  Register v;
  friend Lanes operator+(Lanes a, Lanes b) { return {a.v + b.v}; }
  friend Lanes operator*(Lanes a, Lanes b) { return {a.v * b.v}; }
  friend Lanes operator-(Lanes a, Lanes b) { return {a.v - b.v}; }
  friend Lanes max(Lanes a, Lanes b) { return {a.v > b.v ? a.v : b.v}; }
  friend Lanes min(Lanes a, Lanes b) { return {a.v < b.v ? a.v : b.v}; }
#else
  alignas(16) Real v[kCount];
  template <class F>
  static Lanes each(F f) {
    Lanes lanes;
    for (int k = 0; k < kCount; ++k) lanes.v[k] = f(k);
    return lanes;
  }
  friend Lanes operator+(Lanes a, Lanes b) { return each([&](int k) { return a.v[k] + b.v[k]; }); }
  friend Lanes operator*(Lanes a, Lanes b) { return each([&](int k) { return a.v[k] * b.v[k]; }); }
  friend Lanes operator-(Lanes a, Lanes b) { return each([&](int k) { return a.v[k] - b.v[k]; }); }
  friend Lanes max(Lanes a, Lanes b) { return each([&](int k) { return a.v[k] > b.v[k] ? a.v[k] : b.v[k]; }); }
  friend Lanes min(Lanes a, Lanes b) { return each([&](int k) { return a.v[k] < b.v[k] ? a.v[k] : b.v[k]; }); }
#endif
  static Lanes all(Real s) {
    Lanes lanes;
    for (int k = 0; k < kCount; ++k) lanes.v[k] = s;
    return lanes;
  }
  static Lanes load(const Real* from) {
    Lanes lanes;
    std::memcpy(&lanes.v, from, sizeof lanes.v);
    return lanes;
  }
  void store(Real* to) const { std::memcpy(to, &v, sizeof v); }
};

// Bit k: lane k is at most s.
inline unsigned at_most(Lanes<float> a, float s) {
#if defined(FIELDALIGN_SSE2)
  __m128 lanes;
  std::memcpy(&lanes, &a.v, sizeof lanes);
  return static_cast<unsigned>(_mm_movemask_ps(_mm_cmple_ps(lanes, _mm_set1_ps(s))));
#else
  unsigned bits = 0;
  for (int k = 0; k < 4; ++k) bits |= static_cast<unsigned>(a.v[k] <= s) << k;
  return bits;
#endif
}

}  // namespace fieldalign
