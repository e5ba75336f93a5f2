// Exact nearest neighbours: a tree of boxes, four to a node, whose splits are the bits of the points' codes on Morton's
// curve.
//
// Sorting along the curve is a radix sort and each split a binary search, so building is linear in the points but for
// that. A cell that holds too many points (a far outlier makes all cells large, a sensor's own neighbourhood is dense) is
// sorted again in finer cells. Points are kept in float64, relative to the middle of their bounds, so that coordinates
// of UTM size lose nothing.
#pragma once

#include <array>
#include <bit>
#include <stdexcept>

#include "curve.hpp"
#include "lanes.hpp"

namespace fieldalign {

class PointTree {
 public:
  static constexpr int kMaxNeighbours = 64;

  template <class Real>
  PointTree(PointsView<Real> points, int threads);

  std::size_t size() const { return points_.size(); }
  Vec3 centre() const { return centre_; }
  Vec3 local(std::uint32_t position) const { return points_[position]; }  // relative to centre()
  std::uint32_t row(std::uint32_t position) const { return rows_[position]; }

  // Offers points to `collector` (bound() and offer(squared distance, position)), near ones first, until none is left
  // that could be nearer than bound(). The query is relative to centre().
  template <class Collector>
  void visit(Vec3 query, Collector& collector) const;

 private:
  static constexpr int kFan = 4;                // halves of halves
  static constexpr std::size_t kLeaf = 32;      // the most points of a leaf, but for points that are all equal
  static constexpr std::size_t kTwig = 16384;   // the most points of a subtree that one thread grows
  static constexpr int kDeepest = 48;           // levels: details of 1e-9 of the extent, and what is finer is a leaf

  // Two cache lines. Boxes are float32 in units of unit_, so that any scale fits; visit() allows for their rounding.
  struct alignas(64) Node {
    float lo[3][kFan], hi[3][kFan];
    std::uint32_t child[kFan];  // a leaf's first point, or how many nodes further the child stands
    std::uint32_t count[kFan];  // a leaf's points; 0: not a leaf
  };
  struct Range {
    std::size_t begin, end;
    std::size_t size() const { return end - begin; }
  };
  struct Split {
    Range range;
    int depth;
    int parts;  // one: it could not be parted, or need not
    std::array<Range, kFan> part;
    bool is_parted() const { return parts > 1; }
  };
  // What grew from a range: a leaf, or the first of the nodes that were appended.
  struct Grown {
    Bounds bounds;
    std::uint32_t leaf_points;
  };
  struct Twig {
    std::vector<Node> nodes;
    Grown root;
  };

  template <class Real>
  static Split split(PointsView<Real> points, std::span<Placed> order, Range range, std::size_t most, int depth,
                     int threads);
  template <class Real>
  static void split_to_twigs(PointsView<Real> points, std::span<Placed> order, Range range, int depth, int threads,
                             std::vector<Split>& splits);
  template <class Grow>
  Grown join(std::vector<Node>& nodes, const Split& split, Grow grow) const;
  template <class Real>
  Grown grow(PointsView<Real> points, std::span<Placed> order, Range range, int depth, std::vector<Node>& nodes);
  template <class Real>
  Grown fill_leaf(PointsView<Real> points, std::span<Placed> order, Range range);

