// The one decomposition that all normal equations share.
#include "symmetric_solver.hpp"

#include <Eigen/Cholesky>
#include <Eigen/Core>

namespace modar {

void solve_symmetric(int n, int columns, const double* a, double* x) {
  // The unknowns that a smaller system lacks are zero, and tell nothing of the others.
  using Square = Eigen::Matrix<double, 8, 8>;
  using Column = Eigen::Matrix<double, 8, 1>;
  Square padded = Square::Identity();
  padded.topLeftCorner(n, n) = Eigen::Map<const Eigen::MatrixXd>(a, n, n);
  const Eigen::LDLT<Square> solver(padded);
  for (int k = 0; k < columns; ++k) {
    Eigen::Map<Eigen::VectorXd> column(x + k * n, n);
    Column right = Column::Zero();
    right.head(n) = column;
    column = Column(solver.solve(right)).head(n);
  }
}

}  // namespace modar
