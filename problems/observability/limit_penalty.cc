#include "problems/observability/limit_penalty.h"

#include <cmath>

#include "problems/observability/flat_variables.h"

namespace trueline {
namespace {

constexpr int kLimitOrder = 4;  // rotor speeds need the fourth derivative
using LimitSeries = Taylor<Variable, kLimitOrder>;

// value - limit, as a share of `range`; the penalty squares the part above -`margin`.
struct Excess {
  double margin;
  Variable sum;
  void Add(const Variable& value, double limit, double range) {
    const Variable over = (value - Variable(limit)) / Variable(range) + Variable(margin);
    if (over.value() > 0.0) sum += over * over;
  }
};

Variable SquaredExcess(const FlatState<LimitSeries>& state, const FlightLimits& limits,
                       double margin) {
  Excess excess{margin, Variable()};
  const double half = 0.5 * limits.travel, rate2 = limits.rate * limits.rate;
  for (int i = 0; i < 3; ++i) {
    excess.Add(state.p[i][0], half, half);
    excess.Add(-state.p[i][0], half, half);
    excess.Add(state.w[i][0] * state.w[i][0], rate2, rate2);
  }
  // The flat map itself ends at a thrust that points sideways.
  const double cosine = std::isfinite(limits.tilt) ? std::cos(limits.tilt) : 0.0;
  excess.Add(-state.cos_tilt[0], -cosine, 1.0 - cosine);
  const DownInBody<Variable> down = DownInBodyOf<Variable>(state);
  if (std::isfinite(limits.pitch)) {
    const double square = std::pow(std::sin(limits.pitch), 2);
    excess.Add(down.x * down.x, square, square);
  }
  if (std::isfinite(limits.roll)) {  // sin(roll)^2 times cos(pitch)^2
    const double square = std::pow(std::sin(limits.roll), 2);
    const Variable across = down.y * down.y;
    excess.Add(across - Variable(square) * (across + down.z * down.z), 0.0, square);
  }
  const double low = limits.min_speed * limits.min_speed;
  const double high = limits.max_speed * limits.max_speed;
  for (const LimitSeries& u : state.u) {
    excess.Add(u[0], high, high - low);
    excess.Add(-u[0], -low, high - low);
  }
  return excess.sum;
}

}  // namespace

LimitPenalty::LimitPenalty(FlatVehicle vehicle, SplineShape shape, FlightLimits limits, double step,
                           double margin)
    : vehicle_(std::move(vehicle)),
      shape_(shape),
      limits_(limits),
      per_piece_(static_cast<int>(std::ceil(shape.duration / shape.pieces / step - 1e-9))),
      margin_(margin) {}

double LimitPenalty::Evaluate(const FlatMatrix& free, FlatMatrix* gradient) const {
  const FlatMatrix control = RestToRest(shape_, free);
  FlatMatrix adjoint = FlatMatrix::Zero(kFlatOutputs, control.cols());
  const double piece = shape_.duration / shape_.pieces;
  const int points = per_piece_ * shape_.pieces;
  double total = 0.0;
  std::vector<double> adjoints;
  for (int at = 0; at < per_piece_; ++at) {
    Eigen::MatrixXd basis = SplineBasis(shape_.degree, (at + 0.5) / per_piece_, kLimitOrder);
    for (int j = 1; j <= kLimitOrder; ++j) basis.row(j) /= std::pow(piece, j);
    for (int k = 0; k < shape_.pieces; ++k) {
      Tape::OfThread().Clear();
      const FlatMatrix expansion = control.middleCols(k, shape_.degree + 1) * basis.transpose();
      const FlatVariables<kLimitOrder> inputs(expansion);
      const Variable excess =
          SquaredExcess(StateFromFlat(vehicle_, inputs.series), limits_, margin_);
      total += excess.value() / points;
      if (gradient == nullptr || excess.entry() < 0) continue;
      Tape::OfThread().StartAdjoints(&adjoints);
      adjoints[excess.entry()] = 1.0 / points;
      Tape::OfThread().Sweep(&adjoints);
      adjoint.middleCols(k, shape_.degree + 1) += inputs.Adjoints(adjoints) * basis;
    }
  }
  if (gradient != nullptr) *gradient = adjoint.middleCols(shape_.degree, shape_.num_free());
  return total;
}

}  // namespace trueline
