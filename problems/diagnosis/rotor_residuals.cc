// What a diagnosis of the rotor-driven model reports: unmodelled forces, constants and noise.
#include <cmath>

#include "problems/diagnosis/rotor_flight.h"
#include "problems/diagnosis/whiteness.h"

namespace trueline {
namespace {

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
  std::vector<ParameterEstimate> constants;
  std::vector<std::string> unobservable;
  DescribeConstants(WithCovariance(), fit_.setup->prior, &constants, &unobservable);
  for (const ParameterEstimate& c : constants) {
    diagnosis->parameters.push_back({c.name, c.unit, c.value, c.sigma});
  }
  diagnosis->warnings.insert(diagnosis->warnings.end(), options_.warnings.begin(),
                             options_.warnings.end());
  diagnosis->drive = "rotors";
  diagnosis->residual_of = "disturbances between poses";
  diagnosis->noise = ToYaml(options_.noise);
  diagnosis->rotor_delay = options_.data.rotor_delay;
  diagnosis->gyro_delay = options_.data.gyro_delay;
}

}  // namespace trueline
