#include "problems/diagnosis/score_test.h"

#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "problems/diagnosis/thresholds.h"
#include "problems/result/statistics.h"

namespace trueline {
namespace {

using Matrix = Eigen::MatrixXd;
using Vector = Eigen::VectorXd;
using Indices = std::vector<int>;

// The tested columns with the nuisances projected out (Frisch-Waugh).
struct Projected {
  Matrix gain;         // of the nuisances, by the tested columns
  Vector rest;         // of the nuisances, by the residual
  Matrix information;  // of the tested columns
  Vector score;
};

// A tested column that the nuisances explain wholly (a term and an effect of the same kind) carries
// no information. Rounding leaves some, and a step in it; both are replaced by next to nothing.
void LeaveOutExplained(const Vector& alone, Projected* projected) {
  for (Eigen::Index i = 0; i < alone.size(); ++i) {
    if (projected->information(i, i) > kNoInformation * alone[i]) continue;
    projected->information.row(i).setZero();
    projected->information.col(i).setZero();
    projected->information(i, i) = kNoInformation * kNoInformation * alone[i];
    projected->score[i] = 0.0;
  }
}

Projected Project(const Linearisation& fit, const Indices& nuisances, const Indices& tested) {
  const Eigen::LDLT<Matrix> nn(Matrix(fit.M()(nuisances, nuisances)));
  const Matrix ne = fit.M()(nuisances, tested);
  Projected out;
  out.gain = nn.solve(ne);
  out.rest = nn.solve(Vector(fit.b()(nuisances)));
  out.information = Matrix(fit.M()(tested, tested)) - ne.transpose() * out.gain;
  out.score = Vector(fit.b()(tested)) - ne.transpose() * out.rest;
  LeaveOutExplained(fit.M().diagonal()(tested), &out);
  return out;
}

LinearEstimate EstimateOf(const Projected& projected) {
  const auto size = projected.score.size();
  // A floor avoids division by zero along unobservable directions.
  const double floor = 1e-12 * std::max(1e-12, projected.information.diagonal().maxCoeff());
  const Matrix I = Matrix::Identity(size, size);
  LinearEstimate estimate;
  estimate.cov = Matrix(projected.information + floor * I).llt().solve(I);
  estimate.value = -estimate.cov * projected.score;
  estimate.gain = -projected.score.dot(estimate.value);
  return estimate;
}

double FreeClusters(Eigen::Index clusters, int size) {
  return std::max(1.0, static_cast<double>(clusters - size));
}

// Information by cluster about each of the tested columns.
Matrix ClusterInformation(const Linearisation& fit, const Projected& projected,
                          const Indices& nuisances, const Indices& tested) {
  const auto size = static_cast<Eigen::Index>(tested.size());
  Matrix information(fit.clusters(), size);
  for (Eigen::Index i = 0; i < size; ++i) {
    Vector v = Vector::Zero(fit.b().size() + 1);
    v(nuisances) = -projected.gain.col(i);
    v[tested[i]] = 1.0;
    information.col(i) = fit.ClusterProducts(v, v);
  }
  return information;
}

// Scores by cluster of the fit that includes the tested columns; they sum to zero.
Matrix ClusterScores(const Linearisation& fit, const Projected& projected, const Vector& value,
                     const Indices& nuisances, const Indices& tested) {
  const auto width = fit.b().size();
  Matrix v = Matrix::Zero(width + 1, value.size());
  v(nuisances, Eigen::all) = -projected.gain;
  v(tested, Eigen::all).setIdentity();
  Vector e = Vector::Zero(width + 1);
  e(nuisances) = -projected.rest - projected.gain * value;
  e(tested) = value;
  e[width] = 1.0;
  return fit.ClusterProducts(e, v);
}

}  // namespace

double OwnShare(const Linearisation& fit, const Indices& nuisances, int column) {
  return Project(fit, nuisances, {column}).information(0, 0) / fit.M()(column, column);
}

Matrix ImitatedBy(const Linearisation& fit, const Indices& nuisances, const Indices& tested,
                  const Indices& alike) {
  const Matrix information = Project(fit, nuisances, Concatenated(tested, alike)).information;
  const auto size = static_cast<Eigen::Index>(tested.size());
  const Eigen::Index rest = information.rows() - size;
  const Matrix own = information.topLeftCorner(size, size);
  const Matrix cross = information.topRightCorner(size, rest);
  const Matrix shift = own.ldlt().solve(cross);  // of the values, by an error in units of columns
  const Matrix error = information.bottomRightCorner(rest, rest).ldlt().solve(shift.transpose());
  return shift * error / static_cast<double>(rest);
}

LinearEstimate Estimate(const Linearisation& fit, const Indices& nuisances, const Indices& tested) {
  return EstimateOf(Project(fit, nuisances, tested));
}

Vector BeyondChance(const Vector& moved, const Vector& chance) {
  return (moved.cwiseAbs2() - chance).cwiseMax(0.0);
}

double ScoreTest::z() const { return std::sqrt(std::min(chi2, chi2_cluster)); }

double ScoreTest::Sharing(const Vector& size) const {
  if (information.size() == 0) return INFINITY;
  const Vector of_cluster = information * size.cwiseAbs2();
  const double sharing = std::pow(of_cluster.sum(), 2) / of_cluster.squaredNorm();
  return std::isfinite(sharing) ? sharing : 0.0;
}

double ScoreTest::DegreesOfFreedom(const Vector& size) const {
  return kTails + std::max(0.0, Sharing(size) - 1.0);
}

void ScoreTest::Judge(const Vector& whole_value) {
  const int size = static_cast<int>(whole_value.size());
  chi2 = whole_value.dot(cov_model.ldlt().solve(whole_value));
  chi2_cluster = whole_value.dot(cov_cluster.ldlt().solve(whole_value));
  // A column that overflows on this flight shows nothing.
  if (!std::isfinite(chi2) || !std::isfinite(chi2_cluster)) {
    chi2 = chi2_cluster = gain = 0.0;
    p_model = p_cluster = 1.0;
    return;
  }
  p_model = ChiSquareTail(chi2, size);
  p_cluster = FTail(chi2_cluster / size, size, FreeClusters(information.rows(), size));
}

void ScoreTest::LimitTo(double most) {
  chi2 = std::min(chi2, most);
  p_model = ChiSquareTail(chi2, static_cast<double>(value.size()));
}

void ScoreTest::Widen(const ScoreTest& beside) {
  const Vector chance = (beside.sigma.cwiseAbs2() - sigma.cwiseAbs2()).cwiseMax(0.0);
  const Vector more = BeyondChance(beside.value - value, chance);
  sigma = (sigma.cwiseAbs2() + more).cwiseSqrt();
  cov_model.diagonal() += more;
  cov_cluster.diagonal() += more;
  Judge(value);
}

void ScoreTest::Scale(const Vector& unit) {
  value = value.cwiseProduct(unit);
  sigma = sigma.cwiseProduct(unit);
  cov_model = unit.asDiagonal() * cov_model * unit.asDiagonal();
  cov_cluster = unit.asDiagonal() * cov_cluster * unit.asDiagonal();
  information = information * unit.cwiseAbs2().cwiseInverse().asDiagonal();
  scores = scores * unit.cwiseInverse().asDiagonal();
}

ScoreTest TestColumns(const Linearisation& fit, const Indices& nuisances, const Indices& tested,
                      const Vector& ordinary) {
  const int size = static_cast<int>(ordinary.size());
  const Projected projected = Project(fit, nuisances, tested);
  const LinearEstimate estimate = EstimateOf(projected);
  const Matrix& cov = estimate.cov;
  ScoreTest test;
  test.value = estimate.value;
  test.gain = estimate.gain;
  test.scores = ClusterScores(fit, projected, test.value, nuisances, tested);
  const Matrix& scores = test.scores;
  const auto clusters = static_cast<double>(scores.rows());
  const Matrix scatter =
      scores.transpose() * scores * (clusters / FreeClusters(scores.rows(), size));
  const Matrix cov_cluster = cov * scatter * cov;
  test.sigma = cov.diagonal().cwiseMax(cov_cluster.diagonal()).cwiseSqrt();
  const Matrix usual = ordinary.cwiseAbs2().asDiagonal();
  test.cov_model = cov + usual;
  test.cov_cluster = cov_cluster + usual;
  test.information = ClusterInformation(fit, projected, nuisances, tested);
  test.Judge(test.value);
  return test;
}

ScoreTest TestFound(const Linearisation& fit, const std::vector<Found>& found, std::size_t which,
                    const Indices& beside) {
  const Indices nuisances = Concatenated(fit.Beside(which), beside);
  const EffectColumns& own = fit.found[which];
  const Candidate& candidate = found[which].candidate;
  ScoreTest test =
      TestColumns(fit, nuisances, own.columns, candidate.Ordinary().cwiseQuotient(own.unit));
  test.Scale(own.unit);
  // The whole value is judged: the fitted one plus the step that the nuisance columns cause.
  test.value += found[which].value - candidate.Neutral();
  test.Judge(test.value);
  return test;
}

Vector DetectableSize(const ScoreTest& test, double alpha, const std::vector<Matrix>& errors) {
  const int size = static_cast<int>(test.value.size());
  const double by_model =
      NonCentralityFor(ChiSquareCritical(alpha, size), size, 1.0 - kSingleAlpha);
  const double by_cluster =
      NonCentralityFor(size * FCritical(alpha, size, FreeClusters(test.information.rows(), size)),
                       size, 1.0 - kSingleAlpha);
  // One parameter at a time, the effect's others at zero: v^2 / model is the non-centrality.
  const auto square = [&](const Matrix& error) -> Vector {
    const auto variance = [&](const Matrix& cov) -> Vector {
      return Matrix(cov + error).inverse().diagonal().cwiseInverse();
    };
    return (by_model * variance(test.cov_model)).cwiseMax(by_cluster * variance(test.cov_cluster));
  };
  Vector squares = square(Matrix::Zero(size, size));
  for (const Matrix& error : errors) squares = squares.cwiseMax(square(error));
  return squares.cwiseSqrt();
}

}  // namespace trueline
