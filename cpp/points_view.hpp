// A view of somebody else's (N, 3) array of float32 or float64.
#pragma once

#include <cstddef>

#include "vec.hpp"

namespace fieldalign {

template <class Real>
struct PointsView {
  const Real* data;
  std::size_t n;
  Vec3 operator[](std::size_t i) const {
    const Real* p = data + 3 * i;
    return {static_cast<double>(p[0]), static_cast<double>(p[1]), static_cast<double>(p[2])};
  }
};

}  // namespace fieldalign
