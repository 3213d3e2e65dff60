#include "problems/diagnosis/false_gate.h"

#include <algorithm>
#include <cmath>

#include "problems/diagnosis/imu_flight.h"
#include "problems/log/fixes.h"
#include "problems/result/statistics.h"

namespace trueline {
namespace {

constexpr double kApart = 4.0;       // sigmas of a fix from the path: hardly noise
constexpr double kAgree = 3.0;       // sigmas between two that agree
constexpr int kFewest = 6;           // fixes that make a place
constexpr double kElsewhere = 0.25;  // m from the gate: a nearer one is a poor detection
constexpr double kShare = 0.3;       // of the outliers, at least, agree on the place
constexpr double kWidest = 2.0;  // m, half the side of the smallest box that outliers spread over

struct Outlier {
  std::size_t fix;
  int gate;
  Eigen::Vector3d d;  // m, fix less path
  double sigma;       // m
};

std::vector<Outlier> OutliersOf(const BaseFlight& flight, const BaseFit& fit) {
  std::vector<Outlier> outliers;
  for (std::size_t i = 0; i < flight.plan().fixes.size(); ++i) {
    const Fix& at = flight.log().fixes[flight.plan().fixes[i]];
    const double sigma = at.sigma;  // as stated: the learned sigma includes the outliers
    const Eigen::Vector3d d = -fit.rows.r.segment<3>(3 * static_cast<Eigen::Index>(i));
    if (at.gate >= 0 && d.norm() > kApart * sigma) {
      outliers.push_back({flight.plan().fixes[i], at.gate, d, sigma});
    }
  }
  return outliers;
}

std::vector<Outlier> AgreeingWith(const Outlier& centre, const std::vector<Outlier>& outliers) {
  std::vector<Outlier> agreeing;
  for (const Outlier& o : outliers) {
    const double reach = kAgree * std::hypot(o.sigma, centre.sigma);
    if ((o.d - centre.d).norm() < reach) agreeing.push_back(o);
  }
  return agreeing;
}

// Probability that, of n outliers spread uniformly over a box, at least m lie within reach of one
// of them: a Poisson tail (by chi-square), times n for the choice of the centre.
double ChanceOf(int n, int m, double reach, const std::vector<Outlier>& outliers) {
  double half = kWidest;
  for (const Outlier& o : outliers) half = std::max(half, o.d.cwiseAbs().maxCoeff());
  const double share = std::min(1.0, 4.0 / 3.0 * M_PI * std::pow(reach / (2.0 * half), 3));
  return std::min(1.0, n * (1.0 - ChiSquareTail(2.0 * n * share, 2.0 * (m - 1))));
}

// True if other fixes of the same gate from the same distance lie on the path. If all fixes are
// displaced, the cause is a lens or size error and not a false gate.
bool HasBystanders(const BaseFlight& flight, const BaseFit& fit,
                   const std::vector<Outlier>& agreeing) {
  constexpr double kSameDistance = 0.5;  // m
  constexpr double kBystanderShare = 0.2;
  const auto distance = [&](int id, const Eigen::Vector3d& path) {
    const Gate* gate = GateOf(flight.log(), id);
    return gate == nullptr ? 0.0 : (gate->position - path).norm();
  };
  int bystanders = 0, all = 0;
  for (std::size_t i = 0; i < flight.plan().fixes.size(); ++i) {
    const Fix& fix = flight.log().fixes[flight.plan().fixes[i]];
    const Eigen::Vector3d d = -fit.rows.r.segment<3>(3 * static_cast<Eigen::Index>(i));
    const double here = distance(fix.gate, fix.p_E - d);
    const bool alike = std::any_of(agreeing.begin(), agreeing.end(), [&](const Outlier& o) {
      const Eigen::Vector3d path = flight.log().fixes[o.fix].p_E - o.d;
      return o.gate == fix.gate && std::abs(distance(o.gate, path) - here) < kSameDistance;
    });
    if (fix.gate < 0 || !alike) continue;
    ++all;
    bystanders += d.norm() <= kApart * fix.sigma;
  }
  return bystanders >= kBystanderShare * all;
}

// True for a fix of a gate at which an offset of d (m) would be a clear outlier.
bool IsVisible(const Fix& fix, double d) {
  constexpr double kSurely = 1.5;  // margin beyond kApart, sigmas
  return fix.gate >= 0 && d > (kApart + kSurely) * fix.sigma;
}

// The number of fitted fixes that `counts` chooses.
template <class Counts>
int CountFitted(const BaseFlight& flight, Counts&& counts) {
  const std::vector<std::size_t>& fitted = flight.plan().fixes;
  return static_cast<int>(std::count_if(
      fitted.begin(), fitted.end(), [&](std::size_t i) { return counts(flight.log().fixes[i]); }));
}

int CountVisible(const BaseFlight& flight, double d) {
  return CountFitted(flight, [d](const Fix& fix) { return IsVisible(fix, d); });
}

// The number of these fixes whose displacement is about d (m, E), rather than zero or another.
int DisplacedBy(const Eigen::Vector3d& d, const BaseFlight& flight, const BaseFit& fit) {
  int count = 0;
  for (std::size_t i = 0; i < flight.plan().fixes.size(); ++i) {
    const Fix& fix = flight.log().fixes[flight.plan().fixes[i]];
    const Eigen::Vector3d at = -fit.rows.r.segment<3>(3 * static_cast<Eigen::Index>(i));
    count += IsVisible(fix, d.norm()) && (at - d).norm() < 0.5 * d.norm();
  }
  return count;
}

int OnlyGate(const std::vector<Outlier>& agreeing) {
  const int gate = agreeing.front().gate;
  const bool same = std::all_of(agreeing.begin(), agreeing.end(),
                                [gate](const Outlier& o) { return o.gate == gate; });
  return same ? gate : -1;
}

}  // namespace

std::optional<FalseGate> FindFalseGate(const BaseFlight& flight, const BaseFit& fit, double alpha) {
  const std::vector<Outlier> outliers = OutliersOf(flight, fit);
  std::vector<Outlier> best;
  const Outlier* centre = nullptr;
  for (const Outlier& o : outliers) {
    if (o.d.norm() < kElsewhere) continue;
    std::vector<Outlier> agreeing = AgreeingWith(o, outliers);
    if (agreeing.size() > best.size()) {
      best = std::move(agreeing);
      centre = &o;
    }
  }
  const int n = static_cast<int>(outliers.size()), m = static_cast<int>(best.size());
  if (centre == nullptr || m < kFewest || m < kShare * n) return std::nullopt;
  FalseGate found;
  found.p = ChanceOf(n, m, kAgree * std::sqrt(2.0) * centre->sigma, outliers);
  if (found.p >= alpha || !HasBystanders(flight, fit, best)) return std::nullopt;
  found.gate = OnlyGate(best);
  double weights = 0.0;
  for (const Outlier& o : best) {
    found.fixes.push_back(o.fix);
    // A fix is map position less measured vector, so the object's offset has the opposite sign.
    found.offset -= o.d / (o.sigma * o.sigma);
    weights += 1.0 / (o.sigma * o.sigma);
  }
  found.offset /= weights;
  // Far from the gate noise exceeds the offset: the share counts only fixes that resolve it.
  int count = CountVisible(flight, found.offset.norm());
  if (const int displaced = DisplacedBy(-found.offset, flight, fit); displaced >= kFewest) {
    found.fraction = displaced / static_cast<double>(count);
  } else {
    count = CountFitted(flight, [](const Fix& fix) { return fix.gate >= 0; });
    found.fraction = m / static_cast<double>(count);
  }
  found.sigma = std::sqrt(found.fraction * (1.0 - found.fraction) / static_cast<double>(count));
  return found;
}

double DetectableFraction(const BaseFlight& flight, const BaseFit& fit, double alpha) {
  constexpr double kOffset = 1.0;  // m
  constexpr double kPower = 0.95;
  const std::vector<Outlier> outliers = OutliersOf(flight, fit);
  const int visible = CountVisible(flight, kOffset), others = static_cast<int>(outliers.size());
  if (visible == 0) return 1.0;
  double sigma = 0.0;
  for (const std::size_t i : flight.plan().fixes) {
    sigma = std::max(sigma, std::min(flight.log().fixes[i].sigma, kOffset / kApart));
  }
  int least = kFewest;
  while (least < visible &&
         (least < kShare * (others + least) ||
          ChanceOf(others + least, least, kAgree * std::sqrt(2.0) * sigma, outliers) >= alpha)) {
    ++least;
  }
  // The expected number at which a Poisson count reaches `least` with that power.
  double mean = least;
  while (ChiSquareTail(2.0 * mean, 2.0 * least) > 1.0 - kPower) mean += 0.1;
  return std::min(1.0, mean / visible);
}

// Learned noise grows to hold fixes of another place, and the path is then drawn to them. With the
// noise as stated the path keeps to the majority of each pass.
const BaseFit& ImuDrivenFlight::FitAsStated() const {
  constexpr int kIterations = 8;
  if (as_stated_) return *as_stated_;
  as_stated_ = fit_;
  as_stated_->noise = StartingNoise(options_);
  Solve(flight_.get(), kIterations, &*as_stated_);
  flight_->Evaluate(fit_.x, false);
  return *as_stated_;
}

// The place that is surer of those beside both paths.
std::optional<FalseGate> ImuDrivenFlight::FindFalsePlace(double alpha) const {
  std::optional<FalseGate> best;
  for (const BaseFit* fit : {&fit_, &FitAsStated()}) {
    const auto found = FindFalseGate(*flight_, *fit, 0.5 * alpha);
    if (found && (!best || found->p < best->p)) best = found;
  }
  if (best) best->p *= 2.0;
  return best;
}

std::optional<Cause> ImuDrivenFlight::FindFalseData(double alpha) const {
  if (log_->continuous) return std::nullopt;  // no gates, no false ones
  const auto found = FindFalsePlace(alpha);
  if (!found) return std::nullopt;
  const Candidate candidate{&InfoOf("false_gate"),
                            {{"gate", found->gate},
                             {"dx", found->offset.x()},
                             {"dy", found->offset.y()},
                             {"dz", found->offset.z()}}};
  return Cause{candidate,
               Eigen::VectorXd::Constant(1, found->fraction),
               Eigen::VectorXd::Constant(1, found->sigma),
               found->p,
               {},
               Gain(),
               Gain(),
               {},
               {}};
}

std::unique_ptr<DiagnosedFlight> ImuDrivenFlight::WithoutFalseData(double alpha) const {
  const auto found = FindFalsePlace(alpha);
  return found ? std::make_unique<ImuDrivenFlight>(WithoutFixes(*log_, found->fixes))
               : WithoutCauses();
}

std::optional<CandidateReport> ImuDrivenFlight::ReportFalseData(const std::optional<Cause>& found,
                                                                double alpha) const {
  const auto& fixes = log_->recorded.fixes;
  if (log_->continuous ||
      std::none_of(fixes.begin(), fixes.end(), [](const Fix& f) { return f.gate >= 0; })) {
    return std::nullopt;
  }
  const double p = found ? found->p : 1.0;
  CandidateReport report = NamedReport({&InfoOf("false_gate"), {}},
                                       std::sqrt(ChiSquareCritical(std::max(p, 1e-300), 1.0)), p);
  const Eigen::VectorXd none = Eigen::VectorXd::Zero(1);
  report.value = found ? found->value : none;
  report.sigma = found ? found->sigma : none;
  report.detectable =
      Eigen::VectorXd::Constant(1, DetectableFraction(*flight_, FitAsStated(), 0.5 * alpha));
  return report;
}

}  // namespace trueline