  Vec3 centre_;
  double unit_ = 1;                   // half the longest edge of the bounds
  std::vector<Vec3> points_;          // along the curve
  std::vector<std::uint32_t> rows_;   // position along the curve -> row of the array given
  std::vector<Node> nodes_;           // depth first
};

// The nearest point alone.
struct Nearest {
  double squared = std::numeric_limits<double>::infinity();
  std::uint32_t position = 0;
  double bound() const { return squared; }
  void offer(double d2, std::uint32_t p) {
    if (d2 < squared) squared = d2, position = p;
  }
};

// The k nearest points, nearest first; of a smaller tree, all of them.
struct KNearest {
  KNearest(const PointTree& tree, int wanted) : k(static_cast<int>(std::min<std::size_t>(wanted, tree.size()))) {}
  int k, found = 0;
  double squared[PointTree::kMaxNeighbours];
  std::uint32_t position[PointTree::kMaxNeighbours];
  double bound() const { return found < k ? std::numeric_limits<double>::infinity() : squared[k - 1]; }
  void offer(double d2, std::uint32_t p) {
    if (!(d2 < bound())) return;
    int i = found < k ? found++ : k - 1;
    for (; i > 0 && squared[i - 1] > d2; --i) squared[i] = squared[i - 1], position[i] = position[i - 1];
    squared[i] = d2, position[i] = p;
  }
};

// Every point within a radius: calls body(position).
template <class Body>
struct Within {
  double squared_radius;
  Body body;
  double bound() const { return squared_radius; }
  void offer(double d2, std::uint32_t p) {
    if (d2 < squared_radius) body(p);
  }
};

// ------------------------------------------------------------------------------------------------ building

// Where the range's highest differing bit changes from 0 to 1; the range's begin where all its points are equal.
template <class Real>
std::size_t middle_of(PointsView<Real> points, std::span<Placed> order, std::size_t begin, std::size_t end, int threads) {
  const auto items = order.subspan(begin, end - begin);
  if (items.front().key == items.back().key && !sort_along_curve(points, items, threads)) return begin;
  const int bit = 31 - std::countl_zero(items.front().key ^ items.back().key);
  const auto lacks_bit = [bit](const Placed& p) { return (p.key >> bit & 1) == 0; };
  return begin + (std::partition_point(items.begin(), items.end(), lacks_bit) - items.begin());
}

// Halves a range of more than `most` points, and its halves.
template <class Real>
PointTree::Split PointTree::split(PointsView<Real> points, std::span<Placed> order, Range range, std::size_t most,
                                  int depth, int threads) {
  Split result{range, depth, 1, {range}};
  for (int round = 0; round < 2 && depth < kDeepest; ++round) {
    const Split before = result;
    result.parts = 0;
    for (int k = 0; k < before.parts; ++k) {
      const auto [begin, end] = before.part[k];
      const std::size_t middle = end - begin > most ? middle_of(points, order, begin, end, threads) : begin;
      if (middle != begin) result.part[result.parts++] = {begin, middle};
      result.part[result.parts++] = {middle, end};
    }
  }
  return result;
}

// The splits down to twigs, depth first.
template <class Real>
void PointTree::split_to_twigs(PointsView<Real> points, std::span<Placed> order, Range range, int depth, int threads,
                               std::vector<Split>& splits) {
  const Split parted = split(points, order, range, kTwig, depth, threads);
  splits.push_back(parted);
  if (!parted.is_parted()) return;
  for (int k = 0; k < parted.parts; ++k) split_to_twigs(points, order, parted.part[k], depth + 1, threads, splits);
}

// Appends a node over the parts of a split, and behind it what `grow` appends for each.
template <class Grow>
PointTree::Grown PointTree::join(std::vector<Node>& nodes, const Split& split, Grow grow) const {
  const std::size_t self = nodes.size();
  nodes.push_back({});
  Bounds all;
  for (int k = 0; k < kFan; ++k) {
    const bool there = k < split.parts;
    const auto place = static_cast<std::uint32_t>(nodes.size() - self);
    const Grown child = there ? grow(split.part[k]) : Grown{};  // a child that is not there is infinitely far from anywhere
    Node& node = nodes[self];
    node.count[k] = child.leaf_points;
    node.child[k] = there && child.leaf_points ? static_cast<std::uint32_t>(split.part[k].begin) : place;
    for (int axis = 0; axis < 3; ++axis) {
      node.lo[axis][k] = static_cast<float>(child.bounds.lo[axis] / unit_);
      node.hi[axis][k] = static_cast<float>(child.bounds.hi[axis] / unit_);
    }
    all = merged(all, child.bounds);
  }
  return {all, 0};
}

template <class Real>
PointTree::Grown PointTree::grow(PointsView<Real> points, std::span<Placed> order, Range range, int depth,
                                 std::vector<Node>& nodes) {
  const Split parted = split(points, order, range, kLeaf, depth, 1);
  if (!parted.is_parted()) return fill_leaf(points, order, range);
  return join(nodes, parted, [&](Range part) { return grow(points, order, part, depth + 1, nodes); });
}

template <class Real>
PointTree::Grown PointTree::fill_leaf(PointsView<Real> points, std::span<Placed> order, Range range) {
  Bounds bounds;
  for (std::size_t i = range.begin; i < range.end; ++i) {
    rows_[i] = order[i].index;
    points_[i] = points[rows_[i]] - centre_;
    bounds.add(points_[i]);
  }
  return {bounds, static_cast<std::uint32_t>(range.size())};
}

template <class Real>
PointTree::PointTree(PointsView<Real> points, int threads) : points_(points.n), rows_(points.n) {
  if (points.n == 0) throw std::invalid_argument("a point tree needs at least one point");
  if (points.n > std::numeric_limits<std::uint32_t>::max()) throw std::invalid_argument("a point tree holds 2^32 points");
  const Bounds bounds = bounds_of(points.n, [&](std::size_t i) { return points[i]; }, threads);
  const Vec3 half = 0.5 * (bounds.hi - bounds.lo);
  centre_ = bounds.lo + half;
  if (const double longest = std::max({half.x, half.y, half.z}); longest > 0) unit_ = longest;

  std::vector<Placed> order(points.n);
  parallel_blocks(points.n, kPointBlock, threads, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) order[i] = {0, static_cast<std::uint32_t>(i)};
  });
  const Range whole{0, points.n};
  std::vector<Split> splits;
  sort_along_curve<Real>(points, order, threads);
  split_to_twigs<Real>(points, order, whole, 0, threads, splits);

  std::vector<Twig> twigs(splits.size());
  parallel_blocks(splits.size(), 1, threads, [&](std::size_t i, std::size_t) {
    const Split& here = splits[i];
    if (!here.is_parted()) twigs[i].root = grow<Real>(points, order, here.range, here.depth, twigs[i].nodes);
  });

  std::size_t next = 0;
  const auto gather = [&](const auto& self) -> Grown {
    const std::size_t i = next++;
    if (splits[i].is_parted()) return join(nodes_, splits[i], [&](Range) { return self(self); });
    nodes_.insert(nodes_.end(), twigs[i].nodes.begin(), twigs[i].nodes.end());
    return twigs[i].root;
  };
  join(nodes_, {whole, 0, 1, {whole}}, [&](Range) { return gather(gather); });
}

