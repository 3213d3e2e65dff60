// Faults of a log: a row for each kind, and what an inspection found of it.
#pragma once

#include <limits>
#include <string>

namespace trueline {

// What a fault does to a calibration, worst first.
enum class Level {
  kFatal,   // no calibration is possible, or each is wrong: axes, signs, clocks of another origin
  kBiases,  // parameters come out wrong by more than their intervals say
  kWidens,  // parameters come out less certain
  kNote     // no harm by itself
};

const char* NameOf(Level level);  // "fatal", "biases", "widens", "note"

struct Finding;

// config/reference/findings.md says what each means.
struct FaultKind {
  const char* id;
  const char* unit;  // of a finding's size
  // Whether every program warns of it before a fit, where it is not fatal; null: trueline inspect
  // alone tells it.
  bool (*is_warned)(const Finding& finding) = nullptr;
  // An effect of the diagnosis states it as well: late sensors, scales, a heading that drifts.
  bool is_effect = false;
};

// One fault of a log, with its size, its certainty, what it does to a calibration and its remedy.
struct Finding {
  const FaultKind* kind = nullptr;
  std::string stream = {};  // of the native log
  Level level = Level::kNote;
  double size = 0.0;
  // m/s^2, the error of the specific force in earth axes that the fault makes in this flight; the
  // order within a level. Zero where that is not the harm.
  double error = 0.0;
  double sigma = std::numeric_limits<double>::quiet_NaN();  // one standard deviation of `size`
  std::string text = {};                                    // one sentence, with figures
  std::string remedy = {};                                  // one sentence
  bool repaired = false;                                    // the corrected map holds the repair

  bool Biases() const { return level <= Level::kBiases; }
};

namespace fault {

// Of a finding that is not fatal.
bool Always(const Finding&);
bool OfFixes(const Finding& finding);
bool OfRotorsWhereItBiases(const Finding& finding);
bool OfDriveWhereItBiases(const Finding& finding);  // IMU, rotors or motors
bool OfHarmfulLag(const Finding& finding);
bool OfPlaceDrift(const Finding& finding);
bool OfOtherUnit(const Finding& finding);

// One stream by itself.
inline constexpr FaultKind kImuSlow{"imu_slow", "Hz"};
inline constexpr FaultKind kImuFast{"imu_fast", "Hz"};
inline constexpr FaultKind kJitter{"jitter", "s"};
inline constexpr FaultKind kGaps{"gaps", "s", OfRotorsWhereItBiases};
inline constexpr FaultKind kRepeats{"repeats", "1", OfFixes};
inline constexpr FaultKind kSpikes{"spikes", "samples", OfDriveWhereItBiases};
inline constexpr FaultKind kSaturation{"saturation", "s"};
inline constexpr FaultKind kVibration{"vibration", "m/s^2"};
inline constexpr FaultKind kFiltered{"filtered", "Hz"};
inline constexpr FaultKind kDeadAxis{"dead_axis", "1", Always};  // against the sensor's other axes
inline constexpr FaultKind kDeadSensor{"dead_axis", "s", Always};  // for so long
inline constexpr FaultKind kDeadRotor{"dead_rotor", "1", Always};
inline constexpr FaultKind kRotorsSlow{"rotors_slow", "1", Always};
inline constexpr FaultKind kStuck{"stuck", "s", Always};
inline constexpr FaultKind kTrackingLost{"tracking_lost", "s"};
inline constexpr FaultKind kSharedStamps{"shared_stamps", "1"};
inline constexpr FaultKind kRowsLost{"rows_lost", "1"};

// Clocks, and what they have in common.
inline constexpr FaultKind kCover{"cover", "1", Always};
inline constexpr FaultKind kAttitudeMissing{"attitude_missing", "1", Always};
inline constexpr FaultKind kTimeUnit{"time_unit", "1"};
inline constexpr FaultKind kTimeScale{"time_scale", "1"};
inline constexpr FaultKind kClockJump{"clock_jump", "s", Always};
inline constexpr FaultKind kClockOffset{"clock_offset", "s", OfHarmfulLag, true};
inline constexpr FaultKind kClockDrift{"clock_drift", "s/s", OfPlaceDrift};
inline constexpr FaultKind kPositionLate{"position_late", "s"};

// Attitude, gyroscope and accelerometer.
inline constexpr FaultKind kRatesDisagree{"rates_disagree", "1"};
inline constexpr FaultKind kQuaternionForm{"quaternion_form", "1"};
inline constexpr FaultKind kAngleForm{"angle_form", "1"};
inline constexpr FaultKind kImuAxes{"imu_axes", "deg"};
inline constexpr FaultKind kBodyAxes{"body_axes", "deg"};
inline constexpr FaultKind kBodyUp{"body_up", "deg"};
inline constexpr FaultKind kEarthUp{"earth_up", "deg"};
inline constexpr FaultKind kGyroScale{"gyro_scale", "1", OfOtherUnit};
inline constexpr FaultKind kAttitudeScale{"attitude_scale", "1"};
inline constexpr FaultKind kNotSpecificForce{"not_specific_force", "m/s^2"};
inline constexpr FaultKind kGravityMissing{"gravity_missing", "m/s^2"};
inline constexpr FaultKind kGravityDirection{"gravity_direction", "deg"};
inline constexpr FaultKind kGravityAtRest{"gravity_at_rest", "1"};
inline constexpr FaultKind kGyroBiasAtRest{"gyro_bias_at_rest", "rad/s"};
inline constexpr FaultKind kAccelerometerAxes{"accelerometer_axes", "deg"};
inline constexpr FaultKind kAccelerometerScale{"accelerometer_scale", "1", Always, true};
inline constexpr FaultKind kAccelerometerBias{"accelerometer_bias", "m/s^2"};
inline constexpr FaultKind kLateralForce{"lateral_force", "1", Always};

// Positions.
inline constexpr FaultKind kPositionAxes{"position_axes", "deg"};
inline constexpr FaultKind kPositionScale{"position_scale", "1"};
inline constexpr FaultKind kPositionSpread{"position_spread", "m", Always};
inline constexpr FaultKind kGateApart{"gate_apart", "m"};
inline constexpr FaultKind kHeadingOffset{"heading_offset", "deg", Always};
inline constexpr FaultKind kHeadingDrift{"heading_drift", "deg/s", Always, true};

// Rotors.
inline constexpr FaultKind kRotorOrder{"rotor_order", "1"};
inline constexpr FaultKind kRotorSpin{"rotor_spin", "rotors"};
inline constexpr FaultKind kRotorSpinsReversed{"rotor_spins_reversed", "rotors"};
inline constexpr FaultKind kRotorUnit{"rotor_unit", "1"};
inline constexpr FaultKind kRotorThrust{"rotor_thrust", "1", Always};

}  // namespace fault
}  // namespace trueline
