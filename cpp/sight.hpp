// What a sensor saw from where it stood: how far it looked in each direction.
//
// Directions are the cells of a cube around the sensor. Where a cell holds returns, the sensor looked freely up to the nearest
// return of the cell and those around it, so that slanted surfaces and edges do not count as looked through.
#pragma once

#include <limits>
#include <numbers>
#include <vector>

#include "casts.hpp"
#include "points_view.hpp"
#include "vec.hpp"

namespace fieldalign {

class Sight {
 public:
  template <class Real>
  Sight(PointsView<Real> points, Vec3 eye, int cells) : eye_(eye), cells_(cells) {
    std::vector<float> nearest(6 * static_cast<std::size_t>(cells) * static_cast<std::size_t>(cells), kNothing);
    for (std::size_t i = 0; i < points.n; ++i) {
      const Vec3 ray = points[i] - eye_;
      float& range = nearest[cell_of(ray)];
      range = std::min(range, static_cast<float>(std::sqrt(dot(ray, ray))));
    }
    free_ = nearest;
    for (std::size_t c = 0; c < free_.size(); ++c)
      if (free_[c] < kNothing) free_[c] = nearest_around(nearest, c);
  }

  // How far the sensor looked freely in the direction of a place; nothing where it saw nothing.
  double range_towards(Vec3 place) const {
    const float range = free_[cell_of(place - eye_)];
    return range < kNothing ? range : std::numeric_limits<double>::quiet_NaN();
  }

 private:
  static constexpr float kNothing = std::numeric_limits<float>::infinity();

  // Face of the cube, row, column; cells of equal angles, not of equal lengths on the face.
  std::size_t cell_of(Vec3 ray) const {
    const double size[3] = {std::abs(ray.x), std::abs(ray.y), std::abs(ray.z)};
    const int axis = static_cast<int>(std::max_element(size, size + 3) - size);
    const auto index = [&](int aside) {
      const double angle = std::atan2(ray[aside % 3], size[axis]);
      return static_cast<std::size_t>(cast_within((angle / std::numbers::pi * 4 + 1) / 2 * cells_, 0, cells_ - 1));
    };
    const std::size_t face = static_cast<std::size_t>(2 * axis + (ray[axis] < 0)), n = static_cast<std::size_t>(cells_);
    return (face * n + index(axis + 1)) * n + index(axis + 2);
  }
  float nearest_around(const std::vector<float>& nearest, std::size_t cell) const {
    const int at = static_cast<int>(cell), row = at / cells_ % cells_, column = at % cells_;
    float least = kNothing;
    for (int i = std::max(row - 1, 0); i <= std::min(row + 1, cells_ - 1); ++i)
      for (int j = std::max(column - 1, 0); j <= std::min(column + 1, cells_ - 1); ++j)
        least = std::min(least, nearest[static_cast<std::size_t>(at + (i - row) * cells_ + j - column)]);
    return least;
  }

  Vec3 eye_;
  int cells_;                // along a side of a face
  std::vector<float> free_;  // up to this range the sensor looked freely, by cell
};

}  // namespace fieldalign
