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
inline bool is_finite(Vec3 a) { return std::isfinite(a.x) && std::isfinite(a.y) && std::isfinite(a.z); }
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

// The axis along which points scatter least, of unit length, and the two smaller variances, ascending.
struct LeastAxis {
  Vec3 axis;
  double least, middle;
};

// In closed form: eigenvalues by the cosine of a third of an angle (Smith, CACM 1961), the axis as normal to the rows of
// A - least I. A tenth of the time of Jacobi's rotations, which are left for where that normal is lost in rounding.
inline LeastAxis least_axis(const Square<3>& A) {
  const double mean = (A[0][0] + A[1][1] + A[2][2]) / 3;
  const double a = A[0][0] - mean, b = A[1][1] - mean, c = A[2][2] - mean;
  const double x = A[0][1], y = A[0][2], z = A[1][2];
  const double spread = std::sqrt((a * a + b * b + c * c + 2 * (x * x + y * y + z * z)) / 6);
  const double third = (a * (b * c - z * z) - x * (x * c - z * y) + y * (x * z - b * y)) / (2 * spread * spread * spread);
  const double angle = std::acos(std::clamp(third, -1.0, 1.0)) / 3;
  const double down = 2 * spread * std::cos(angle + 2.0943951023931953);  // the least eigenvalue, from the mean
  const Vec3 rows[3] = {{a - down, x, y}, {x, b - down, z}, {y, z, c - down}};
  const Vec3 normals[3] = {cross(rows[0], rows[1]), cross(rows[1], rows[2]), cross(rows[2], rows[0])};
  Vec3 n = *std::max_element(normals, normals + 3, [](Vec3 p, Vec3 q) { return dot(p, p) < dot(q, q); });
  if (n.x + n.y + n.z < 0) n = -1.0 * n;  // which of the three it is shall not show
  const double length = std::sqrt(dot(n, n));
  if (!(length > 1e-6 * spread * spread)) {
    const auto [values, vectors] = eigen<3>(A);
    return {{vectors[0][0], vectors[1][0], vectors[2][0]}, std::max(values[0], 0.0), std::max(values[1], 0.0)};
  }
  const Vec3 axis = (1 / length) * n;
  const Vec3 image{A[0][0] * axis.x + x * axis.y + y * axis.z, x * axis.x + A[1][1] * axis.y + z * axis.z,
                   y * axis.x + z * axis.y + A[2][2] * axis.z};
  const double up = 2 * spread * std::cos(angle);
  return {axis, std::max(dot(axis, image), 0.0), std::max(mean - up - down, 0.0)};
}

}  // namespace fieldalign
