// Exact nearest neighbours: a tree of boxes, eight to a node, whose splits are the bits of the points' codes on Morton's
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

  std::size_t size() const { return rows_.size(); }
  Vec3 centre() const { return centre_; }
  Vec3 local(std::uint32_t position) const { return {x_[position], y_[position], z_[position]}; }  // relative to centre()
  std::uint32_t row(std::uint32_t position) const { return rows_[position]; }

  // Offers points to `collector` (bound() and offer(squared distance, position)), near ones first, until none is left
  // that could be nearer than bound(). The query is relative to centre().
  template <class Collector>
  void visit(Vec3 query, Collector& collector) const;

 private:
  static constexpr int kFan = 8;
  static constexpr std::size_t kEnough = 16;    // points that are not parted further, though a node has room
  static constexpr std::size_t kLeaf = 48;      // the most points of a leaf, but for points that are all equal
  static constexpr std::size_t kTwig = 16384;   // the most points of a subtree that one thread grows
  static constexpr int kDeepest = 32;           // levels: details of 1e-9 of the extent, and what is finer is a leaf
  static constexpr std::size_t kOverrun = 3;    // how far behind a leaf least_squared() may read

  using Four = Lanes<float>;

  // Four cache lines. Boxes are float32 in units of unit_, so that any scale fits; visit() allows for their rounding.
  struct alignas(64) Node {
    Four lo[3][kFan / Four::kCount], hi[3][kFan / Four::kCount];
    std::uint32_t begin[kFan];  // a leaf's first point, or how many nodes further the child stands
    std::uint32_t end[kFan];    // behind a leaf's last point; 0: not a leaf
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
    bool is_leaf;
  };
  struct Twig {
    std::vector<Node> nodes;
    Grown root;
  };

  template <class Real>
  static Split split(PointsView<Real> points, std::span<Placed> order, Range range, int depth, int threads);
  template <class Real>
  static void split_to_twigs(PointsView<Real> points, std::span<Placed> order, Range range, int depth, int threads,
                             std::vector<Split>& splits);
  double least_squared(Vec3 query, std::size_t begin, std::size_t end) const;
  template <class Grow>
  Grown join(std::vector<Node>& nodes, const Split& split, Grow grow) const;
  template <class Real>
  Grown grow(PointsView<Real> points, std::span<Placed> order, Range range, int depth, std::vector<Node>& nodes);
  template <class Real>
  Grown fill_leaf(PointsView<Real> points, std::span<Placed> order, Range range);

  Vec3 centre_;
  double unit_ = 1;                   // half the longest edge of the bounds
  std::vector<double> x_, y_, z_;     // along the curve, and kOverrun zeros
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
  if (items.front().key == items.back().key) {
    const Bounds bounds = bounds_of(items.size(), [&](std::size_t i) { return points[items[i].index]; }, threads);
    if (!sort_along_curve(points, items, bounds, threads)) return begin;
  }
  const int bit = 31 - std::countl_zero(items.front().key ^ items.back().key);
  const auto lacks_bit = [bit](const Placed& p) { return (p.key >> bit & 1) == 0; };
  return begin + (std::partition_point(items.begin(), items.end(), lacks_bit) - items.begin());
}

// Halves the largest part again and again, until a node is full or no part has more than kEnough points.
template <class Real>
PointTree::Split PointTree::split(PointsView<Real> points, std::span<Placed> order, Range range, int depth, int threads) {
  Split result{range, depth, 1, {range}};
  std::array<std::size_t, kFan> points_to_part{range.size()};  // 0: cannot be parted
  while (result.parts < kFan && depth < kDeepest) {
    const auto k = std::max_element(points_to_part.begin(), points_to_part.end()) - points_to_part.begin();
    if (points_to_part[k] <= kEnough) break;
    const auto [begin, end] = result.part[k];
    const std::size_t middle = middle_of(points, order, begin, end, threads);
    points_to_part[k] = middle - begin;
    if (middle == begin) continue;
    points_to_part[result.parts] = end - middle;
    result.part[k].end = middle;
    result.part[result.parts++] = {middle, end};
  }
  return result;
}

