// A map that grows, and is the field that scans are tracked in: voxels around the sensor, in each of them the plane of
// its points.
#pragma once

#include <span>
#include <utility>

#include "scan.hpp"

namespace fieldalign {

struct MapPlane {
  Vec3 mean, normal;     // in the world's frame
  double least, middle;  // variances across the plane, and along its shorter axis
};

// A scan's places, moved by a pose about an origin.
inline std::vector<Vec3> moved(std::span<const ScanPoint> scan, const Motion& pose, Vec3 origin) {
  std::vector<Vec3> places(scan.size());
  for (std::size_t i = 0; i < scan.size(); ++i) places[i] = pose.moved(scan[i].place()) + origin;
  return places;
}

class VoxelMap {
 public:
  static constexpr std::int32_t kNone = -1;

  explicit VoxelMap(double voxel) : voxel_(voxel), table_(14), cells_of_(table_.slots(), kNone) {}

  double voxel() const { return voxel_; }
  std::size_t size() const { return cells_.size(); }
  double count(std::int32_t cell) const { return cells_[cell].scatter.n; }

  // Points enter their voxels' sums; a voxel that has `most` of them takes no more, so that it stays where it was.
  void add(std::span<const ScanPoint> scan, const Motion& pose, double most) {
    const auto places = moved(scan, pose, {});
    find_all(places);  // so that they are at hand
    for (const Vec3 place : places) {
      const Voxel at = voxel_at(place);
      Cell& cell = cells_[at_or_new(at)];
      if (cell.scatter.n >= most) continue;
      cell.scatter.add(place - voxel_ * middle_of(at));
      cell.is_fitted = false;
    }
  }

  // The cells that pseudo points come to lie in, where these hold `fewest` points; else those of their six neighbours
  // whose mean is nearest. A wide match is by the nearest mean among the eight cells that are nearest.
  std::vector<std::int32_t> match(const std::vector<Vec3>& places, double fewest, bool is_wide) {
    std::vector<std::int32_t> cells = find_all(places);
    for (std::size_t i = 0; i < places.size(); ++i)
      if (is_wide)
        cells[i] = nearest_of_eight(places[i], fewest);
      else if (cells[i] == kNone || count(cells[i]) < fewest)
        cells[i] = nearest_of_six(places[i], fewest);
    return cells;
  }

  // The plane of a cell, fitted where points were added since.
  const MapPlane& plane(std::int32_t index) {
    Cell& cell = cells_[index];
    if (!cell.is_fitted) {
      const LeastAxis fitted = least_axis(cell.scatter.covariance());
      cell.plane = {voxel_ * middle_of(cell.at) + (1 / cell.scatter.n) * cell.scatter.sum, fitted.axis, fitted.least,
                    fitted.middle};
      cell.is_fitted = true;
    }
    return cell.plane;
  }

  // Leaves what lies within a radius; returns how many cells are left.
  std::size_t keep_within(Vec3 centre, double radius) {
    std::erase_if(cells_, [&](const Cell& cell) {
      const Vec3 away = voxel_ * middle_of(cell.at) - centre;
      return dot(away, away) > radius * radius;
    });
    rebuild();
    return size();
  }

 private:
  struct Cell {
    Voxel at;
    bool is_fitted;
    Scatter scatter;  // about the voxel's middle
    MapPlane plane;
  };
  struct Nearest {
    VoxelMap& map;
    Vec3 place;
    double fewest;
    std::int32_t cell = kNone;
    double squared = 0;

    void offer(Voxel at) {
      const std::int32_t other = map.find(at);
      if (other == kNone || map.count(other) < fewest) return;
      const Vec3 away = place - map.plane(other).mean;
      if (cell == kNone || dot(away, away) < squared) cell = other, squared = dot(away, away);
    }
  };

  // The cells around places, or none; they are on their way from memory.
  std::vector<std::int32_t> find_all(const std::vector<Vec3>& places) const {
    std::vector<std::uint64_t> keys(places.size());
    for (std::size_t i = 0; i < places.size(); ++i) {
      keys[i] = key_of(voxel_at(places[i]));
      table_.prefetch_slot(keys[i]), prefetch(&cells_of_[table_.first_slot(keys[i])]);
    }
    std::vector<std::int32_t> cells(places.size());
    for (std::size_t i = 0; i < places.size(); ++i) {
      cells[i] = cells_of_[table_.slot_of(keys[i])];
      if (cells[i] == kNone) continue;
      const char* cell = reinterpret_cast<const char*>(&cells_[cells[i]]);
      prefetch(cell), prefetch(cell + 64), prefetch(cell + 128);
    }
    return cells;
  }

  std::int32_t nearest_of_six(Vec3 place, double fewest) {
    const Voxel at = voxel_at(place);
    Nearest found{*this, place, fewest};
    for (const int step : {-1, 1}) {
      found.offer({at.x + step, at.y, at.z});
      found.offer({at.x, at.y + step, at.z});
      found.offer({at.x, at.y, at.z + step});
    }
    return found.cell;
  }

  std::int32_t nearest_of_eight(Vec3 place, double fewest) {
    const Vec3 corner = (1 / voxel_) * place;
    const Voxel low = voxel_of(corner.x - 0.5, corner.y - 0.5, corner.z - 0.5);
    Nearest found{*this, place, fewest};
    for (int k = 0; k < 8; ++k) found.offer({low.x + (k & 1), low.y + (k >> 1 & 1), low.z + (k >> 2)});
    return found.cell;
  }

  static Vec3 middle_of(Voxel at) { return {at.x + 0.5, at.y + 0.5, at.z + 0.5}; }
  Voxel voxel_at(Vec3 place) const {
    const Vec3 x = (1 / voxel_) * place;
    return voxel_of(x.x, x.y, x.z);
  }
  std::int32_t find(Voxel at) const { return cells_of_[table_.slot_of(key_of(at))]; }

  std::int32_t at_or_new(Voxel at) {
    const std::size_t slot = table_.slot_of(key_of(at));
    if (cells_of_[slot] != kNone) return cells_of_[slot];
    const auto index = static_cast<std::int32_t>(cells_.size());
    cells_.push_back({at, false, {}, {}});
    table_.fill(slot, key_of(at));
    cells_of_[slot] = index;
    if (table_.is_crowded()) rebuild();
    return index;
  }

  void rebuild() {
    table_ = VoxelTable::with_room_for(cells_.size());
    cells_of_.assign(table_.slots(), kNone);
    for (std::size_t i = 0; i < cells_.size(); ++i) {
      const std::uint64_t key = key_of(cells_[i].at);
      const std::size_t slot = table_.slot_of(key);
      table_.fill(slot, key);
      cells_of_[slot] = static_cast<std::int32_t>(i);
    }
  }

  double voxel_;
  VoxelTable table_;
  std::vector<std::int32_t> cells_of_;  // by slot
  std::vector<Cell> cells_;
};

}  // namespace fieldalign
