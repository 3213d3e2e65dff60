#include "problems/vgd/passes.h"

#include <fmt/format.h>

#include <algorithm>

#include "problems/log/imu_health.h"
#include "problems/log/samples.h"
#include "problems/result/statistics.h"
#include "problems/trajectory/mocap_path.h"
#include "problems/vgd/rough_path.h"

namespace trueline {
namespace {

constexpr double kLongestStep = 3.0;          // s, between fixes of one run
constexpr double kShortestStep = 0.7;         // s, that ends a run
constexpr double kFromEnds = 0.05;            // s, of IMU and attitude
constexpr char kPrepared[] = "fixes_to_fit";  // in `source` of a log with such fixes

double LongestStep(double interval) {
  return std::clamp(2.5 * interval, kShortestStep, kLongestStep);
}

// Share of the samples that lie in runs longer than `longest` (s).
template <class Sample>
double ShareInLongRuns(const std::vector<Sample>& samples, double gap, double longest) {
  std::size_t inside = 0, first = 0;
  for (std::size_t i = 0; i < samples.size(); ++i) {
    const bool last =
        i + 1 == samples.size() || SecondsBetween(samples[i].t, samples[i + 1].t) > gap;
    if (!last) continue;
    if (SecondsBetween(samples[first].t, samples[i].t) > longest) inside += i - first + 1;
    first = i + 1;
  }
  return static_cast<double>(inside) / static_cast<double>(samples.size());
}

// Sigma of what changes from fix to fix, by the third differences of evenly spaced fixes: the
// path's jerk hardly enters them, and white noise has its variance times 20. The slow part's
// changes enter with 6 of these 20, so the result errs to the large side. Robust (MAD). NaN if
// fixes are too far apart.
double WhiteSigma(const std::vector<Fix>& fixes, double interval) {
  constexpr double kFarApart = 0.3;  // s
  constexpr double kUneven = 0.2;    // of the interval
  std::vector<double> differences;
  if (interval > kFarApart) return std::nan("");
  for (std::size_t i = 3; i < fixes.size(); ++i) {
    bool even = true;
    for (std::size_t k = i - 2; k <= i; ++k) {
      const double step = SecondsBetween(fixes[k - 1].t, fixes[k].t);
      even = even && std::abs(step - interval) < kUneven * interval;
    }
    if (!even) continue;
    const Eigen::Vector3d third =
        fixes[i].p_E - 3.0 * fixes[i - 1].p_E + 3.0 * fixes[i - 2].p_E - fixes[i - 3].p_E;
    differences.push_back(std::abs(third.x()));
    differences.push_back(std::abs(third.y()));
  }
  return differences.empty() ? std::nan("")
                             : SigmaOfSizes(std::move(differences)) / std::sqrt(20.0);
}

FixNoise NoiseOf(const FlightLog& log, const ContinuousFixOptions& options, double interval) {
  constexpr double kUsualWhite = 0.2;   // of the stated sigma, where the log does not show it
  constexpr double kLeastWhite = 0.01;  // the same, at least
  const double sigma = MedianSigma(log.fixes);
  const double white = WhiteSigma(log.fixes, interval);
  return {std::isnan(white) ? kUsualWhite * sigma : std::max(kLeastWhite * sigma, white),
          options.correlation_time, options.latency, options.latency_sigma, LongestStep(interval)};
}

// Root mean square about the mean of each axis.
double ScatterOf(const std::vector<ImuSample>& imu, std::size_t first, std::size_t end,
                 Eigen::Vector3d ImuSample::*axes) {
  Eigen::Vector3d sum = Eigen::Vector3d::Zero(), squares = sum;
  const auto count = static_cast<double>(end - first);
  for (std::size_t i = first; i < end; ++i) {
    sum += imu[i].*axes;
    squares += (imu[i].*axes).cwiseAbs2();
  }
  return std::sqrt((squares / count - (sum / count).cwiseAbs2()).cwiseMax(0.0).sum());
}

// First and last time at which the IMU does not rest, by seconds; the whole log if it always rests.
std::pair<TimeNs, TimeNs> Airborne(const std::vector<ImuSample>& imu) {
  constexpr double kRate = 0.03;  // rad/s, scatter at rest
  constexpr double kForce = 0.3;  // m/s^2
  std::pair<TimeNs, TimeNs> span{imu.back().t, imu.front().t};
  for (std::size_t first = 0, i = 0; i < imu.size(); ++i) {
    if (SecondsBetween(imu[first].t, imu[i].t) < 1.0) continue;
    if (ScatterOf(imu, first, i, &ImuSample::gyro) > kRate ||
        ScatterOf(imu, first, i, &ImuSample::accel) > kForce) {
      span = {std::min(span.first, imu[first].t), std::max(span.second, imu[i].t)};
    }
    first = i;
  }
  if (span.first < span.second) return span;
  return {imu.front().t, imu.back().t};
}

// Adds the times between fixes that are two seconds and a metre or more apart.
void AddMoves(const std::vector<Fix>& fixes, std::pair<TimeNs, TimeNs>* span) {
  constexpr double kSeconds = 2.0, kMetres = 1.0;
  std::size_t from = 0;
  for (std::size_t i = 0; i < fixes.size(); ++i) {
    while (from + 1 < i && SecondsBetween(fixes[from + 1].t, fixes[i].t) >= kSeconds) ++from;
    if ((fixes[i].p_E - fixes[from].p_E).norm() < kMetres) continue;
    *span = {std::min(span->first, fixes[from].t), std::max(span->second, fixes[i].t)};
  }
}

// The time of flight that IMU and attitude cover.
std::pair<TimeNs, TimeNs> FlightSpan(const FlightLog& log) {
  const TimeNs margin = FromSeconds(kFromEnds);
  std::pair<TimeNs, TimeNs> airborne = Airborne(log.imu);
  AddMoves(log.fixes, &airborne);
  auto [from, to] = airborne;
  from = std::max(from, log.imu.front().t + margin);
  to = std::min(to, log.imu.back().t - margin);
  if (log.attitude.empty()) return {from, to};
  return {std::max(from, log.attitude.front().t + margin),
          std::min(to, log.attitude.back().t - margin)};
}

// Shorter on a short flight, so that it has arcs enough; a pass holds at least three of the fixes
// that a fit uses.
void ChooseLengths(const FlightLog& log, const ContinuousFixOptions& options, double interval,
                   ContinuousFixes* found) {
  constexpr double kCycles = 6.0;    // at least, of a pass and an arc
  constexpr double kShortest = 1.0;  // s, of an arc
  const auto [from, to] = FlightSpan(log);
  const double most = SecondsBetween(from, to) / kCycles * options.share;
  found->arc = std::min(options.arc, std::max(kShortest, most));
  const double apart = found->from_mocap ? options.mocap_interval : options.interval;
  const double step = std::max(1.0, std::round(apart / interval)) * interval;
  found->pass = std::max(found->arc * (1.0 - options.share) / options.share, 2.5 * step);
}

std::vector<Fix> FixesOfMocap(const std::vector<PoseSample>& mocap, double sigma) {
  std::vector<Fix> fixes;
  fixes.reserve(mocap.size());
  for (const PoseSample& pose : mocap) fixes.push_back({pose.t, pose.p_E, sigma, -1});
  return fixes;
}

// Those about `interval` seconds apart: a whole number of steps of the log.
std::vector<Fix> Thinned(const std::vector<Fix>& fixes, double interval) {
  const double step = MedianStep(fixes);
  const double apart = std::max(1.0, std::round(interval / step)) * step - 0.5 * step;
  std::vector<Fix> kept;
  for (const Fix& fix : fixes) {
    if (kept.empty() || SecondsBetween(kept.back().t, fix.t) > apart) kept.push_back(fix);
  }
  return kept;
}

}  // namespace

void Serialize(YamlArchive* a, ContinuousFixOptions* o) {
  a->Choice("divide", &o->divide, {{"auto", DivideFixes::kAuto}, {"never", DivideFixes::kNever}});
  a->Positive("longest_pass_s", &o->longest_pass);
  a->Positive("arc_s", &o->arc);
  a->Positive("share_withheld", &o->share);
  a->Require(o->share < 1.0, "share_withheld", "must lie between 0 and 1");
  a->Positive("interval_s", &o->interval);
  a->NotNegative("correlation_time_s", &o->correlation_time);
  a->Value("latency_s", &o->latency);
  a->NotNegative("latency_sigma_s", &o->latency_sigma);
  a->Positive("mocap_interval_s", &o->mocap_interval);
  a->Positive("mocap_sigma_m", &o->mocap_sigma);
}

std::string ContinuousFixes::Text() const {
  const std::string source =
      from_mocap ? fmt::format("the positions are mocap's, continuous ({:.3g} Hz)", rate)
                 : fmt::format("the fixes are continuous ({:.3g} Hz)", rate);
  return fmt::format(
      "{}: time divides the flight into arcs of {:.3g} s, with passes of {:.3g} s between; each "
      "arc "
      "is predicted by windows that use no position of it",
      source, arc, pass);
}

std::optional<ContinuousFixes> FindContinuousFixes(const FlightLog& log,
                                                   const ContinuousFixOptions& options) {
  const bool passes_gates = !log.gates.empty() && !log.fixes.empty();
  if (options.divide == DivideFixes::kNever || passes_gates || log.imu.size() < 2) {
    return std::nullopt;
  }
  ContinuousFixes found;
  found.from_mocap = log.fixes.empty();
  const double interval = found.from_mocap ? MedianStep(log.mocap) : MedianStep(log.fixes);
  if (!(interval > 0.0)) return std::nullopt;
  const double gap = LongestStep(interval);
  const double share = found.from_mocap ? ShareInLongRuns(log.mocap, gap, options.longest_pass)
                                        : ShareInLongRuns(log.fixes, gap, options.longest_pass);
  if (share < 0.5) return std::nullopt;
  found.rate = found.from_mocap ? MeanRate(log.mocap) : MeanRate(log.fixes);
  ChooseLengths(log, options, interval, &found);
  found.noise = found.from_mocap ? FixNoise{.white = options.mocap_sigma, .longest_step = gap}
                                 : NoiseOf(log, options, interval);
  return found;
}

std::shared_ptr<const FlightLog> WithFixesToFit(const FlightLog& log,
                                                const ContinuousFixOptions& options,
                                                const ContinuousFixes& found) {
  auto fit = std::make_shared<FlightLog>(log);
  // A prepared log that is prepared again keeps its fixes: others have their indices.
  if (!fit->source.try_emplace(kPrepared).second) return fit;
  const auto [first, last] = FlightSpan(log);
  if (found.from_mocap) fit->fixes = FixesOfMocap(log.mocap, options.mocap_sigma);
  std::erase_if(fit->fixes,
                [from = first, to = last](const Fix& fix) { return fix.t < from || fix.t > to; });
  fit->fixes = Thinned(fit->fixes, found.from_mocap ? options.mocap_interval : options.interval);
  return fit;
}

std::vector<Pass> FindPasses(const std::vector<Fix>& fixes, const PassOptions& options) {
  std::vector<Pass> passes;
  std::size_t first = 0;
  for (std::size_t i = 0; i < fixes.size(); ++i) {
    const bool last_of_run =
        i + 1 == fixes.size() || SecondsBetween(fixes[i].t, fixes[i + 1].t) > options.pass_gap;
    if (!last_of_run) continue;
    if (static_cast<int>(i - first + 1) >= options.min_fixes) {
      passes.push_back({first, i, fixes[first].t, fixes[i].t});
    }
    first = i + 1;
  }
  return passes;
}

namespace {

// Index of the last fix of the pass that begins with fixes[first], and is to last until `end`.
std::size_t LastOfPass(const std::vector<Fix>& fixes, std::size_t first, std::size_t run_end,
                       TimeNs end) {
  std::size_t last = first;
  while (last + 1 < run_end && fixes[last + 1].t <= end) ++last;
  return last;
}

// False for mocap that is too slow throughout.
bool CanInterpolate(const std::vector<PoseSample>& mocap) {
  const auto close = [](const PoseSample& a, const PoseSample& b) {
    return SecondsBetween(a.t, b.t) <= kLongestMocapGap;
  };
  return std::ranges::adjacent_find(mocap, close) != mocap.end();
}

}  // namespace

std::vector<Pass> DividePasses(const std::vector<Fix>& fixes, const PassOptions& options,
                               const ContinuousFixes& found) {
  PassOptions whole = options;
  whole.pass_gap = found.noise.longest_step;
  std::vector<Pass> passes;
  for (const Pass& run : FindPasses(fixes, whole)) {
    for (std::size_t first = run.first; first <= run.last;) {
      const std::size_t last =
          LastOfPass(fixes, first, run.last + 1, fixes[first].t + FromSeconds(found.pass));
      if (static_cast<int>(last - first + 1) >= options.min_fixes) {
        passes.push_back({first, last, fixes[first].t, fixes[last].t});
      }
      const TimeNs next = fixes[last].t + FromSeconds(found.arc);
      first = last + 1;
      while (first <= run.last && fixes[first].t < next) ++first;
    }
  }
  return passes;
}

std::optional<ArcTruth> TruthAtPass(const FlightLog& log, const Pass& next) {
  constexpr int kFixes = 5;  // of the next pass
  if (CanInterpolate(log.mocap)) {
    const auto p_E = PositionAt(log.mocap, next.begin, kLongestMocapGap);
    return p_E ? std::optional<ArcTruth>({*p_E, true, 0.0}) : std::nullopt;
  }
  const std::size_t last = std::min(next.last, next.first + kFixes - 1);
  const LineFit line = FitLine(log.fixes, next.first, last, next.begin);
  return ArcTruth{line.p, false, line.sigma};
}

}  // namespace trueline
