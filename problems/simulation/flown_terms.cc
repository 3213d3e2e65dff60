#include "problems/simulation/flown_terms.h"

#include <cmath>
#include <memory>

#include "problems/effects/read_effects.h"

namespace trueline::simulation {
namespace {

using Of = TermQuantity;

double SquaredDistance(const TermFactor& factor, const Flow& flow) {
  return (flow.p_E.head<2>() - Eigen::Vector2d(factor.at[0], factor.at[1])).squaredNorm() /
         (factor.at[2] * factor.at[2]);
}

double HumpAt(const TermFactor& factor, const Flow& flow) {
  const double edge = factor.at.size() > 3 ? factor.at[3] : 2.0;
  return std::exp(-std::pow(std::sqrt(SquaredDistance(factor, flow)), edge));
}

// Without lag and sign.
double QuantityAt(const TermFactor& factor, const Flow& flow) {
  const double heading = std::atan2(flow.R_E_B(1, 0), flow.R_E_B(0, 0));
  switch (factor.of) {
    case Of::kSpeedX:
    case Of::kSpeedY:
    case Of::kSpeedZ:
      return flow.ground_B[static_cast<int>(factor.of) - static_cast<int>(Of::kSpeedX)];
    case Of::kRateX:
    case Of::kRateY:
    case Of::kRateZ:
      return flow.w_B[static_cast<int>(factor.of) - static_cast<int>(Of::kRateX)];
    case Of::kThrust:
      return flow.thrust - factor.at[0];
    case Of::kSine:
      return std::sin(factor.at[0] * heading);
    case Of::kCosine:
      return std::cos(factor.at[0] * heading);
    case Of::kNorth:
      return flow.p_E.x() - factor.at[0];
    case Of::kEast:
      return flow.p_E.y() - factor.at[0];
    case Of::kHeight:
      return -flow.p_E.z() - factor.at[0];
    case Of::kTime:
      return (flow.t - factor.at[0]) / factor.at[1];
    case Of::kPlace:
      return HumpAt(factor, flow);
    case Of::kSlopeNorth:
      return (flow.p_E.x() - factor.at[0]) * HumpAt(factor, flow);
    case Of::kSlopeEast:
      return (flow.p_E.y() - factor.at[1]) * HumpAt(factor, flow);
    case Of::kVoltage:
    case Of::kGateDistance:
      break;
  }
  return 0.0;
}

// A factor with its memory: the integration asks several times at one step.
class FlownFactor {
 public:
  explicit FlownFactor(const TermFactor& factor) : factor_(factor) {}

  double At(const Flow& flow) {
    double value = QuantityAt(factor_, flow);
    if (factor_.lag > 0.0) value = Lagging(value, flow.t);
    return factor_.size ? std::abs(value) : value;
  }

 private:
  double Lagging(double value, double t) {
    if (!started_) lagging_ = value;
    if (started_ && t > last_)
      lagging_ += (value - lagging_) * -std::expm1((last_ - t) / factor_.lag);
    last_ = started_ ? std::max(last_, t) : t;
    started_ = true;
    return lagging_;
  }

  TermFactor factor_;
  bool started_ = false;
  double last_ = 0.0, lagging_ = 0.0;
};

class FlownTerm {
 public:
  explicit FlownTerm(const Effect& effect) : form_(*effect.term), size_(effect["size"]) {
    for (const TermFactor& factor : form_.with) factors_.emplace_back(factor);
  }

  Vector3d InBody(const Flow& flow) {
    double size = size_;
    for (FlownFactor& factor : factors_) size *= factor.At(flow);
    if (form_.axis < 3) return size * Vector3d::Unit(form_.axis);
    return flow.R_E_B.transpose() * (size * Vector3d::Unit(form_.axis - 3));
  }

 private:
  TermForm form_;
  double size_;
  std::vector<FlownFactor> factors_;
};

}  // namespace

Effect ReadFlownTerm(const YamlMap& entry) {
  Effect effect = ReadTerm(entry);
  if (effect.term->on != TermOn::kForce && effect.term->on != TermOn::kTurn) {
    entry.Fail("where", "cannot be flown: the simulator takes forces and moments; leave it out");
  }
  for (const TermFactor& factor : effect.term->with) {
    if (factor.of != Of::kVoltage) continue;
    entry.Fail("with", "cannot be flown: the simulator has no battery; leave the term out");
  }
  return effect;
}

void AddTerms(const std::vector<Effect>& terms, Stages* stages) {
  for (const Effect& effect : terms) {
    const auto term = std::make_shared<FlownTerm>(effect);
    auto& stage = effect.term->on == TermOn::kForce ? stages->force : stages->turn;
    stage.push_back([term](const Flow& flow, Vector3d* sum) { *sum += term->InBody(flow); });
  }
}

}  // namespace trueline::simulation
