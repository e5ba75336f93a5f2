// One sweep of a sensor that moves: thinned, and carried to one moment.
#pragma once

#include <span>

#include "motion.hpp"
#include "voxel_table.hpp"

namespace fieldalign {

struct ScanPoint {
  float x, y, z;  // in the sensor's frame of its own moment
  float seconds;  // from the moment of the sweep's pose

  Vec3 place() const { return {x, y, z}; }
};

// The first of every stride-th point (i) of n in each voxel, of those between two ranges; one that is not finite is in
// none.
template <class Point>
std::vector<ScanPoint> thin_scan(std::size_t n, std::size_t stride, float voxel, float nearest, float farthest,
                                 Point point) {
  std::vector<ScanPoint> kept;
  VoxelTable seen(14);
  const float per_voxel = 1 / voxel, low = nearest * nearest, high = farthest * farthest;
  std::uint64_t last = VoxelTable::kEmpty;
  for (std::size_t i = 0; i < n; i += stride) {
    const ScanPoint p = point(i);
    const float squared = p.x * p.x + p.y * p.y + p.z * p.z;
    if (!(squared >= low && squared <= high)) continue;
    const std::uint64_t key = key_of(voxel_of(p.x * per_voxel, p.y * per_voxel, p.z * per_voxel));
    if (key == last) continue;  // neighbours along a beam's way
    last = key;
    const std::size_t slot = seen.slot_of(key);
    if (!seen.is_empty(slot)) continue;
    seen.fill(slot, key);
    kept.push_back(p);
    if (seen.is_crowded()) seen = seen.grown();
  }
  return kept;
}

// A motion at a constant twist (w, v) a second: exp(s (w, v)) for any s.
class SteadyMotion {
 public:
  explicit SteadyMotion(const double* twist)
      : w_{twist[0], twist[1], twist[2]}, v_{twist[3], twist[4], twist[5]}, squared_(dot(w_, w_)) {}

  // exp(s (w, v)) p = p + s u + b w x u + c w x (w x u), u = w x p + v, with b = (1 - cos a) / w^2,
  // c = (a s - s sin a) / (w^2 a), a = s |w|; as series, which are exact to 1e-13 for turns of up to half a radian.
  Vec3 moved(Vec3 p, double s) const {
    const double q = s * s * squared_;
    const double b = s * s / 2 * (1 - q / 12 * (1 - q / 30 * (1 - q / 56 * (1 - q / 90))));
    const double c = s * s * s / 6 * (1 - q / 20 * (1 - q / 42 * (1 - q / 72 * (1 - q / 110))));
    const Vec3 u = cross(w_, p) + v_, along = cross(w_, u);
    return p + s * u + b * along + c * cross(w_, along);
  }

 private:
  Vec3 w_, v_;
  double squared_;
};

// Every point where it would have been seen at the moment of the sweep's pose, the sensor's twist a second being steady.
inline void deskew(std::span<const ScanPoint> scan, const SteadyMotion& motion, ScanPoint* deskewed) {
  for (const ScanPoint& p : scan) {
    const Vec3 place = motion.moved(p.place(), p.seconds);
    *deskewed++ = {static_cast<float>(place.x), static_cast<float>(place.y), static_cast<float>(place.z), p.seconds};
  }
}

}  // namespace fieldalign
