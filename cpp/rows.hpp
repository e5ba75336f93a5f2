// What is done to each pseudo point, row by row; NumPy's columns of (n, 3) arrays take ten times as long.
#pragma once

#include <cmath>
#include <cstddef>

#include "vec.hpp"

namespace fieldalign {

// points (n x 3) turned by R (3 x 3, by rows) and shifted by t.
inline void transform(const double* R, const double* t, const double* points, std::size_t n, double* moved) {
  for (std::size_t i = 0; i < n; ++i) {
    const double *p = points + 3 * i;
    for (int a = 0; a < 3; ++a) moved[3 * i + a] = R[3 * a] * p[0] + R[3 * a + 1] * p[1] + R[3 * a + 2] * p[2] + t[a];
  }
}

// The unit vectors (n x 3) away from the feet: the gradients' directions, turned about where the value is negative, so
// that signed and unsigned fields agree; zero where a gradient is.
inline void unit_rows(const double* value, const double* gradient, std::size_t n, double* unit) {
  for (std::size_t i = 0; i < n; ++i) {
    const double* g = gradient + 3 * i;
    const double length = std::sqrt(g[0] * g[0] + g[1] * g[1] + g[2] * g[2]);
    const double scale = length > 0 ? (value[i] < 0 ? -1 : 1) / length : 0;
    for (int a = 0; a < 3; ++a) unit[3 * i + a] = scale * g[a];
  }
}

// g^T [-[x]_x, I]: rows (n x 6) of x cross g, then g.
inline void moment_rows(const double* x, const double* g, std::size_t n, double* rows) {
  for (std::size_t i = 0; i < n; ++i) {
    const double *p = x + 3 * i, *v = g + 3 * i;
    double* row = rows + 6 * i;
    row[0] = p[1] * v[2] - p[2] * v[1], row[1] = p[2] * v[0] - p[0] * v[2], row[2] = p[0] * v[1] - p[1] * v[0];
    row[3] = v[0], row[4] = v[1], row[5] = v[2];
  }
}

}  // namespace fieldalign
