// Four floats side by side, worked on together.
#pragma once

#include <cstring>

namespace fieldalign {

// GCC and Clang turn their vector types into one register of SSE or NEON; elsewhere a plain loop does the same.
struct Lanes {
#if defined(__GNUC__)
  typedef float Four __attribute__((vector_size(16)));
  Four v;
  friend Lanes operator+(Lanes a, Lanes b) { return {a.v + b.v}; }
  friend Lanes operator*(Lanes a, Lanes b) { return {a.v * b.v}; }
  friend Lanes operator-(Lanes a, float s) { return {a.v - s}; }
  friend Lanes operator-(float s, Lanes a) { return {s - a.v}; }
  friend Lanes max(Lanes a, Lanes b) { return {a.v > b.v ? a.v : b.v}; }
#else
  float v[4];
  template <class F>
  static Lanes each(F f) {
    return {{f(0), f(1), f(2), f(3)}};
  }
  friend Lanes operator+(Lanes a, Lanes b) { return each([&](int k) { return a.v[k] + b.v[k]; }); }
  friend Lanes operator*(Lanes a, Lanes b) { return each([&](int k) { return a.v[k] * b.v[k]; }); }
  friend Lanes operator-(Lanes a, float s) { return each([&](int k) { return a.v[k] - s; }); }
  friend Lanes operator-(float s, Lanes a) { return each([&](int k) { return s - a.v[k]; }); }
  friend Lanes max(Lanes a, Lanes b) { return each([&](int k) { return a.v[k] > b.v[k] ? a.v[k] : b.v[k]; }); }
#endif
  static Lanes load(const float* from) {
    Lanes lanes;
    std::memcpy(&lanes.v, from, sizeof lanes.v);
    return lanes;
  }
  float operator[](int k) const { return v[k]; }
};

}  // namespace fieldalign
