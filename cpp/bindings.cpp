// What Python sees of the native core. Shapes are checked here, meaning in Python; the interpreter is free meanwhile.
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>

#include "arrays.hpp"
#include "keypoints.hpp"
#include "least_squares.hpp"
#include "motion.hpp"
#include "multiplicity.hpp"
#include "occupancy.hpp"
#include "point_field.hpp"
#include "point_tree.hpp"
#include "rows.hpp"
#include "surfels.hpp"
#include "thinning.hpp"

using namespace nanobind::literals;
using namespace fieldalign;

namespace {

using Rotation = nb::ndarray<const double, nb::shape<3, 3>, nb::c_contig, nb::device::cpu>;
using Pose4 = nb::ndarray<const double, nb::shape<4, 4>, nb::c_contig, nb::device::cpu>;
using Rows6 = nb::ndarray<const double, nb::shape<-1, 6>, nb::c_contig, nb::device::cpu>;

Array<double> bounds_array(const Bounds& b) {
  return array(std::vector<double>{b.lo.x, b.lo.y, b.lo.z, b.hi.x, b.hi.y, b.hi.z}, {2, 3});
}

int checked_neighbours(int k) {
  if (k < 1 || k > PointTree::kMaxNeighbours) throw std::invalid_argument("neighbours must be 1 to 64");
  return k;
}

template <class Real>
void construct(PointTree* self, Points<Real> points, int threads) {
  nb::gil_scoped_release free;
  new (self) PointTree(view(points), threads);
}

template <class Real>
auto survey_points(Points<Real> points, int threads) {
  Survey all;
  {
    nb::gil_scoped_release free;
    all = survey(points.shape(0), [all_points = view(points)](std::size_t i) { return all_points[i]; }, threads);
  }
  const Vec3 mean = (1.0 / static_cast<double>(points.shape(0))) * all.sum;
  return std::make_pair(bounds_array(all.bounds),
                        array(std::vector<double>{mean.x, mean.y, mean.z}, {3}));
}

auto nearest(const PointTree& tree, Points<double> queries, int k, int threads) {
  const std::size_t n = queries.shape(0), width = std::min<std::size_t>(checked_neighbours(k), tree.size());
  std::vector<double> distances(n * width);
  std::vector<std::int64_t> rows(n * width);
  {
    nb::gil_scoped_release free;
    parallel_blocks(n, 128, threads, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        KNearest found(tree, k);
        tree.visit(view(queries)[i] - tree.centre(), found);
        for (int j = 0; j < found.found; ++j) {
          distances[i * width + j] = std::sqrt(found.squared[j]);
          rows[i * width + j] = tree.row(found.position[j]);
        }
      }
    });
  }
  return std::make_pair(array(std::move(distances), {n, width}), array(std::move(rows), {n, width}));
}

// value, gradient, foot and place of the distance field, for the mean over the k nearest points.
nb::tuple sample(const PointTree& tree, Points<double> queries, int k, std::optional<Places> guess, int threads) {
  const std::size_t n = queries.shape(0);
  checked_neighbours(k);
  std::vector<double> value(n), gradient(3 * n), foot(3 * n);
  std::vector<std::uint32_t> place(n);
  if (guess) {
    if (guess->shape(0) != n) throw std::invalid_argument("queries and guess differ in length");
    std::copy_n(guess->data(), n, place.begin());
    if (std::any_of(place.begin(), place.end(), [&](std::uint32_t p) { return p >= tree.size(); }))
      throw std::invalid_argument("guess holds places that the tree has not");
  }
  {
    nb::gil_scoped_release free;
    parallel_blocks(n, 128, threads, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i) {
        const Vec3 query = view(queries)[i] - tree.centre();
        if (!guess && i > begin) place[i] = place[i - 1];  // queries in a row often lie near each other
        const FieldSample s = k == 1 ? nearest_point_field(tree, query, place[i]) : mean_point_field(tree, query, k);
        const Vec3 at = s.foot + tree.centre();
        value[i] = s.value;
        gradient[3 * i] = s.gradient.x, gradient[3 * i + 1] = s.gradient.y, gradient[3 * i + 2] = s.gradient.z;
        foot[3 * i] = at.x, foot[3 * i + 1] = at.y, foot[3 * i + 2] = at.z;
      }
    });
  }
  return nb::make_tuple(array(std::move(value), {n}), array(std::move(gradient), {n, 3}),
                        array(std::move(foot), {n, 3}), array(std::move(place), {n}));
}

