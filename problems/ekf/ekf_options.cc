#include "problems/ekf/ekf_options.h"

#include <algorithm>
#include <vector>

#include "problems/common/units.h"

namespace trueline {
namespace {

void SerializeStart(YamlArchive* a, EkfStart* start) {
  a->Positive("position_sigma_m", &start->position);
  a->Positive("velocity_sigma_mps", &start->velocity);
  a->Positive("tilt_sigma_deg", &start->tilt, kDegree);
  a->Positive("heading_sigma_deg", &start->heading, kDegree);
  a->Positive("accel_bias_sigma_mps2", &start->accel_bias);
  a->Positive("gyro_bias_sigma_deg_per_s", &start->gyro_bias, kDegree);
}

// `above`: what every variance must exceed.
template <std::size_t kSize>
void SerializeVariances(YamlArchive* a, const std::string& key, double above,
                        const std::string& remedy, std::array<double, kSize>* variances) {
  std::vector<double> read(variances->begin(), variances->end());
  a->Value(key, &read);
  const bool valid =
      read.size() == kSize &&
      std::all_of(read.begin(), read.end(), [=](double value) { return value > above; });
  a->Require(valid, key, remedy);
  if (valid) std::copy(read.begin(), read.end(), variances->begin());
}

void SerializePaper(YamlArchive* a, EkfOptions* o) {
  SerializeVariances(a, "q_per_sample", -1e-300,
                     "needs nine variances of zero or above: three each for p (m^2), v (m^2/s^2), "
                     "Phi (rad^2)",
                     &o->paper_q);
  SerializeVariances(a, "p0", 0.0,
                     "needs five variances above zero: of p (m^2), v (m^2/s^2), Phi (rad^2), "
                     "b_a (m^2/s^4), b_g (rad^2/s^2)",
                     &o->paper_p0);
  a->Positive("fix_sigma_m", &o->paper_fix_sigma);
  a->Positive("sample_rate_hz", &o->paper_rate);
}

}  // namespace

void Serialize(YamlArchive* a, EkfOptions* o) {
  a->Choice("tuning", &o->tuning,
            {{"consistent", EkfTuning::kConsistent}, {"paper", EkfTuning::kPaper}});
  a->Choice("attitude", &o->attitude,
            {{"error_state", AttitudeForm::kErrorState}, {"euler", AttitudeForm::kEuler}});
  a->Choice("gating", &o->gating,
            {{"chi_square", EkfGating::kChiSquare}, {"none", EkfGating::kNone}});
  a->Positive("gate_chi_square", &o->gate);
  a->Value("max_refusals", &o->max_refusals);
  a->Value("iterated", &o->iterated);
  a->Map("start", [o](YamlArchive* map) { SerializeStart(map, &o->start); });
  a->Map("paper", [o](YamlArchive* map) { SerializePaper(map, o); });
}

}  // namespace trueline
