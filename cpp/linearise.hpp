// The robust step: pseudo points near one cloud's surface against the planes of the other's.
//
// A pseudo point lies `offset` from its own surface, along the normal n' there. Where it is moved to x, the other surface
// is the plane (m, n) at x's foot, and the two signed distances should agree: r = N.(x - m) - offset N.n'. N halves n and
// n', so that a curved surface pulls to neither side (symmetric objective, Rusinkiewicz, SIGGRAPH 2019). The row of the
// Jacobian for a twist (w, v) on the pose's left is [x cross N, N]; for a growth of x by exp(g) it is x.N, the seventh.
#pragma once

#include <algorithm>
#include <limits>
#include <optional>

#include "least_squares.hpp"
#include "vec.hpp"

namespace fieldalign {

struct RobustLoss {
  double scale;       // of residuals over their spread: one as large has a quarter of the weight
  double min_cosine;  // between normals that agree: below, a pseudo point is truncated
  double reach;       // from x to m, a length: beyond, a pseudo point has no partner
  bool facing = false;  // whether normals point towards the sensors: then those that oppose do not agree
};

struct Residual {
  double r, cosine;
  Vec3 between, normal;  // N, and n with the sign that n' has
};

// Nothing where the pseudo point is truncated.
inline std::optional<Residual> residual(Vec3 x, Vec3 own_normal, double offset, Vec3 mean, Vec3 normal,
                                        const RobustLoss& loss) {
  const Vec3 away = x - mean;
  if (!(dot(away, away) <= loss.reach * loss.reach)) return {};
  double cosine = dot(normal, own_normal);
  if (cosine < 0 && !loss.facing) normal = -1.0 * normal, cosine = -cosine;
  if (!(cosine >= loss.min_cosine)) return {};
  Vec3 between = normal + own_normal;
  between = (1 / std::sqrt(dot(between, between))) * between;
  return Residual{dot(between, away) - offset * dot(between, own_normal), cosine, between, normal};
}

// Geman and McClure's weight (1 + z^2)^-2 of z = r / (scale spread), times the cosine between the normals.
inline double weight_of(const Residual& found, double spread, const RobustLoss& loss) {
  const double z = found.r / (loss.scale * spread), falloff = 1 / (1 + z * z);
  return found.cosine * falloff * falloff;
}

// Of N = 6 freedoms, or of 7 with the growth.
template <int N>
std::array<double, N> row_of(Vec3 place, Vec3 normal) {
  const Vec3 moment = cross(place, normal);
  std::array<double, N> row = {moment.x, moment.y, moment.z, normal.x, normal.y, normal.z};
  if constexpr (N == 7) row[6] = dot(place, normal);
  return row;
}

// By how much to lengthen reweighted steps: the loss bends less than its weights say (Huber, Robust Statistics, 7.8), and
// the steps come out short by about a third. Never so long that one ends as far beyond the end.
inline double stretch_of(double weights, double curvature) {
  return 1 / std::clamp(curvature / std::max(weights, 1e-300), 0.6, 1.0);
}

// What one pose's pseudo points add up to for its next step.
template <int N>
struct StepSums {
  Square<N> H{};             // sum of weight J^T J, the upper triangle
  std::array<double, N> g{};  // sum of weight J^T r
  double weights = 0;         // sum of weights
  double squares = 0;         // sum of weight r^2
  double curvature = 0;       // sum of the loss's second derivatives
  int kept = 0;               // not truncated

  void add(Vec3 x, const Residual& found, double spread, const RobustLoss& loss) {
    const double w = weight_of(found, spread, loss) / (spread * spread);
    const double z = found.r / (loss.scale * spread);
    const auto row = row_of<N>(x, found.between);
    for (int a = 0; a < N; ++a) {
      const double weighted = w * row[a];
      g[a] += weighted * found.r;
      for (int b = a; b < N; ++b) H[a][b] += weighted * row[b];
    }
    weights += w;
    squares += w * found.r * found.r;
    curvature += w * (4 / (1 + z * z) - 3);
    ++kept;
  }
  double stretch() const { return stretch_of(weights, curvature); }
};

// What the residuals at the end tell of the pose's certainty.
constexpr int kRun = 16;  // pseudo points: neighbours in space, whose errors may go together

template <int N>
struct CertaintySums {
  Square<N> hold{};     // sum of weight J^T J', J of one cloud's planes, J' of the other's
  Square<N> scatter{};  // of the gradient: sum over runs of g g^T
  std::array<double, N> run{};  // g of the run that is not over yet
  int length = 0;

  // The noise of the two clouds' normals is not the same, so that it cancels from the product: a plane, whose normals
  // differ by noise alone, does not hold a pose that slides on it.
  void add(Vec3 x, Vec3 own_normal, Vec3 mean, const Residual& found, double spread, const RobustLoss& loss) {
    const double w = weight_of(found, spread, loss) / (spread * spread);
    const auto own = row_of<N>(x, own_normal), other = row_of<N>(mean, found.normal);
    for (int a = 0; a < N; ++a)
      for (int b = 0; b < N; ++b) hold[a][b] += w / 2 * (own[a] * other[b] + other[a] * own[b]);
    add_gradient(w * found.r, row_of<N>(x, found.between));
  }
  void add_gradient(double weighted, const std::array<double, N>& row) {
    for (int a = 0; a < N; ++a) run[a] += weighted * row[a];
    if (++length == kRun) end_run();
  }
  void end_run() {
    for (int a = 0; a < N; ++a)
      for (int b = 0; b < N; ++b) scatter[a][b] += run[a] * run[b];
    run = {}, length = 0;
  }
};

// How well one pose lays surfels on the other surface.
struct AgreementSums {
  double agreeing = 0;  // the surfels' weights, where the surfaces coincide whole, else in part
  double met = 0;       // the weights of those near the other surface at all
  int on = 0;           // how many are on the other surface: within the scale across, and twice that in all

  void add(Vec3 x, Vec3 own_normal, double weight, Vec3 mean, Vec3 normal, const RobustLoss& loss) {
    met += weight;
    const Vec3 away = x - mean;
    on += dot(away, away) < 4 * loss.scale * loss.scale && std::abs(dot(away, normal)) < loss.scale;
    const auto found = residual(x, own_normal, 0, mean, normal, loss);
    if (found) agreeing += weight * weight_of(*found, 1, loss);
  }
};

}  // namespace fieldalign
