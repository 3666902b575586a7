// Small systems of normal equations. Internal to runtime/track.
#pragma once

namespace modar {

/// Cholesky's decomposition A = L D L^T in place. a: n x n, symmetric; its lower triangle (by
/// columns) is read, and holds L and D afterwards. What the equations do not tell (a pivot that is
/// nothing beside its diagonal) is solved as 0; what is not finite stays so.
/// One loop for all sizes: a solver of Eigen's for each brought 14 KB to the device.
void decompose(int n, double* a);

/// x: the right side, then the solution. a: of decompose().
void solve_decomposed(int n, const double* a, double* x);

/// Both for Eigen's or other fixed matrices by columns; overwrites `a`, answers the solution.
template <class Matrix, class Vector>
Vector solve_symmetric(Matrix& a, Vector x) {
  const int n = static_cast<int>(x.size());
  decompose(n, a.data());
  solve_decomposed(n, a.data(), x.data());
  return x;
}

}  // namespace modar
