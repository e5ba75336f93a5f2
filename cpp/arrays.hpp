// NumPy arrays as the bindings take and give them.
#pragma once

#include <initializer_list>
#include <stdexcept>
#include <vector>

#include <nanobind/nanobind.h>
#include <nanobind/ndarray.h>

#include "points_view.hpp"

namespace fieldalign {

namespace nb = nanobind;

template <class Real>
using Points = nb::ndarray<const Real, nb::shape<-1, 3>, nb::c_contig, nb::device::cpu>;
using Matrices4 = nb::ndarray<const double, nb::shape<-1, 4, 4>, nb::c_contig, nb::device::cpu>;
using Places = nb::ndarray<const std::uint32_t, nb::shape<-1>, nb::c_contig, nb::device::cpu>;
using Values = nb::ndarray<const double, nb::shape<-1>, nb::c_contig, nb::device::cpu>;
template <class T>
using Array = nb::ndarray<nb::numpy, T>;

template <class Real>
PointsView<Real> view(const Points<Real>& points) {
  return {points.data(), points.shape(0)};
}

// A NumPy array that owns what `values` held.
template <class T>
Array<T> array(std::vector<T>&& values, std::initializer_list<std::size_t> shape) {
  auto* kept = new std::vector<T>(std::move(values));
  nb::capsule owner(kept, [](void* p) noexcept { delete static_cast<std::vector<T>*>(p); });
  return Array<T>(kept->data(), shape, owner);
}

inline void check_lengths(std::size_t n, std::initializer_list<std::size_t> others) {
  for (const std::size_t other : others)
    if (other != n) throw std::invalid_argument("arrays differ in length");
}

}  // namespace fieldalign
