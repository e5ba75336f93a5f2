// What Python sees of odometry: thinned scans, the map of voxels, and the sums of a scan against it.
#include <nanobind/stl/optional.h>

#include "step_arrays.hpp"
#include "tracking.hpp"

namespace fieldalign {

using namespace nanobind::literals;

namespace {

using Scan = nb::ndarray<const float, nb::shape<-1, 4>, nb::c_contig, nb::device::cpu>;
using Cells = nb::ndarray<const std::int32_t, nb::shape<-1>, nb::c_contig, nb::device::cpu>;
using Pose4 = nb::ndarray<const double, nb::shape<4, 4>, nb::c_contig, nb::device::cpu>;

static_assert(sizeof(ScanPoint) == 4 * sizeof(float));
std::span<const ScanPoint> scan_of(const Scan& scan) {
  return {reinterpret_cast<const ScanPoint*>(scan.data()), scan.shape(0)};
}

Array<float> scan_array(std::vector<ScanPoint>&& scan) {
  auto* kept = new std::vector<ScanPoint>(std::move(scan));
  nb::capsule owner(kept, [](void* p) noexcept { delete static_cast<std::vector<ScanPoint>*>(p); });
  return Array<float>(reinterpret_cast<float*>(kept->data()), {kept->size(), 4}, owner);
}

Vec3 vector_of(const Values& v) {
  check_lengths(3, {v.shape(0)});
  return {v.data()[0], v.data()[1], v.data()[2]};
}

template <class Real>
Array<float> thinned(Points<Real> points, std::optional<Values> times, double moment, std::size_t stride, double voxel,
                     double nearest, double farthest) {
  const std::size_t n = points.shape(0);
  if (times) check_lengths(n, {times->shape(0)});
  if (stride < 1 || !(voxel > 0)) throw std::invalid_argument("stride and voxel must be positive");
  std::vector<ScanPoint> scan;
  {
    nb::gil_scoped_release free;
    const Real* xyz = points.data();
    const double* at = times ? times->data() : nullptr;
    scan = thin_scan(n, stride, static_cast<float>(voxel), static_cast<float>(nearest), static_cast<float>(farthest),
                     [=](std::size_t i) {
                       const Real* p = xyz + 3 * i;
                       return ScanPoint{static_cast<float>(p[0]), static_cast<float>(p[1]), static_cast<float>(p[2]),
                                        at ? static_cast<float>(at[i] - moment) : 0.0f};
                     });
  }
  return scan_array(std::move(scan));
}

Array<float> thinned_again(Scan scan, double voxel) {
  if (!(voxel > 0)) throw std::invalid_argument("voxel must be positive");
  const auto points = scan_of(scan);
  return scan_array(thin_scan(points.size(), 1, static_cast<float>(voxel), 0, std::numeric_limits<float>::infinity(),
                              [&](std::size_t i) { return points[i]; }));
}

Array<float> deskewed(Scan scan, Values twist) {
  check_lengths(6, {twist.shape(0)});
  std::vector<ScanPoint> moved(scan.shape(0));
  deskew(scan_of(scan), SteadyMotion(twist.data()), moved.data());
  return scan_array(std::move(moved));
}

// The cells (L,) that pseudo points lie in; in a wide match, that whose mean is nearest.
Array<std::int32_t> match(VoxelMap& map, Scan scan, Pose4 pose, Values origin, double fewest, bool is_wide) {
  const Motion T = motion_of(pose.data());
  const Vec3 o = vector_of(origin);
  std::vector<std::int32_t> cells;
  cells.reserve(scan.shape(0));
  for (const ScanPoint& p : scan_of(scan)) {
    const Vec3 x = T.moved(p.place()) + o;
    cells.push_back(is_wide ? map.nearest_cell(x, fewest) : map.cell_at(x, fewest));
  }
  const std::size_t n = cells.size();
  return array(std::move(cells), {n});
}

std::span<const std::int32_t> checked_cells(const VoxelMap& map, const Scan& scan, const Cells& cells) {
  check_lengths(scan.shape(0), {cells.shape(0)});
  const std::span<const std::int32_t> all(cells.data(), cells.shape(0));
  const auto is_known = [&](std::int32_t c) { return c >= VoxelMap::kNone && c < static_cast<std::int32_t>(map.size()); };
  if (!std::all_of(all.begin(), all.end(), is_known)) throw std::invalid_argument("the map has no such cell");
  return all;
}

nb::tuple sums(VoxelMap& map, Scan scan, Cells cells, Pose4 pose, Values origin, double deviations, double least_scale,
               double gate, double thickness, double flatness, bool is_whole) {
  const TrackLoss loss{deviations, least_scale, gate, thickness, flatness, is_whole};
  const TrackSums found = track_sums(map, scan_of(scan), checked_cells(map, scan, cells), motion_of(pose.data()),
                                     vector_of(origin), loss);
  return nb::make_tuple(arrays_of(std::vector<StepSums<6>>{found.step}), found.scale, found.met, found.on);
}

nb::tuple certainty(VoxelMap& map, Scan scan, Cells cells, Pose4 pose, Values origin, double scale, double gate,
                    double thickness, double flatness) {
  const TrackLoss loss{0, 0, gate, thickness, flatness, false};
  const CertaintySums<6> known = certainty_sums(map, scan_of(scan), checked_cells(map, scan, cells),
                                                motion_of(pose.data()), vector_of(origin), loss, scale);
  return nb::make_tuple(array_of(known.hold), array_of(known.scatter));
}

// Means (n, 3), normals (n, 3) and numbers of points (n,) of the cells that hold so many.
nb::tuple planes(VoxelMap& map, double fewest) {
  std::vector<double> means, normals, counts;
  for (std::size_t i = 0; i < map.size(); ++i) {
    const auto cell = static_cast<std::int32_t>(i);
    if (map.count(cell) < fewest) continue;
    const MapPlane& plane = map.plane(cell);
    means.insert(means.end(), {plane.mean.x, plane.mean.y, plane.mean.z});
    normals.insert(normals.end(), {plane.normal.x, plane.normal.y, plane.normal.z});
    counts.push_back(map.count(cell));
  }
  const std::size_t n = counts.size();
  return nb::make_tuple(array(std::move(means), {n, 3}), array(std::move(normals), {n, 3}), array(std::move(counts), {n}));
}

void construct_map(VoxelMap* self, double voxel) {
  if (!(voxel > 0)) throw std::invalid_argument("voxel must be positive");
  new (self) VoxelMap(voxel);
}

}  // namespace

void bind_odometry(nb::module_& m) {
  m.def("thin_scan", &thinned<float>, "points"_a.noconvert(), "times"_a.none(), "moment"_a, "stride"_a, "voxel"_a,
        "nearest"_a, "farthest"_a);
  m.def("thin_scan", &thinned<double>, "points"_a.noconvert(), "times"_a.none(), "moment"_a, "stride"_a, "voxel"_a,
        "nearest"_a, "farthest"_a);
  m.def("thin_again", &thinned_again, "scan"_a, "voxel"_a);
  m.def("deskew", &deskewed, "scan"_a, "twist"_a);
  nb::class_<VoxelMap>(m, "VoxelMap", "A map that grows: voxels, in each of them the plane of its points.")
      .def("__init__", &construct_map, "voxel"_a)
      .def("__len__", &VoxelMap::size)
      .def("add", [](VoxelMap& map, Scan scan, Pose4 pose, double most) {
             map.add(scan_of(scan), motion_of(pose.data()), most);
           }, "scan"_a, "pose"_a, "most"_a)
      .def("keep_within", [](VoxelMap& map, Values centre, double radius) {
             return map.keep_within(vector_of(centre), radius);
           }, "centre"_a, "radius"_a)
      .def("match", &match, "scan"_a, "pose"_a, "origin"_a, "fewest"_a, "is_wide"_a)
      .def("sums", &sums, "scan"_a, "cells"_a, "pose"_a, "origin"_a, "deviations"_a, "least_scale"_a, "gate"_a,
           "thickness"_a, "flatness"_a, "is_whole"_a)
      .def("certainty", &certainty, "scan"_a, "cells"_a, "pose"_a, "origin"_a, "scale"_a, "gate"_a, "thickness"_a,
           "flatness"_a)
      .def("planes", &planes, "fewest"_a);
}

}  // namespace fieldalign
