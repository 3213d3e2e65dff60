// Errors of the rotor-driven model: open-loop replays by rotor speeds alone, the half of a flight
// that it was not fitted to, unmodelled forces; and what a diagnosis reports of the fit.
#include <Eigen/Cholesky>
#include <algorithm>
#include <cmath>

#include "problems/diagnosis/gain.h"
#include "problems/diagnosis/misfit.h"
#include "problems/diagnosis/rotor_flight.h"
#include "problems/diagnosis/thresholds.h"
#include "problems/result/statistics.h"
#include "problems/rotor/rotor_state.h"
#include "problems/rotor/rotor_step.h"

namespace trueline {
namespace {

constexpr double kReplaySpacing = 0.1;  // s, between starts

// The pose nearest to t.
std::size_t NearestPose(const RotorData& data, double t) {
  const auto& poses = data.poses;
  const auto after = std::ranges::lower_bound(poses, t, {}, &RotorPose::t);
  if (after == poses.begin()) return 0;
  const auto nearest =
      after == poses.end() || t - std::prev(after)->t < after->t - t ? std::prev(after) : after;
  return static_cast<std::size_t>(nearest - poses.begin());
}

// The share of a step of the constants, at most 1, that leaves mass and inertia a fifth of their
// values. Half a flight may show inertia so badly that the whole step, which is linear, makes it
// negative.
double ShareWithinBody(const RotorConstants& from, const RotorConstants& step) {
  constexpr double kLeastLeft = 0.2;
  double share = 1.0;
  for (const int i :
       {kMassConstant, kInertiaConstants, kInertiaConstants + 1, kInertiaConstants + 2}) {
    if (step[i] < 0.0) share = std::min(share, (1.0 - kLeastLeft) * from[i] / -step[i]);
  }
  return std::max(share, 0.0);
}

// The unmodelled force between two poses: mean specific force and angular acceleration (body
// axes), in sigmas of what the flight resolves.
Eigen::Matrix<double, 6, 1> DisturbanceOf(const RotorSetup& setup, const RotorNoise& noise,
                                          const RotorNode& start, const RotorNode& next,
                                          const RotorConstants& constants, RotorSegment span) {
  const auto accelerations = [](double, const RotorState&, Eigen::MatrixXd* out) {
    out->setIdentity(12, 6);
  };
  SegmentModel segment(setup.model, *setup.data, noise, std::move(span), {});
  const SegmentPath path = segment.Follow(start, constants);
  segment.SetWeight(path);
  SegmentResidual residual = segment.Evaluate(path, next);
  segment.Whiten(&residual);
  Eigen::MatrixXd response = segment.Respond(path, next, 6, accelerations);
  segment.Whiten(&response);
  Eigen::Matrix<double, 6, 1> sigmas;
  for (int j = 0; j < 6; ++j) {
    sigmas[j] = -response.col(j).dot(residual.error) / response.col(j).norm();
  }
  return sigmas;
}

}  // namespace

std::vector<ReplayError> RotorDrivenFlight::ReplayOpenLoop() const {
  RotorData data = *fit_.setup->data;
  const double spacing =
      (data.poses.back().t - data.poses.front().t) / static_cast<double>(data.poses.size() - 1);
  const double gap = std::max(0.05, 0.6 * spacing);  // s, between the horizon and the nearest pose
  if (data.motors) data.SimulateMotors(MotorsOf(fit_.batch.mean));
  std::vector<ReplayError> errors;
  double next = data.poses.front().t;
  for (std::size_t i = 0; i < data.poses.size(); ++i) {
    double from = data.poses[i].t;
    if (from < next) continue;
    next = from + kReplaySpacing;
    RotorState x = Joined(fit_.batch.nodes[i].motion, fit_.batch.mean);
    Eigen::Vector3d drift = fit_.batch.nodes[i].drift;
    const Eigen::Vector3d p_E = SensedPosition(x);
    for (const double horizon : kReplayHorizons) {
      const double asked = data.poses[i].t + horizon;
      if (asked > data.poses.back().t) break;
      const RotorPose& pose = data.poses[NearestPose(data, asked)];
      if (pose.t <= from || std::abs(pose.t - asked) > gap) continue;
      x = Integrated(fit_.setup->model, data, options_.noise, x, &drift, from, pose.t);
      from = pose.t;
      const Eigen::Vector3d error_E = SensedPosition(x) - p_E - (pose.p_E - data.poses[i].p_E);
      errors.push_back({static_cast<int>(i), horizon, data.origin + FromSeconds(pose.t), error_E,
                        AttitudeOf(x).transpose() * error_E});
    }
  }
  return errors;
}

std::string RotorDrivenFlight::ReplaysAgainst() const { return "poses"; }

ReplaySituation RotorDrivenFlight::SituationOf(const ReplayError& replay) const {
  const RotorData& data = *fit_.setup->data;
  const double t = SecondsBetween(data.origin, replay.end) - 0.5 * replay.horizon;
  const std::size_t i = NearestPose(data, t);
  const RotorState x = Joined(fit_.batch.nodes[i].motion, fit_.batch.mean);
  const Eigen::Matrix3d R_E_B = AttitudeOf(x);
  const Eigen::Vector3d f_B = fit_.setup->model.BodyAccelerationOf(x.data(), data.InputAt(t)).force;
  const Eigen::Vector3d p_E = SensedPosition(x);
  ReplaySituation at;
  at.time = data.since_start + t;
  at.speed = x.segment<3>(RotorDrivenModel::kVelocity).norm();
  at.acceleration = (R_E_B * f_B + log_.gravity * Eigen::Vector3d::UnitZ()).norm();
  at.thrust = -f_B.z();
  at.rate = x.segment<3>(RotorDrivenModel::kRate).norm();
  at.heading = Heading(R_E_B);
  at.height = -p_E.z();
  at.battery = LastBefore(log_.battery, data.origin + FromSeconds(t));
  at.north = p_E.x();
  at.east = p_E.y();
  return at;
}

RotorDrivenFlight::PartFit RotorDrivenFlight::FitWithout(int half,
                                                         const std::vector<Found>& found) const {
  std::vector<bool> used(Normal().clusters());
  for (std::size_t c = 0; c < used.size(); ++c) used[c] = HalfOf(static_cast<int>(c)) != half;
  const RotorNormal normal = Normal().Only(used);
  Eigen::VectorXd z = normal.M().ldlt().solve(-normal.b());
  const RotorPrior& prior = fit_.setup->prior;
  const std::vector<int> free = prior.Free();
  RotorConstants step = RotorConstants::Zero();
  for (std::size_t i = 0; i < free.size(); ++i) {
    step[free[i]] = z[static_cast<int>(i)] * prior.sigma[free[i]];
  }
  const double share = ShareWithinBody(fit_.batch.mean, step);
  z *= share;
  PartFit part{fit_.batch.mean + share * step, {}};
  const auto fit = Linearise({}, false);
  for (std::size_t k = 0; k < found.size(); ++k) {
    const Eigen::VectorXd steps = z(fit->found[k].columns);
    const Eigen::VectorXd sizes = steps.cwiseProduct(fit->found[k].unit);
    part.effects.push_back(found[k].candidate.At(found[k].value + sizes));
  }
  return part;
}

// Open-loop position errors after half a second, by the cluster in which they start: means over
// starts. None of a half where the filter diverges with the other half's fit.
HeldOutErrors RotorDrivenFlight::ErrorsHeldOut(const std::vector<Found>& found,
                                               bool /*with_false_data*/) const {
  HeldOutErrors errors;
  errors.metric = "open_loop_position_error_0.5s";
  const int count = Normal().clusters();
  if (count < kFewestBlocks) return errors;
  for (const int half : {0, 1}) {
    PartFit part = FitWithout(half, found);
    const RotorSetup setup = MakeRotorSetup(log_, options_, *lagged_, part.effects);
    part.constants = setup.prior.WithKnown(part.constants);
    const double start = setup.data->poses.front().t;
    const double length = setup.data->poses.back().t - start;
    std::map<int, std::vector<double>> by_cluster;
    for (const OpenLoopError& e :
         PredictOpenLoop(setup.model, *setup.data, options_.noise, part.constants, part.constants,
                         {kReplayHorizons[1]}, kReplaySpacing)) {
      const int cluster = std::min(count - 1, static_cast<int>((e.t - start) / length * count));
      if (HalfOf(cluster) == half) by_cluster[cluster].push_back(e.error);
    }
    for (const auto& [cluster, values] : by_cluster) errors.arcs[cluster] = Mean(values);
  }
  return errors;
}

Residuals RotorDrivenFlight::WhitenedResiduals() const {
  constexpr double kBlock = 0.5;  // s; pose noise correlates neighbours within a block
  const RotorData& data = *fit_.setup->data;
  Residuals residuals;
  std::vector<TimedResidual> timed;
  std::vector<RotorSegment> segments = CutSegments(data);
  double squares = 0.0;
  for (std::size_t i = 0; i < segments.size(); ++i) {
    const Eigen::Matrix<double, 6, 1> sigmas =
        DisturbanceOf(*fit_.setup, options_.noise, fit_.batch.nodes[i], fit_.batch.nodes[i + 1],
                      fit_.batch.mean, std::move(segments[i]));
    const double t = data.poses[i].t, since_start = data.since_start + t;
    residuals.rows.push_back({since_start, "specific_force", -1, sigmas.head<3>()});
    residuals.rows.push_back({since_start, "angular_acceleration", -1, sigmas.tail<3>()});
    timed.push_back({t, sigmas});
    squares += sigmas.squaredNorm();
  }
  residuals.rms = std::sqrt(squares / (6.0 * static_cast<double>(segments.size())));
  residuals.whiteness_p = WhitenessOf(SumsOfBlocks(timed, kBlock), 2.0 * kBlock);
  return residuals;
}

void RotorDrivenFlight::Describe(Diagnosis* diagnosis) const {
  std::vector<std::string> unobservable;
  const RotorWeights weights = fit_.weights.By();
  const RotorBatchResult batch = fit_.batch.cov.size() > 0
                                     ? fit_.batch
                                     : RunRotorBatch(fit_.setup->model, *fit_.setup->data,
                                                     BatchOptions(), &fit_.batch, &weights);
  DescribeConstants(batch, fit_.setup->prior, &diagnosis->parameters, &unobservable);
  diagnosis->warnings.insert(diagnosis->warnings.end(), options_.warnings.begin(),
                             options_.warnings.end());
  diagnosis->drive = "rotors";
  diagnosis->residual_of = "disturbances between poses";
  diagnosis->noise = ToYaml(options_.noise);
  diagnosis->rotor_delay = options_.data.rotor_delay;
  diagnosis->gyro_delay = options_.data.gyro_delay;
}

}  // namespace trueline
