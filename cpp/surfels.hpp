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
      const Vec3 normal = eigen(scatter.covariance()).vectors[0];
      normals[3 * i] = normal.x, normals[3 * i + 1] = normal.y, normals[3 * i + 2] = normal.z;
    }
  });
}

}  // namespace fieldalign
