// How many cells of a lattice points fill, for one cell size after the other: what a cloud's own scale is read from.
#pragma once

#include "casts.hpp"
#include "curve.hpp"

namespace fieldalign {

constexpr int kHalvings = 20;

struct Occupancy {
  Bounds core;                                // where the cloud is, but for far outliers
  double edge = 0;                            // of the coarsest cell, which holds all points of the core
  std::array<double, kHalvings> shared{};     // cells of edge / 2^k that hold two points or more
  std::array<double, kHalvings> company{};    // share of the points that lie in such a cell
};

// The box of the middle 96 % along each axis, widened on all sides by twice its longest edge.
inline Bounds core_of(const std::vector<Vec3>& points) {
  constexpr std::size_t kMost = 2048;
  const std::size_t stride = std::max<std::size_t>(1, points.size() / kMost);
  std::array<double, 3> low, high;
  double longest = 0;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> along;
    for (std::size_t i = 0; i < points.size(); i += stride) along.push_back(points[i][axis]);
    std::sort(along.begin(), along.end());
    low[axis] = along[along.size() / 50], high[axis] = along[along.size() - 1 - along.size() / 50];
    longest = std::max(longest, high[axis] - low[axis]);
  }
  // Where nearly all points are one place, the others are no outliers: they are all there is to see.
  const double width = longest > 0 ? 2 * longest : Bounds::kNothing;
  const Vec3 rim{width, width, width};
  return {Vec3{low[0], low[1], low[2]} - rim, Vec3{high[0], high[1], high[2]} + rim};
}

// Morton's code of a cell, 20 bits an axis: equal leading bits are equal cells.
inline std::uint64_t code_of(Vec3 cell) {
  const auto whole = [](double v) { return cast_within<std::uint32_t>(v, 0, (1 << kHalvings) - 1); };
  const std::uint32_t x = whole(cell.x), y = whole(cell.y), z = whole(cell.z);
  const auto half = [&](int shift) -> std::uint64_t {
    return kSpread[x >> shift & 1023] | kSpread[y >> shift & 1023] << 1 | kSpread[z >> shift & 1023] << 2;
  };
  return half(10) << 30 | half(0);
}

// Of at most `most` points, evenly spread over the rows.
template <class Real>
Occupancy occupancy(PointsView<Real> points, std::size_t most, int threads) {
  std::vector<Vec3> sample(std::min(points.n, most));
  for (std::size_t i = 0; i < sample.size(); ++i)
    sample[i] = points[static_cast<std::size_t>(static_cast<double>(i) * points.n / sample.size())];
  Occupancy result;
  std::erase_if(sample, [](Vec3 p) { return !is_finite(p); });
  if (sample.empty()) throw std::invalid_argument("an occupancy needs points that are finite");
  result.core = core_of(sample);
  std::erase_if(sample, [&](Vec3 p) { return !contains(result.core, p); });
  Bounds bounds;
  for (const Vec3 p : sample) bounds.add(p);
  const Vec3 extent = bounds.hi - bounds.lo;
  result.edge = std::max({extent.x, extent.y, extent.z});
  const double scale = result.edge > 0 ? ((1 << kHalvings) - 1) / result.edge : 0;
  std::vector<Keyed<std::uint64_t>> codes(sample.size());
  for (std::size_t i = 0; i < sample.size(); ++i) codes[i] = {code_of(scale * (sample[i] - bounds.lo)), 0};
  radix_sort<std::uint64_t>(codes, 3 * kHalvings, threads);
  for (int k = 0; k < kHalvings; ++k) {
    const int shift = 3 * (kHalvings - k);
    for (std::size_t begin = 0, end; begin < codes.size(); begin = end) {
      for (end = begin + 1; end < codes.size() && codes[end].key >> shift == codes[begin].key >> shift;) ++end;
      if (end - begin < 2) continue;
      result.shared[k] += 1;
      result.company[k] += static_cast<double>(end - begin) / static_cast<double>(codes.size());
    }
  }
  return result;
}

}  // namespace fieldalign
