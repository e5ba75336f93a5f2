// Any pose: pairs of surfels of one cloud that look like pairs of the other each give a pose, and each pose is tested.
//
// Nothing moves but the probes, a few hundred surfels of one cloud; what they meet is looked up in the other's grid. Most
// poses are dropped after the first few probes, so that a test costs a fraction of a microsecond.
#pragma once

#include <array>

#include "motion.hpp"
#include "pair_table.hpp"
#include "random.hpp"

namespace fieldalign {

// A rigid motion that takes the probes' cloud into the grid's.
struct Pose {
  std::array<float, 9> R;  // by rows
  Vec3f t;

  Vec3f turned(Vec3f p) const {
    return {R[0] * p.x + R[1] * p.y + R[2] * p.z, R[3] * p.x + R[4] * p.y + R[5] * p.z,
            R[6] * p.x + R[7] * p.y + R[8] * p.z};
  }
  Vec3f moved(Vec3f p) const {
    const Vec3f r = turned(p);
    return {r.x + t.x, r.y + t.y, r.z + t.z};
  }
};

struct Candidate {
  Pose pose;
  float score;   // mean over the probes: 1 on the other surface, less `penalty` near it
  int hits = 1;  // how many hypotheses led here
};

struct SearchSettings {
  std::uint64_t seed;
  int rounds, draws;    // at most so many rounds, and pairs drawn in each
  int matches;          // poses tried for a drawn pair, at most
  float tolerance;      // distance from a plane that counts as on it
  float min_cosine;     // between normals that agree
  float penalty;        // for being near the other surface: what a wrong pose gets there by chance
  float doubt;          // a pose is dropped when it falls so many standard deviations short of the shortlist
  int keep;             // candidates
  float apart_cosine, apart_distance;  // candidates that differ less are one
  float drift_cosine, drift_distance;  // a pose that is not allowed stands for one that differs less
  int enough_hits;      // to settle on the best, where
  float distinct;       // the next has less than this share of its score
  float alike;          // all have more than this share of it: to search on would find no better one
  bool facing;          // normals point towards the sensors: those that oppose do not agree
};

// Poses near a guess: the pivot may move by `radius` from where the guess puts it, and the cloud turn by an angle.
struct Confinement {
  Pose guess;
  Vec3f pivot;        // a place of the probes' cloud
  float radius;
  float cosine;       // of the largest angle
};

inline float trace_of_difference(const Pose& a, const Pose& b) {
  float trace = 0;
  for (int k = 0; k < 9; ++k) trace += a.R[k] * b.R[k];
  return trace;
}

inline bool lies_within(const Pose& pose, const Confinement& c) {
  const Vec3f shift = pose.moved(c.pivot) - c.guess.moved(c.pivot);
  return (trace_of_difference(pose, c.guess) - 1) / 2 >= c.cosine && dot(shift, shift) <= c.radius * c.radius;
}

// Whether two poses turn by less than an angle of this cosine against each other, and the pivot lies nearer than this.
inline bool are_near(const Pose& a, const Pose& b, Vec3f pivot, float cosine, float distance) {
  if ((trace_of_difference(a, b) - 1) / 2 < cosine) return false;
  const Vec3f shift = a.moved(pivot) - b.moved(pivot);
  return dot(shift, shift) < distance * distance;
}

// The best candidates that differ from each other, best first.
class Shortlist {
 public:
  Shortlist(const SearchSettings& s, Vec3f pivot) : settings_(s), pivot_(pivot) {}
  // Below this score a candidate is not worth its test.
  float floor() const {
    const float best = all_.empty() ? 0 : all_.front().score;
    return std::max(0.5f * best, static_cast<int>(all_.size()) < settings_.keep ? 0 : all_.back().score);
  }
  const std::vector<Candidate>& all() const { return all_; }

  bool wants(float score) const {
    return static_cast<int>(all_.size()) < settings_.keep || score > all_.back().score;
  }
  void offer(Candidate c) {
    if (!wants(c.score)) return;
    for (std::size_t i = 0; i < all_.size(); ++i) {
      if (!is_same(all_[i].pose, c.pose)) continue;
      if (all_[i].score >= c.score) {
        all_[i].hits += c.hits;
        return;
      }
      c.hits += all_[i].hits;
      all_.erase(all_.begin() + static_cast<std::ptrdiff_t>(i--));
    }
    const auto place = std::upper_bound(all_.begin(), all_.end(), c,
                                        [](const Candidate& a, const Candidate& b) { return a.score > b.score; });
    all_.insert(place, c);
    if (static_cast<int>(all_.size()) > settings_.keep) all_.pop_back();
  }

