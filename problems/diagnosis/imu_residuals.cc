// What a diagnosis of the IMU-driven model reports: residuals, parameters and noise.
#include <cmath>

#include "problems/diagnosis/imu_flight.h"
#include "problems/diagnosis/whiteness.h"
#include "problems/result/yaml_text.h"

namespace trueline {
namespace {

// The nuisance strengths, learned with the causes in the model.
YAML::Node NoiseNode(const NoiseStrengths& noise) {
  YAML::Node node;
  node["fix_scale"] = Rounded(noise.fix_scale, 3);
  node["force_sigma_mps2"] = Rounded(noise.force_sigma, 3);
  node["gust_mps2"] = Rounded(noise.process.gust, 3);
  node["gust_memory_s"] = Rounded(noise.process.gust_memory, 3);
  node["acceleration_mps2_per_sqrt_hz"] = Rounded(noise.process.acceleration, 3);
  node["tilt_deg"] = Rounded(noise.process.tilt / kDegree, 3);
  node["heading_deg"] = Rounded(noise.process.heading / kDegree, 3);
  node["memory_s"] = Rounded(noise.process.memory, 3);
  node.SetStyle(YAML::EmitterStyle::Flow);
  return node;
}

}  // namespace

Residuals ImuDrivenFlight::WhitenedResiduals() const {
  const ChainSystem system(fit_.Linear(*flight_), fit_.noise);
  const Eigen::VectorXd sigmas = system.Whitened(system.reduced().Fitted());
  Residuals residuals;
  std::vector<TimedResidual> fixes;
  int row = 0;
  for (const std::size_t i : plan_.fixes) {
    const Fix& fix = flight_->log().fixes[i];
    residuals.rows.push_back({ToSeconds(fix.t), "fix", fix.gate, sigmas.segment<3>(row)});
    fixes.push_back({ToSeconds(fix.t), sigmas.segment<3>(row)});
    row += 3;
  }
  residuals.rms = std::sqrt(sigmas.head(row).squaredNorm() / std::max(1, row));
  for (const std::size_t i : plan_.forces) {
    residuals.rows.push_back({ToSeconds(flight_->forces()[i].t), "force", -1,
                              Eigen::Vector3d(sigmas[row], sigmas[row + 1], 0.0)});
    row += 2;
  }
  constexpr double kNeighbours = 0.3;  // s
  residuals.whiteness_p = WhitenessOf(fixes, kNeighbours);
  return residuals;
}

std::vector<ParameterEstimate> ImuDrivenFlight::Estimates() const {
  const ThetaVector value = Parameters(), sigma = Sigmas();
  std::vector<ParameterEstimate> estimates;
  for (int i = 0; i < kStatedSize; ++i) {
    estimates.push_back({kTheta[i].name, value[i], sigma[i], kTheta[i].unit, ""});
  }
  return estimates;
}

void ImuDrivenFlight::Describe(Diagnosis* diagnosis) const {
  for (const ParameterEstimate& p : Estimates()) {
    diagnosis->parameters.push_back({p.name, p.unit, p.value, p.sigma});
  }
  diagnosis->residual_of = "residual of fixes";
  diagnosis->warnings.insert(diagnosis->warnings.end(), data_.warnings.begin(),
                             data_.warnings.end());
  if (log_->continuous) diagnosis->fixes = log_->continuous->Text();
  diagnosis->noise = NoiseNode(fit_.noise);
}

}  // namespace trueline
