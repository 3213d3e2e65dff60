#include "problems/vgd/vgd_options.h"

#include <map>

#include "problems/common/yaml_options.h"

namespace trueline {
namespace {

const std::map<std::string, FixLoss> kLosses = {{"huber", FixLoss::kHuber},
                                                {"cauchy", FixLoss::kCauchy},
                                                {"none", FixLoss::kNone},
                                                {"norm", FixLoss::kNorm}};
const std::map<std::string, VgdSolver> kSolvers = {
    {"trust_region", VgdSolver::kTrustRegion}, {"gradient_descent", VgdSolver::kGradientDescent}};
const std::map<std::string, ThrustSource> kThrusts = {
    {"accelerometer", ThrustSource::kAccelerometer}, {"level_flight", ThrustSource::kLevelFlight}};
const std::map<std::string, AttitudeSource> kAttitudes = {
    {"logged", AttitudeSource::kLogged},
    {"complementary_filter", AttitudeSource::kComplementaryFilter}};

// YAML gives angles in degrees.
double UnitOf(int parameter) { return parameter >= 3 ? kDegree : 1.0; }

void ReadPriors(const YamlMap& map, std::array<ParameterPrior, 9>* priors) {
  for (int i = 0; i < 9; ++i) {
    const YamlMap entry = map.ChildOrEmpty(kImuDrivenNames[i]);
    ParameterPrior& prior = (*priors)[i];
    const double unit = UnitOf(i);
    prior.mean = unit * entry.Get<double>("mean", prior.mean / unit);
    prior.sigma = unit * entry.Get<double>("sigma", prior.sigma / unit);
    prior.lower = unit * entry.Get<double>("lower", prior.lower / unit);
    prior.upper = unit * entry.Get<double>("upper", prior.upper / unit);
    entry.Finish();
    if (!(prior.sigma > 0.0)) map.Fail(kImuDrivenNames[i], "sigma must be above zero");
    if (!(prior.lower < prior.mean && prior.mean < prior.upper)) {
      map.Fail(kImuDrivenNames[i], "needs lower < mean < upper");
    }
  }
  map.Finish();
}

void ReadProcess(const YamlMap& map, ProcessNoise* process) {
  ReadNotNegative(map, "acceleration_mps2_per_sqrt_hz", &process->acceleration);
  ReadNotNegative(map, "tilt_deg", &process->tilt, kDegree);
  ReadNotNegative(map, "heading_deg", &process->heading, kDegree);
  ReadPositive(map, "memory_s", &process->memory);
  ReadNotNegative(map, "gust_mps2", &process->gust);
  ReadPositive(map, "gust_memory_s", &process->gust_memory);
  map.Finish();
}

void ReadDragMeasurement(const YamlMap& map, DragMeasurementOptions* options) {
  ReadOption(map, "enabled", &options->enabled);
  ReadPositive(map, "interval_s", &options->interval);
  ReadPositive(map, "sigma_mps2", &options->sigma);
  ReadPositive(map, "bias_sigma_mps2", &options->bias_sigma);
  map.Finish();
}

void ReadDrive(const YamlMap& map, DriveOptions* drive) {
  ReadOption(map, "thrust", kThrusts, &drive->thrust);
  ReadOption(map, "attitude", kAttitudes, &drive->attitude);
  ReadNotNegative(map, "filter_k_p_per_s", &drive->filter.k_p);
  ReadNotNegative(map, "filter_k_i_per_s2", &drive->filter.k_i);
  ReadOption(map, "attitude_latency_s", &drive->attitude_latency);
  ReadPositive(map, "max_gap_s", &drive->max_gap);
  map.Finish();
}

}  // namespace

VgdOptions ReadVgdOptions(const YamlMap& map) {
  VgdOptions options;
  ReadCount(map, "gamma", &options.gamma);
  ReadCount(map, "min_window_fixes", &options.min_window_fixes);
  ReadPriors(map.ChildOrEmpty("priors"), &options.priors);
  ReadOption(map, "loss", kLosses, &options.loss);
  ReadPositive(map, "loss_scale_sigmas", &options.loss_scale);
  ReadOption(map, "whiten", &options.whiten);
  ReadProcess(map.ChildOrEmpty("process"), &options.process);
  ReadOption(map, "adapt_drift", &options.adapt_drift);
  ReadPositive(map, "knot_interval_s", &options.knot_interval);
  ReadDragMeasurement(map.ChildOrEmpty("drag_measurement"), &options.drag_measurement);
  ReadOption(map, "solver", kSolvers, &options.solver);
  ReadCount(map, "max_iterations", &options.max_iterations);
  ReadPositive(map, "tolerance", &options.tolerance);
  ReadPositive(map, "max_block_s", &options.max_block);
  ReadPositive(map, "pass_gap_s", &options.passes.pass_gap);
  ReadPositive(map, "max_arc_s", &options.passes.max_arc);
  ReadCount(map, "min_fixes", &options.passes.min_fixes);
  ReadDrive(map.ChildOrEmpty("drive"), &options.drive);
  map.Finish();
  return options;
}

YAML::Node ToYaml(const VgdOptions& options) {
  YAML::Node node;
  node["gamma"] = options.gamma;
  node["min_window_fixes"] = options.min_window_fixes;
  for (int i = 0; i < 9; ++i) {
    const ParameterPrior& prior = options.priors[i];
    YAML::Node entry;
    entry["mean"] = prior.mean / UnitOf(i);
    entry["sigma"] = prior.sigma / UnitOf(i);
    entry["lower"] = prior.lower / UnitOf(i);
    entry["upper"] = prior.upper / UnitOf(i);
    entry.SetStyle(YAML::EmitterStyle::Flow);
    node["priors"][kImuDrivenNames[i]] = entry;
  }
  node["loss"] = NameOf(kLosses, options.loss);
  node["loss_scale_sigmas"] = options.loss_scale;
  node["whiten"] = options.whiten;
  node["process"]["acceleration_mps2_per_sqrt_hz"] = options.process.acceleration;
  node["process"]["tilt_deg"] = options.process.tilt / kDegree;
  node["process"]["heading_deg"] = options.process.heading / kDegree;
  node["process"]["memory_s"] = options.process.memory;
  node["process"]["gust_mps2"] = options.process.gust;
  node["process"]["gust_memory_s"] = options.process.gust_memory;
  node["adapt_drift"] = options.adapt_drift;
  node["knot_interval_s"] = options.knot_interval;
  node["drag_measurement"]["enabled"] = options.drag_measurement.enabled;
  node["drag_measurement"]["interval_s"] = options.drag_measurement.interval;
  node["drag_measurement"]["sigma_mps2"] = options.drag_measurement.sigma;
  node["drag_measurement"]["bias_sigma_mps2"] = options.drag_measurement.bias_sigma;
  node["solver"] = NameOf(kSolvers, options.solver);
  node["max_iterations"] = options.max_iterations;
  node["tolerance"] = options.tolerance;
  node["max_block_s"] = options.max_block;
  node["pass_gap_s"] = options.passes.pass_gap;
  node["max_arc_s"] = options.passes.max_arc;
  node["min_fixes"] = options.passes.min_fixes;
  node["drive"]["thrust"] = NameOf(kThrusts, options.drive.thrust);
  node["drive"]["attitude"] = NameOf(kAttitudes, options.drive.attitude);
  node["drive"]["filter_k_p_per_s"] = options.drive.filter.k_p;
  node["drive"]["filter_k_i_per_s2"] = options.drive.filter.k_i;
  node["drive"]["attitude_latency_s"] = options.drive.attitude_latency;
  node["drive"]["max_gap_s"] = options.drive.max_gap;
  return node;
}

}  // namespace trueline