// The splits down to twigs, depth first.
template <class Real>
void PointTree::split_to_twigs(PointsView<Real> points, std::span<Placed> order, Range range, int depth, int threads,
                               std::vector<Split>& splits) {
  const Split parted =
      range.size() > kTwig ? split(points, order, range, depth, threads) : Split{range, depth, 1, {range}};
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
    // A child that is not there is a leaf without points, infinitely far from anywhere.
    const Range part = k < split.parts ? split.part[k] : Range{1, 1};
    const auto place = static_cast<std::uint32_t>(nodes.size() - self);
    const Grown child = k < split.parts ? grow(part) : Grown{{}, true};
    Node& node = nodes[self];
    node.begin[k] = child.is_leaf ? static_cast<std::uint32_t>(part.begin) : place;
    node.end[k] = child.is_leaf ? static_cast<std::uint32_t>(part.end) : 0;
    for (int axis = 0; axis < 3; ++axis) {
      node.lo[axis][k / Four::kCount].v[k % Four::kCount] = static_cast<float>(child.bounds.lo[axis] / unit_);
      node.hi[axis][k / Four::kCount].v[k % Four::kCount] = static_cast<float>(child.bounds.hi[axis] / unit_);
    }
    all = merged(all, child.bounds);
  }
  return {all, false};
}

template <class Real>
PointTree::Grown PointTree::grow(PointsView<Real> points, std::span<Placed> order, Range range, int depth,
                                 std::vector<Node>& nodes) {
  if (range.size() <= kLeaf) return fill_leaf(points, order, range);
  const Split parted = split(points, order, range, depth, 1);
  if (!parted.is_parted()) return fill_leaf(points, order, range);
  return join(nodes, parted, [&](Range part) { return grow(points, order, part, depth + 1, nodes); });
}

template <class Real>
PointTree::Grown PointTree::fill_leaf(PointsView<Real> points, std::span<Placed> order, Range range) {
  Bounds bounds;
  for (std::size_t i = range.begin; i < range.end; ++i) {
    rows_[i] = order[i].index;
    const Vec3 p = points[rows_[i]] - centre_;
    x_[i] = p.x, y_[i] = p.y, z_[i] = p.z;
  }
  // A loop of its own: the one above waits for memory, and the shorter it is, the more points it waits for at once.
  for (std::size_t i = range.begin; i < range.end; ++i) bounds.add({x_[i], y_[i], z_[i]});
  return {bounds, true};
}

template <class Real>
PointTree::PointTree(PointsView<Real> points, int threads)
    : x_(points.n + kOverrun), y_(points.n + kOverrun), z_(points.n + kOverrun), rows_(points.n) {
  if (points.n == 0) throw std::invalid_argument("a point tree needs at least one point");
  if (points.n > std::numeric_limits<std::uint32_t>::max()) throw std::invalid_argument("a point tree holds 2^32 points");
  const auto [bounds, sum] = survey(points.n, [&](std::size_t i) { return points[i]; }, threads);
  const Vec3 half = 0.5 * (bounds.hi - bounds.lo);
  if (!is_finite(sum) || !is_finite(half)) throw std::invalid_argument("the points of a tree must be finite");
  centre_ = bounds.lo + half;
  if (const double longest = std::max({half.x, half.y, half.z}); longest > 0) unit_ = longest;

  std::vector<Placed> order(points.n);
  parallel_blocks(points.n, kPointBlock, threads, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) order[i] = {0, static_cast<std::uint32_t>(i)};
  });
  const Range whole{0, points.n};
  std::vector<Split> splits;
  sort_along_curve<Real>(points, order, bounds, threads);
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
  const Grown root = gather(gather);
  if (root.is_leaf) join(nodes_, {whole, 0, 1, {whole}}, [&](Range) { return root; });
}

