// Vectors of three, and how points scatter.
#pragma once

#include <algorithm>
#include <cmath>

#include "symmetric_eigen.hpp"

namespace fieldalign {

struct Vec3 {
  double x = 0, y = 0, z = 0;
  double operator[](int axis) const { return axis == 0 ? x : axis == 1 ? y : z; }
};

inline Vec3 operator+(Vec3 a, Vec3 b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
inline Vec3 operator-(Vec3 a, Vec3 b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline Vec3 operator*(double s, Vec3 a) { return {s * a.x, s * a.y, s * a.z}; }
inline double dot(Vec3 a, Vec3 b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
inline Vec3 cross(Vec3 a, Vec3 b) { return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; }
inline Vec3 smaller(Vec3 a, Vec3 b) { return {std::min(a.x, b.x), std::min(a.y, b.y), std::min(a.z, b.z)}; }
inline Vec3 larger(Vec3 a, Vec3 b) { return {std::max(a.x, b.x), std::max(a.y, b.y), std::max(a.z, b.z)}; }

// The scatter of points about their mean, summed point by point.
struct Scatter {
  double n = 0, xx = 0, xy = 0, xz = 0, yy = 0, yz = 0, zz = 0;
  Vec3 sum;

  void add(Vec3 p) {
    n += 1;
    sum = sum + p;
    xx += p.x * p.x, xy += p.x * p.y, xz += p.x * p.z;
    yy += p.y * p.y, yz += p.y * p.z, zz += p.z * p.z;
  }
  Square<3> covariance() const {
    const Vec3 m = (1 / n) * sum;
    const double a = xx / n - m.x * m.x, b = xy / n - m.x * m.y, c = xz / n - m.x * m.z;
    const double d = yy / n - m.y * m.y, e = yz / n - m.y * m.z, f = zz / n - m.z * m.z;
    return {{{a, b, c}, {b, d, e}, {c, e, f}}};
  }
};

}  // namespace fieldalign
