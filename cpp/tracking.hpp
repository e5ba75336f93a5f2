// A scan against the map: pseudo points on the scan's own surface, so that their own distance is zero by construction,
// against the planes of the voxels that they come to lie in.
#pragma once

#include "linearise.hpp"
#include "voxel_map.hpp"

namespace fieldalign {

struct TrackLoss {
  double deviations;   // of the residuals: one as large as so many has a quarter of the weight
  double least_scale;  // the scale is no finer than that (a length)
  double gate;         // beyond, a pseudo point has no partner (a length)
  double thickness;    // of a plane, at least (a length)
  double flatness;     // a plane has less than this share of its variance along the shorter axis across
  bool is_whole;       // whether voxels that are no planes hold, too, and planes along themselves
};

struct TrackSums {
  StepSums<6> step;
  double scale = 0;
  int met = 0;  // pseudo points in a voxel with a plane
  int on = 0;   // of these, within twice the thickness of it
};

// How widely residuals across a plane of this variance scatter, as a multiple of the least.
inline double spread_across(double variance, const TrackLoss& loss) {
  return std::sqrt(variance / (loss.thickness * loss.thickness) + 1);
}

inline bool is_plane(const MapPlane& plane, const TrackLoss& loss) {
  return loss.is_whole || plane.least < loss.flatness * plane.middle;
}

// A pseudo point that has a plane: where it is about `origin`, in the axes of the world, and its residual.
struct Met {
  Vec3 x;
  double r, spread;
  const MapPlane* plane;
  double count;  // of the plane's points
};

// take(met) for each pseudo point that has a plane.
template <class Take>
void meet_planes(VoxelMap& map, std::span<const ScanPoint> scan, std::span<const std::int32_t> cells, const Motion& pose,
                 Vec3 origin, const TrackLoss& loss, Take take) {
  for (std::size_t i = 0; i < scan.size(); ++i) {
    if (cells[i] == VoxelMap::kNone) continue;
    const MapPlane& plane = map.plane(cells[i]);
    if (!is_plane(plane, loss)) continue;
    const Vec3 x = pose.moved(scan[i].place());
    const double r = dot(plane.normal, x + origin - plane.mean);
    take(Met{x, r, spread_across(plane.least, loss), &plane, map.count(cells[i])});
  }
}

// Two axes of unit length that span the plane across n.
inline std::array<Vec3, 2> across(Vec3 n) {
  const Vec3 other = std::abs(n.x) < 0.6 ? cross(n, {1, 0, 0}) : cross(n, {0, 1, 0});
  const Vec3 one = (1 / std::sqrt(dot(other, other))) * other;
  return {one, cross(n, one)};
}

constexpr double kLooser = 1.8;  // residuals along a plane, which depend on where its points happen to lie

// A voxel's points scatter along its plane, too; what they hold there is that of two more planes, as thick as they are
// wide.
inline void add_along(StepSums<6>& sums, Vec3 x, Vec3 away, const MapPlane& plane, const TrackLoss& loss,
                      const RobustLoss& robust) {
  const double spread = kLooser * spread_across(plane.middle, loss);
  for (const Vec3 axis : across(plane.normal)) sums.add(x, {dot(axis, away), 1, axis, axis}, spread, robust);
}

// H, g and the totals of a step; the weights' scale is that of the residuals themselves, by their median.
inline TrackSums track_sums(VoxelMap& map, std::span<const ScanPoint> scan, std::span<const std::int32_t> cells,
                            const Motion& pose, Vec3 origin, const TrackLoss& loss) {
  TrackSums sums;
  std::vector<Met> met;
  std::vector<double> sizes;
  met.reserve(scan.size()), sizes.reserve(scan.size());
  meet_planes(map, scan, cells, pose, origin, loss, [&](const Met& m) {
    ++sums.met;
    sums.on += std::abs(m.r) < 2 * loss.thickness;
    if (std::abs(m.r) > loss.gate) return;
    met.push_back(m);
    sizes.push_back(std::abs(m.r) / m.spread);
  });
  if (met.empty()) return sums;
  const auto middle = sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2);
  std::nth_element(sizes.begin(), middle, sizes.end());
  sums.scale = std::max(loss.deviations * 1.4826 * *middle, loss.least_scale);
  const RobustLoss robust{sums.scale, 0, loss.gate};
  for (const Met& m : met) {
    sums.step.add(m.x, {m.r, 1, m.plane->normal, m.plane->normal}, m.spread, robust);
    if (loss.is_whole) add_along(sums.step, m.x, m.x + origin - m.plane->mean, *m.plane, loss, robust);
  }
  return sums;
}

// What holds the pose and how its gradient scatters. A plane's normal is uncertain by its thickness over the width and
// over the root of its count, and J J^T holds the square of that noise; it is taken off, so that nothing but surface
// holds.
inline CertaintySums<6> certainty_sums(VoxelMap& map, std::span<const ScanPoint> scan,
                                       std::span<const std::int32_t> cells, const Motion& pose, Vec3 origin,
                                       const TrackLoss& loss, double scale) {
  CertaintySums<6> known;
  const RobustLoss robust{scale, 0, loss.gate};
  meet_planes(map, scan, cells, pose, origin, loss, [&](const Met& m) {
    if (std::abs(m.r) > loss.gate) return;
    const Vec3 n = m.plane->normal;
    const Residual found{m.r, 1, n, n};
    known.add(m.x, n, m.x, found, m.spread, robust);
    const double tilt = m.plane->least / (m.plane->middle * m.count);  // variance of the normal, along an axis
    const double noise = weight_of(found, m.spread, robust) / (m.spread * m.spread) * tilt;
    for (const Vec3 axis : across(n)) {
      const auto row = row_of<6>(m.x, axis);
      for (int a = 0; a < 6; ++a)
        for (int b = 0; b < 6; ++b) known.hold[a][b] -= noise * row[a] * row[b];
    }
  });
  known.end_run();
  return known;
}

}  // namespace fieldalign