  // Whether more draws would change nothing: the best one stands out, found so often that an equal twin, as likely to be
  // hit, would have been found too; or the list is full of twins.
  bool is_settled() const {
    if (all_.size() < 2) return false;
    const float best = all_[0].score;
    const bool is_full = static_cast<int>(all_.size()) == settings_.keep;
    return (all_[0].hits >= settings_.enough_hits && all_[1].score < settings_.distinct * best) ||
           (is_full && all_.back().score > settings_.alike * best);
  }

 private:
  bool is_same(const Pose& a, const Pose& b) const {
    return are_near(a, b, pivot_, settings_.apart_cosine, settings_.apart_distance);
  }

  SearchSettings settings_;
  Vec3f pivot_;
  std::vector<Candidate> all_;
};

// The score of the probes [begin, end), summed. In short loops without a branch: the first ones are done several probes at
// a time, and in the last the probes wait for memory together.
inline float sum_of_scores(const ClosestGrid& grid, std::span<const Plane> probes, const Pose& pose, std::size_t begin,
                           std::size_t end, const SearchSettings& s) {
  constexpr std::size_t kAtOnce = 16;
  const float opposed = s.facing ? 1.0f : -1.0f;  // what a cosine is multiplied by for the other sign of a normal
  int on = 0;
  float met = 0;
  for (std::size_t i = begin; i < end; i += kAtOnce) {
    const std::size_t n = std::min(kAtOnce, end - i);
    Vec3f x[kAtOnce];
    std::uint32_t cell[kAtOnce];
    for (std::size_t k = 0; k < n; ++k) x[k] = pose.moved(probes[i + k].mean);
    for (std::size_t k = 0; k < n; ++k) cell[k] = grid.cell_at(x[k]);
    for (std::size_t k = 0; k < n; ++k) {
      const Plane& plane = grid.plane_in(cell[k]);
      const float distance = std::abs(dot(plane.normal, x[k] - plane.mean));
      const float between = dot(plane.normal, pose.turned(probes[i + k].normal));
      const float cosine = std::max(between, opposed * between);
      on += static_cast<int>(distance < s.tolerance) & static_cast<int>(cosine > s.min_cosine);
      met += plane.weight;
    }
  }
  return static_cast<float>(on) - s.penalty * met;
}

// The mean score over all probes; nothing as soon as the first ones leave little hope of reaching `floor`.
inline std::optional<float> score(const ClosestGrid& grid, std::span<const Plane> probes, const Pose& pose, float floor,
                                  const SearchSettings& s) {
  constexpr std::size_t kStages[] = {12, 32, 80};
  const float variance = (floor + 0.1f) * (0.9f - floor);
  float sum = 0;
  std::size_t asked = 0;
  for (const std::size_t stage : kStages) {
    const std::size_t end = std::min(stage, probes.size());
    sum += sum_of_scores(grid, probes, pose, asked, end, s);
    asked = end;
    const float n = static_cast<float>(asked);
    if (sum < n * floor - s.doubt * std::sqrt(n * variance)) return {};
  }
  sum += sum_of_scores(grid, probes, pose, asked, probes.size(), s);
  return sum / static_cast<float>(probes.size());
}

// The frame that a pair spans: the axis from a to b, and a's normal where it leaves the axis, turned along it.
inline std::array<Vec3f, 3> frame_of(const Plane& a, const Plane& b) {
  const auto scaled = [](float s, Vec3f v) { return Vec3f{s * v.x, s * v.y, s * v.z}; };
  const auto unit = [&](Vec3f v) { return scaled(1 / std::sqrt(dot(v, v)), v); };
  const Vec3f u = unit(b.mean - a.mean);
  const float along = dot(a.normal, u);
  const Vec3f h = unit(scaled(along < 0 ? -1.0f : 1.0f, a.normal - scaled(along, u)));
  return {u, h, {u.y * h.z - u.z * h.y, u.z * h.x - u.x * h.z, u.x * h.y - u.y * h.x}};
}

// The pose that lays one pair on the other: frame on frame, middle on middle.
inline Pose pose_between(const Plane& a, const Plane& b, const Plane& onto_a, const Plane& onto_b) {
  const auto from = frame_of(a, b), onto = frame_of(onto_a, onto_b);
  Pose pose{};
  for (int k = 0; k < 3; ++k) {
    const float f[3] = {from[k].x, from[k].y, from[k].z}, o[3] = {onto[k].x, onto[k].y, onto[k].z};
    for (int r = 0; r < 3; ++r)
      for (int c = 0; c < 3; ++c) pose.R[3 * r + c] += o[r] * f[c];
  }
  const auto middle = [](Vec3f p, Vec3f q) { return Vec3f{(p.x + q.x) / 2, (p.y + q.y) / 2, (p.z + q.z) / 2}; };
  pose.t = middle(onto_a.mean, onto_b.mean) - pose.turned(middle(a.mean, b.mean));
  return pose;
}

struct Found {
  std::vector<Candidate> candidates;
  std::uint64_t tested = 0;  // poses
};

// The middle of some places.
inline Vec3f middle_of(std::span<const Plane> planes) {
  Vec3 sum;
  for (const Plane& p : planes) sum = sum + Vec3{p.mean.x, p.mean.y, p.mean.z};
  const double share = 1.0 / static_cast<double>(planes.size());
  return {static_cast<float>(share * sum.x), static_cast<float>(share * sum.y), static_cast<float>(share * sum.z)};
}

// What a search works on. `probes` are surfels of the other cloud in an order without meaning, `drawn` those whose pairs
// are looked up.
struct SearchSpace {
  const ClosestGrid& grid;
  const PairTable& table;
  std::span<const Plane> drawn, probes;
  std::optional<Confinement> confinement;
  std::optional<Freedoms> freedoms;
};

// The allowed pose that a pose stands for, which comes from two pairs and is as rough as their normals; nothing where none
// is near.
inline std::optional<Pose> allowed(const Pose& pose, const Freedoms& freedoms, Vec3f pivot, const SearchSettings& s) {
  Motion motion;
  std::copy(pose.R.begin(), pose.R.end(), motion.R.begin());
  motion.t = {pose.t.x, pose.t.y, pose.t.z};
  motion = freedoms.nearest(motion);
  Pose nearest;
  std::transform(motion.R.begin(), motion.R.end(), nearest.R.begin(), [](double v) { return static_cast<float>(v); });
  nearest.t = {static_cast<float>(motion.t.x), static_cast<float>(motion.t.y), static_cast<float>(motion.t.z)};
  if (!are_near(pose, nearest, pivot, s.drift_cosine, s.drift_distance)) return {};
  return nearest;
}

// Draws one pair, tries the poses that its likes give, offers those that score to the list; how many were tested.
inline std::uint64_t try_pair(const SearchSpace& space, Vec3f pivot, Random& random, float floor, Shortlist& list,
                              const SearchSettings& s) {
  const auto any = [&] { return &space.drawn[random.below(static_cast<std::uint32_t>(space.drawn.size()))]; };
  const Plane *a = any(), *b = any();
  const auto feature = ordered_feature(a, b, space.table.band());
  if (!feature) return 0;
  const auto like = space.table.like(*feature);
  const std::size_t tries = std::min<std::size_t>(like.size(), static_cast<std::size_t>(s.matches));
  std::uint64_t tested = 0;
  for (std::size_t k = 0; k < tries; ++k) {
    const auto pair = like[tries == like.size() ? k : random.below(static_cast<std::uint32_t>(like.size()))];
    const auto members = space.table.members();
    Pose pose = pose_between(*a, *b, members[pair.first], members[pair.second]);
    if (space.freedoms) {
      const auto nearest = allowed(pose, *space.freedoms, pivot, s);
      if (!nearest) continue;
      pose = *nearest;
    }
    if (space.confinement && !lies_within(pose, *space.confinement)) continue;
    ++tested;
    const auto found = score(space.grid, space.probes, pose, std::max(floor, list.floor()), s);
    if (found) list.offer({pose, *found});
  }
  return tested;
}

// Rounds of draws, in blocks that do not depend on the number of threads; what a round found raises the bar for the next.
inline Found search(const SearchSpace& space, const SearchSettings& s, int threads) {
  constexpr std::size_t kDraws = 32;  // of a block
  constexpr float kLeast = 0.02f;     // score of a candidate
  const Vec3f pivot = middle_of(space.probes);
  const std::size_t blocks = (static_cast<std::size_t>(s.draws) + kDraws - 1) / kDraws;
  Shortlist all(s, pivot);
  std::uint64_t tested = 0;
  for (int round = 0; round < s.rounds && !all.is_settled(); ++round) {
    const float floor = std::max(all.floor(), kLeast);
    std::vector<Shortlist> lists(blocks, Shortlist(s, pivot));
    std::vector<std::uint64_t> tests(blocks, 0);
    parallel_blocks(blocks, 1, threads, [&](std::size_t block, std::size_t) {
      Random random(s.seed, static_cast<std::uint64_t>(round) << 32 | block);
      for (std::size_t draw = 0; draw < kDraws; ++draw)
        tests[block] += try_pair(space, pivot, random, floor, lists[block], s);
    });
    for (std::size_t b = 0; b < blocks; ++b) {
      tested += tests[b];
      for (const Candidate& c : lists[b].all()) all.offer(c);
    }
  }
  return {all.all(), tested};
}

}  // namespace fieldalign
