// The closest surfel of a cloud, looked up instead of searched: a block-sparse grid around the surface.
//
// Each cell holds the surfel nearest to its middle, or nearly so, within a margin of the surface. Only blocks of cells near the surface
// are kept, so a wide scene with fine detail costs memory for its surface, not for its volume.
#pragma once

#include <cstdint>
#include <span>
#include <stdexcept>
#include <vector>

#include "casts.hpp"
#include "survey.hpp"

namespace fieldalign {

struct Vec3f {
  float x = 0, y = 0, z = 0;
};
inline Vec3f operator-(Vec3f a, Vec3f b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
inline float dot(Vec3f a, Vec3f b) { return a.x * b.x + a.y * b.y + a.z * b.z; }

// A plane of the surface: half a cache line.
struct alignas(32) Plane {
  Vec3f mean;
  float weight;  // 1; 0 for the plane that stands for none
  Vec3f normal;
};

class ClosestGrid {
 public:
  ClosestGrid(std::vector<Plane> planes, float cell, float margin);

  // The plane nearest to the middle of the place's cell; one infinitely far away where the surface is not near.
  const Plane& at(Vec3f place) const { return plane_in(cell_at(place)); }
  const Plane& plane_in(std::uint32_t cell) const { return planes_[cells_[cell]]; }
  bool is_far(const Plane& plane) const { return &plane == &planes_.back(); }

  // Where a place's cell stands among the cells. Without a branch: what lies outside, or is NaN, is clamped to the rim,
  // which is empty.
  std::uint32_t cell_at(Vec3f place) const {
    const auto index = [this](float offset, float last) {
      return static_cast<std::uint32_t>(static_cast<std::int32_t>(std::min(std::max(0.0f, offset * inverse_), last)));
    };
    const std::uint32_t i = index(place.x - lo_.x, last_.x), j = index(place.y - lo_.y, last_.y),
                        k = index(place.z - lo_.z, last_.z);
    return blocks_[block_of(i, j, k)] * kCells + within(i, j, k);
  }

 private:
  static constexpr int kBits = 3;                     // a block is 8 x 8 x 8 cells
  static constexpr std::uint32_t kCells = 1 << (3 * kBits), kMask = (1 << kBits) - 1;
  static constexpr float kMostMargin = 16;            // cells: each plane opens the blocks within it
  static constexpr double kMostBlocks = 1 << 22;      // of the box: 16 MiB of indices

  struct Cell {
    std::uint32_t i, j, k;
  };

  std::uint32_t block_of(std::uint32_t i, std::uint32_t j, std::uint32_t k) const {
    return ((k >> kBits) * rows_ + (j >> kBits)) * columns_ + (i >> kBits);
  }
  static std::uint32_t within(std::uint32_t i, std::uint32_t j, std::uint32_t k) {
    return ((k & kMask) << (2 * kBits)) | ((j & kMask) << kBits) | (i & kMask);
  }
  bool is_on_rim(Cell c) const;
  std::size_t opened(Cell c);
  float squared_distance(Cell c, const Plane& plane) const;
  void spread(float margin);

  std::vector<Plane> planes_;  // and one that is infinitely far away
  std::uint32_t none_;         // the row of that one
  Vec3f lo_, last_;  // the lowest corner, and the last cell along each axis
  float inverse_;
  std::uint32_t columns_ = 0, rows_ = 0;
  std::vector<std::uint32_t> blocks_;  // over the box: which block of cells; 0 is the block without anything
  std::vector<std::uint32_t> cells_;
};

// `planes` must not be empty. A margin is kept free around them.
inline ClosestGrid::ClosestGrid(std::vector<Plane> planes, float cell, float margin)
    : planes_(std::move(planes)), none_(static_cast<std::uint32_t>(planes_.size())), inverse_(1 / cell) {
  if (planes_.empty()) throw std::invalid_argument("a grid needs at least one plane");
  if (!(cell > 0) || !(margin > 0)) throw std::invalid_argument("cell and margin must be positive");
  if (!(margin <= kMostMargin * cell)) throw std::invalid_argument("a margin is at most 16 cells");
  Bounds bounds;
  for (const Plane& p : planes_) {
    if (!is_finite({p.mean.x, p.mean.y, p.mean.z})) throw std::invalid_argument("planes must be at finite places");
    bounds.add({p.mean.x, p.mean.y, p.mean.z});
  }
  const Vec3 rim{margin + cell, margin + cell, margin + cell};
  const Vec3 low = bounds.lo - rim, extent = bounds.hi + rim - low;
  const auto blocks = [&](double length) { return std::floor(length / cell / (1 << kBits)) + 1; };
  const double columns = blocks(extent.x), rows = blocks(extent.y), layers = blocks(extent.z);
  if (!(columns * rows * layers <= kMostBlocks)) throw std::invalid_argument("the box holds too many cells");
  // Cells are found in float32: so far from the origin, its steps must still be shorter than they.
  const double farthest = std::max({-low.x, -low.y, -low.z, low.x + extent.x, low.y + extent.y, low.z + extent.z});
  if (!(farthest < cell * (1 << 23))) throw std::invalid_argument("the planes are too far from the origin for such cells");
  lo_ = {static_cast<float>(low.x), static_cast<float>(low.y), static_cast<float>(low.z)};
  columns_ = static_cast<std::uint32_t>(columns), rows_ = static_cast<std::uint32_t>(rows);
  const auto last = [](double count) { return static_cast<float>(count * (1 << kBits) - 1); };
  last_ = {last(columns), last(rows), last(layers)};
  blocks_.assign(static_cast<std::size_t>(columns * rows * layers), 0);
  cells_.assign(kCells, none_);
  spread(margin);
  constexpr float far = 1e18f;  // its square is a float still
  planes_.push_back({{far, far, far}, 0, {1, 0, 0}});
}

// Whether a cell is one of the outermost, or beyond: where cells are many, rounding may lay a plane there.
inline bool ClosestGrid::is_on_rim(Cell c) const {
  const auto is_outermost = [](std::uint32_t index, float last) {
    return index - 1 >= static_cast<std::uint32_t>(last) - 1;  // 0 wraps around
  };
  return is_outermost(c.i, last_.x) || is_outermost(c.j, last_.y) || is_outermost(c.k, last_.z);
}

// The place of a cell among the cells, its block opened where it was not.
inline std::size_t ClosestGrid::opened(Cell c) {
  std::uint32_t& block = blocks_[block_of(c.i, c.j, c.k)];
  if (block == 0) {
    block = static_cast<std::uint32_t>(cells_.size() / kCells);
    cells_.resize(cells_.size() + kCells, none_);
  }
  return std::size_t{block} * kCells + within(c.i, c.j, c.k);
}

inline float ClosestGrid::squared_distance(Cell c, const Plane& plane) const {
  const float cell = 1 / inverse_;
  const Vec3f middle{lo_.x + (static_cast<float>(c.i) + 0.5f) * cell, lo_.y + (static_cast<float>(c.j) + 0.5f) * cell,
                     lo_.z + (static_cast<float>(c.k) + 0.5f) * cell};
  const Vec3f away = middle - plane.mean;
  return dot(away, away);
}

// From the cells of the planes outward, each cell handing its plane on to its neighbours where it is nearer than theirs.
inline void ClosestGrid::spread(float margin) {
  std::vector<Cell> front, next;
  const float most = margin * margin;
  const auto offer = [&](Cell c, std::uint32_t plane, float limit) {
    if (is_on_rim(c)) return;
    const float squared = squared_distance(c, planes_[plane]);
    if (!(squared < limit)) return;
    std::uint32_t& holds = cells_[opened(c)];
    if (holds == plane || (holds != none_ && !(squared < squared_distance(c, planes_[holds])))) return;
    holds = plane;
    next.push_back(c);
  };
  const auto offer_around = [&](Cell c, std::uint32_t plane) {
    const auto [i, j, k] = c;
    for (const Cell n : {Cell{i - 1, j, k}, Cell{i + 1, j, k}, Cell{i, j - 1, k}, Cell{i, j + 1, k}, Cell{i, j, k - 1},
                         Cell{i, j, k + 1}})
      offer(n, plane, most);
  };
  for (std::uint32_t p = 0; p < none_; ++p) {
    const Vec3f at = planes_[p].mean - lo_;
    const auto index = [&](float offset) { return cast_within<std::uint32_t>(offset * inverse_, 0, 1u << 30); };
    const Cell own{index(at.x), index(at.y), index(at.z)};
    offer(own, p, std::numeric_limits<float>::infinity());
    offer_around(own, p);  // where it lost its own cell, it may still win others
  }
  while (!next.empty()) {
    front.swap(next);
    next.clear();
    for (const Cell c : front) offer_around(c, cells_[opened(c)]);
  }
}

}  // namespace fieldalign
