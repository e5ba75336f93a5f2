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

}  // namespace fieldalign
