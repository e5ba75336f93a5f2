// Rigid motions.
#pragma once

#include <algorithm>
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

// A rotation by rows, then a shift.
struct Motion {
  std::array<double, 9> R;
  Vec3 t;

  Vec3 turned(Vec3 p) const {
    return {R[0] * p.x + R[1] * p.y + R[2] * p.z, R[3] * p.x + R[4] * p.y + R[5] * p.z,
            R[6] * p.x + R[7] * p.y + R[8] * p.z};
  }
  Vec3 moved(Vec3 p) const { return turned(p) + t; }
};

inline Motion motion_of(const double* T) {  // (4, 4) by rows
  return {{T[0], T[1], T[2], T[4], T[5], T[6], T[8], T[9], T[10]}, {T[3], T[7], T[11]}};
}

inline Motion inverse(const Motion& m) {
  Motion back{{m.R[0], m.R[3], m.R[6], m.R[1], m.R[4], m.R[7], m.R[2], m.R[5], m.R[8]}, {}};
  back.t = -1.0 * back.turned(m.t);
  return back;
}

inline Motion operator*(const Motion& a, const Motion& b) {
  Motion product{};
  for (int i = 0; i < 3; ++i)
    for (int j = 0; j < 3; ++j)
      for (int k = 0; k < 3; ++k) product.R[3 * i + j] += a.R[3 * i + k] * b.R[3 * k + j];
  product.t = a.moved(b.t);
  return product;
}

// Log of a motion: the twist (w, v) that generates it, turning by at most pi.
inline std::array<double, 6> log_motion(const Motion& m) {
  const auto& R = m.R;
  const Vec3 axial = 0.5 * Vec3{R[7] - R[5], R[2] - R[6], R[3] - R[1]};
  const double sine = std::sqrt(dot(axial, axial)), cosine = (R[0] + R[4] + R[8] - 1) / 2;
  const double angle = std::atan2(sine, cosine), half = angle / 2;
  Vec3 w = (sine > 1e-8 ? angle / sine : 1.0) * axial;
  if (cosine <= -0.9) {  // near half a turn the axis is the direction that the symmetric part keeps
    const Vec3 columns[3] = {{R[0] - cosine, (R[1] + R[3]) / 2, (R[2] + R[6]) / 2},
                             {(R[1] + R[3]) / 2, R[4] - cosine, (R[5] + R[7]) / 2},
                             {(R[2] + R[6]) / 2, (R[5] + R[7]) / 2, R[8] - cosine}};
    const int longest = R[0] >= R[4] ? (R[0] >= R[8] ? 0 : 2) : (R[4] >= R[8] ? 1 : 2);
    const Vec3 axis = (1 / std::sqrt(dot(columns[longest], columns[longest]))) * columns[longest];
    w = (dot(axis, axial) >= 0 ? angle : -angle) * axis;
  }
  // v solves V v = t, where V is the left Jacobian of w (Barfoot, State Estimation for Robotics, 7.1.3).
  const double share = angle < 1e-4 ? 1.0 / 12 : (1 - half / std::tan(half)) / (angle * angle);
  const Vec3 turned = cross(w, m.t), v = m.t - 0.5 * turned + share * cross(w, turned);
  return {w.x, w.y, w.z, v.x, v.y, v.z};
}

// Which motions D = left G right, or the inverse of that, are allowed: as a quaternion and a shift they have zeros where
// they are not free.
struct Freedoms {
  Motion left, right;
  bool inverted;
  std::array<double, 3> turns, shifts;  // 1 where free, else 0

  // The nearest motion G that is allowed: these parts are set to zero, and the quaternion's length to one.
  Motion nearest(const Motion& G) const {
    Motion D = left * G * right;
    if (inverted) D = inverse(D);
    D.R = rotation_of(masked(quaternion_of(D.R)));
    D.t = {shifts[0] * D.t.x, shifts[1] * D.t.y, shifts[2] * D.t.z};
    if (inverted) D = inverse(D);
    return inverse(left) * D * inverse(right);
  }

 private:
  using Quaternion = std::array<double, 4>;  // scalar first

  static Quaternion quaternion_of(const std::array<double, 9>& R) {
    const double x = R[7] - R[5], y = R[2] - R[6], z = R[3] - R[1], yz = R[7] + R[5], zx = R[2] + R[6], xy = R[3] + R[1];
    const double squares[4] = {1 + R[0] + R[4] + R[8], 1 + R[0] - R[4] - R[8], 1 - R[0] + R[4] - R[8],
                               1 - R[0] - R[4] + R[8]};
    switch (std::max_element(squares, squares + 4) - squares) {  // rows of 4 q q^T: the longest
      case 0: return {squares[0], x, y, z};
      case 1: return {x, squares[1], xy, zx};
      case 2: return {y, xy, squares[2], yz};
      default: return {z, zx, yz, squares[3]};
    }
  }
  Quaternion masked(Quaternion q) const {
    for (int k = 0; k < 3; ++k) q[k + 1] *= turns[k];
    const double length = std::sqrt(q[0] * q[0] + q[1] * q[1] + q[2] * q[2] + q[3] * q[3]);
    if (!(length > 0)) return {1, 0, 0, 0};
    for (double& part : q) part /= length;
    return q;
  }
  static std::array<double, 9> rotation_of(const Quaternion& q) {
    const auto [w, x, y, z] = q;
    return {1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y), 2 * (x * y + w * z),
            1 - 2 * (x * x + z * z), 2 * (y * z - w * x), 2 * (x * z - w * y), 2 * (y * z + w * x),
            1 - 2 * (x * x + y * y)};
  }
};

}  // namespace fieldalign
