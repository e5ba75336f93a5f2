// What Python sees of odometry: thinned scans, the map of voxels, and the sums of a scan against it.
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>

#include "step_arrays.hpp"
#include "tracking.hpp"

namespace fieldalign {

using namespace nanobind::literals;

namespace {

using Scan = nb::ndarray<const float, nb::shape<-1, 4>, nb::c_contig, nb::device::cpu>;
using Pose4 = nb::ndarray<const double, nb::shape<4, 4>, nb::c_contig, nb::device::cpu>;

using Pose6 = nb::ndarray<const double, nb::shape<6, 6>, nb::c_contig, nb::device::cpu>;

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

// The first point in each voxel, and `count` of these, evenly taken; where these are too few, of all.
auto thinned_twice(Scan scan, double voxel, std::size_t count) {
  if (!(voxel > 0)) throw std::invalid_argument("voxel must be positive");
  const auto points = scan_of(scan);
  std::vector<ScanPoint> sparse = thin_scan(points.size(), 1, static_cast<float>(voxel), 0,
                                            std::numeric_limits<float>::infinity(), [&](std::size_t i) { return points[i]; });
  const std::span<const ScanPoint> from = sparse.size() < count ? points : sparse;
  std::vector<ScanPoint> few(std::min(from.size(), count));
  for (std::size_t i = 0; i < few.size(); ++i) few[i] = from[i * from.size() / few.size()];
  return std::make_pair(scan_array(std::move(sparse)), scan_array(std::move(few)));
}

Array<float> deskewed(Scan scan, Values twist) {
  check_lengths(6, {twist.shape(0)});
  std::vector<ScanPoint> moved(scan.shape(0));
  deskew(scan_of(scan), SteadyMotion(twist.data()), moved.data());
  return scan_array(std::move(moved));
}

// A dict's numbers by their names.
struct Numbers {
  nb::dict values;
  double operator()(const char* name) const { return nb::cast<double>(values[name]); }
  int whole(const char* name) const { return nb::cast<int>(values[name]); }
};

Array<double> pose_array(const Motion& m) {
  const auto& R = m.R;
  return array(std::vector<double>{R[0], R[1], R[2], m.t.x, R[3], R[4], R[5], m.t.y, R[6], R[7], R[8], m.t.z, 0, 0, 0, 1},
               {4, 4});
}

// The upper triangle as a whole matrix.
Array<double> symmetric_array(Square<6> H) {
  for (int a = 0; a < 6; ++a)
    for (int b = 0; b < a; ++b) H[a][b] = H[b][a];
  return array_of(H);
}

nb::dict tracked(VoxelMap& map, Scan scan, Pose4 start, Values origin, std::optional<Pose4> last, double seconds,
                 std::optional<Pose6> held, bool is_whole, nb::dict settings) {
  const Numbers s{settings};
  TrackLoss loss{s("deviations"), s("least_scale"), s("gate"), s("thickness"), s("flatness"), s("width"), is_whole};
  const TrackSchedule schedule{s.whole("steps"), s.whole("free_steps"), s("fewest"), s("first_scale"),
                               s("still_shift"), s("still_turn"), s("largest_turn"),
                               s("trust"), s("arm")};
  const Vec3 about = vector_of(origin);
  std::optional<LastPose> before;
  if (last) before = LastPose{motion_of(last->data()), seconds};
  std::optional<HeldTwists> twists;
  if (held) {
    twists.emplace();
    for (int i = 0; i < 6; ++i) std::copy_n(held->data() + 6 * i, 6, twists->columns[i].begin());
  }
  const double certain_gate = s("certain_gate"), certain_flatness = s("certain_flatness");
  Tracked found;
  CertaintySums<6> known;
  {
    nb::gil_scoped_release free;
    found = track(map, scan_of(scan), motion_of(start.data()), about, loss, schedule, before, twists);
    loss.gate = certain_gate;
    if (!is_whole)
      known = certainty_sums(map, found.scan, found.cells, found.pose, about, loss, found.sums.scale, certain_flatness);
  }
  nb::dict result;
  result["motion"] = pose_array(found.pose);
  result["points"] = found.scan.size();
  result["met"] = found.sums.met;
  result["on"] = found.sums.on;
  result["away"] = found.sums.away;
  result["middle"] = found.sums.middle;
  result["iterations"] = found.steps;
  result["scale"] = found.sums.scale;
  result["H"] = symmetric_array(found.sums.step.H);
  result["stretch"] = found.sums.step.stretch();
  result["hold"] = array_of(known.hold);
  result["lever"] = lever(found.sums.step.H);
  result["least_hold"] = least_share(known.hold, lever(found.sums.step.H));
  result["scatter"] = array_of(known.scatter);
  return result;
}

// Means (n, 3), normals (n, 3), numbers of points (n,) and the two lesser variances (n, 2) of the cells that hold so many.
nb::tuple planes(VoxelMap& map, double fewest) {
  std::vector<double> means, normals, counts, variances;
  for (std::size_t i = 0; i < map.size(); ++i) {
    const auto cell = static_cast<std::int32_t>(i);
    if (map.count(cell) < fewest) continue;
    const MapPlane& plane = map.plane(cell);
    means.insert(means.end(), {plane.mean.x, plane.mean.y, plane.mean.z});
    normals.insert(normals.end(), {plane.normal.x, plane.normal.y, plane.normal.z});
    counts.push_back(map.count(cell));
    variances.insert(variances.end(), {plane.least, plane.middle});
  }
  const std::size_t n = counts.size();
  return nb::make_tuple(array(std::move(means), {n, 3}), array(std::move(normals), {n, 3}), array(std::move(counts), {n}),
                        array(std::move(variances), {n, 2}));
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
  m.def("thin_twice", &thinned_twice, "scan"_a, "voxel"_a, "count"_a);
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
      .def("track", &tracked, "scan"_a, "start"_a, "origin"_a, "last"_a.none(), "seconds"_a, "held"_a.none(),
           "is_whole"_a, "settings"_a)
      .def("planes", &planes, "fewest"_a);
}

}  // namespace fieldalign
