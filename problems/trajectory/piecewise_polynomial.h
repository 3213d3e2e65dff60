// Trajectories as piecewise polynomials in the flat outputs: position of the centre of mass in E
// (x, y, z, m) and yaw (rad).
#pragma once

#include <Eigen/Core>
#include <functional>
#include <vector>

namespace trueline {

inline constexpr int kFlatOutputs = 4;
// Derivatives that neighbouring pieces share where a path is expanded piece by piece.
inline constexpr int kMatchedDerivatives = 5;
using FlatMatrix = Eigen::Matrix<double, kFlatOutputs, Eigen::Dynamic>;

class PiecewisePolynomial {
 public:
  // Piece i runs from breaks[i] to breaks[i + 1] and is sum_j coefficients[i].col(j) (t -
  // breaks[i])^j.
  PiecewisePolynomial(std::vector<double> breaks, std::vector<FlatMatrix> coefficients);

  // A uniform B-spline: `control` holds pieces + degree points. degree - 1 derivatives are
  // continuous; a point repeated `degree` times at an end makes the flight start or end at rest.
  static PiecewisePolynomial FromSpline(const FlatMatrix& control, int degree, double duration);

  // `pieces` of equal length from 0 to `duration` (s) that agree with `expand(t)` (Taylor
  // coefficients at t) at the breaks in value and kMatchedDerivatives derivatives.
  static PiecewisePolynomial FromExpansions(const std::function<FlatMatrix(double)>& expand,
                                            double duration, int pieces);

  double start() const { return breaks_.front(); }
  double end() const { return breaks_.back(); }
  double duration() const { return end() - start(); }
  int num_pieces() const { return static_cast<int>(coefficients_.size()); }
  const std::vector<double>& breaks() const { return breaks_; }
  const std::vector<FlatMatrix>& coefficients() const { return coefficients_; }

  // Taylor coefficients at t, 4 x (order + 1), of the piece that holds t (at a break: the later).
  FlatMatrix Expand(double t, int order) const;
  // The same of a given piece.
  FlatMatrix ExpandPiece(int piece, double t, int order) const;
  int PieceAt(double t) const;

  // The trajectory about its first point, `factor` times as large (yaw too).
  PiecewisePolynomial Scaled(double factor) const;

 private:
  std::vector<double> breaks_;
  std::vector<FlatMatrix> coefficients_;
};

// Column j: Taylor coefficients about s in [0, 1], in units of one piece, of the uniform B-spline
// basis function of the j-th of the degree + 1 control points active on a piece; (order + 1) x
// (degree + 1).
Eigen::MatrixXd SplineBasis(int degree, double s, int order);

// Taylor coefficients about `offset` of the polynomial sum_j c.col(j) t^j, up to `order`.
FlatMatrix ShiftPolynomial(const FlatMatrix& c, double offset, int order);

}  // namespace trueline
