#include "problems/diagnosis/agreement.h"

#include <Eigen/QR>
#include <algorithm>
#include <cmath>

#include "cost_functions/huber.h"
#include "problems/diagnosis/thresholds.h"
#include "problems/result/statistics.h"
#include "problems/vgd/attitude_errors.h"

namespace trueline {

using Eigen::VectorXd;

namespace {

using RowsOfMocap = StreamRows (MocapComparison::*)(const FlightLog&) const;

StreamComparison Against(const MocapComparison& mocap, const std::string& stream,
                         const std::string& unit, RowsOfMocap rows,
                         const std::vector<std::string>& alike = {}, bool independent = true) {
  return {.stream = "mocap " + stream,
          .unit = unit,
          .alike = alike,
          .rows = [&mocap, rows](const FlightLog& corrected) { return (mocap.*rows)(corrected); },
          .noiseless = [&mocap](const FlightLog&) { return mocap.WithFixesOnPath(); },
          .independent = independent};
}

StreamComparison AgainstAttitude(const MocapComparison& mocap) {
  return Against(mocap, "attitude", "rad", &MocapComparison::Attitude,
                 {"ahrs_acceleration_error", "ahrs_drag_error", "attitude_latency"});
}

StreamComparison AgainstPosition(const MocapComparison& mocap) {
  return Against(mocap, "position", "sigma", &MocapComparison::Fixes, {"fix_latency", "fix_scale"});
}

// The logged attitude's turn less the gyroscope's, rad, in axes of E'. Offsets: FilterSlopes().
StreamRows GyroRows(const FlightLog& log) {
  const std::vector<GyroInterval> intervals = GyroIntervals(log.imu, log.attitude);
  StreamRows rows{{}, Eigen::VectorXd(3 * intervals.size()), FilterSlopes(intervals)};
  for (std::size_t k = 0; k < intervals.size(); ++k) {
    rows.t.push_back(ToSeconds(static_cast<TimeNs>(k + 1) * kGyroInterval));
    rows.r.segment<3>(static_cast<Eigen::Index>(3 * k)) = intervals[k].turn;
  }
  return rows;
}

}  // namespace

bool IsFittedToMocap(const FlightLog& data) {
  return std::any_of(data.fixes.begin(), data.fixes.end(), [](const Fix& f) { return f.gate < 0; });
}

std::optional<StreamComparison> ComparisonFor(const EffectInfo& info, const MocapComparison& mocap,
                                              bool fitted_to_mocap) {
  if (info.correct == nullptr) return std::nullopt;
  const bool attitude = info.enters == EntersAt::kAttitude;
  if (info.enters == EntersAt::kAccelerometer || (attitude && !mocap.HasOwnAttitude())) {
    return AgainstAcceleration(mocap, fitted_to_mocap);
  }
  return attitude ? AgainstAttitude(mocap) : AgainstPosition(mocap);
}

StreamComparison AgainstAcceleration(const MocapComparison& mocap, bool fitted_to_mocap) {
  return Against(mocap, "acceleration", "m/s^2", &MocapComparison::Acceleration, {},
                 mocap.HasOwnAttitude() || !fitted_to_mocap);
}

StreamComparison AgainstGyroscope() {
  return {.stream = "gyroscope",
          .unit = "rad",
          .alike = {"ahrs_drag_error", "attitude_latency", "tilt_scale"},
          .rows = GyroRows,
          .noiseless =
              [](const FlightLog& log) {
                FlightLog noiseless = log;
                noiseless.attitude = SmoothAttitude(log.imu, log.attitude);
                return noiseless;
              },
          .own_errors = 0.5,
          .stated_by = {{"ahrs_acceleration_error", kFeedback}},
          .passes = 2};
}

std::vector<StreamComparison> IndependentComparisons(const MocapComparison& mocap,
                                                     bool fitted_to_mocap) {
  std::vector<StreamComparison> all{AgainstPosition(mocap)};
  if (mocap.HasOwnAttitude()) all.push_back(AgainstAttitude(mocap));
  const StreamComparison acceleration = AgainstAcceleration(mocap, fitted_to_mocap);
  if (acceleration.independent) all.push_back(acceleration);
  return all;
}

VectorXd RobustWeightsByAxis(const VectorXd& residual) {
  VectorXd weight = VectorXd::Zero(residual.size());
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<double> sizes;
    for (Eigen::Index row = axis; row < residual.size(); row += 3) {
      if (residual[row] != 0.0) sizes.push_back(std::abs(residual[row]));
    }
    if (sizes.empty()) continue;
    const double scale = std::max(1e-9, SigmaOfSizes(std::move(sizes)));
    for (Eigen::Index row = axis; row < residual.size(); row += 3) {
      const double u = std::abs(residual[row]) / scale;
      if (u > 0.0) weight[row] = HuberWeight(kOutlierSigmas, u) / (scale * scale);
    }
  }
  return weight;
}

std::map<int, double> DistancesFromMocap(const StreamRows& rows,
                                         const std::function<bool(double t)>& counts) {
  std::vector<double> t;
  std::vector<Eigen::Index> chosen;  // rows
  for (std::size_t i = 0; i < rows.t.size(); ++i) {
    const auto row = static_cast<Eigen::Index>(3 * i);
    if (!counts(rows.t[i]) || rows.r.segment<3>(row).isZero(0.0)) continue;
    t.push_back(rows.t[i]);
    for (const Eigen::Index axis : {0, 1, 2}) chosen.push_back(row + axis);
  }
  const VectorXd r = rows.r(chosen);
  const Eigen::MatrixXd offsets = rows.nuisances(chosen, Eigen::all);
  if (r.size() <= offsets.cols()) return {};
  VectorXd left = r;
  for (int i = 0; i < kRepeats; ++i) {
    const VectorXd root = RobustWeightsByAxis(left).cwiseSqrt();
    const Eigen::MatrixXd weighted = root.asDiagonal() * offsets;
    left = r - offsets * weighted.completeOrthogonalDecomposition().solve(root.cwiseProduct(r));
  }
  std::map<int, std::pair<double, int>> sums;  // by second: distances and their number
  for (std::size_t i = 0; i < t.size(); ++i) {
    auto& [sum, count] = sums[static_cast<int>(std::floor(t[i]))];
    sum += left.segment<3>(static_cast<Eigen::Index>(3 * i)).norm();
    ++count;
  }
  std::map<int, double> distances;
  for (const auto& [second, of] : sums) distances[second] = of.first / of.second;
  return distances;
}

}  // namespace trueline
