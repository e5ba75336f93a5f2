// Pairs of surfels, to be found again by what no rigid motion changes.
//
// Of two surfels at distance d on the axis u, with normals n and m whose signs mean nothing: d, |n.u|, |m.u|, |n.m|, and
// the sign of (n.u)(m.u)(n.m). The steeper surfel (larger |n.u|) comes first; its normal fixes the turn about the axis.
// (Point pair features, Drost et al., CVPR 2010, made free of the normals' signs.)
#pragma once

#include <optional>

#include "closest_grid.hpp"
#include "parallel.hpp"

namespace fieldalign {

struct PairBand {
  float shortest, longest;  // of the distances between two surfels that are taken
};

// What a pair of planes is known by, and the frame that it spans.
struct PairFeature {
  float distance, first, second, between;  // d, |n.u|, |m.u|, |n.m|
  bool is_odd;                             // the sign of the product
};

constexpr float kMostParallel = 0.93f;   // |n.m|: nearly parallel planes leave a shift free
constexpr float kLeastSteep = 0.12f;     // |n.u| of the steeper one: below, noise decides on the sign of its normal
constexpr float kMostSteep = 0.98f;      // and above, the turn about the axis is undetermined

// The feature of a pair, which is put in order, the steeper first; nothing where the pair is no good.
inline std::optional<PairFeature> ordered_feature(const Plane*& a, const Plane*& b, PairBand band) {
  const Vec3f away = b->mean - a->mean;
  const float squared = dot(away, away);
  if (squared < band.shortest * band.shortest || squared > band.longest * band.longest) return {};
  const float between = dot(a->normal, b->normal);
  if (std::abs(between) > kMostParallel) return {};
  const float distance = std::sqrt(squared);
  const float one = dot(a->normal, away) / distance, other = dot(b->normal, away) / distance;
  if (std::abs(other) > std::abs(one)) std::swap(a, b);
  const float first = std::max(std::abs(one), std::abs(other)), second = std::min(std::abs(one), std::abs(other));
  if (first < kLeastSteep || first > kMostSteep) return {};
  return PairFeature{distance, first, second, std::abs(between), one * other * between < 0};
}

class PairTable {
 public:
  static constexpr int kDistances = 20, kSteep = 10, kBetween = 8;
  static constexpr std::size_t kBins = std::size_t{kDistances} * kSteep * kSteep * kBetween * 2;

  struct Pair {
    std::uint16_t first, second;
  };

  // Of all pairs among `members` (at most 65535 of them), by their rows among the planes of the grid.
  PairTable(std::vector<Plane> members, PairBand band, int threads);

  std::size_t size() const { return pairs_.size(); }
  PairBand band() const { return band_; }
  std::span<const Plane> members() const { return members_; }

  // How many pairs there are of each look.
  std::vector<std::uint32_t> counts() const {
    std::vector<std::uint32_t> numbers(kBins);
    for (std::size_t b = 0; b < kBins; ++b) numbers[b] = begin_[b + 1] - begin_[b];
    return numbers;
  }

  // The pairs that look like this one.
  std::span<const Pair> like(const PairFeature& f) const {
    const std::size_t bin = bin_of(f);
    return {pairs_.data() + begin_[bin], pairs_.data() + begin_[bin + 1]};
  }

 private:
  std::size_t bin_of(const PairFeature& f) const {
    const auto bin = [](float share, int count) {
      return static_cast<std::size_t>(cast_within(share * static_cast<float>(count), 0, count - 1));
    };
    const std::size_t d = bin((f.distance - band_.shortest) / (band_.longest - band_.shortest), kDistances);
    const std::size_t steep = bin(f.first, kSteep) * kSteep + bin(f.second, kSteep);
    return ((d * kSteep * kSteep + steep) * kBetween + bin(f.between, kBetween)) * 2 + (f.is_odd ? 1 : 0);
  }

  std::vector<Plane> members_;
  PairBand band_;
  std::vector<Pair> pairs_;            // by bin
  std::vector<std::uint32_t> begin_;   // of each bin, and the end
};

inline PairTable::PairTable(std::vector<Plane> members, PairBand band, int threads)
    : members_(std::move(members)), band_(band), begin_(kBins + 1, 0) {
  const std::size_t n = members_.size();
  if (n > 65535) throw std::invalid_argument("a pair table has at most 65535 members");
  struct Found {
    std::uint32_t bin;
    Pair pair;
  };
  constexpr std::size_t kRows = 32;
  std::vector<std::vector<Found>> found((n + kRows - 1) / kRows);
  parallel_blocks(n, kRows, threads, [&](std::size_t begin, std::size_t end) {
    auto& here = found[begin / kRows];
    here.reserve((end - begin) * n / 4);
    for (std::size_t i = begin; i < end; ++i)
      for (std::size_t j = i + 1; j < n; ++j) {
        const Plane *a = &members_[i], *b = &members_[j];
        const auto feature = ordered_feature(a, b, band_);
        if (!feature) continue;
        const auto row = [&](const Plane* plane) { return static_cast<std::uint16_t>(plane - members_.data()); };
        here.push_back({static_cast<std::uint32_t>(bin_of(*feature)), {row(a), row(b)}});
      }
  });
  for (const auto& block : found)
    for (const Found& f : block) ++begin_[f.bin + 1];
  for (std::size_t b = 0; b < kBins; ++b) begin_[b + 1] += begin_[b];
  pairs_.resize(begin_.back());
  std::vector<std::uint32_t> place(begin_.begin(), begin_.end() - 1);
  for (const auto& block : found)
    for (const Found& f : block) pairs_[place[f.bin]++] = f.pair;
}

}  // namespace fieldalign
