// Planes through the neighbours of a place.
#pragma once

#include "point_tree.hpp"

namespace fieldalign {

// The unit normal of the plane through the k nearest points of each query, n x 3; its sign has no meaning.
template <class Real>
void plane_normals(const PointTree& tree, PointsView<Real> queries, int k, int threads, double* normals) {
  parallel_blocks(queries.n, 64, threads, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Vec3 query = queries[i] - tree.centre();
      KNearest nearest(tree, k);
      tree.visit(query, nearest);
      Scatter scatter;
      for (int j = 0; j < nearest.found; ++j) scatter.add(tree.local(nearest.position[j]) - query);
      const auto axes = eigen<3>(scatter.covariance()).vectors;
      for (int a = 0; a < 3; ++a) normals[3 * i + a] = axes[a][0];
    }
  });
}

}  // namespace fieldalign
