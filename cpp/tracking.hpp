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
  double flatness;     // a plane has less than this share of its variance along the shorter axis across,
  double width;        // and along that a deviation of at least this (a length): a beam's trace is a line, no plane
  bool is_whole;       // whether voxels that are no planes hold, too, and planes along themselves
};

struct TrackSums {
  StepSums<6> step;
  double scale = 0;
  int met = 0;  // pseudo points in a voxel with a plane
  int on = 0;   // of these, within four times the thickness of it
  double away = 0;  // how far these are from it, at most twelve times the thickness each, summed up
  double middle = 0;  // the median of how far those are that are not beyond the gate
};

// How widely residuals across a plane of this variance scatter, as a multiple of the least.
inline double spread_across(double variance, const TrackLoss& loss) {
  return std::sqrt(variance / (loss.thickness * loss.thickness) + 1);
}

inline bool is_plane(const MapPlane& plane, const TrackLoss& loss) {
  return loss.is_whole || (plane.least < loss.flatness * plane.middle && plane.middle > loss.width * loss.width);
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

// Puts the values into another order.
inline double median_of(std::vector<double>& values) {
  const auto middle = values.begin() + static_cast<std::ptrdiff_t>(values.size() / 2);
  std::nth_element(values.begin(), middle, values.end());
  return *middle;
}

// H, g and the totals of a step; the weights' scale is that of the residuals themselves, by their median.
inline TrackSums track_sums(VoxelMap& map, std::span<const ScanPoint> scan, std::span<const std::int32_t> cells,
                            const Motion& pose, Vec3 origin, const TrackLoss& loss) {
  TrackSums sums;
  std::vector<Met> met;
  std::vector<double> sizes, distances;
  met.reserve(scan.size()), sizes.reserve(scan.size()), distances.reserve(scan.size());
  meet_planes(map, scan, cells, pose, origin, loss, [&](const Met& m) {
    ++sums.met;
    sums.on += std::abs(m.r) < 4 * loss.thickness;
    sums.away += std::min(std::abs(m.r), 12 * loss.thickness);
    if (!(std::abs(m.r) <= loss.gate)) return;  // nor what is no number
    met.push_back(m);
    sizes.push_back(std::abs(m.r) / m.spread), distances.push_back(std::abs(m.r));
  });
  if (met.empty()) return sums;
  sums.scale = std::max(loss.deviations * 1.4826 * median_of(sizes), loss.least_scale);
  sums.middle = median_of(distances);
  const RobustLoss robust{sums.scale, 0, loss.gate};
  for (const Met& m : met) {
    sums.step.add(m.x, {m.r, 1, m.plane->normal, m.plane->normal}, m.spread, robust);
    if (loss.is_whole) add_along(sums.step, m.x, m.x + origin - m.plane->mean, *m.plane, loss, robust);
  }
  return sums;
}

// What holds the pose and how its gradient scatters. A plane's normal is uncertain by its thickness over the width and
// over the root of its count, and J J^T holds the square of that noise; it is taken off, so that nothing but surface
// holds. Planes that are less flat may be edges, whose normals lie anywhere: they hold nothing.
inline CertaintySums<6> certainty_sums(VoxelMap& map, std::span<const ScanPoint> scan,
                                       std::span<const std::int32_t> cells, const Motion& pose, Vec3 origin,
                                       const TrackLoss& loss, double scale, double certain_flatness) {
  CertaintySums<6> known;
  const RobustLoss robust{scale, 0, loss.gate};
  meet_planes(map, scan, cells, pose, origin, loss, [&](const Met& m) {
    if (std::abs(m.r) > loss.gate) return;
    const Vec3 n = m.plane->normal;
    const double w = weight_of({m.r, 1, n, n}, m.spread, robust) / (m.spread * m.spread);
    const auto row = row_of<6>(m.x, n);
    known.add_gradient(w * m.r, row);
    if (m.plane->least > certain_flatness * m.plane->middle) return;
    const double tilt = m.plane->least / (m.plane->middle * m.count);  // variance of the normal, along an axis
    const auto [first, second] = across(n);
    const auto one = row_of<6>(m.x, first), two = row_of<6>(m.x, second);
    for (int a = 0; a < 6; ++a)
      for (int b = a; b < 6; ++b) known.hold[a][b] += w * (row[a] * row[b] - tilt * (one[a] * one[b] + two[a] * two[b]));
  });
  for (int a = 0; a < 6; ++a)
    for (int b = 0; b < a; ++b) known.hold[a][b] = known.hold[b][a];
  known.end_run();
  return known;
}

// How a pose is sought. All lengths in the map's unit.
struct TrackSchedule {
  int steps;            // at most
  int free_steps;       // in which each pseudo point finds its plane anew; later, in every third
  double fewest;        // points of a plane
  double first_scale;   // of residuals, in the first step: the guess is off
  double still_shift, still_turn;  // steps that are no longer end the search
  double largest_turn;  // of a step
  double trust;         // in the start, beside residuals of unit variance, one over a length squared; 0 for none
  double arm;           // the lever over which turns count by what they move
};

// The sums of a step, and what is known beforehand, that the pose is near `start`: as residuals of the scan's own scale.
inline StepSums<6> with_prior(const TrackSums& sums, const Motion& pose, const Motion& start, const TrackSchedule& schedule,
                              double deviations) {
  StepSums<6> both = sums.step;
  const double deviation = sums.scale / deviations, weight = schedule.trust * deviation * deviation;
  const Twist off = log_motion(pose * inverse(start));
  for (int a = 0; a < 6; ++a) {
    const double each = a < 3 ? weight * schedule.arm * schedule.arm : weight;
    both.H[a][a] += each;
    both.g[a] += each * off[a];
  }
  return both;
}

// The twists that may be told from the scan: held x, of free x; columns that are zero are not free.
struct HeldTwists {
  Square<6> columns;

  NormalEquations within(const StepSums<6>& sums) const {
    NormalEquations inside;
    for (int a = 0; a < 6; ++a)
      for (int b = 0; b < 6; ++b)
        for (int i = 0; i < 6; ++i) {
          for (int j = 0; j < 6; ++j)
            inside.H[a][b] += columns[i][a] * sums.H[std::min(i, j)][std::max(i, j)] * columns[j][b];
          if (b == 0) inside.g[a] += columns[i][a] * sums.g[i];
        }
    return inside;
  }
  Twist whole(const Twist& x) const {
    Twist twist{};
    for (int i = 0; i < 6; ++i)
      for (int a = 0; a < 6; ++a) twist[i] += columns[i][a] * x[a];
    return twist;
  }
};

// Where the sensor was, about the origin, and how many seconds ago: what deskews a scan, given where it is now.
struct LastPose {
  Motion pose;
  double seconds;

  SteadyMotion until(const Motion& now) const {
    Twist twist = log_motion(inverse(pose) * now);
    for (double& part : twist) part /= seconds;
    return SteadyMotion(twist.data());
  }
};

// The step -H^+ g, within what is held, lengthened as the loss bends, but turning no more than so far.
inline Twist step_of(const StepSums<6>& sums, double largest_turn, const std::optional<HeldTwists>& held) {
  NormalEquations equations{sums.H, sums.g};
  for (int a = 0; a < 6; ++a)
    for (int b = 0; b < a; ++b) equations.H[a][b] = equations.H[b][a];
  Twist x = held ? held->whole(solve(held->within(sums))) : solve(equations);
  return limited(x, sums.stretch(), largest_turn);
}

struct Tracked {
  Motion pose;
  std::vector<ScanPoint> scan;  // as deskewed at the end
  std::vector<std::int32_t> cells;
  TrackSums sums;
  int steps = 0;
};

// Gauss-Newton (paper eq. 14 to 16), from a pose about the origin.
inline Tracked track(VoxelMap& map, std::span<const ScanPoint> scan, const Motion& start, Vec3 origin, TrackLoss loss,
                     const TrackSchedule& schedule, const std::optional<LastPose>& last,
                     const std::optional<HeldTwists>& held) {
  Tracked found{start, {scan.begin(), scan.end()}, {}, {}, 0};
  const double least_scale = loss.least_scale;
  while (found.steps < schedule.steps) {
    if (last && found.steps <= schedule.free_steps) deskew(scan, last->until(found.pose), found.scan.data());
    if (found.steps < schedule.free_steps || found.steps % 3 == 0)
      found.cells = map.match(moved(found.scan, found.pose, origin), schedule.fewest, loss.is_whole);
    loss.least_scale = found.steps == 0 ? std::max(schedule.first_scale, least_scale) : least_scale;
    found.sums = track_sums(map, found.scan, found.cells, found.pose, origin, loss);
    ++found.steps;
    const StepSums<6> sums = with_prior(found.sums, found.pose, start, schedule, loss.deviations);
    const Twist x = step_of(sums, schedule.largest_turn, held);
    found.pose = motion_of(exp_twist({x[0], x[1], x[2]}, {x[3], x[4], x[5]}).data()) * found.pose;
    const double turn = x[0] * x[0] + x[1] * x[1] + x[2] * x[2], shift = x[3] * x[3] + x[4] * x[4] + x[5] * x[5];
    if (turn < schedule.still_turn * schedule.still_turn && shift < schedule.still_shift * schedule.still_shift) break;
  }
  return found;
}

}  // namespace fieldalign
