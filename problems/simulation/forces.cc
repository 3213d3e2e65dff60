#include "problems/simulation/forces.h"

#include <fmt/ranges.h>

#include <algorithm>
#include <cmath>
#include <memory>
#include <numbers>

#include "problems/effects/declaration.h"
#include "problems/result/yaml_text.h"

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

void AddTerm(const Effect& term, Stages* stages) {
  const auto flown = std::make_shared<FlownTerm>(term);
  auto& stage = term.term->on == TermOn::kForce ? stages->force : stages->turn;
  stage.push_back([flown](const Flow& flow, Vector3d* sum) { *sum += flown->InBody(flow); });
}

namespace {

const std::vector<std::string> kAxes = {"x_B", "y_B", "z_B", "north", "east", "down"};
const std::vector<std::string> kVariables = {"forward speed", "sideways speed", "sink rate",
                                             "roll rate",     "pitch rate",     "yaw rate"};

constexpr int kDigits = 12;  // in files

int IndexIn(const std::vector<std::string>& names, const std::string& name) {
  const auto at = std::find(names.begin(), names.end(), name);
  return at == names.end() ? -1 : static_cast<int>(at - names.begin());
}

// The variables of a product "a * b".
std::vector<int> Factors(const YamlMap& map, std::string product) {
  std::vector<int> factors;
  while (!product.empty()) {
    const std::size_t end = std::min(product.find(" * "), product.size());
    factors.push_back(IndexIn(kVariables, product.substr(0, end)));
    if (factors.back() < 0) {
      map.Fail("goes_with", fmt::format("must be one of {}, or a product, \"yaw rate * sink rate\"",
                                        fmt::join(kVariables, ", ")));
    }
    product.erase(0, std::min(end + 3, product.size()));
  }
  return factors;
}

}  // namespace

std::vector<UnnamedForce> ReadUnnamedForces(const YamlMap& map, std::vector<Effect>* effects) {
  std::vector<UnnamedForce> forces;
  for (const YamlMap& entry : map.Children("forces")) {
    if (entry.Has("id")) {
      effects->push_back(ReadFlownTerm(entry));
      continue;
    }
    UnnamedForce force;
    force.axis = IndexIn(kAxes, entry.GetChoice("along", kAxes, kAxes.front()));
    force.factors = Factors(entry, entry.Get<std::string>("goes_with", std::string()));
    force.size = entry.Get<double>("size");
    if (entry.Has("place")) {
      const auto place = entry.Get<std::vector<double>>("place");
      if (place.size() != 2) entry.Fail("place", "needs north and east, in m");
      force.place = Eigen::Vector2d(place[0], place[1]);
      force.radius = entry.Get<double>("radius");
      if (!(force.radius > 0.0)) entry.Fail("radius", "must be above 0 m");
    } else if (force.factors.empty()) {
      entry.Fail("goes_with", "is needed, or a place with its radius");
    }
    entry.Finish();
    forces.push_back(force);
  }
  return forces;
}

YAML::Node ToYaml(const UnnamedForce& force) {
  YAML::Node node;
  node["along"] = kAxes[force.axis];
  std::vector<std::string> names;
  for (const int factor : force.factors) names.push_back(kVariables[factor]);
  if (!names.empty()) node["goes_with"] = fmt::format("{}", fmt::join(names, " * "));
  if (force.radius > 0.0) {
    for (const double x : force.place) node["place"].push_back(Rounded(x, kDigits));
    node["radius"] = Rounded(force.radius, kDigits);
  }
  node["size"] = Rounded(force.size, kDigits);
  node.SetStyle(YAML::EmitterStyle::Flow);
  return node;
}

Vector3d ForceOf(const std::vector<UnnamedForce>& forces, const BodyState& state) {
  Vector3d sum = Vector3d::Zero();
  if (forces.empty()) return sum;
  const Eigen::Matrix3d R_E_B = state.Attitude().toRotationMatrix();
  Eigen::Matrix<double, 6, 1> variables;
  variables << R_E_B.transpose() * state.v_E, state.w_B;
  for (const UnnamedForce& force : forces) {
    double size = force.size;
    for (const int factor : force.factors) size *= variables[factor];
    if (force.radius > 0.0) {
      const double distance = (state.p_E.head<2>() - force.place).norm() / force.radius;
      size *= 1.0 / (1.0 + std::pow(distance, 4));
    }
    sum += force.axis < 3 ? Vector3d(size * R_E_B.col(force.axis))
                          : Vector3d(size * Vector3d::Unit(force.axis - 3));
  }
  return sum;
}

namespace {

constexpr double kShortest = 0.3;  // s
constexpr double kEvery = 0.5;     // s, mean time between the starts of eddies

}  // namespace

// The mean square of a sum of eddies is their rate times the mean of peak^2 (3 / 8) length.
Eigen::Vector3d SlowMoments::At(double t) {
  if (rms_ == 0.0) return Eigen::Vector3d::Zero();
  const double mean_square = 3.0 / 8.0 * 0.5 * (kShortest + kLongest) / kEvery;
  while (next_ <= t) {
    const double length = random_.Uniform(kShortest, kLongest);
    eddies_.push_back({next_, length, rms_ / std::sqrt(mean_square) * random_.NormalVector3()});
    next_ -= kEvery * std::log(random_.Uniform(1e-12, 1.0));
  }
  std::erase_if(eddies_, [t](const Eddy& eddy) { return t > eddy.start + eddy.length; });
  Eigen::Vector3d sum = Eigen::Vector3d::Zero();
  for (const Eddy& eddy : eddies_) {
    const double phase = 2.0 * std::numbers::pi * (t - eddy.start) / eddy.length;
    sum += 0.5 * (1.0 - std::cos(phase)) * eddy.peak;
  }
  return sum;
}

}  // namespace trueline::simulation
