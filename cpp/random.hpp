// Random numbers that depend on a seed and a stream alone: each block of work draws from a stream of its own, so that no
// answer depends on which thread did it.
#pragma once

#include <cstdint>

namespace fieldalign {

// SplitMix64 (Steele, Lea and Flood, OOPSLA 2014).
class Random {
 public:
  Random(std::uint64_t seed, std::uint64_t stream) : state_(mixed(seed ^ mixed(stream + 0x9E3779B97F4A7C15u))) {}

  // A whole number in [0, n).
  std::uint32_t below(std::uint32_t n) { return static_cast<std::uint32_t>(((next() >> 32) * n) >> 32); }

 private:
  static std::uint64_t mixed(std::uint64_t z) {
    z = (z ^ (z >> 30)) * 0xBF58476D1CE4E5B9u;
    z = (z ^ (z >> 27)) * 0x94D049BB133111EBu;
    return z ^ (z >> 31);
  }
  std::uint64_t next() { return mixed(state_ += 0x9E3779B97F4A7C15u); }

  std::uint64_t state_;
};

}  // namespace fieldalign
