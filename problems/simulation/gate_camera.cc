#include "problems/simulation/gate_camera.h"

#include <algorithm>
#include <cmath>

#include "problems/common/units.h"

namespace trueline::simulation {
namespace {

constexpr double kShortestView = 0.1;  // s, and the longest gap within a view

}  // namespace

GateCamera::GateCamera(const DetectorConfig& config, const std::vector<Gate>& map,
                       const Stages& stages, std::uint64_t seed)
    : config_(config),
      map_(map),
      stages_(stages),
      latency_(config.latency),
      times_(seed, "fix_times"),
      noise_(seed, "fix_noise"),
      outliers_(seed, "fix_outliers"),
      jitter_(seed, "fix_jitter"),
      false_gates_(seed, "false_gates") {
  for (const Gate& gate : map_) {
    standing_.push_back(gate.position);
    Apply(stages_.gate, gate.id, &standing_.back());
  }
  Apply(stages_.fix_latency, &latency_);
}

bool GateCamera::Sees(const TruthSample& sample, int gate) const {
  const Vector3d u_E = standing_[gate] - sample.p_E;
  const double distance = u_E.norm();
  if (distance < config_.range_min || distance > config_.range_max) return false;
  const double yaw = map_[gate].yaw;
  const double through = (u_E.x() * std::cos(yaw) + u_E.y() * std::sin(yaw)) / distance;
  if (through < std::cos(config_.max_view_deg * kDegree)) return false;
  const Vector3d u_B = sample.q_E_B.conjugate() * u_E;
  const Vector3d u_C =
      Eigen::AngleAxisd(-config_.camera_pitch_deg * kDegree, Vector3d::UnitY()) * u_B;
  return std::abs(std::atan2(u_C.y(), u_C.x())) < 0.5 * config_.fov_horizontal_deg * kDegree &&
         std::abs(std::atan2(u_C.z(), u_C.x())) < 0.5 * config_.fov_vertical_deg * kDegree;
}

int GateCamera::VisibleGate(const TruthSample& sample) const {
  int nearest = -1;
  for (int i = 0; i < static_cast<int>(map_.size()); ++i) {
    if (!Sees(sample, i)) continue;
    const auto distance = [&](int gate) { return (standing_[gate] - sample.p_E).norm(); };
    if (nearest < 0 || distance(i) < distance(nearest)) nearest = i;
  }
  return nearest;
}

std::vector<GateView> GateCamera::Views(const Trajectory& truth) const {
  std::vector<GateView> views;
  for (const TruthSample& sample : truth.samples()) {
    if (sample.t < 0.0) continue;
    const int gate = VisibleGate(sample);
    if (gate < 0) continue;
    if (!views.empty() && views.back().gate == gate &&
        sample.t - views.back().end < kShortestView) {
      views.back().end = sample.t;
    } else {
      views.push_back({gate, sample.t, sample.t});
    }
  }
  std::erase_if(views, [](const GateView& v) { return v.end - v.start < kShortestView; });
  return views;
}

// Outliers are drawn for every fix, so that enabling them changes no other random number.
Vector3d GateCamera::Noise(double sigma) {
  const bool outlier = outliers_.Bernoulli(config_.outlier_share);
  Vector3d wrong;
  for (double& axis : wrong) axis = outliers_.Uniform(-config_.outlier_size, config_.outlier_size);
  if (outlier) return wrong;
  if (config_.tail_dof <= 0.0) return sigma * noise_.NormalVector3();
  Vector3d noise;
  for (double& axis : noise) axis = sigma * noise_.StudentT(config_.tail_dof);
  return noise;
}

// Fix = map position - R_E_B * measured vector + noise: errors of map, vector and attitude all
// enter the fix.
Fix GateCamera::Measure(const Trajectory& truth, int gate, double t) {
  const TruePose pose = truth.At(t);
  Vector3d object_E = standing_[gate];
  Apply(stages_.false_gate, map_[gate].id, &false_gates_, &object_E);
  Vector3d u_B = pose.q_E_B.conjugate() * (object_E - pose.p_E);
  const double distance = (standing_[gate] - pose.p_E).norm();
  Apply(stages_.gate_vector, &u_B);
  const Quaterniond& turn = config_.turned_by_ahrs ? pose.q_Ep_I : pose.q_E_B;
  Fix fix;
  fix.sigma = std::max(config_.sigma_floor, config_.sigma_factor * distance);
  fix.p_E = map_[gate].position - turn * u_B + Noise(fix.sigma);
  fix.gate = map_[gate].id;
  fix.t = FromSeconds(t + latency_ + config_.jitter * jitter_.Normal());
  return fix;
}

std::vector<Fix> GateCamera::Fixes(const Trajectory& truth) {
  std::vector<Fix> fixes;
  for (const GateView& view : Views(truth)) {
    const int most = std::max(1, static_cast<int>((view.end - view.start) * config_.max_rate));
    const int wanted = times_.UniformInt(config_.fixes_min, config_.fixes_max);
    std::vector<double> times(std::min(wanted, most));
    for (double& t : times) t = times_.Uniform(view.start, view.end);
    std::sort(times.begin(), times.end());
    for (const double t : times) fixes.push_back(Measure(truth, view.gate, t));
  }
  std::sort(fixes.begin(), fixes.end(), [](const Fix& a, const Fix& b) { return a.t < b.t; });
  const auto same = [](const Fix& a, const Fix& b) { return a.t == b.t; };
  fixes.erase(std::unique(fixes.begin(), fixes.end(), same), fixes.end());
  return fixes;
}

}  // namespace trueline::simulation
