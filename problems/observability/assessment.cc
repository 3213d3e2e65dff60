#include "problems/observability/assessment.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>

namespace trueline {
namespace {

constexpr double kUnseen = 1e-13;  // of the largest eigenvalue, columns scaled to unit diagonal
constexpr double kUseless = 1e3;   // a sigma above so many typical sizes counts as infinite
constexpr double kInfinity = std::numeric_limits<double>::infinity();

// Factors that scale the diagonal to one; zero columns stay zero.
Eigen::VectorXd UnitDiagonalScale(const Eigen::MatrixXd& matrix) {
  return matrix.diagonal().unaryExpr(
      [](double value) { return value > 0.0 ? 1.0 / std::sqrt(value) : 1.0; });
}

// Zeroes rounding errors of states that no output depends on: scaled to unit diagonal they would
// look like information.
void DropUseless(const std::vector<int>& states, const std::vector<StateInfo>& info,
                 Eigen::MatrixXd* information) {
  for (std::size_t i = 0; i < states.size(); ++i) {
    const double useless = kUseless * info[states[i]].typical;
    if ((*information)(i, i) * useless * useless >= 1.0) continue;
    information->row(i).setZero();
    information->col(i).setZero();
  }
}

Eigen::MatrixXd PseudoInverse(const Eigen::MatrixXd& matrix) {
  const Eigen::VectorXd scale = UnitDiagonalScale(matrix);
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(scale.asDiagonal() * matrix *
                                                             scale.asDiagonal());
  const Eigen::VectorXd& values = eigen.eigenvalues();
  const double cut = kUnseen * values.tail<1>()[0];
  const Eigen::VectorXd inverse =
      values.unaryExpr([cut](double value) { return value > cut ? 1.0 / value : 0.0; });
  const Eigen::MatrixXd vectors = scale.asDiagonal() * eigen.eigenvectors();
  return vectors * inverse.asDiagonal() * vectors.transpose();
}

}  // namespace

Assessment Assess(const Eigen::MatrixXd& information, const std::vector<int>& states,
                  const std::vector<StateInfo>& info) {
  Eigen::MatrixXd asked = information(states, states);
  DropUseless(states, info, &asked);
  const Eigen::VectorXd scale = UnitDiagonalScale(asked);
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(scale.asDiagonal() * asked *
                                                             scale.asDiagonal());
  const Eigen::VectorXd root = eigen.eigenvalues().cwiseMax(0.0).cwiseSqrt();
  Eigen::MatrixXd scaled_root = Eigen::MatrixXd::Zero(states.size(), information.cols());
  Eigen::MatrixXd physical_root = scaled_root;
  for (std::size_t j = 0; j < states.size(); ++j) {
    scaled_root.col(states[j]) = root.cwiseProduct(eigen.eigenvectors().row(j).transpose());
    physical_root.col(states[j]) = scaled_root.col(states[j]) / scale[j];
  }
  Assessment result;
  result.rank = NumericalRank(scaled_root, states, std::sqrt(kUnseen));
  FillDirections(physical_root, info, &result.rank);
  const Eigen::MatrixXd covariance = PseudoInverse(asked);
  for (std::size_t i = 0; i < states.size(); ++i) {
    const bool seen = result.rank.StatusOf(states[i]) == "ok";
    const double sigma = std::sqrt(covariance(i, i));
    const bool useful = sigma <= kUseless * info[states[i]].typical;
    result.sigma.push_back(seen && useful ? sigma : kInfinity);
  }
  return result;
}

std::vector<double> SigmasOf(const Assessment& assessment, const std::vector<int>& interest) {
  const std::vector<int>& states = assessment.rank.states;
  std::vector<double> sigmas;
  for (const int state : interest) {
    const auto at = std::find(states.begin(), states.end(), state);
    sigmas.push_back(assessment.sigma[at - states.begin()]);
  }
  return sigmas;
}

Eigen::MatrixXd SchurComplement(const Eigen::MatrixXd& information, const std::vector<int>& kept,
                                const std::vector<int>& dropped) {
  Eigen::MatrixXd own = information(kept, kept);
  if (dropped.empty()) return own;
  const Eigen::MatrixXd cross = information(kept, dropped);
  const Eigen::MatrixXd left =
      own - cross * PseudoInverse(information(dropped, dropped)) * cross.transpose();
  return 0.5 * (left + left.transpose());
}

GramianScores ScoreGramian(const Eigen::MatrixXd& gramian) {
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(gramian);
  const Eigen::VectorXd values = eigen.eigenvalues().cwiseMax(0.0);
  GramianScores scores;
  scores.sigma_min = values[0];
  scores.condition = values[0] > 0.0 ? values.tail<1>()[0] / values[0] : kInfinity;
  scores.log10_determinant = values.array().log10().sum();
  const Eigen::VectorXd inverse = values.cwiseInverse();
  for (Eigen::Index i = 0; i < gramian.rows(); ++i) {
    const Eigen::VectorXd part = eigen.eigenvectors().row(i).transpose().cwiseAbs2();
    const double variance = (part.array() > 1e-24).select(part.cwiseProduct(inverse), 0.0).sum();
    scores.per_state.push_back(1.0 / variance);
  }
  return scores;
}

GramianScores ScoreStates(const Eigen::MatrixXd& gramian, const std::vector<int>& interest,
                          const std::vector<int>& asked, const std::vector<double>& scale) {
  const Eigen::Map<const Eigen::VectorXd> d(scale.data(), static_cast<Eigen::Index>(scale.size()));
  const Eigen::MatrixXd scaled = d.asDiagonal() * gramian * d.asDiagonal();
  return ScoreGramian(SchurComplement(scaled, interest, Others(asked, interest)));
}

std::vector<int> Others(const std::vector<int>& asked, const std::vector<int>& interest) {
  std::vector<int> others;
  for (const int state : asked) {
    if (std::find(interest.begin(), interest.end(), state) == interest.end()) {
      others.push_back(state);
    }
  }
  return others;
}

}  // namespace trueline
