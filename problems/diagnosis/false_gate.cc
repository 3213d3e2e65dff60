#include "problems/diagnosis/false_gate.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "problems/diagnosis/imu_flight.h"
#include "problems/diagnosis/thresholds.h"
#include "problems/log/samples.h"
#include "problems/result/statistics.h"

namespace trueline {
namespace {

constexpr double kVisible = 5.5;  // sigmas: an offset of as much is clearly no noise
constexpr int kFewest = 6;        // fixes that make a place
constexpr double kShare = 0.3;    // of the outliers, that agree on the place; of bystanders
constexpr double kWidest = 2.0;   // m, half the side of the smallest box that outliers spread over

// A fix of a gate that was fitted.
struct FittedFix {
  std::size_t fix;
  int gate;
  int pass;
  Eigen::Vector3d d;  // m, fix less path
  double sigma;       // m, as stated: the learned sigma includes the outliers
  double distance;    // m, of the path from the gate

  bool IsOutlier() const { return d.norm() > kOutlierSigmas * sigma; }
};
using FittedFixes = std::vector<FittedFix>;

FittedFixes FittedFixesOf(const BaseFlight& flight, const BaseFit& fit) {
  FittedFixes fixes;
  for (std::size_t i = 0; i < flight.plan().fixes.size(); ++i) {
    const Fix& at = flight.log().fixes[flight.plan().fixes[i]];
    if (at.gate < 0) continue;
    const Eigen::Vector3d d = -fit.rows.r.segment<3>(3 * static_cast<Eigen::Index>(i));
    const Gate* gate = GateOf(flight.log(), at.gate);
    const double distance = gate == nullptr ? 0.0 : (gate->position - (at.p_E - d)).norm();
    const int pass = flight.plan().fix_cluster[i];
    fixes.push_back({flight.plan().fixes[i], at.gate, pass, d, at.sigma, distance});
  }
  return fixes;
}

FittedFixes OutliersAmong(FittedFixes fixes) {
  std::erase_if(fixes, [](const FittedFix& f) { return !f.IsOutlier(); });
  return fixes;
}

FittedFixes AgreeingWith(const FittedFix& centre, const FittedFixes& outliers) {
  FittedFixes agreeing;
  for (const FittedFix& o : outliers) {
    const double reach = kApartSigmas * std::hypot(o.sigma, centre.sigma);
    if ((o.d - centre.d).norm() < reach) agreeing.push_back(o);
  }
  return agreeing;
}

// Probability that, of n outliers spread uniformly over a box, at least m lie within reach of one
// of them: a Poisson tail (by chi-square), times n for the choice of the centre.
double ChanceOf(int n, int m, double reach, const FittedFixes& outliers) {
  double half = kWidest;
  for (const FittedFix& o : outliers) half = std::max(half, o.d.cwiseAbs().maxCoeff());
  const double share = std::min(1.0, 4.0 / 3.0 * M_PI * std::pow(reach / (2.0 * half), 3));
  return std::min(1.0, n * (1.0 - ChiSquareTail(2.0 * n * share, 2.0 * (m - 1))));
}

// True if the fix is nearer to the path than to a place that far from it.
bool IsOnPath(const FittedFix& fix, const FittedFix& place) {
  return fix.d.norm() < kMostOf * place.d.norm();
}

// True if other fixes of the same gate from the same distance lie on the path. If all fixes are
// displaced, the cause is a lens or size error and not a false gate.
bool HasBystanders(const FittedFixes& fixes, const FittedFixes& agreeing, const FittedFix& place) {
  int bystanders = 0, all = 0;
  for (const FittedFix& fix : fixes) {
    const bool alike = std::ranges::any_of(agreeing, [&](const FittedFix& o) {
      return o.gate == fix.gate && std::abs(o.distance - fix.distance) < kSamePlace;
    });
    if (!alike) continue;
    ++all;
    bystanders += IsOnPath(fix, place);
  }
  return bystanders >= kShare * all;
}

// How many agree on a place independently: an error of the path moves whole passes, but no fix
// apart from others of its pass.
struct Independent {
  int passes = 0, within = 0;  // wholly displaced passes; fixes apart from others of theirs

