#include "problems/trajectory/piecewise_polynomial.h"

#include <glog/logging.h>

#include <Eigen/LU>
#include <algorithm>
#include <cmath>

namespace trueline {
namespace {

// Cox-de Boor on the integer knots, as polynomials in s on one piece: column j the coefficients of
// the basis function of the j-th active control point.
Eigen::MatrixXd UniformBasis(int degree) {
  Eigen::MatrixXd basis = Eigen::MatrixXd::Ones(1, 1);
  for (int d = 1; d <= degree; ++d) {
    Eigen::MatrixXd next = Eigen::MatrixXd::Zero(d + 1, d + 1);
    for (int j = 0; j < d; ++j) {  // point j of degree d - 1 gives (1 - w) to j, w to j + 1
      const double w0 = (d - 1.0 - j) / d, w1 = 1.0 / d;
      next.col(j).head(d) += (1.0 - w0) * basis.col(j);
      next.col(j).tail(d) -= w1 * basis.col(j);
      next.col(j + 1).head(d) += w0 * basis.col(j);
      next.col(j + 1).tail(d) += w1 * basis.col(j);
    }
    basis = next;
  }
  return basis;
}

// Coefficients n + 1 ... 2 n + 1 that make a piece of length h end at `end`, given the first n + 1.
FlatMatrix HermitePiece(const FlatMatrix& start, const FlatMatrix& end, double h) {
  const auto n = start.cols();
  FlatMatrix piece = FlatMatrix::Zero(kFlatOutputs, 2 * n);
  for (Eigen::Index j = 0; j < n; ++j) piece.col(j) = start.col(j) * std::pow(h, j);
  FlatMatrix missing = -ShiftPolynomial(piece, 1.0, static_cast<int>(n) - 1);
  for (Eigen::Index j = 0; j < n; ++j) missing.col(j) += end.col(j) * std::pow(h, j);
  Eigen::MatrixXd binomials(n, n);  // of power n + j, derivative i, at 1
  for (Eigen::Index j = 0; j < n; ++j) {
    double value = 1.0;
    for (Eigen::Index i = 0; i < n; ++i) {
      binomials(i, j) = value;
      value *= static_cast<double>(n + j - i) / static_cast<double>(i + 1);
    }
  }
  piece.rightCols(n) = binomials.partialPivLu().solve(missing.transpose()).transpose();
  for (Eigen::Index j = 0; j < 2 * n; ++j) piece.col(j) /= std::pow(h, j);
  return piece;
}

}  // namespace

FlatMatrix ShiftPolynomial(const FlatMatrix& c, double offset, int order) {
  FlatMatrix shifted = c;
  const Eigen::Index n = c.cols();
  for (Eigen::Index i = 0; i < std::min<Eigen::Index>(n, order + 1); ++i) {
    for (Eigen::Index j = n - 2; j >= i; --j) shifted.col(j) += offset * shifted.col(j + 1);
  }
  FlatMatrix result = FlatMatrix::Zero(kFlatOutputs, order + 1);
  const auto kept = std::min<Eigen::Index>(n, order + 1);
  result.leftCols(kept) = shifted.leftCols(kept);
  return result;
}

Eigen::MatrixXd SplineBasis(int degree, double s, int order) {
  const Eigen::MatrixXd basis = UniformBasis(degree);
  Eigen::MatrixXd result(order + 1, degree + 1);
  for (int first = 0; first <= degree; first += kFlatOutputs) {
    FlatMatrix batch = FlatMatrix::Zero(kFlatOutputs, degree + 1);
    const int count = std::min(kFlatOutputs, degree + 1 - first);
    batch.topRows(count) = basis.middleCols(first, count).transpose();
    result.middleCols(first, count) = ShiftPolynomial(batch, s, order).topRows(count).transpose();
  }
  return result;
}

PiecewisePolynomial::PiecewisePolynomial(std::vector<double> breaks,
                                         std::vector<FlatMatrix> coefficients)
    : breaks_(std::move(breaks)), coefficients_(std::move(coefficients)) {
  CHECK_EQ(breaks_.size(), coefficients_.size() + 1);
  CHECK(!coefficients_.empty());
  CHECK(std::is_sorted(breaks_.begin(), breaks_.end()));
}

PiecewisePolynomial PiecewisePolynomial::FromSpline(const FlatMatrix& control, int degree,
                                                    double duration) {
  const int pieces = static_cast<int>(control.cols()) - degree;
  CHECK_GT(pieces, 0);
  const double h = duration / pieces;
  const Eigen::MatrixXd basis = SplineBasis(degree, 0.0, degree);
  std::vector<double> breaks = {0.0};
  std::vector<FlatMatrix> coefficients;
  for (int i = 0; i < pieces; ++i) {
    FlatMatrix c = control.middleCols(i, degree + 1) * basis.transpose();
    for (int j = 1; j <= degree; ++j) c.col(j) /= std::pow(h, j);
    coefficients.push_back(c);
    breaks.push_back((i + 1) * h);
  }
  return {breaks, coefficients};
}

PiecewisePolynomial PiecewisePolynomial::FromExpansions(
    const std::function<FlatMatrix(double)>& expand, double duration, int pieces) {
  const auto at = [&](double t) { return expand(t).leftCols(kMatchedDerivatives + 1).eval(); };
  std::vector<double> breaks{0.0};
  std::vector<FlatMatrix> coefficients;
  for (int i = 1; i <= pieces; ++i) {
    const double before = breaks.back(), now = i * duration / pieces;
    coefficients.push_back(HermitePiece(at(before), at(now), now - before));
    breaks.push_back(now);
  }
  return {breaks, coefficients};
}

int PiecewisePolynomial::PieceAt(double t) const {
  const auto after = std::upper_bound(breaks_.begin(), breaks_.end(), t);
  return std::clamp(static_cast<int>(after - breaks_.begin()) - 1, 0, num_pieces() - 1);
}

FlatMatrix PiecewisePolynomial::Expand(double t, int order) const {
  return ExpandPiece(PieceAt(t), t, order);
}

FlatMatrix PiecewisePolynomial::ExpandPiece(int piece, double t, int order) const {
  return ShiftPolynomial(coefficients_[piece], t - breaks_[piece], order);
}

PiecewisePolynomial PiecewisePolynomial::Scaled(double factor) const {
  const Eigen::Vector4d origin = coefficients_.front().col(0);
  std::vector<FlatMatrix> scaled = coefficients_;
  for (FlatMatrix& c : scaled) {
    c *= factor;
    c.col(0) += (1.0 - factor) * origin;
  }
  return {breaks_, scaled};
}

}  // namespace trueline
