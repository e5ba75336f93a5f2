// Intrinsic shape signatures (Zhong, ICCV Workshops 2009): points whose surroundings vary in three directions.
#pragma once

#include "point_tree.hpp"

namespace fieldalign {

struct IssSettings {
  double salient_radius, non_max_radius, gamma_21, gamma_32;
  int min_neighbours;
};

// Rows of the tree's points that are keypoints, ascending.
inline std::vector<std::uint32_t> iss_keypoints(const PointTree& tree, const IssSettings& s, int threads) {
  const std::size_t n = tree.size();
  std::vector<double> saliency(n, 0);  // the smallest eigenvalue; 0: not salient
  parallel_blocks(n, 256, threads, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      const Vec3 here = tree.local(i);
      Scatter scatter;
      Within within{s.salient_radius * s.salient_radius,
                    [&](std::uint32_t p) { scatter.add(tree.local(p) - here); }};
      tree.visit(here, within);
      if (scatter.n < s.min_neighbours) continue;
      const auto values = eigen<3>(scatter.covariance()).values;
      if (values[1] < s.gamma_21 * values[2] && values[0] < s.gamma_32 * values[1]) saliency[i] = values[0];
    }
  });
  std::vector<char> is_keypoint(n, 0);
  parallel_blocks(n, 256, threads, [&](std::size_t begin, std::size_t end) {
    for (std::size_t i = begin; i < end; ++i) {
      if (!(saliency[i] > 0)) continue;
      int neighbours = 0;
      bool largest = true;
      Within within{s.non_max_radius * s.non_max_radius, [&](std::uint32_t p) {
                      ++neighbours;
                      largest &= saliency[p] <= saliency[i];
                    }};
      tree.visit(tree.local(i), within);
      is_keypoint[i] = largest && neighbours >= s.min_neighbours;
    }
  });
  std::vector<std::uint32_t> rows;
  for (std::size_t i = 0; i < n; ++i)
    if (is_keypoint[i]) rows.push_back(tree.row(i));
  std::sort(rows.begin(), rows.end());
  return rows;
}

}  // namespace fieldalign
