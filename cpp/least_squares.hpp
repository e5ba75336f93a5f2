// Sums over the pseudo points, in one fixed order: the same bits for any number of threads.
#pragma once

#include <array>
#include <bit>
#include <cstdint>
#include <cstring>
#include <vector>

namespace fieldalign {

struct NormalEquations {
  std::array<double, 36> H{};
  std::array<double, 6> g{};
};

// H = sum w J^T J and g = sum w J^T r over n rows of six.
inline NormalEquations normal_equations(const double* J, const double* r, const double* w, std::size_t n) {
  NormalEquations sums;
  for (std::size_t i = 0; i < n; ++i) {
    const double* row = J + 6 * i;
    for (int a = 0; a < 6; ++a) {
      const double weighted = w[i] * row[a];
      sums.g[a] += weighted * r[i];
      for (int b = 0; b < 6; ++b) sums.H[6 * a + b] += weighted * row[b];
    }
  }
  return sums;
}

// For each of n points, how many of them are equal to it, bit by bit.
inline void multiplicity(const double* points, std::size_t n, std::int64_t* counts) {
  const std::size_t slots = std::bit_ceil(2 * n + 1);
  std::vector<std::size_t> owner(slots, n);  // n: free
  std::vector<std::size_t> first(n);
  for (std::size_t i = 0; i < n; ++i) {
    std::uint64_t words[3], hash = 0;
    std::memcpy(words, points + 3 * i, sizeof words);
    for (const std::uint64_t word : words) hash = (hash ^ word) * 0x9E3779B97F4A7C15u, hash ^= hash >> 29;
    std::size_t slot = hash & (slots - 1);
    while (owner[slot] != n && std::memcmp(points + 3 * owner[slot], words, sizeof words) != 0)
      slot = (slot + 1) & (slots - 1);
    if (owner[slot] == n) owner[slot] = i, counts[i] = 0;
    first[i] = owner[slot];
    ++counts[first[i]];
  }
  for (std::size_t i = n; i-- > 0;) counts[i] = counts[first[i]];
}

}  // namespace fieldalign
