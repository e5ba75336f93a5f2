// Points in the order of Morton's curve: near on the curve is near in space, and a run of codes is a box.
#pragma once

#include <array>

#include "survey.hpp"
#include "radix_sort.hpp"

namespace fieldalign {

using Placed = Keyed<std::uint32_t>;  // code on the curve, row of the points

// The bounds of point(i) for i in [0, n).
template <class Point>
Bounds bounds_of(std::size_t n, Point point, int threads) {
  return survey(n, point, threads).bounds;
}

// Spreads the lowest ten bits of v to every third bit.
constexpr std::uint32_t spread(std::uint32_t v) {
  v = (v | (v << 16)) & 0x030000FF;
  v = (v | (v << 8)) & 0x0300F00F;
  v = (v | (v << 4)) & 0x030C30C3;
  return (v | (v << 2)) & 0x09249249;
}

constexpr auto kSpread = [] {
  std::array<std::uint32_t, 1024> table{};
  for (std::uint32_t v = 0; v < table.size(); ++v) table[v] = spread(v);
  return table;
}();

// Codes the items' points in 1024^3 cells over their bounds and sorts them by code, then by row.
// False where all the points are equal: no cells can part them.
template <class Real>
bool sort_along_curve(PointsView<Real> points, std::span<Placed> items, const Bounds& bounds, int threads) {
  const Vec3 extent = bounds.hi - bounds.lo;
  const double longest = std::max({extent.x, extent.y, extent.z});
  const double scale = 1023.999 / longest;
  if (!(longest > 0) || !std::isfinite(longest) || !std::isfinite(scale)) return false;
  parallel_blocks(items.size(), kPointBlock, threads, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Vec3 cell = scale * (points[items[i].index] - bounds.lo);
      items[i].key = kSpread[static_cast<std::int32_t>(cell.x)] | kSpread[static_cast<std::int32_t>(cell.y)] << 1 |
                     kSpread[static_cast<std::int32_t>(cell.z)] << 2;
    }
  });
  const auto by_code = [](const Placed& a, const Placed& b) {
    return a.key != b.key ? a.key < b.key : a.index < b.index;
  };
  if (items.size() < 4096)
    std::sort(items.begin(), items.end(), by_code);  // a radix sort's tables cost more than so few items
  else
    radix_sort(items, 30, threads);
  return true;
}

}  // namespace fieldalign
