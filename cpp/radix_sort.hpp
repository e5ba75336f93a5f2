// Stable sort of (key, index) by key, in passes of eleven bits; the order is the same for any number of threads.
#pragma once

#include <array>
#include <cstdint>
#include <span>
#include <utility>
#include <vector>

#include "parallel.hpp"

namespace fieldalign {

template <class Key>
struct Keyed {
  Key key;
  std::uint32_t index;
};

// Sorts by the lowest `bits` bits of the keys; the others must be zero.
template <class Key>
void radix_sort(std::span<Keyed<Key>> items, int bits, int threads) {
  constexpr int digit = 11;
  constexpr std::size_t buckets = std::size_t{1} << digit;
  const std::size_t n = items.size();
  // One block for each thread: each block counts its digits, then writes to places of its own.
  const std::size_t parts = std::clamp<std::size_t>(n / 65536, 1, std::max(threads, 1));
  const std::size_t block = (n + parts - 1) / parts;
  std::vector<Keyed<Key>> room(n);
  std::span<Keyed<Key>> from = items, to = room;
  std::vector<std::array<std::uint32_t, buckets>> counts(parts);
  for (int shift = 0; shift < bits; shift += digit) {
    const auto bucket = [shift](Key key) { return static_cast<std::size_t>(key >> shift) & (buckets - 1); };
    parallel_blocks(n, block, threads, [&](std::size_t begin, std::size_t end) {
      auto& count = counts[begin / block];
      count.fill(0);
      for (std::size_t i = begin; i < end; ++i) ++count[bucket(from[i].key)];
    });
    std::uint32_t place = 0;
    for (std::size_t b = 0; b < buckets; ++b)
      for (auto& count : counts) place += std::exchange(count[b], place);
    parallel_blocks(n, block, threads, [&](std::size_t begin, std::size_t end) {
      auto& count = counts[begin / block];
      for (std::size_t i = begin; i < end; ++i) to[count[bucket(from[i].key)]++] = from[i];
    });
    std::swap(from, to);
  }
  if (from.data() != items.data()) std::copy(from.begin(), from.end(), items.begin());
}

}  // namespace fieldalign