// Means and normals (n, 3) of the planes through the k nearest points, and their thickness and width (n, 2).
nb::tuple surfels(const PointTree& tree, Points<double> queries, int k, int threads) {
  const std::size_t n = queries.shape(0);
  checked_neighbours(k);
  std::vector<double> means(3 * n), normals(3 * n), spread(2 * n);
  {
    nb::gil_scoped_release free;
    fit_surfels(tree, view(queries), k, threads, [&](std::size_t i, const Surfel& s) {
      const Vec3 mean = s.mean + tree.centre();
      for (int a = 0; a < 3; ++a) means[3 * i + a] = mean[a], normals[3 * i + a] = s.normal[a];
      spread[2 * i] = s.thickness, spread[2 * i + 1] = s.width;
    });
  }
  return nb::make_tuple(array(std::move(means), {n, 3}), array(std::move(normals), {n, 3}),
                        array(std::move(spread), {n, 2}));
}

Array<std::uint32_t> keypoints(const PointTree& tree, double salient_radius, double non_max_radius, double gamma_21,
                               double gamma_32, int min_neighbours, int threads) {
  std::vector<std::uint32_t> rows;
  {
    nb::gil_scoped_release free;
    rows = iss_keypoints(tree, {salient_radius, non_max_radius, gamma_21, gamma_32, min_neighbours}, threads);
  }
  const std::size_t n = rows.size();
  return array(std::move(rows), {n});
}

template <class Real>
nb::tuple thin_points(Points<Real> points, Points<double> bounds, double voxel, int threads) {
  check_lengths(2, {bounds.shape(0)});
  Thinned thinned;
  {
    nb::gil_scoped_release free;
    thinned = thin(view(points), view(bounds)[0], view(bounds)[1], voxel, threads);
  }
  const std::size_t n = thinned.means.size();
  std::vector<double> means(3 * n);
  for (std::size_t i = 0; i < n; ++i)
    means[3 * i] = thinned.means[i].x, means[3 * i + 1] = thinned.means[i].y, means[3 * i + 2] = thinned.means[i].z;
  return nb::make_tuple(array(std::move(means), {n, 3}), array(std::move(thinned.first), {n}),
                        array(std::move(thinned.count), {n}));
}

template <class Real>
nb::tuple occupancy_of(Points<Real> points, std::size_t most, int threads) {
  Occupancy found;
  {
    nb::gil_scoped_release free;
    found = occupancy(view(points), most, threads);
  }
  return nb::make_tuple(bounds_array(found.core), found.edge, array(std::vector<double>(found.shared.begin(), found.shared.end()), {kHalvings}),
                        array(std::vector<double>(found.company.begin(), found.company.end()), {kHalvings}));
}

Array<double> transform_points(Rotation R, Values t, Points<double> points) {
  if (t.shape(0) != 3) throw std::invalid_argument("t must have three entries");
  std::vector<double> moved(points.shape(0) * 3);
  transform(R.data(), t.data(), points.data(), points.shape(0), moved.data());
  return array(std::move(moved), {points.shape(0), 3});
}

Array<double> exponential(Values twist) {
  if (twist.shape(0) != 6) throw std::invalid_argument("a twist has six entries");
  const double* x = twist.data();
  const auto T = exp_twist({x[0], x[1], x[2]}, {x[3], x[4], x[5]});
  return array(std::vector<double>(T.begin(), T.end()), {4, 4});
}

