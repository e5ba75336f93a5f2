// Which voxel a place lies in, and a table of the voxels that are in use.
#pragma once

#include <cstdint>
#include <vector>

#include "casts.hpp"
#include "vec.hpp"

namespace fieldalign {

struct Voxel {
  std::int32_t x, y, z;
};

// The greatest whole number not above v, of at most 2^30 either way, so that neighbours have numbers, too; std::floor is a
// call into the library on the oldest x86-64.
template <class Real>
std::int32_t whole(Real v) {
  const auto i = cast_within<std::int32_t>(v, -(1 << 30), 1 << 30);
  return i - static_cast<std::int32_t>(v < static_cast<Real>(i));
}

// Of the place x, y, z, measured in voxels.
template <class Real>
Voxel voxel_of(Real x, Real y, Real z) {
  return {whole(x), whole(y), whole(z)};
}

// Memory that is wanted soon; most of the time of a large table is waiting for it.
inline void prefetch([[maybe_unused]] const void* place) {
#if defined(__GNUC__)
  __builtin_prefetch(place);
#endif
}

// 21 bits an axis: voxels a million and more away share a key with others.
inline std::uint64_t key_of(Voxel c) {
  const auto bits = [](std::int32_t i) { return static_cast<std::uint64_t>(i + (1 << 20)) & 0x1fffff; };
  return bits(c.x) << 42 | bits(c.y) << 21 | bits(c.z);
}

// Keys in slots, by open addressing; what belongs to a key is kept by the owner under the same slot.
class VoxelTable {
 public:
  static constexpr std::uint64_t kEmpty = ~std::uint64_t{0};

  explicit VoxelTable(int bits) : keys_(std::size_t{1} << bits, kEmpty), shift_(64 - bits) {}

  std::size_t slots() const { return keys_.size(); }
  bool is_empty(std::size_t slot) const { return keys_[slot] == kEmpty; }

  void prefetch_slot(std::uint64_t key) const { prefetch(&keys_[first_slot(key)]); }
  std::size_t first_slot(std::uint64_t key) const { return key * 0x9E3779B97F4A7C15u >> shift_; }

  // Where the key is, or, in an empty slot, where it would be.
  std::size_t slot_of(std::uint64_t key) const {
    std::size_t slot = first_slot(key);
    while (keys_[slot] != key && keys_[slot] != kEmpty) slot = (slot + 1) & (keys_.size() - 1);
    return slot;
  }
  void fill(std::size_t slot, std::uint64_t key) { keys_[slot] = key, ++filled_; }

  // More than half full, searches take long.
  bool is_crowded() const { return 2 * filled_ > keys_.size(); }

  // Empty, with room for so many keys.
  static VoxelTable with_room_for(std::size_t keys) {
    int bits = 10;
    while ((std::size_t{1} << bits) < 4 * keys) ++bits;
    return VoxelTable(bits);
  }

  // The same keys in four times the room.
  VoxelTable grown() const {
    VoxelTable larger = with_room_for(filled_);
    for (const std::uint64_t key : keys_)
      if (key != kEmpty) larger.fill(larger.slot_of(key), key);
    return larger;
  }

 private:
  std::vector<std::uint64_t> keys_;
  int shift_;
  std::size_t filled_ = 0;
};

}  // namespace fieldalign
