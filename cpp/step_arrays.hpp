// Sums of the robust step as NumPy arrays.
#pragma once

#include "arrays.hpp"
#include "linearise.hpp"

namespace fieldalign {

constexpr std::size_t kTotals = 4;

// H (b, N, N), g (b, N), and for each pose sum of weights, weighted squares, curvature and how many were kept (b, 4).
template <int N>
nb::tuple arrays_of(const std::vector<StepSums<N>>& sums) {
  const std::size_t b = sums.size(), n = N;
  std::vector<double> H, g, totals;
  for (const StepSums<N>& s : sums) {
    g.insert(g.end(), s.g.begin(), s.g.end());
    for (int i = 0; i < N; ++i)
      for (int j = 0; j < N; ++j) H.push_back(s.H[std::min(i, j)][std::max(i, j)]);
    totals.insert(totals.end(), {s.weights, s.squares, s.curvature, static_cast<double>(s.kept)});
  }
  return nb::make_tuple(array(std::move(H), {b, n, n}), array(std::move(g), {b, n}), array(std::move(totals), {b, kTotals}));
}

template <std::size_t N>
Array<double> array_of(const std::array<std::array<double, N>, N>& A) {
  std::vector<double> flat;
  for (const auto& row : A) flat.insert(flat.end(), row.begin(), row.end());
  return array(std::move(flat), {N, N});
}

}  // namespace fieldalign
