// One point for each occupied voxel.
#pragma once

#include <stdexcept>

#include "casts.hpp"
#include "radix_sort.hpp"
#include "survey.hpp"

namespace fieldalign {

struct Thinned {
  std::vector<Vec3> means;            // of the points of each voxel
  std::vector<std::uint32_t> first;   // the lowest row of each voxel
  std::vector<std::uint32_t> count;   // how many points it holds
};

// Voxels of edge `voxel` whose lattice begins at the points' own lower corner `lo`, so that a shifted cloud is thinned
// alike; `hi` is the upper corner. In the order of the lattice.
template <class Real>
Thinned thin(PointsView<Real> points, Vec3 lo, Vec3 hi, double voxel, int threads) {
  const auto width = [&](double extent) {
    const double cells = extent / voxel + 1;
    if (!(cells >= 1)) throw std::invalid_argument("bounds and voxel are none");
    if (!(cells < 2097152)) throw std::invalid_argument("voxel is less than 1 / 2097152 of the cloud's extent");
    int bits = 1;
    while ((1u << bits) < static_cast<std::uint32_t>(cells) + 1) ++bits;
    return bits;
  };
  const Vec3 extent = hi - lo;
  const int bx = width(extent.x), by = width(extent.y), bz = width(extent.z);
  std::vector<Keyed<std::uint64_t>> order(points.n);
  parallel_blocks(points.n, kPointBlock, threads, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Vec3 p = points[i] - lo;
      const auto cell = [&](double offset, int bits) {
        return cast_within<std::uint64_t>(offset / voxel, 0, (1u << bits) - 1);
      };
      order[i] = {(cell(p.z, bz) << (bx + by)) | (cell(p.y, by) << bx) | cell(p.x, bx), static_cast<std::uint32_t>(i)};
    }
  });
  radix_sort<std::uint64_t>(order, bx + by + bz, threads);
  std::vector<Thinned> parts((order.size() + kPointBlock - 1) / kPointBlock);
  parallel_blocks(order.size(), kPointBlock, threads, [&](std::size_t begin, std::size_t end) {
    Thinned& part = parts[begin / kPointBlock];
    std::size_t i = begin;
    while (i > 0 && i < end && order[i].key == order[i - 1].key) ++i;  // a voxel belongs to the block it begins in
    while (i < end) {
      Vec3 sum;
      const std::size_t first = i;
      for (; i < order.size() && order[i].key == order[first].key; ++i) sum = sum + (points[order[i].index] - lo);
      part.means.push_back(lo + (1.0 / static_cast<double>(i - first)) * sum);
      part.first.push_back(order[first].index);
      part.count.push_back(static_cast<std::uint32_t>(i - first));
    }
  });
  Thinned all;
  for (const Thinned& part : parts) {
    all.means.insert(all.means.end(), part.means.begin(), part.means.end());
    all.first.insert(all.first.end(), part.first.begin(), part.first.end());
    all.count.insert(all.count.end(), part.count.begin(), part.count.end());
  }
  return all;
}

}  // namespace fieldalign
