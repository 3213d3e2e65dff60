#include "problems/diagnosis/prepare_log.h"

#include <algorithm>
#include <set>

#include "problems/calibration/calibration.h"
#include "problems/common/error.h"

namespace trueline {
namespace {

// Adds mocap at its interval where IMU and attitude cover it. Mocap outside of them would
// make one long pass that cannot be integrated as a whole.
void AddMocap(const FlightLog& log, const ContinuousFixOptions& options, FlightLog* data) {
  constexpr double kFromEnds = 0.05;  // s
  const TimeNs from = std::max(data->imu.front().t, data->attitude.front().t);
  const TimeNs to = std::min(data->imu.back().t, data->attitude.back().t);
  TimeNs next = from + FromSeconds(kFromEnds);
  for (const PoseSample& pose : log.mocap) {
    if (pose.t < next || pose.t > to - FromSeconds(kFromEnds)) continue;
    data->fixes.push_back({pose.t, pose.p_E, options.mocap_sigma, -1});
    next = pose.t + FromSeconds(options.mocap_interval);
  }
  std::ranges::sort(data->fixes, {}, &Fix::t);
}

// Fixes without gates are divided by time; a log with nothing but mocap is fitted to it.
void PrepareContinuous(PreparedLog* prepared) {
  ContinuousFixOptions& options = prepared->options.vgd.passes.continuous;
  if (!prepared->options.fit_to_mocap) {
    prepared->continuous = FindContinuousFixes(prepared->data, options);
  }
  if (!prepared->continuous || prepared->continuous->from_mocap) {
    prepared->options.fit_to_mocap = prepared->options.fit_to_mocap || prepared->continuous;
    options.divide = DivideFixes::kNever;
    return;
  }
  for (FlightLog* log : {&prepared->recorded, &prepared->kept, &prepared->data}) {
    for (Fix& fix : log->fixes) fix.gate = 0;
  }
  prepared->data = *WithFixesToFit(prepared->data, options, *prepared->continuous);
}

FlightLog LeaveOut(const std::vector<std::size_t>& fixes, const FlightLog& log) {
  FlightLog kept = log;
  const std::set<std::size_t> left_out(fixes.begin(), fixes.end());
  kept.fixes.clear();
  for (std::size_t i = 0; i < log.fixes.size(); ++i) {
    if (left_out.count(i) == 0) kept.fixes.push_back(log.fixes[i]);
  }
  return kept;
}

}  // namespace

ImuDiagnosisOptions DiagnosisOptionsOf(const CalibrationOptions& calibration) {
  ImuDiagnosisOptions options;
  options.vgd = calibration.methods.vgd;
  options.effects = calibration.effects;
  options.priors_without_model = calibration.priors_without_model;
  options.warnings = calibration.warnings;
  return options;
}

std::shared_ptr<const PreparedLog> PrepareLog(const FlightLog& log,
                                              const ImuDiagnosisOptions& options) {
  auto prepared = std::make_shared<PreparedLog>(PreparedLog{log, log, log, options});
  FlightLog& data = prepared->data;
  DriveOptions& drive = prepared->options.vgd.drive;
  if (data.attitude.empty() || drive.attitude == AttitudeSource::kComplementaryFilter) {
    data.attitude = RunComplementaryFilter(data.imu, drive.filter);
    drive.attitude = AttitudeSource::kLogged;
    drive.attitude_latency = 0.0;
  }
  // A diagnosis names errors of the logged attitude, so the gyroscope may not replace them.
  drive.longest_hold = 0.0;
  constexpr double kOrdinaryShare = 0.05;  // of the tilt that ordinary filters are wrong by
  if (drive.attitude_errors.share == 0.0) drive.attitude_errors.share = kOrdinaryShare;
  PrepareContinuous(prepared.get());
  if (!prepared->options.fit_to_mocap && log.fixes.empty() && !log.mocap.empty()) {
    throw ErrorAt(log.directory + "/fixes.csv", 0, "holds no fixes; use --fit_to=mocap");
  }
  if (!prepared->options.fit_to_mocap) return prepared;
  if (log.mocap.empty()) {
    throw ErrorAt(log.directory + "/mocap.csv", 0,
                  "is not there or empty; --fit_to=mocap needs it (use --fit_to=fixes)");
  }
  AddMocap(log, options.vgd.passes.continuous, &data);
  return prepared;
}

std::shared_ptr<const PreparedLog> WithoutFixes(const PreparedLog& log,
                                                const std::vector<std::size_t>& fixes) {
  auto without = std::make_shared<PreparedLog>(log);
  without->data = LeaveOut(fixes, log.data);
  // With mocap among the data their fixes are numbered differently.
  if (!log.options.fit_to_mocap) without->kept = LeaveOut(fixes, log.recorded);
  return without;
}

VgdOptions OpenPriors(VgdOptions options) {
  constexpr double kOpenDrag = 1.0;  // 1/s
  for (int i = 0; i < kMotionSize; ++i) {
    if (kTheta[i].group != ParameterGroup::kDrag) continue;
    options.priors[i].sigma = std::max(kOpenDrag, options.priors[i].sigma);
  }
  return options;
}

}  // namespace trueline
