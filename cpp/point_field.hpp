// The distance field of a point cloud, paper Sec. IV-A: D(x) = min_p |p - x|^2, given here as distance.
#pragma once

#include <algorithm>

#include "point_tree.hpp"

namespace fieldalign {

struct FieldSample {
  double value;
  Vec3 gradient, foot;
};

// A field whose squared value is `squared` and whose half gradient of the square is `offset`: gradient of the value.
// On a point itself the distance has no derivative; 0 is a subgradient.
inline Vec3 gradient_of_root(double value, Vec3 offset) { return value > 0 ? (1 / value) * offset : Vec3{}; }

// `place` is the foot's position in the tree; on entry, a guess of it that changes nothing but the time.
inline FieldSample nearest_point_field(const PointTree& tree, Vec3 query, std::uint32_t& place) {
  Nearest nearest;
  const Vec3 guess = query - tree.local(place);
  nearest.offer(dot(guess, guess), place);
  tree.visit(query, nearest);
  place = nearest.position;
  const Vec3 foot = tree.local(nearest.position);
  const double value = std::sqrt(nearest.squared);
  return {value, gradient_of_root(value, query - foot), foot};
}

// The paper's k-mean feature (Sec. V-G.2): the mean of the squared distances to the k nearest points.
inline FieldSample mean_point_field(const PointTree& tree, Vec3 query, int k) {
  KNearest nearest(tree, k);
  tree.visit(query, nearest);
  // Summed along the curve, not by distance: the same neighbours give the same foot, bit by bit.
  std::sort(nearest.position, nearest.position + nearest.found);
  double squared = 0;
  Vec3 sum;
  for (int j = 0; j < nearest.found; ++j) {
    const Vec3 p = tree.local(nearest.position[j]);
    squared += dot(query - p, query - p);
    sum = sum + p;
  }
  const Vec3 mean = (1.0 / nearest.found) * sum;
  const double value = std::sqrt(squared / nearest.found);
  return {value, gradient_of_root(value, query - mean), mean};
}

}  // namespace fieldalign
