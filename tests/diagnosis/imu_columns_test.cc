#include "problems/diagnosis/imu_columns.h"

#include <gtest/gtest.h>

#include <limits>

namespace trueline {
namespace {

// A fix 14 km away made one column infinite, and the tests of all other columns no numbers.
TEST(FreeColumns, AColumnThatOverflowsCarriesNoInformation) {
  Eigen::MatrixXd rows = Eigen::MatrixXd::Ones(4, 3);
  rows(2, 1) = std::numeric_limits<double>::infinity();
  rows(3, 1) = std::numeric_limits<double>::quiet_NaN();
  const Columns columns = FreeColumns(rows);
  EXPECT_EQ(columns.d_rows.col(0), Eigen::VectorXd::Ones(4));
  EXPECT_EQ(columns.d_rows.col(1), Eigen::VectorXd::Zero(4));
  EXPECT_EQ(columns.d_rows.col(2), Eigen::VectorXd::Ones(4));
}

}  // namespace
}  // namespace trueline
