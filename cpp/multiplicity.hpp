// How many points share a place.
#pragma once

#include <bit>
#include <cstdint>
#include <cstring>
#include <vector>

namespace fieldalign {

// For each of n points (three doubles), how many of them are equal to it, bit by bit.
inline std::vector<std::int64_t> multiplicity(const double* points, std::size_t n) {
  const std::size_t slots = std::bit_ceil(2 * n + 1);
  std::vector<std::size_t> owner(slots, n), first(n);  // n: a free slot
  std::vector<std::int64_t> counts(n, 0);
  for (std::size_t i = 0; i < n; ++i) {
    std::uint64_t words[3], hash = 0;
    std::memcpy(words, points + 3 * i, sizeof words);
    for (const std::uint64_t word : words) hash = (hash ^ word) * 0x9E3779B97F4A7C15u, hash ^= hash >> 29;
    std::size_t slot = hash & (slots - 1);
    while (owner[slot] != n && std::memcmp(points + 3 * owner[slot], words, sizeof words) != 0)
      slot = (slot + 1) & (slots - 1);
    if (owner[slot] == n) owner[slot] = i;
    first[i] = owner[slot];
    ++counts[first[i]];
  }
  for (std::size_t i = 0; i < n; ++i) counts[i] = counts[first[i]];
  return counts;
}

}  // namespace fieldalign