// ------------------------------------------------------------------------------------------------ asking

template <class Collector>
void PointTree::visit(Vec3 query, Collector& collector) const {
  struct Branch {
    float squared;
    std::uint32_t child, count;
  };
  const float q[3] = {static_cast<float>(query.x / unit_), static_cast<float>(query.y / unit_),
                      static_cast<float>(query.z / unit_)};
  // Boxes (at most 1 in size) and query are rounded to 6e-8 of their size: widened by more, none is taken for too far.
  const float slack = 2e-7f * (1 + std::max({std::abs(q[0]), std::abs(q[1]), std::abs(q[2])}));
  const double per_unit = (1 + 1e-6) / (unit_ * unit_);  // and the rounding of the sum
  constexpr double farthest = std::numeric_limits<float>::max();  // a child that is not there lies beyond
  const auto limit = [&] { return static_cast<float>(std::min(collector.bound() * per_unit, farthest)); };
  Branch stack[kFan * (kDeepest + 2)];
  int top = 0;
  for (Branch here{0, 0, 0};;) {
    if (here.count) {
      for (std::uint32_t i = here.child; i < here.child + here.count; ++i) {
        const Vec3 d = points_[i] - query;
        collector.offer(dot(d, d), i);
      }
    } else {
      const Node& node = nodes_[here.child];
      Lanes squared{};
      for (int axis = 0; axis < 3; ++axis) {
        const Lanes below = Lanes::load(node.lo[axis]) - (q[axis] + slack);
        const Lanes above = (q[axis] - slack) - Lanes::load(node.hi[axis]);
        const Lanes outside = max(max(below, above), Lanes{});
        squared = squared + outside * outside;
      }
      // Children wait on the stack with the nearest on top.
      const float bound = limit();
      const int bottom = top;
      for (int k = 0; k < kFan; ++k) {
        const float far = squared[k];
        if (!(far <= bound)) continue;
        int place = top++;
        for (; place > bottom && stack[place - 1].squared < far; --place) stack[place] = stack[place - 1];
        stack[place] = {far, node.count[k] ? node.child[k] : here.child + node.child[k], node.count[k]};
      }
    }
    const float bound = limit();
    do {
      if (top == 0) return;
      here = stack[--top];
    } while (here.squared > bound);
  }
}

}  // namespace fieldalign
