#include "problems/diagnosis/residual_rows.h"

#include <cmath>

namespace trueline {

double RmsOfFixes(const BaseFlight& flight, const Eigen::VectorXd& whitened) {
  const int count = 3 * static_cast<int>(flight.plan().fixes.size());
  return std::sqrt(whitened.head(count).squaredNorm() / std::max(1, count));
}

std::vector<RowReport> RowReports(const BaseFlight& flight, const Eigen::VectorXd& before,
                                  const Eigen::VectorXd& after) {
  const FlightPlan& plan = flight.plan();
  std::vector<RowReport> rows;
  int row = 0;
  for (const std::size_t i : plan.fixes) {
    const Fix& fix = flight.log().fixes[i];
    rows.push_back({fix.t, true, fix.gate, before.segment<3>(row), after.segment<3>(row)});
    row += 3;
  }
  for (const std::size_t i : plan.forces) {
    Eigen::Vector3d b = Eigen::Vector3d::Zero(), a = b;
    b.head<2>() = before.segment<2>(row);
    a.head<2>() = after.segment<2>(row);
    rows.push_back({flight.forces()[i].t, false, -1, b, a});
    row += 2;
  }
  return rows;
}

double WhitenessOf(const std::vector<RowReport>& rows, Eigen::Vector3d RowReport::*when) {
  constexpr double kNeighbours = 0.3;  // s
  double products = 0.0, squares = 0.0;
  const RowReport* last = nullptr;
  for (const RowReport& row : rows) {
    if (!row.fix) continue;
    if (last != nullptr && SecondsBetween(last->t, row.t) < kNeighbours) {
      const Eigen::Vector3d product = (last->*when).cwiseProduct(row.*when);
      products += product.sum();
      squares += product.squaredNorm();  // its variance, also under heavy tails
    }
    last = &row;
  }
  return squares > 0.0 ? std::erfc(std::abs(products) / std::sqrt(2.0 * squares)) : 1.0;
}

}  // namespace trueline
