// Planes through the neighbours of a place: what a surface looks like from near.
#pragma once

#include "point_tree.hpp"

namespace fieldalign {

struct Surfel {
  Vec3 mean, normal;         // the neighbours' mean; the normal's sign has no meaning
  double thickness, width;   // standard deviations across the plane, and along its shorter axis
};

// The plane through the k nearest points of a place; all relative to the tree's centre.
inline Surfel surfel_at(const PointTree& tree, Vec3 place, int k) {
  KNearest nearest(tree, k);
  tree.visit(place, nearest);
  Scatter scatter;
  for (int j = 0; j < nearest.found; ++j) scatter.add(tree.local(nearest.position[j]) - place);
  const auto [normal, least, middle] = least_axis(scatter.covariance());
  return {place + (1 / scatter.n) * scatter.sum, normal, std::sqrt(least), std::sqrt(middle)};
}

// surfel_at() for each of the queries, handed to take(i, surfel).
template <class Real, class Take>
void fit_surfels(const PointTree& tree, PointsView<Real> queries, int k, int threads, Take take) {
  parallel_blocks(queries.n, 64, threads, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) take(i, surfel_at(tree, queries[i] - tree.centre(), k));
  });
}

// How many of the witnesses, some planes (n, 3) of a surface, lie in the plane through a place: within `distance` of it,
// and their normals within an angle of this cosine.
struct Witnesses {
  std::vector<float> x, y, z, nx, ny, nz;  // by coordinate, so that several are asked at a time

  void add(Vec3 mean, Vec3 normal) {
    const auto put = [](std::vector<float>& list, double value) { list.push_back(static_cast<float>(value)); };
    put(x, mean.x), put(y, mean.y), put(z, mean.z);
    put(nx, normal.x), put(ny, normal.y), put(nz, normal.z);
  }
  int in_plane(Vec3 mean, Vec3 normal, float distance, float min_cosine) const {
    const float a = static_cast<float>(normal.x), b = static_cast<float>(normal.y), c = static_cast<float>(normal.z);
    const float offset = static_cast<float>(dot(mean, normal));
    int count = 0;
    for (std::size_t j = 0; j < x.size(); ++j) {
      const float away = std::abs(a * x[j] + b * y[j] + c * z[j] - offset);
      const float cosine = std::abs(a * nx[j] + b * ny[j] + c * nz[j]);
      count += static_cast<int>(away < distance) & static_cast<int>(cosine > min_cosine);
    }
    return count;
  }
};

}  // namespace fieldalign
