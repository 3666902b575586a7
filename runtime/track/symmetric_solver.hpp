// Small systems of normal equations. Internal to runtime/track.
#pragma once

namespace modar {

/// Solves A X = B by Eigen's L D L^T, one for all sizes up to 8: one for each size and file brought
/// 14 KB to the device. a: n x n, symmetric. x: `columns` right sides of n numbers, then their
/// solutions. What the equations do not tell is solved as 0; what is not finite makes no number.
void solve_symmetric(int n, int columns, const double* a, double* x);

/// The same for Eigen's or other matrices of fixed size by columns; answers the solutions.
template <class Matrix, class Right>
Right solve_symmetric(const Matrix& a, Right x) {
  solve_symmetric(static_cast<int>(x.rows()), static_cast<int>(x.cols()), a.data(), x.data());
  return x;
}

}  // namespace modar
