// L D L^T without pivots: normal equations are positive semidefinite.
#include "symmetric_solver.hpp"

namespace modar {
namespace {

constexpr double kNothing = 1e-15;  // of a diagonal, that is left of it as a pivot

}  // namespace

void decompose(int n, double* a) {
  for (int j = 0; j < n; ++j) {
    double* column = a + j * n;
    const double nothing = kNothing * column[j];
    for (int k = 0; k < j; ++k) {
      const double* before = a + k * n;
      const double weight = before[j] * before[k];  // L(j,k) D(k)
      for (int i = j; i < n; ++i) column[i] -= before[i] * weight;
    }
    if (column[j] <= nothing) column[j] *= 0.0;  // of infinity: no number
    for (int i = j + 1; i < n; ++i) column[i] = column[j] == 0.0 ? 0.0 : column[i] / column[j];
  }
}

void solve_decomposed(int n, const double* a, double* x) {
  for (int j = 0; j < n; ++j) {
    for (int i = j + 1; i < n; ++i) x[i] -= a[j * n + i] * x[j];
  }
  for (int j = n - 1; j >= 0; --j) {
    const double pivot = a[j * n + j];
    x[j] = pivot == 0.0 ? 0.0 : x[j] / pivot;
    for (int i = j + 1; i < n; ++i) x[j] -= a[j * n + i] * x[i];
  }
}

}  // namespace modar
