#include "problems/diagnosis/score_test.h"

#include <Eigen/Cholesky>
#include <cmath>

#include "problems/result/distributions.h"

namespace trueline {
namespace {

using Matrix = Eigen::MatrixXd;
using Vector = Eigen::VectorXd;

struct Projected {
  Matrix gain;         // nuisances that go with the candidate's parameters
  Vector rest;         // nuisances that go with the residual
  Matrix information;  // of the candidate's parameters
  Vector score;
};

// Nuisances out of the reduced normal equations (Frisch-Waugh).
Projected Project(const Reduced& reduced, int nuisances, int candidate, int size) {
  const Eigen::LDLT<Matrix> nn(reduced.M.topLeftCorner(nuisances, nuisances));
  const Matrix ne = reduced.M.block(0, candidate, nuisances, size);
  Projected out;
  out.gain = nn.solve(ne);
  out.rest = nn.solve(reduced.b.head(nuisances));
  out.information = reduced.M.block(candidate, candidate, size, size) - ne.transpose() * out.gain;
  out.score = reduced.b.segment(candidate, size) - ne.transpose() * out.rest;
  return out;
}

// Scores by cluster of the fit with the effect in it; they add up to zero.
Matrix ClusterScores(const ChainSystem& system, const Projected& projected, const Vector& value,
                     int candidate) {
  const int size = static_cast<int>(value.size());
  const int nuisances = static_cast<int>(projected.rest.size());
  Matrix v = Matrix::Zero(system.border() + 1, size);
  v.topRows(nuisances) = -projected.gain;
  v.middleRows(candidate, size).setIdentity();
  Vector e = Vector::Zero(system.border() + 1);
  e.head(nuisances) = -projected.rest - projected.gain * value;
  e.segment(candidate, size) = value;
  e[system.border()] = 1.0;
  return system.ClusterProducts(e, v);
}

}  // namespace

ScoreTest TestColumns(const ChainSystem& system, int nuisances, int candidate, int size) {
  const Projected projected = Project(system.reduced(), nuisances, candidate, size);
  ScoreTest test;
  test.information = projected.information;
  // Directions that the flight does not show at all must not divide by zero.
  const double floor = 1e-12 * std::max(1e-12, projected.information.diagonal().maxCoeff());
  const Matrix information = projected.information + floor * Matrix::Identity(size, size);
  const Matrix cov = information.llt().solve(Matrix::Identity(size, size));
  test.value = -cov * projected.score;
  test.chi2 = projected.score.dot(cov * projected.score);
  test.p_model = ChiSquareTail(test.chi2, size);

  const Matrix scores = ClusterScores(system, projected, test.value, candidate);
  const int clusters = static_cast<int>(scores.rows());
  const int freedom = std::max(1, clusters - size);
  const Matrix scatter = scores.transpose() * scores * (double(clusters) / freedom);
  const Matrix cov_cluster = cov * scatter * cov;
  test.sigma = cov.diagonal().cwiseMax(cov_cluster.diagonal()).cwiseSqrt();
  const Eigen::LDLT<Matrix> wald(cov_cluster + 1e-12 * cov);
  const double f = test.value.dot(wald.solve(test.value)) / size;
  test.p_cluster = FTail(f, size, freedom);
  test.inflation = std::max(1.0, test.chi2 / std::max(1e-12, f * size));
  return test;
}

Eigen::VectorXd DetectableSize(const ScoreTest& test, double alpha, int clusters) {
  const int size = static_cast<int>(test.value.size());
  const double critical =
      std::max(ChiSquareCritical(alpha, size),
               size * FCritical(alpha, size, std::max(1, clusters - size)));
  const double lambda = NonCentralityFor(critical, size, 0.95);
  // One parameter at a time, the effect's others at zero.
  const Vector model = test.information.diagonal().cwiseMax(1e-300).cwiseInverse();
  const Vector spread = test.sigma.cwiseAbs2().cwiseQuotient(
      (test.information + 1e-12 * test.information.diagonal().maxCoeff() *
                              Matrix::Identity(size, size))
          .inverse()
          .diagonal()
          .cwiseMax(1e-300));
  return (lambda * model.cwiseProduct(spread)).cwiseSqrt();
}

}  // namespace trueline
