// The linear step over the pseudo points, summed in one fixed order: the same bits for any number of threads.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>
#include <cstddef>

#include "symmetric_eigen.hpp"

namespace fieldalign {

using Twist = std::array<double, 6>;       // (w, v)

struct NormalEquations {
  Square<6> H{};
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

// The length over which rotations and translations are of one size.
inline double lever(const Square<6>& H) {
  const double turn = H[0][0] + H[1][1] + H[2][2], shift = H[3][3] + H[4][4] + H[5][5];
  return turn > 0 && shift > 0 ? std::sqrt(turn / shift) : 1;
}

// A matrix over twists whose translations are measured in lengths of a lever.
inline Square<6> levered(const Square<6>& H, const Twist& scale) {
  Square<6> scaled;
  for (int a = 0; a < 6; ++a)
    for (int b = 0; b < 6; ++b) scaled[a][b] = scale[a] * H[a][b] * scale[b];
  return scaled;
}

// The smallest eigenvalue as a share of the largest; 0 where there is none.
inline double least_share(const Square<6>& H, double length) {
  const auto values = eigen<6>(levered(H, {1, 1, 1, length, length, length})).values;
  return values[5] > 0 ? values[0] / values[5] : 0;
}

// x = -H^+ g: the pseudo-inverse, so that a direction without any information gets no step. Rotations and translations
// are brought to one size first, so that the unit of length does not decide what counts as no information.
inline Twist solve(const NormalEquations& sums) {
  const double length = lever(sums.H);
  const Twist scale = {1, 1, 1, length, length, length};
  const Eigen<6> parts = eigen<6>(levered(sums.H, scale));
  Twist x{};
  for (int k = 0; k < 6; ++k) {
    if (!(parts.values[k] > 1e-13 * parts.values[5])) continue;
    double along = 0;
    for (int a = 0; a < 6; ++a) along += parts.vectors[a][k] * scale[a] * sums.g[a];
    for (int a = 0; a < 6; ++a) x[a] -= scale[a] * parts.vectors[a][k] * along / parts.values[k];
  }
  return x;
}

// A step, lengthened, but turning by no more than so far.
inline Twist limited(Twist x, double stretch, double largest_turn) {
  for (double& part : x) part *= stretch;
  const double turn = std::sqrt(x[0] * x[0] + x[1] * x[1] + x[2] * x[2]);
  if (turn > largest_turn)
    for (double& part : x) part *= largest_turn / turn;
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
