#include "problems/rotor/rotor_noise.h"

namespace trueline {

void Serialize(YamlArchive* a, RotorNoise* noise) {
  a->Positive("sigma_accel", &noise->accel);
  a->Positive("sigma_gyro", &noise->gyro);
  a->Positive("sigma_position", &noise->position);
  a->Positive("sigma_attitude", &noise->attitude);
  a->Positive("force_density", &noise->force_density);
  a->Positive("angular_density", &noise->angular_density);
  a->NotNegative("angular_drift", &noise->angular_drift);
  a->Positive("angular_drift_time", &noise->angular_drift_time);
}

}  // namespace trueline
