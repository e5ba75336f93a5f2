// The linear step over the pseudo points, summed in one fixed order: the same bits for any number of threads.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>
#include <vector>

namespace fieldalign {

using Twist = std::array<double, 6>;       // (w, v)
using Square6 = std::array<Twist, 6>;

struct NormalEquations {
  Square6 H{};
  Twist g{};
};

// H = sum w J^T J and g = sum w J^T r over n rows of six.
inline NormalEquations normal_equations(const double* J, const double* r, const double* w, std::size_t n) {
  NormalEquations sums;
  for (std::size_t i = 0; i < n; ++i) {
    const double* row = J + 6 * i;
    for (int a = 0; a < 6; ++a) {
      const double weighted = w[i] * row[a];
      sums.g[a] += weighted * r[i];
      for (int b = 0; b < 6; ++b) sums.H[a][b] += weighted * row[b];
    }
  }
  return sums;
}

// Eigenvalues and, as columns, eigenvectors of a symmetric matrix, by Jacobi's rotations.
struct Eigen6 {
  Twist values;
  Square6 vectors;
};

inline Eigen6 eigen(Square6 A) {
  Square6 E{};
  for (int i = 0; i < 6; ++i) E[i][i] = 1;
  for (int sweep = 0; sweep < 50; ++sweep) {
    double off = 0, diagonal = 0;
    for (int p = 0; p < 6; ++p)
      for (int q = 0; q < 6; ++q) (p == q ? diagonal : off) += A[p][q] * A[p][q];
    if (off <= 1e-32 * diagonal) break;
    for (int p = 0; p < 5; ++p)
      for (int q = p + 1; q < 6; ++q) {
        if (A[p][q] == 0) continue;
        const double theta = (A[q][q] - A[p][p]) / (2 * A[p][q]);
        const double t = (theta >= 0 ? 1 : -1) / (std::abs(theta) + std::sqrt(theta * theta + 1));
        const double cosine = 1 / std::sqrt(t * t + 1), sine = t * cosine;
        const auto turn = [&](double& u, double& v) {
          const double old = u;
          u = cosine * old - sine * v, v = sine * old + cosine * v;
        };
        for (int k = 0; k < 6; ++k) turn(A[k][p], A[k][q]);
        for (int k = 0; k < 6; ++k) turn(A[p][k], A[q][k]), turn(E[k][p], E[k][q]);
      }
  }
  Eigen6 result{{}, E};
  for (int i = 0; i < 6; ++i) result.values[i] = A[i][i];
  return result;
}

// x = -H^+ g: the pseudo-inverse, so that a direction without any information gets no step. Rotations and translations
// are brought to one size first, so that the unit of length does not decide what counts as no information.
inline Twist solve(const NormalEquations& sums) {
  const auto& H = sums.H;
  const double turn = H[0][0] + H[1][1] + H[2][2], shift = H[3][3] + H[4][4] + H[5][5];
  const double length = turn > 0 && shift > 0 ? std::sqrt(turn / shift) : 1;
  const Twist scale = {1, 1, 1, length, length, length};
  Square6 scaled;
  for (int a = 0; a < 6; ++a)
    for (int b = 0; b < 6; ++b) scaled[a][b] = scale[a] * H[a][b] * scale[b];
  const Eigen6 parts = eigen(scaled);
  const double largest = *std::max_element(parts.values.begin(), parts.values.end());
  Twist x{};
  for (int k = 0; k < 6; ++k) {
    if (!(parts.values[k] > 1e-13 * largest)) continue;
    double along = 0;
    for (int a = 0; a < 6; ++a) along += parts.vectors[a][k] * scale[a] * sums.g[a];
    for (int a = 0; a < 6; ++a) x[a] -= scale[a] * parts.vectors[a][k] * along / parts.values[k];
  }
  return x;
}

struct Reweighting {
  double floor;      // residuals below it are weighted alike
  double unit;       // the length that counts as much as a radian in the rule for stopping
  double tolerance;  // stop where the twist changes by less
  int steps;         // or after so many
};

// The twist that minimises sum |J x + r|, by iteratively reweighted least squares with p = 1 (paper Sec. IV-C): weights
// |J x + r|^(p - 2), from those given, and left behind for the next time.
inline Twist reweighted_solution(const double* J, const double* r, double* w, std::size_t n, const Reweighting& s) {
  Twist x{};
  for (int step = 0; step < s.steps; ++step) {
    const Twist before = x;
    x = solve(normal_equations(J, r, w, n));
    for (std::size_t i = 0; i < n; ++i) {
      const double* row = J + 6 * i;
      double residual = r[i];
      for (int a = 0; a < 6; ++a) residual += row[a] * x[a];
      w[i] = 1 / std::max(s.floor, std::abs(residual));
    }
    // Lengths of both parts, where the authors' program sums |components|: a turned world must not stop elsewhere.
    double turn = 0, shift = 0;
    for (int a = 0; a < 3; ++a) {
      turn += (x[a] - before[a]) * (x[a] - before[a]);
      shift += (x[a + 3] - before[a + 3]) * (x[a + 3] - before[a + 3]);
    }
    if (std::sqrt(turn) + std::sqrt(shift) / s.unit < s.tolerance) break;
  }
  return x;
}

}  // namespace fieldalign
