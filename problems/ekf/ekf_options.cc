#include "problems/ekf/ekf_options.h"

#include <cmath>
#include <string>
#include <vector>

#include "problems/common/units.h"
#include "problems/common/yaml_options.h"

namespace trueline {
namespace {

const std::map<std::string, EkfTuning> kTunings = {{"consistent", EkfTuning::kConsistent},
                                                   {"paper", EkfTuning::kPaper}};
const std::map<std::string, AttitudeForm> kForms = {{"euler", AttitudeForm::kEuler},
                                                    {"error_state", AttitudeForm::kErrorState}};
const std::map<std::string, EkfGating> kGatings = {{"none", EkfGating::kNone},
                                                   {"chi_square", EkfGating::kChiSquare}};
const std::map<std::string, CovarianceForm> kCovariances = {{"sparse", CovarianceForm::kSparse},
                                                            {"dense", CovarianceForm::kDense}};

// One positive number of the options with its key; `unit` is the key's unit in SI.
struct Entry {
  const char* key;
  double* value;
  double unit = 1.0;
};

std::vector<Entry> NoiseEntries(ImuNoise* noise) {
  return {{"accel_noise_mps2_per_sqrt_hz", &noise->accel},
          {"gyro_noise_deg_per_s_per_sqrt_hz", &noise->gyro, kDegree},
          {"accel_bias_walk_mps3_per_sqrt_hz", &noise->accel_walk},
          {"gyro_bias_walk_deg_per_s2_per_sqrt_hz", &noise->gyro_walk, kDegree}};
}

std::vector<Entry> StartEntries(EkfStart* start) {
  return {{"position_sigma_m", &start->position},
          {"velocity_sigma_mps", &start->velocity},
          {"tilt_sigma_deg", &start->tilt, kDegree},
          {"heading_sigma_deg", &start->heading, kDegree},
          {"accel_bias_sigma_mps2", &start->accel_bias},
          {"gyro_bias_sigma_deg_per_s", &start->gyro_bias, kDegree}};
}

void ReadPaperQ(const YamlMap& map, std::array<double, 9>* q) {
  const auto values =
      map.Get<std::vector<double>>("q_per_sample", std::vector<double>(q->begin(), q->end()));
  bool good = values.size() == q->size();
  for (const double value : values) good = good && value >= 0.0;
  if (!good) {
    map.Fail("q_per_sample",
             "needs nine variances of zero or above: three each for p (m^2), "
             "v (m^2/s^2), Phi (rad^2)");
  }
  std::copy(values.begin(), values.end(), q->begin());
}

}  // namespace

EkfOptions ReadEkfOptions(const YamlMap& map) {
  EkfOptions options;
  ReadOption(map, "tuning", kTunings, &options.tuning);
  ReadOption(map, "attitude", kForms, &options.attitude);
  ReadOption(map, "gating", kGatings, &options.gating);
  ReadPositive(map, "gate_chi_square", &options.gate);
  ReadOption(map, "max_refusals", &options.max_refusals);
  ReadOption(map, "iterated", &options.iterated);
  ReadOption(map, "covariance", kCovariances, &options.covariance);
  const YamlMap noise = map.ChildOrEmpty("noise"), start = map.ChildOrEmpty("start");
  for (const Entry& e : NoiseEntries(&options.noise)) {
    ReadNotNegative(noise, e.key, e.value, e.unit);
  }
  ReadOption(noise, "gyro_from_log", &options.gyro_from_log);
  noise.Finish();
  for (const Entry& e : StartEntries(&options.start)) ReadPositive(start, e.key, e.value, e.unit);
  start.Finish();
  const YamlMap paper = map.ChildOrEmpty("paper");
  ReadPaperQ(paper, &options.paper_q);
  ReadPositive(paper, "p0", &options.paper_p0);
  ReadPositive(paper, "fix_sigma_m", &options.paper_fix_sigma);
  ReadPositive(paper, "sample_rate_hz", &options.paper_rate);
  paper.Finish();
  map.Finish();
  return options;
}

YAML::Node ToYaml(const EkfOptions& given) {
  EkfOptions options = given;  // the tables of entries point into it
  YAML::Node node;
  node["tuning"] = NameOf(kTunings, options.tuning);
  node["attitude"] = NameOf(kForms, options.attitude);
  node["gating"] = NameOf(kGatings, options.gating);
  node["gate_chi_square"] = options.gate;
  node["max_refusals"] = options.max_refusals;
  node["iterated"] = options.iterated;
  node["covariance"] = NameOf(kCovariances, options.covariance);
  for (const Entry& e : NoiseEntries(&options.noise)) node["noise"][e.key] = *e.value / e.unit;
  node["noise"]["gyro_from_log"] = options.gyro_from_log;
  for (const Entry& e : StartEntries(&options.start)) node["start"][e.key] = *e.value / e.unit;
  node["paper"]["q_per_sample"] =
      std::vector<double>(options.paper_q.begin(), options.paper_q.end());
  node["paper"]["p0"] = options.paper_p0;
  node["paper"]["fix_sigma_m"] = options.paper_fix_sigma;
  node["paper"]["sample_rate_hz"] = options.paper_rate;
  return node;
}

}  // namespace trueline