// ------------------------------------------------------------------------------------------------ asking

// The least squared distance from the query to the points, or to some of the few behind them.
inline double PointTree::least_squared(Vec3 query, std::size_t begin, std::size_t end) const {
  using Pair = Lanes<double>;
  const Pair x = Pair::all(query.x), y = Pair::all(query.y), z = Pair::all(query.z);
  Pair least = Pair::all(std::numeric_limits<double>::infinity());
  for (std::size_t i = begin; i < end; i += 4)
    for (std::size_t j = i; j < i + 4; j += Pair::kCount) {
      const Pair dx = Pair::load(&x_[j]) - x, dy = Pair::load(&y_[j]) - y, dz = Pair::load(&z_[j]) - z;
      least = min(dx * dx + dy * dy + dz * dz, least);
    }
  return std::min(least.v[0], least.v[1]);
}

template <class Collector>
void PointTree::visit(Vec3 query, Collector& collector) const {
  const Vec3 scaled{query.x / unit_, query.y / unit_, query.z / unit_};
  const Four q[3] = {Four::all(static_cast<float>(scaled.x)), Four::all(static_cast<float>(scaled.y)),
                     Four::all(static_cast<float>(scaled.z))};
  // Boxes (at most 1 in size) and query are rounded to 6e-8 of their size: with more allowed, none is taken for too far.
  const double slack = 2e-7 * (1 + std::max({std::abs(scaled.x), std::abs(scaled.y), std::abs(scaled.z)}));
  const auto limit = [&] {
    const double radius = std::sqrt(collector.bound()) / unit_ + slack;
    return static_cast<float>(radius * radius * (1 + 1e-6));  // and for the rounding of the sum
  };
  float bound = limit();
  // Children that wait: the squared distance's bits, which order as it does, over the place among all nodes' children.
  std::uint64_t stack[kFan * (kDeepest + 2)];
  int top = 0;
  for (std::uint32_t at = 0;;) {
    const Node& node = nodes_[at];
    float squared[kFan];
    unsigned near = 0;  // bit k: child k is within the bound
    for (int half = 0; half < kFan / Four::kCount; ++half) {
      Four sum = Four::all(0);
      for (int axis = 0; axis < 3; ++axis) {
        const Four outside = q[axis] - min(max(q[axis], node.lo[axis][half]), node.hi[axis][half]);
        sum = sum + outside * outside;
      }
      sum.store(squared + half * Four::kCount);
      near |= at_most(sum, bound) << half * Four::kCount;
    }
    // The nearest goes on top; to sort the others would take longer than it saves.
    const auto next_near = [&] {
      const auto k = static_cast<std::uint32_t>(std::countr_zero(near));
      near &= near - 1;
      return std::uint64_t{std::bit_cast<std::uint32_t>(squared[k])} << 32 | (at * kFan + k);
    };
    if (near) {
      std::uint64_t nearest = next_near();
      while (near) {
        const std::uint64_t child = next_near();
        const std::uint64_t nearer = std::min(nearest, child);
        stack[top++] = nearest ^ child ^ nearer;  // the other: written as a maximum, compilers make it a branch
        nearest = nearer;
      }
      stack[top++] = nearest;
    }
    for (;;) {
      if (top == 0) return;
      const std::uint64_t next = stack[--top];
      if (std::bit_cast<float>(static_cast<std::uint32_t>(next >> 32)) > bound) continue;
      const auto place = static_cast<std::uint32_t>(next);
      const std::uint32_t parent = place / kFan, begin = nodes_[parent].begin[place % kFan];
      const std::uint32_t end = nodes_[parent].end[place % kFan];
      if (end == 0) {
        at = parent + begin;
        break;
      }
      if (!(least_squared(query, begin, end) < collector.bound())) continue;
      for (std::uint32_t i = begin; i < end; ++i) {
        const Vec3 d = local(i) - query;
        collector.offer(dot(d, d), i);
      }
      bound = limit();
    }
  }
}

}  // namespace fieldalign
