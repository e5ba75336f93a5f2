// Rigid motions.
#pragma once

#include <array>
#include <cmath>

#include "vec.hpp"

namespace fieldalign {

// Exp of a twist (w, v): the 4 x 4 motion that it generates, by rows (Rodrigues' formula).
inline std::array<double, 16> exp_twist(Vec3 w, Vec3 v) {
  const double angle = std::sqrt(dot(w, w));
  double a, b, c;  // of W, W^2 and, for the shift, W^2
  if (angle < 1e-4) {  // the next terms of the series are below float64's resolution
    a = 1 - angle * angle / 6, b = 0.5 - angle * angle / 24, c = 1.0 / 6 - angle * angle / 120;
  } else {
    const double half = std::sin(angle / 2) / angle;
    a = std::sin(angle) / angle, b = 2 * half * half, c = (1 - a) / (angle * angle);
  }
  // W x = w cross x, and W^2 x = w (w . x) - angle^2 x.
  const auto combined = [&](Vec3 x, double first, double second) {
    return x + first * cross(w, x) + second * (dot(w, x) * w - angle * angle * x);
  };
  const Vec3 X = combined({1, 0, 0}, a, b), Y = combined({0, 1, 0}, a, b), Z = combined({0, 0, 1}, a, b);
  const Vec3 t = combined(v, b, c);
  return {X.x, Y.x, Z.x, t.x, X.y, Y.y, Z.y, t.y, X.z, Y.z, Z.z, t.z, 0, 0, 0, 1};
}

}  // namespace fieldalign
