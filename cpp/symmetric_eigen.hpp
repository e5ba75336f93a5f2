// Eigenvalues and eigenvectors of small symmetric matrices.
#pragma once

#include <algorithm>
#include <array>
#include <cmath>

namespace fieldalign {

template <int N>
using Square = std::array<std::array<double, N>, N>;

template <int N>
struct Eigen {
  std::array<double, N> values;  // ascending
  Square<N> vectors;             // columns of unit length, in the order of the values
};

// Jacobi's rotations: slower than a closed form, but right for nearly equal eigenvalues, which planes and lines have.
template <int N>
Eigen<N> eigen(Square<N> A) {
  Square<N> E{};
  for (int i = 0; i < N; ++i) E[i][i] = 1;
  for (int sweep = 0; sweep < 50; ++sweep) {
    double off = 0, diagonal = 0;
    for (int p = 0; p < N; ++p)
      for (int q = p; q < N; ++q) (p == q ? diagonal : off) += A[p][q] * A[p][q];
    if (off <= 1e-32 * diagonal) break;
    for (int p = 0; p < N - 1; ++p)
      for (int q = p + 1; q < N; ++q) {
        if (A[p][q] == 0) continue;
        const double theta = (A[q][q] - A[p][p]) / (2 * A[p][q]);
        const double t = (theta >= 0 ? 1 : -1) / (std::abs(theta) + std::sqrt(theta * theta + 1));
        const double cosine = 1 / std::sqrt(t * t + 1), sine = t * cosine;
        const auto turn = [&](double& u, double& v) {
          const double old = u;
          u = cosine * old - sine * v, v = sine * old + cosine * v;
        };
        for (int k = 0; k < N; ++k) turn(A[k][p], A[k][q]);
        for (int k = 0; k < N; ++k) turn(A[p][k], A[q][k]), turn(E[k][p], E[k][q]);
      }
  }
  std::array<int, N> rank;
  for (int i = 0; i < N; ++i) rank[i] = i;
  std::sort(rank.begin(), rank.end(), [&](int a, int b) { return A[a][a] < A[b][b]; });
  Eigen<N> result;
  for (int i = 0; i < N; ++i) {
    result.values[i] = A[rank[i]][rank[i]];
    for (int k = 0; k < N; ++k) result.vectors[k][i] = E[k][rank[i]];
  }
  return result;
}

}  // namespace fieldalign
