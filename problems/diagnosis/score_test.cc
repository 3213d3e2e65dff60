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

// Projects nuisances out of the reduced normal equations (Frisch-Waugh).
Projected Project(const ReducedSystem& reduced, int nuisances, int candidate, int size) {
  const Eigen::LDLT<Matrix> nn(reduced.M().topLeftCorner(nuisances, nuisances));
  const Matrix ne = reduced.M().block(0, candidate, nuisances, size);
  Projected out;
  out.gain = nn.solve(ne);
  out.rest = nn.solve(reduced.b().head(nuisances));
  out.information = reduced.M().block(candidate, candidate, size, size) - ne.transpose() * out.gain;
  out.score = reduced.b().segment(candidate, size) - ne.transpose() * out.rest;
  return out;
}

// Scores by cluster of the fit that includes the effect; they sum to zero.
Matrix ClusterScores(const ReducedSystem& system, const Projected& projected, const Vector& value,
                     int candidate) {
  const int size = static_cast<int>(value.size());
  const int nuisances = static_cast<int>(projected.rest.size());
  const auto border = system.border();
  Matrix v = Matrix::Zero(border + 1, size);
  v.topRows(nuisances) = -projected.gain;
  v.middleRows(candidate, size).setIdentity();
  Vector e = Vector::Zero(border + 1);
  e.head(nuisances) = -projected.rest - projected.gain * value;
  e.segment(candidate, size) = value;
  e[border] = 1.0;
  return system.ClusterProducts(e, v);
}

}  // namespace

double ScoreTest::z() const { return std::sqrt(std::min(chi2, chi2_cluster)); }

void ScoreTest::Judge(const Vector& whole_value, int clusters) {
  const int size = static_cast<int>(whole_value.size());
  chi2 = whole_value.dot(cov_model.ldlt().solve(whole_value));
  chi2_cluster = whole_value.dot(cov_cluster.ldlt().solve(whole_value));
  p_model = ChiSquareTail(chi2, size);
  p_cluster = FTail(chi2_cluster / size, size, std::max(1, clusters - size));
}

void ScoreTest::LimitTo(double gain) {
  chi2 = std::min(chi2, gain);
  p_model = ChiSquareTail(chi2, static_cast<double>(value.size()));
}

ScoreTest TestColumns(const ReducedSystem& system, int nuisances, int candidate,
                      const Vector& ordinary) {
  const int size = static_cast<int>(ordinary.size());
  const Projected projected = Project(system, nuisances, candidate, size);
  // A floor avoids division by zero along unobservable directions.
  const double floor = 1e-12 * std::max(1e-12, projected.information.diagonal().maxCoeff());
  const Matrix I = Matrix::Identity(size, size);
  const Matrix cov = Matrix(projected.information + floor * I).llt().solve(I);
  ScoreTest test;
  test.value = -cov * projected.score;
  const Matrix scores = ClusterScores(system, projected, test.value, candidate);
  const int clusters = static_cast<int>(scores.rows());
  const Matrix scatter =
      scores.transpose() * scores * (double(clusters) / std::max(1, clusters - size));
  const Matrix cov_cluster = cov * scatter * cov;
  test.sigma = cov.diagonal().cwiseMax(cov_cluster.diagonal()).cwiseSqrt();
  const Matrix usual = ordinary.cwiseAbs2().asDiagonal();
  test.cov_model = cov + usual;
  test.cov_cluster = cov_cluster + usual;
  test.Judge(test.value, clusters);
  return test;
}

Vector DetectableSize(const ScoreTest& test, double alpha, int clusters) {
  const int size = static_cast<int>(test.value.size());
  const double by_model = NonCentralityFor(ChiSquareCritical(alpha, size), size, 0.95);
  const double by_cluster =
      NonCentralityFor(size * FCritical(alpha, size, std::max(1, clusters - size)), size, 0.95);
  // One parameter at a time, the effect's others at zero: v^2 / model is the non-centrality.
  const Vector model = test.cov_model.inverse().diagonal().cwiseInverse();
  const Vector cluster = test.cov_cluster.inverse().diagonal().cwiseInverse();
  return (by_model * model).cwiseMax(by_cluster * cluster).cwiseSqrt();
}

}  // namespace trueline