Array<double> logarithm(Pose4 T) {
  const auto twist = log_motion(motion_of(T.data()));
  return array(std::vector<double>(twist.begin(), twist.end()), {6});
}

Array<double> relative_twist(Pose4 A, Pose4 B) {
  const auto twist = log_motion(inverse(motion_of(A.data())) * motion_of(B.data()));
  return array(std::vector<double>(twist.begin(), twist.end()), {6});
}

Array<double> directions(Values value, Points<double> gradient) {
  if (value.shape(0) != gradient.shape(0)) throw std::invalid_argument("value and gradient differ in length");
  std::vector<double> unit(gradient.shape(0) * 3);
  unit_rows(value.data(), gradient.data(), gradient.shape(0), unit.data());
  return array(std::move(unit), {gradient.shape(0), 3});
}

Array<double> moments(Points<double> x, Points<double> g) {
  if (x.shape(0) != g.shape(0)) throw std::invalid_argument("x and g differ in length");
  std::vector<double> rows(x.shape(0) * 6);
  moment_rows(x.data(), g.data(), x.shape(0), rows.data());
  return array(std::move(rows), {x.shape(0), 6});
}

Array<double> twist_array(const Twist& x) { return array(std::vector<double>(x.begin(), x.end()), {6}); }

Array<double> direct(Rows6 J, Values r) {
  check_lengths(J.shape(0), {r.shape(0)});
  const std::vector<double> ones(J.shape(0), 1);
  return twist_array(solve(normal_equations(J.data(), r.data(), ones.data(), J.shape(0))));
}

auto reweighted(Rows6 J, Values r, Values w, double floor, double unit, double tolerance, int steps) {
  check_lengths(J.shape(0), {r.shape(0), w.shape(0)});
  std::vector<double> weights(w.data(), w.data() + w.shape(0));
  Twist x;
  {
    nb::gil_scoped_release free;
    x = reweighted_solution(J.data(), r.data(), weights.data(), J.shape(0), {floor, unit, tolerance, steps});
  }
  return std::make_pair(twist_array(x), array(std::move(weights), {w.shape(0)}));
}

Array<double> information(Rows6 J, Values w) {
  check_lengths(J.shape(0), {w.shape(0)});
  const std::vector<double> zeros(J.shape(0), 0);
  const Square<6> H = normal_equations(J.data(), zeros.data(), w.data(), J.shape(0)).H;
  std::vector<double> rows;
  for (const Twist& row : H) rows.insert(rows.end(), row.begin(), row.end());
  return array(std::move(rows), {6, 6});
}

Array<std::int64_t> count_equal(Points<double> points) {
  return array(multiplicity(points.data(), points.shape(0)), {points.shape(0)});
}

Array<std::uint32_t> rows_along_curve(const PointTree& tree, Places places) {
  std::vector<std::uint32_t> rows(places.shape(0));
  for (std::size_t i = 0; i < rows.size(); ++i) {
    if (places.data()[i] >= tree.size()) throw std::invalid_argument("the tree has no such place");
    rows[i] = tree.row(places.data()[i]);
  }
  const std::size_t n = rows.size();
  return array(std::move(rows), {n});
}

constexpr const char* kSurveyDoc =
    "Lowest and highest corner (2, 3) and mean (3,) of points (n, 3); the mean is not finite where a coordinate is not.";
constexpr const char* kOccupancyDoc =
    "A box (2, 3) around the points but for far outliers, the edge of a cell around it, and for its k-th halving: how many\n"
    "cells hold two points or more (20,), and which share of the points they hold (20,). Of at most `most` points.";
constexpr const char* kThinDoc = "Mean (m, 3), first row (m,) and number (m,) of the points of each occupied voxel.";

}  // namespace

namespace fieldalign {
void bind_search(nb::module_& m);
void bind_odometry(nb::module_& m);
}

