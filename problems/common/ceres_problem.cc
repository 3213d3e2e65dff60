#include "problems/common/ceres_problem.h"

namespace trueline {

ceres::Problem::Options ProblemOptions(ceres::EvaluationCallback* callback) {
  ceres::Problem::Options options;
  options.evaluation_callback = callback;
  return options;
}

Eigen::SparseMatrix<double> ToEigen(const ceres::CRSMatrix& crs) {
  using RowMajor = Eigen::SparseMatrix<double, Eigen::RowMajor>;
  return Eigen::Map<const RowMajor>(crs.num_rows, crs.num_cols, static_cast<int>(crs.values.size()),
                                    crs.rows.data(), crs.cols.data(), crs.values.data());
}

}  // namespace trueline
