// Vectors of three, and the eigen-decomposition of a symmetric 3 x 3 matrix.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

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
  // Covariance, upper triangle by rows: xx xy xz yy yz zz.
  std::array<double, 6> covariance() const {
    const Vec3 m = (1 / n) * sum;
    return {xx / n - m.x * m.x, xy / n - m.x * m.y, xz / n - m.x * m.z,
            yy / n - m.y * m.y, yz / n - m.y * m.z, zz / n - m.z * m.z};
  }
};

struct Eigen3 {
  std::array<double, 3> values;   // ascending
  std::array<Vec3, 3> vectors;    // unit length, in the order of the values
};

// Jacobi's rotations: slower than the closed form, but right for nearly equal eigenvalues, which planes and lines have.
inline Eigen3 eigen(const std::array<double, 6>& c) {
  double A[3][3] = {{c[0], c[1], c[2]}, {c[1], c[3], c[4]}, {c[2], c[4], c[5]}};
  double E[3][3] = {{1, 0, 0}, {0, 1, 0}, {0, 0, 1}};
  for (int sweep = 0; sweep < 30; ++sweep) {
    const double off = A[0][1] * A[0][1] + A[0][2] * A[0][2] + A[1][2] * A[1][2];
    const double diagonal = A[0][0] * A[0][0] + A[1][1] * A[1][1] + A[2][2] * A[2][2];
    if (off <= 1e-32 * diagonal) break;
    for (int p = 0; p < 2; ++p)
      for (int q = p + 1; q < 3; ++q) {
        if (A[p][q] == 0) continue;
        const double theta = (A[q][q] - A[p][p]) / (2 * A[p][q]);
        const double t = (theta >= 0 ? 1 : -1) / (std::abs(theta) + std::sqrt(theta * theta + 1));
        const double cosine = 1 / std::sqrt(t * t + 1), sine = t * cosine;
        for (int k = 0; k < 3; ++k) {
          const double u = A[k][p], v = A[k][q];
          A[k][p] = cosine * u - sine * v, A[k][q] = sine * u + cosine * v;
        }
        for (int k = 0; k < 3; ++k) {
          const double u = A[p][k], v = A[q][k];
          A[p][k] = cosine * u - sine * v, A[q][k] = sine * u + cosine * v;
          const double e = E[k][p], f = E[k][q];
          E[k][p] = cosine * e - sine * f, E[k][q] = sine * e + cosine * f;
        }
      }
  }
  std::array<int, 3> rank = {0, 1, 2};
  std::sort(rank.begin(), rank.end(), [&](int a, int b) { return A[a][a] < A[b][b]; });
  Eigen3 result;
  for (int i = 0; i < 3; ++i) {
    result.values[i] = A[rank[i]][rank[i]];
    result.vectors[i] = {E[0][rank[i]], E[1][rank[i]], E[2][rank[i]]};
  }
  return result;
}

}  // namespace fieldalign
