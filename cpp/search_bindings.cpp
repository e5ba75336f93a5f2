// What Python sees of the search and of the robust step.
#include <nanobind/stl/optional.h>
#include <nanobind/stl/pair.h>

#include "arrays.hpp"
#include "linearise.hpp"
#include "motion.hpp"
#include "search.hpp"
#include "sight.hpp"
#include "step_arrays.hpp"
#include "surfels.hpp"

namespace fieldalign {

using namespace nanobind::literals;

namespace {

Vec3f narrow(Vec3 p) { return {static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)}; }
Vec3 widen(Vec3f p) { return {p.x, p.y, p.z}; }

std::vector<Plane> planes_of(const Points<double>& means, const Points<double>& normals) {
  check_lengths(means.shape(0), {normals.shape(0)});
  std::vector<Plane> planes(means.shape(0));
  for (std::size_t i = 0; i < planes.size(); ++i)
    planes[i] = {narrow(view(means)[i]), 1, narrow(view(normals)[i])};
  return planes;
}

void construct_grid(ClosestGrid* self, Points<double> means, Points<double> normals, double cell, double margin) {
  std::vector<Plane> planes = planes_of(means, normals);
  nb::gil_scoped_release free;
  new (self) ClosestGrid(std::move(planes), static_cast<float>(cell), static_cast<float>(margin));
}

void construct_table(PairTable* self, Points<double> means, Points<double> normals, double shortest, double longest,
                     int threads) {
  std::vector<Plane> planes = planes_of(means, normals);
  nb::gil_scoped_release free;
  new (self) PairTable(std::move(planes), {static_cast<float>(shortest), static_cast<float>(longest)}, threads);
}

Pose pose_of(const double* T) {
  Pose pose;
  for (int r = 0; r < 3; ++r)
    for (int c = 0; c < 3; ++c) pose.R[3 * r + c] = static_cast<float>(T[4 * r + c]);
  pose.t = narrow({T[3], T[7], T[11]});
  return pose;
}

// For each pose and each place near the grid's surface: take(pose's row, place's row, place moved, normal moved, plane).
template <class Take>
void meet(const ClosestGrid& grid, PointsView<double> places, PointsView<double> normals, Matrices4 poses, int threads,
          Take take) {
  parallel_blocks(poses.shape(0), 1, threads, [&](std::size_t k, std::size_t) {
    const Motion pose = motion_of(poses.data() + 16 * k);
    for (std::size_t i = 0; i < places.n; ++i) {
      const Vec3 x = pose.moved(places[i]);
      const Plane& plane = grid.at(narrow(x));
      if (!grid.is_far(plane)) take(k, i, x, pose.turned(normals[i]), plane);
    }
  });
}

// Many poses against the grid.
nb::tuple grid_sums(const ClosestGrid& grid, Points<double> places, Points<double> normals, Values offsets,
                    Matrices4 poses, double scale, double min_cosine, double reach, bool facing, int threads) {
  check_lengths(places.shape(0), {normals.shape(0), offsets.shape(0)});
  std::vector<StepSums<6>> sums(poses.shape(0));
  {
    nb::gil_scoped_release free;
    const RobustLoss loss{scale, min_cosine, reach, facing};
    meet(grid, view(places), view(normals), poses, threads,
         [&](std::size_t k, std::size_t i, Vec3 x, Vec3 normal, const Plane& plane) {
           const auto found = residual(x, normal, offsets.data()[i], widen(plane.mean), widen(plane.normal), loss);
           if (found) sums[k].add(x, *found, 1, loss);
         });
  }
  return arrays_of(sums);
}

// For each pose the weights of the surfels that agree with and that meet the surface, and the share of those on it (b, 3).
Array<double> grid_agreement(const ClosestGrid& grid, Points<double> places, Points<double> normals, Values weights,
                             Matrices4 poses, double scale, double min_cosine, double reach, bool facing, int threads) {
  const std::size_t n = places.shape(0), b = poses.shape(0);
  check_lengths(n, {normals.shape(0), weights.shape(0)});
  std::vector<AgreementSums> sums(b);
  {
    nb::gil_scoped_release free;
    const RobustLoss loss{scale, min_cosine, reach, facing};
    meet(grid, view(places), view(normals), poses, threads,
         [&](std::size_t k, std::size_t i, Vec3 x, Vec3 normal, const Plane& plane) {
           sums[k].add(x, normal, weights.data()[i], widen(plane.mean), widen(plane.normal), loss);
         });
  }
  std::vector<double> shares;
  for (const AgreementSums& s : sums)
    shares.insert(shares.end(), {s.agreeing, s.met, static_cast<double>(s.on) / static_cast<double>(n)});
  return array(std::move(shares), {b, 3});
}

// One pose, whose pseudo points are moved already and whose planes are known; seven freedoms, the last a growth. The scale of the residuals is their own:
// so many standard deviations, by their median, but no finer than what is given. H, g and totals; hold; scatter; the scale.
nb::tuple plane_sums(Points<double> x, Points<double> own_normals, Points<double> means, Points<double> normals,
                     Values spreads, double min_cosine, double reach, double deviations,
                     double least_scale) {
  const std::size_t n = x.shape(0);
  check_lengths(n, {own_normals.shape(0), means.shape(0), normals.shape(0), spreads.shape(0)});
  RobustLoss loss{0, min_cosine, reach};
  std::vector<std::optional<Residual>> found(n);
  std::vector<double> sizes;
  for (std::size_t i = 0; i < n; ++i) {
    found[i] = residual(view(x)[i], view(own_normals)[i], 0, view(means)[i], view(normals)[i], loss);
    const double size = found[i] ? std::abs(found[i]->r) / spreads.data()[i] : std::numeric_limits<double>::quiet_NaN();
    if (!std::isnan(size)) sizes.push_back(size);
  }
  if (!sizes.empty()) {
    const auto middle = sizes.begin() + static_cast<std::ptrdiff_t>(sizes.size() / 2);
    std::nth_element(sizes.begin(), middle, sizes.end());
    loss.scale = std::max(deviations * 1.4826 * *middle, std::max(least_scale, std::numeric_limits<double>::min()));
  }
  std::vector<StepSums<7>> sums(1);
  CertaintySums<7> known;
  for (std::size_t i = 0; i < n; ++i) {
    if (!found[i]) continue;
    sums[0].add(view(x)[i], *found[i], spreads.data()[i], loss);
    known.add(view(x)[i], view(own_normals)[i], view(means)[i], *found[i], spreads.data()[i], loss);
  }
  known.end_run();
  return nb::make_tuple(arrays_of(sums), array_of(known.hold), array_of(known.scatter), loss.scale);
}

// Gauss-Newton steps of many poses: the twists (b, 6), and the poses (b, 4, 4) that they lead to.
auto take_steps(Matrices4 poses, nb::ndarray<const double, nb::shape<-1, 6, 6>, nb::c_contig, nb::device::cpu> H,
                nb::ndarray<const double, nb::shape<-1, 6>, nb::c_contig, nb::device::cpu> g, Values stretch,
                double largest_turn) {
  const std::size_t b = poses.shape(0);
  check_lengths(b, {H.shape(0), g.shape(0), stretch.shape(0)});
  std::vector<double> twists(6 * b), moved(16 * b, 0.0);
  for (std::size_t k = 0; k < b; ++k) {
    NormalEquations sums;
    std::copy_n(g.data() + 6 * k, 6, sums.g.begin());
    for (int i = 0; i < 6; ++i) std::copy_n(H.data() + 36 * k + 6 * i, 6, sums.H[i].begin());
    const Twist x = limited(solve(sums), stretch.data()[k], largest_turn);
    const auto E = exp_twist({x[0], x[1], x[2]}, {x[3], x[4], x[5]});
    const double* T = poses.data() + 16 * k;
    for (int r = 0; r < 4; ++r)
      for (int c = 0; c < 4; ++c)
        for (int j = 0; j < 4; ++j) moved[16 * k + 4 * r + c] += E[4 * r + j] * T[4 * j + c];
    std::copy(x.begin(), x.end(), twists.begin() + static_cast<std::ptrdiff_t>(6 * k));
  }
  return std::make_pair(array(std::move(twists), {b, 6}), array(std::move(moved), {b, 4, 4}));
}

// By how much to lengthen the steps of many poses (b,).
Array<double> stretches(nb::ndarray<const double, nb::shape<-1, kTotals>, nb::c_contig, nb::device::cpu> totals) {
  const std::size_t b = totals.shape(0);
  std::vector<double> found(b);
  for (std::size_t k = 0; k < b; ++k) found[k] = stretch_of(totals.data()[kTotals * k], totals.data()[kTotals * k + 2]);
  return array(std::move(found), {b});
}

// For each surfel, how many of the witnesses lie in its plane (n,).
Array<std::uint32_t> coplanar(Points<double> places, Points<double> normals, Points<double> witness_places,
                              Points<double> witness_normals, double distance, double min_cosine, int threads) {
  const std::size_t n = places.shape(0);
  check_lengths(n, {normals.shape(0)});
  check_lengths(witness_places.shape(0), {witness_normals.shape(0)});
  std::vector<std::uint32_t> counts(n);
  {
    nb::gil_scoped_release free;
    Witnesses witnesses;
    for (std::size_t k = 0; k < witness_places.shape(0); ++k) witnesses.add(view(witness_places)[k], view(witness_normals)[k]);
    const float near = static_cast<float>(distance), cosine = static_cast<float>(min_cosine);
    parallel_blocks(n, 256, threads, [&](std::size_t begin, std::size_t end) {
      for (std::size_t i = begin; i < end; ++i)
        counts[i] = static_cast<std::uint32_t>(witnesses.in_plane(view(places)[i], view(normals)[i], near, cosine));
    });
  }
  return array(std::move(counts), {n});
}

void construct_sight(Sight* self, Points<double> points, Values eye, int cells) {
  check_lengths(3, {eye.shape(0)});
  if (cells < 1) throw std::invalid_argument("there must be cells");
  nb::gil_scoped_release free;
  new (self) Sight(view(points), {eye.data()[0], eye.data()[1], eye.data()[2]}, cells);
}

Array<double> ranges(const Sight& sight, Points<double> places) {
  std::vector<double> found(places.shape(0));
  {
    nb::gil_scoped_release free;
    for (std::size_t i = 0; i < found.size(); ++i) found[i] = sight.range_towards(view(places)[i]);
  }
  const std::size_t n = found.size();
  return array(std::move(found), {n});
}

// Poses (c, 4, 4), their scores (c,) and how many were tested.
nb::tuple search_poses(const ClosestGrid& grid, const PairTable& table, Points<double> drawn_means,
                       Points<double> drawn_normals, Points<double> probe_means, Points<double> probe_normals,
                       std::optional<nb::tuple> confinement, std::optional<nb::tuple> freedoms, nb::dict settings,
                       int threads) {
  const std::vector<Plane> drawn = planes_of(drawn_means, drawn_normals), probes = planes_of(probe_means, probe_normals);
  if (drawn.empty() || probes.empty()) throw std::invalid_argument("there must be surfels to draw and to probe");
  const auto number = [&](const char* name) { return nb::cast<double>(settings[name]); };
  const auto whole = [&](const char* name) { return nb::cast<int>(settings[name]); };
  const auto real = [&](const char* name) { return static_cast<float>(number(name)); };
  const SearchSettings s{nb::cast<std::uint64_t>(settings["seed"]), whole("rounds"), whole("draws"), whole("matches"),
                         real("tolerance"), real("min_cosine"), real("penalty"), real("doubt"), whole("keep"),
                         real("apart_cosine"), real("apart_distance"), real("drift_cosine"), real("drift_distance"),
                         whole("enough_hits"), real("distinct"), real("alike"), nb::cast<bool>(settings["facing"])};
  std::optional<Confinement> near;
  if (confinement) {
    const auto guess = nb::cast<Matrices4>((*confinement)[0]);
    const auto pivot = nb::cast<Values>((*confinement)[1]);
    if (guess.shape(0) < 1) throw std::invalid_argument("a confinement needs a guess");
    check_lengths(3, {pivot.shape(0)});
    near = Confinement{pose_of(guess.data()), narrow({pivot.data()[0], pivot.data()[1], pivot.data()[2]}),
                       nb::cast<float>((*confinement)[2]), nb::cast<float>((*confinement)[3])};
  }
  std::optional<Freedoms> allowed;
  if (freedoms) {
    const auto ends = nb::cast<Matrices4>((*freedoms)[0]);
    const auto mask = nb::cast<Values>((*freedoms)[2]);
    check_lengths(2, {ends.shape(0)});
    check_lengths(6, {mask.shape(0)});
    allowed = Freedoms{motion_of(ends.data()), motion_of(ends.data() + 16), nb::cast<bool>((*freedoms)[1]), {}, {}};
    std::copy_n(mask.data(), 3, allowed->turns.begin());
    std::copy_n(mask.data() + 3, 3, allowed->shifts.begin());
  }
  Found found;
  {
    nb::gil_scoped_release free;
    found = search({grid, table, drawn, probes, near, allowed}, s, threads);
  }
  const std::size_t c = found.candidates.size();
  std::vector<double> poses(16 * c, 0.0), scores(c);
  for (std::size_t k = 0; k < c; ++k) {
    const Pose& p = found.candidates[k].pose;
    double* T = poses.data() + 16 * k;
    for (int r = 0; r < 3; ++r)
      for (int col = 0; col < 3; ++col) T[4 * r + col] = p.R[3 * r + col];
    T[3] = p.t.x, T[7] = p.t.y, T[11] = p.t.z, T[15] = 1;
    scores[k] = found.candidates[k].score;
  }
  return nb::make_tuple(array(std::move(poses), {c, 4, 4}), array(std::move(scores), {c}), found.tested);
}

}  // namespace

