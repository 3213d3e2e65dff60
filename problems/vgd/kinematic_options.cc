#include "problems/vgd/kinematic_options.h"

#include "problems/common/units.h"

namespace trueline {

void Serialize(YamlArchive* a, KinematicOptions* o) {
  a->Value("initial_attitude", &o->initial_attitude);
  a->Positive("accel_bias_sigma_mps2", &o->accel_bias_sigma);
  a->Positive("gyro_bias_sigma_deg_per_s", &o->gyro_bias_sigma, kDegree);
  a->Positive("tilt_sigma_deg", &o->tilt_sigma, kDegree);
  a->Positive("heading_sigma_deg", &o->heading_sigma, kDegree);
}

}  // namespace trueline
