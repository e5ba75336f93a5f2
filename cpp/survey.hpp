// One pass over the points: their bounds and their mean.
#pragma once

#include <limits>

#include "parallel.hpp"
#include "points_view.hpp"

namespace fieldalign {

constexpr std::size_t kPointBlock = 16384;  // points a thread takes at a time

struct Bounds {
  static constexpr double kNothing = std::numeric_limits<double>::infinity();
  Vec3 lo{kNothing, kNothing, kNothing}, hi{-kNothing, -kNothing, -kNothing};
  void add(Vec3 p) { lo = smaller(lo, p), hi = larger(hi, p); }
};

inline bool contains(const Bounds& b, Vec3 p) {
  return p.x >= b.lo.x && p.y >= b.lo.y && p.z >= b.lo.z && p.x <= b.hi.x && p.y <= b.hi.y && p.z <= b.hi.z;
}

inline Bounds merged(const Bounds& a, const Bounds& b) { return {smaller(a.lo, b.lo), larger(a.hi, b.hi)}; }

struct Survey {
  Bounds bounds;
  Vec3 sum;  // NaN or infinite where a coordinate is
};

// Of point(i) for i in [0, n); summed by blocks, in their order.
template <class Point>
Survey survey(std::size_t n, Point point, int threads) {
  std::vector<Survey> parts((n + kPointBlock - 1) / kPointBlock);
  parallel_blocks(n, kPointBlock, threads, [&](std::size_t begin, std::size_t end) {
    Survey part;
    for (std::size_t i = begin; i < end; ++i) part.bounds.add(point(i)), part.sum = part.sum + point(i);
    parts[begin / kPointBlock] = part;
  });
  Survey all;
  for (const Survey& part : parts) all.bounds = merged(all.bounds, part.bounds), all.sum = all.sum + part.sum;
  return all;
}

}  // namespace fieldalign