void bind_search(nb::module_& m) {
  nb::class_<ClosestGrid>(m, "ClosestGrid", "The surfel closest to any place near a surface, looked up in a grid.")
      .def("__init__", &construct_grid, "means"_a, "normals"_a, "cell"_a, "margin"_a)
      .def("robust_sums", &grid_sums, "places"_a, "normals"_a, "offsets"_a, "poses"_a, "scale"_a,
           "min_cosine"_a, "reach"_a, "facing"_a, "threads"_a)
      .def("agreement", &grid_agreement, "places"_a, "normals"_a, "weights"_a, "poses"_a, "scale"_a, "min_cosine"_a, "reach"_a,
           "facing"_a, "threads"_a);
  nb::class_<PairTable>(m, "PairTable", "Pairs of surfels, found again by what no rigid motion changes.")
      .def("__init__", &construct_table, "means"_a, "normals"_a, "shortest"_a, "longest"_a, "threads"_a)
      .def("__len__", &PairTable::size)
      .def("counts", [](const PairTable& table) { return array(table.counts(), {PairTable::kBins}); });
  nb::class_<Sight>(m, "Sight", "What a sensor saw from where it stood.")
      .def("__init__", &construct_sight, "points"_a, "eye"_a, "cells"_a)
      .def("ranges", &ranges, "places"_a);
  m.def("search", &search_poses, "grid"_a, "table"_a, "drawn_means"_a, "drawn_normals"_a, "probe_means"_a,
        "probe_normals"_a, "confinement"_a.none(), "freedoms"_a.none(), "settings"_a, "threads"_a);
  m.def("robust_sums", &plane_sums, "x"_a, "own_normals"_a, "means"_a, "normals"_a, "spreads"_a, "min_cosine"_a,
        "reach"_a, "deviations"_a, "least_scale"_a);
  m.attr("RUN") = kRun;
  m.def("coplanar", &coplanar, "places"_a, "normals"_a, "witness_places"_a, "witness_normals"_a, "distance"_a,
        "min_cosine"_a, "threads"_a);
  m.def("stretch", &stretches, "totals"_a);
  m.def("take_steps", &take_steps, "poses"_a, "H"_a, "g"_a, "stretch"_a, "largest_turn"_a);
}

}  // namespace fieldalign