NB_MODULE(_core, m) {
  m.doc() = "The native core of fieldalign: what loops over points.";
  nb::class_<PointTree>(m, "PointTree", "Exact nearest neighbours among n points.")
      .def("__init__", &construct<float>, "points"_a.noconvert(), "threads"_a)
      .def("__init__", &construct<double>, "points"_a.noconvert(), "threads"_a)
      .def("__len__", &PointTree::size)
      .def("nearest", &nearest, "queries"_a, "neighbours"_a, "threads"_a,
           "Distances (n, k) and rows (n, k) of the k nearest points, nearest first.")
      .def("sample", &sample, "queries"_a, "neighbours"_a, "guess"_a.none(), "threads"_a,
           "value (n,), gradient (n, 3), foot (n, 3) and its place (n,) of the field of mean distance to the k nearest\n"
           "points; a place of an earlier sample, given as a guess, changes nothing but the time.")
      .def("surfels", &surfels, "queries"_a, "neighbours"_a, "threads"_a,
           "Means (n, 3) and unit normals (n, 3) of the planes through the k nearest points, and standard deviations\n"
           "(n, 2) across the plane and along its shorter axis.")
      .def("rows", &rows_along_curve, "places"_a, "Rows (n,) of places (n,) along the tree's curve.")
      .def("keypoints", &keypoints, "salient_radius"_a, "non_max_radius"_a, "gamma_21"_a, "gamma_32"_a,
           "min_neighbours"_a, "threads"_a, "Rows of the ISS keypoints, ascending.");
  m.def("survey", &survey_points<float>, "points"_a.noconvert(), "threads"_a, kSurveyDoc);
  m.def("survey", &survey_points<double>, "points"_a.noconvert(), "threads"_a, kSurveyDoc);
  m.def("thin", &thin_points<float>, "points"_a.noconvert(), "bounds"_a, "voxel"_a, "threads"_a,
        kThinDoc);
  m.def("thin", &thin_points<double>, "points"_a.noconvert(), "bounds"_a, "voxel"_a, "threads"_a,
        kThinDoc);
  m.def("occupancy", &occupancy_of<float>, "points"_a.noconvert(), "most"_a, "threads"_a, kOccupancyDoc);
  m.def("occupancy", &occupancy_of<double>, "points"_a.noconvert(), "most"_a, "threads"_a, kOccupancyDoc);
  m.def("transform", &transform_points, "R"_a, "t"_a, "points"_a, "R (3, 3) times each of points (n, 3), plus t (3,).");
  m.def("exp_twist", &exponential, "twist"_a, "The motion (4, 4) that a twist (w, v) (6,) generates.");
  m.def("log_motion", &logarithm, "T"_a, "The twist (w, v) (6,) that generates a motion (4, 4).");
  m.def("relative_twist", &relative_twist, "A"_a, "B"_a, "The twist (6,) of A^-1 B, of motions (4, 4).");
  m.def("directions", &directions, "value"_a, "gradient"_a, "Unit vectors (n, 3) away from the feet; zero without any.");
  m.def("moment_rows", &moments, "x"_a, "g"_a, "Rows (n, 6) of x cross g, then g, of x and g (n, 3).");
  m.def("direct", &direct, "J"_a, "r"_a, "The twist (6,) that minimises |J x + r|^2 over rows (n, 6), (n,).");
  m.def("reweighted", &reweighted, "J"_a, "r"_a, "w"_a, "floor"_a, "unit"_a, "tolerance"_a, "steps"_a,
        "The twist (6,) that minimises sum |J x + r|, and the weights (n,) it ends with.");
  m.def("information", &information, "J"_a, "w"_a, "sum w J^T J (6, 6), over rows (n, 6), (n,).");
  bind_search(m);
  bind_odometry(m);
  m.def("count_equal", &count_equal, "points"_a, "For each point (n, 3), how many of them equal it.");
}