  int all() const { return passes + within; }
};
Independent IndependentAmong(const FittedFixes& some, const FittedFixes& fixes,
                             const FittedFix& place) {
  using Pass = std::pair<int, int>;  // of a gate
  std::set<Pass> on_path, whole;
  for (const FittedFix& fix : fixes) {
    if (IsOnPath(fix, place)) on_path.emplace(fix.gate, fix.pass);
  }
  Independent count;
  for (const FittedFix& fix : some) {
    const bool within = on_path.contains({fix.gate, fix.pass});
    count.within += within;
    if (!within) whole.emplace(fix.gate, fix.pass);
  }
  count.passes = static_cast<int>(whole.size());
  return count;
}

DisplacedFixes DisplacedAmong(const FittedFixes& fixes, const Eigen::Vector3d& offset) {
  DisplacedFixes displaced;
  for (const FittedFix& fix : fixes) displaced.Add(fix.d, fix.sigma, offset);
  return displaced;
}

}  // namespace

void DisplacedFixes::Add(const Eigen::Vector3d& d, double sigma, const Eigen::Vector3d& offset) {
  if (offset.norm() <= kVisible * sigma) return;
  ++visible;
  displaced += (d + offset).norm() < kMostOf * offset.norm();
}

Eigen::Vector3d OffsetOf(const Candidate& false_gate) {
  const auto& fixed = false_gate.fixed;
  return {fixed.at("dx"), fixed.at("dy"), fixed.at("dz")};
}

std::optional<FalseGate> FindFalseGate(const BaseFlight& flight, const BaseFit& fit, double alpha) {
  const FittedFixes fixes = FittedFixesOf(flight, fit), outliers = OutliersAmong(fixes);
  FittedFixes best;
  const FittedFix* centre = nullptr;
  for (const FittedFix& o : outliers) {
    if (o.d.norm() < kSamePlace) continue;  // a poor detection of the gate
    FittedFixes agreeing = AgreeingWith(o, outliers);
    if (agreeing.size() > best.size()) {
      best = std::move(agreeing);
      centre = &o;
    }
  }
  const int m = static_cast<int>(best.size());
  if (centre == nullptr || m < kFewest) return std::nullopt;
  const Independent agree = IndependentAmong(best, fixes, *centre);
  const int n = IndependentAmong(outliers, fixes, *centre).all();
  if (agree.all() < kShare * n) return std::nullopt;
  const double p =
      ChanceOf(n, agree.all(), kApartSigmas * std::sqrt(2.0) * centre->sigma, outliers);
  if (p >= alpha || !HasBystanders(fixes, best, *centre)) return std::nullopt;
  FalseGate found;
  Eigen::Vector3d offset = Eigen::Vector3d::Zero();
  double weights = 0.0;
  for (const FittedFix& o : best) {
    found.fixes.push_back(o.fix);
    // A fix is map position less measured vector, so the object's offset has the opposite sign.
    offset -= o.d / (o.sigma * o.sigma);
    weights += 1.0 / (o.sigma * o.sigma);
  }
  offset /= weights;
  // Far from the gate noise exceeds the offset: the share counts only fixes that resolve it.
  auto [count, displaced] = DisplacedAmong(fixes, offset);
  if (displaced < kFewest) {
    displaced = m;
    count = static_cast<int>(fixes.size());
  }
  const double share = displaced / static_cast<double>(count);
  const double sigma = std::sqrt(share * (1.0 - share) / static_cast<double>(count));
  const bool one_gate = std::ranges::count(best, centre->gate, &FittedFix::gate) == m;
  found.cause.candidate = {&InfoOf("false_gate"),
                           {{"gate", one_gate ? centre->gate : -1},
                            {"dx", offset.x()},
                            {"dy", offset.y()},
                            {"dz", offset.z()}}};
  found.cause.value = Eigen::VectorXd::Constant(1, share);
  found.cause.sigma = Eigen::VectorXd::Constant(1, sigma);
  found.cause.p = p;
  found.cause.beside_any_path = agree.within >= agree.passes;
  return found;
}

double DetectableFraction(const BaseFlight& flight, const BaseFit& fit, double alpha) {
  const FittedFixes fixes = FittedFixesOf(flight, fit), outliers = OutliersAmong(fixes);
  const int visible = DisplacedAmong(fixes, Eigen::Vector3d::UnitX()).visible;
  const int others = static_cast<int>(outliers.size());
  if (visible == 0) return 1.0;
  double sigma = 0.0;
  for (const FittedFix& fix : fixes) {
    sigma = std::max(sigma, std::min(fix.sigma, 1.0 / kOutlierSigmas));
  }
  int least = kFewest;
  while (least < visible && (least < kShare * (others + least) ||
                             ChanceOf(others + least, least, kApartSigmas * std::sqrt(2.0) * sigma,
                                      outliers) >= alpha)) {
    ++least;
  }
  // The expected number at which a Poisson count reaches `least` with that power.
  double mean = least;
  while (ChiSquareTail(2.0 * mean, 2.0 * least) > kSingleAlpha) mean += 0.1;
  return std::min(1.0, mean / visible);
}

// Learned noise grows to hold fixes of another place, and the path is then drawn to them. With the
// noise as stated the path keeps to the majority of each pass.
const BaseFit& ImuDrivenFlight::FitAsStated() const {
  if (as_stated_) return *as_stated_;
  as_stated_ = fit_;
  as_stated_->noise = StartingNoise(options_);
  Solve(flight_.get(), kMostIterations, &*as_stated_);
  flight_->Evaluate(fit_.x, false);
  return *as_stated_;
}

// The place that is surer of those beside both paths.
std::optional<FalseGate> ImuDrivenFlight::FindFalsePlace(double alpha) const {
  std::optional<FalseGate> best;
  for (const BaseFit* fit : {&fit_, &FitAsStated()}) {
    const auto found = FindFalseGate(*flight_, *fit, 0.5 * alpha);
    if (found && (!best || found->cause.p < best->cause.p)) best = found;
  }
  if (best) best->cause.p *= 2.0;
  return best;
}

std::optional<Cause> ImuDrivenFlight::FindFalseData(double alpha) const {
  if (log_->continuous) return std::nullopt;  // no gates, no false ones
  const auto found = FindFalsePlace(alpha);
  return found ? std::optional(found->cause) : std::nullopt;
}

std::unique_ptr<DiagnosedFlight> ImuDrivenFlight::WithoutFalseData(double alpha) const {
  const auto found = FindFalsePlace(alpha);
  return found ? std::make_unique<ImuDrivenFlight>(WithoutFixes(*log_, found->fixes))
               : WithoutCauses();
}

std::optional<CandidateReport> ImuDrivenFlight::ReportFalseData(const std::optional<Cause>& found,
                                                                double alpha) const {
  const auto& fixes = log_->recorded.fixes;
  if (log_->continuous || std::ranges::none_of(fixes, [](const Fix& f) { return f.gate >= 0; })) {
    return std::nullopt;
  }
  const double p = found ? found->p : 1.0;
  const Eigen::VectorXd none = Eigen::VectorXd::Zero(1);
  return CandidateReport{
      "false_gate",
      "false_gate",
      std::sqrt(ChiSquareCritical(std::max(p, 1e-300), 1.0)),
      p,
      found ? found->value : none,
      found ? found->sigma : none,
      Eigen::VectorXd::Constant(1, DetectableFraction(*flight_, FitAsStated(), 0.5 * alpha))};
}

}  // namespace trueline
