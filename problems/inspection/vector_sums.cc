#include "problems/inspection/vector_sums.h"

#include <Eigen/Dense>

#include "problems/inspection/clear.h"

namespace trueline {

double Correlation(const VectorSums& sums, bool any_turn) {
  if (!(sums.n >= kFewest) || !(sums.Scale() > 0.0)) return 0.0;
  const Eigen::Matrix3d h = sums.Cov();
  const double shared =
      any_turn ? Eigen::JacobiSVD<Eigen::Matrix3d>(h).singularValues().sum() : h.trace();
  return shared / sums.Scale();
}

double CorrelationUnder(const Eigen::Matrix3d& turn, const VectorSums& block) {
  constexpr double kFewestOfBlock = 10.0;  // pairs
  if (block.n < kFewestOfBlock || !(block.Scale() > 0.0)) return std::nan("");
  return (turn.transpose() * block.Cov()).trace() / block.Scale();
}

double PlainCorrelation(const VectorSums& sums) {
  const Eigen::Matrix3d h = sums.Cov();
  double best = -1.0;
  for (const Eigen::Matrix3d& m : SignedPermutations()) {
    best = std::max(best, m.cwiseProduct(h).sum() / sums.Scale());
  }
  return best;
}

TurnFit FitTurn(const VectorSums& sums) {
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(sums.Cov(),
                                              Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Matrix3d &u = svd.matrixU(), &v = svd.matrixV();
  TurnFit turn;
  turn.best = u * v.transpose();
  const double sign = turn.best.determinant() > 0.0 ? 1.0 : -1.0;
  turn.rotation = u * Eigen::Vector3d(1.0, 1.0, sign).asDiagonal() * v.transpose();
  turn.mirrored = u * Eigen::Vector3d(1.0, 1.0, -sign).asDiagonal() * v.transpose();
  turn.third = sign * 2.0 * svd.singularValues()[2] / sums.Scale();
  return turn;
}

BlocksOfSums BlockSums(const std::vector<VectorPair>& pairs, double from, double to) {
  BlocksOfSums blocks;
  for (const VectorPair& pair : pairs) {
    const double share = (pair.t - from) / std::max(1e-9, to - from);
    const int block = std::clamp(static_cast<int>(share * kBlocks), 0, kBlocks - 1);
    blocks[static_cast<std::size_t>(block)].Add(pair);
  }
  return blocks;
}

VectorSums Total(const BlocksOfSums& blocks) {
  VectorSums total;
  for (const VectorSums& block : blocks) total += block;
  return total;
}

VectorSums SumOf(const std::vector<VectorPair>& pairs) {
  VectorSums sums;
  for (const VectorPair& pair : pairs) sums.Add(pair);
  return sums;
}

LagLine FitLagLine(const std::vector<Eigen::Vector2d>& points) {
  if (points.size() < 5) return {};
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (const auto& p : points) mean += p / static_cast<double>(points.size());
  double tt = 0.0, tl = 0.0, rest = 0.0;
  for (const auto& p : points) {
    tt += std::pow(p[0] - mean[0], 2);
    tl += (p[0] - mean[0]) * (p[1] - mean[1]);
  }
  const double slope = tl / tt;
  for (const auto& p : points) rest += std::pow(p[1] - mean[1] - slope * (p[0] - mean[0]), 2);
  return {slope, std::sqrt(rest / static_cast<double>(points.size() - 2) / tt)};
}

double BlockMiddle(std::size_t block, double span) {
  return (static_cast<double>(block) + 0.5) * span / kBlocks;
}

}  // namespace trueline
