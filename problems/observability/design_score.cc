#include "problems/observability/design_score.h"

#include <Eigen/Eigenvalues>
#include <algorithm>
#include <cmath>
#include <limits>

#include "problems/common/parallel.h"
#include "problems/observability/assessment.h"
#include "problems/observability/e2log.h"
#include "problems/observability/lie_derivatives.h"
#include "problems/trajectory/limits.h"

namespace trueline {
namespace {

constexpr int kScoreOrder = 3;  // of E2LOG in the design; the result's score is the exact Gramian's
using System = RotorDrivenSystem;
using GramianMatrix = Eigen::Matrix<double, System::kErrors, System::kErrors>;

struct SegmentState {
  LocalSensitivity<double, System::kErrors> local;
  GramianMatrix gramian, transition, after;  // W_k, Phi_k, V_{k+1}
};

// Adjoint of one segment's flat Taylor coefficients (4 x (kScoreOrder + 5)), given those of W and
// Phi.
FlatMatrix SweepSegment(const RotorDrivenSystem& system, const RotorFlight& flight,
                        const DesignTarget& target, const SegmentTimes& time,
                        const SegmentState& state, const GramianMatrix& adjoint_gramian) {
  Tape::OfThread().Clear();
  const FlatVariables<kScoreOrder + 4> inputs(
      flight.path().ExpandPiece(time.piece, time.start, kScoreOrder + 4));
  const auto start =
      StartFromFlat<Variable, kScoreOrder>(flight.vehicle(), flight.parameters(), inputs.series);
  const RotorSumsSystem by_sums(system);
  const auto local = ExpandSensitivity<kScoreOrder, Variable>(
      by_sums, start.x, by_sums.Inputs(start.u), time.duration);

  std::vector<double> adjoints;
  Tape::OfThread().StartAdjoints(&adjoints);
  const auto seed = [&](const Variable& variable, double adjoint) {
    if (variable.entry() >= 0) adjoints[variable.entry()] += adjoint;
  };
  const Quadrature& rule = GaussLegendre<kScoreOrder + 1>();
  const Eigen::Map<const Eigen::VectorXd> weights(target.weights.data(), system.num_outputs());
  for (std::size_t g = 0; g < rule.nodes.size(); ++g) {
    const double t = rule.nodes[g] * time.duration;
    const Eigen::MatrixXd adjoint_k =
        2.0 * rule.weights[g] * time.duration *
        (weights.asDiagonal() *
         (weights.asDiagonal() * SensitivityAt<System::kErrors>(state.local, t) * adjoint_gramian));
    double power = 1.0;
    for (int i = 0; i <= kScoreOrder; ++i, power *= t) {
      for (Eigen::Index r = 0; r < adjoint_k.rows(); ++r) {
        for (int c = 0; c < System::kErrors; ++c) {
          seed(local.gradients[i](r, c), adjoint_k(r, c) * power);
        }
      }
    }
  }
  const GramianMatrix adjoint_transition = 2.0 * state.after * state.transition * adjoint_gramian;
  for (int r = 0; r < System::kMovingErrors; ++r) {
    for (int c = 0; c < System::kErrors; ++c)
      seed(local.transition(r, c), adjoint_transition(r, c));
  }
  Tape::OfThread().Sweep(&adjoints);
  return inputs.Adjoints(adjoints);
}

SegmentState ExpandSegment(const RotorDrivenSystem& system, const RotorFlight& flight,
                           const DesignTarget& target, const SegmentTimes& time) {
  const auto flat = FlatSeries<Taylor<double, kScoreOrder + 4>>(
      flight.path().ExpandPiece(time.piece, time.start, kScoreOrder + 4));
  const auto start =
      StartFromFlat<double, kScoreOrder>(flight.vehicle(), flight.parameters(), flat);
  SegmentState state;
  const RotorSumsSystem by_sums(system);
  state.local = ExpandSensitivity<kScoreOrder, double>(by_sums, start.x, by_sums.Inputs(start.u),
                                                       time.duration);
  state.gramian =
      LocalGramian<System::kErrors, kScoreOrder>(state.local, target.weights, time.duration);
  state.transition = state.local.transition;
  return state;
}

}  // namespace

DesignTarget TargetOf(const RotorDrivenSystem& system, const std::vector<std::string>& show,
                      const std::vector<std::string>& free, bool by_noise,
                      const std::function<void(const char*, const std::string&)>& fail) {
  const auto named = [&](const char* key, const std::vector<std::string>& names) {
    return ConstantsNamed(system.errors(), names,
                          [&](const std::string& text) { fail(key, text); });
  };
  DesignTarget target;
  target.interest = named("show", show);
  target.asked = system.PaperStates();
  AddStates(named("free", free), &target.asked);
  target.weights = system.OutputWeights();
  if (!by_noise) target.weights.assign(target.weights.size(), 1.0);
  return target;
}

SoftMinimum LogSoftMinimum(const Eigen::MatrixXd& gramian, const DesignTarget& target) {
  constexpr double kPower = 6.0;
  const Eigen::Map<const Eigen::VectorXd> scale(target.scale.data(), gramian.rows());
  const Eigen::MatrixXd scaled = scale.asDiagonal() * gramian * scale.asDiagonal();
  const std::vector<int> others = Others(target.asked, target.interest);
  const Eigen::MatrixXd left = SchurComplement(scaled, target.interest, others);
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> eigen(left);
  const Eigen::VectorXd values = eigen.eigenvalues().cwiseMax(1e-300);
  const Eigen::ArrayXd ratio = (values[0] / values.array()).pow(kPower);
  SoftMinimum result;
  result.log_value = std::log(values[0]) - std::log(ratio.sum()) / kPower;
  const Eigen::VectorXd share = (ratio / ratio.sum() / values.array()).matrix();
  const Eigen::MatrixXd inner =
      eigen.eigenvectors() * share.asDiagonal() * eigen.eigenvectors().transpose();

  // Marginalised = A - B D^-1 B' = T' W T with T = (I, -D^-1 B'): its change is <T inner T', dW>.
  Eigen::MatrixXd lift = Eigen::MatrixXd::Zero(gramian.rows(), target.interest.size());
  for (std::size_t i = 0; i < target.interest.size(); ++i) lift(target.interest[i], i) = 1.0;
  if (!others.empty()) {
    const Eigen::MatrixXd own = scaled(others, others), cross = scaled(others, target.interest);
    const Eigen::MatrixXd solved = own.selfadjointView<Eigen::Lower>().ldlt().solve(cross);
    for (std::size_t i = 0; i < others.size(); ++i) lift.row(others[i]) = -solved.row(i);
  }
  lift = scale.asDiagonal() * lift;
  result.gradient = lift * inner * lift.transpose();
  return result;
}

DesignScore::DesignScore(RotorDrivenSystem system, std::vector<double> parameters,
                         SplineShape shape, DesignTarget target, int threads)
    : system_(std::move(system)),
      parameters_(std::move(parameters)),
      shape_(shape),
      target_(std::move(target)),
      threads_(threads) {}

double DesignScore::Evaluate(const FlatMatrix& free, FlatMatrix* gradient) const {
  const RotorFlight flight({system_.model(), parameters_}, SplinePath(shape_, free));
  const std::vector<SegmentTimes> times = SplitIntoSegments(flight.path(), target_.segment);
  const int count = static_cast<int>(times.size());
  std::vector<SegmentState> states(count);
  ParallelFor(count, threads_,
              [&](int k) { states[k] = ExpandSegment(system_, flight, target_, times[k]); });
  GramianMatrix total = GramianMatrix::Zero();
  for (int k = count - 1; k >= 0; --k) {
    states[k].after = total;
    total = states[k].gramian + states[k].transition.transpose() * total * states[k].transition;
  }
  if (!total.allFinite()) return -std::numeric_limits<double>::infinity();
  const SoftMinimum score = LogSoftMinimum(0.5 * (total + total.transpose()), target_);
  if (gradient == nullptr) return score.log_value;

  std::vector<GramianMatrix> adjoints(count);
  adjoints[0] = score.gradient;
  for (int k = 0; k + 1 < count; ++k) {
    adjoints[k + 1] = states[k].transition * adjoints[k] * states[k].transition.transpose();
  }
  std::vector<FlatMatrix> local(count);
  ParallelFor(count, threads_, [&](int k) {
    local[k] = SweepSegment(system_, flight, target_, times[k], states[k], adjoints[k]);
  });
  FlatMatrix control = FlatMatrix::Zero(kFlatOutputs, shape_.num_control());
  const double piece = shape_.duration / shape_.pieces;
  for (int k = 0; k < count; ++k) {
    const double s = (times[k].start - flight.path().breaks()[times[k].piece]) / piece;
    Eigen::MatrixXd basis = SplineBasis(shape_.degree, s, kScoreOrder + 4);
    for (int j = 1; j <= kScoreOrder + 4; ++j) basis.row(j) /= std::pow(piece, j);
    control.middleCols(times[k].piece, shape_.degree + 1) += local[k] * basis;
  }
  *gradient = control.middleCols(shape_.degree, shape_.num_free());
  return score.log_value;
}

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
