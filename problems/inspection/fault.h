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

// A row of the table below, whose comment is the text of config/reference/findings.md.
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

// The IMU is logged too slowly.
inline constexpr FaultKind kImuSlow{"imu_slow", "Hz"};
// The IMU is logged faster than sensors are.
inline constexpr FaultKind kImuFast{"imu_fast", "Hz"};
// Stamps scatter about even intervals.
inline constexpr FaultKind kJitter{"jitter", "s"};
// Samples are missing.
inline constexpr FaultKind kGaps{"gaps", "s", OfRotorsWhereItBiases};
// Samples repeat the one before in more than three of ten. Repaired: takes new rows alone.
inline constexpr FaultKind kRepeats{"repeats", "1", OfFixes};
// Single samples stand out.
inline constexpr FaultKind kSpikes{"spikes", "samples", OfDriveWhereItBiases};
// An axis stands at its limit.
inline constexpr FaultKind kSaturation{"saturation", "s"};
// Much of the accelerometer is above 20 Hz.
inline constexpr FaultKind kVibration{"vibration", "m/s^2"};
// A low-pass acts on an axis.
inline constexpr FaultKind kFiltered{"filtered", "Hz"};
// An axis lacks the noise of its neighbours or never changes.
inline constexpr FaultKind kDeadAxis{"dead_axis", "1", Always};
inline constexpr FaultKind kDeadSensor{"dead_axis", "s", Always};
// A rotor never changes.
inline constexpr FaultKind kDeadRotor{"dead_rotor", "1", Always};
// Speeds are logged below 100 Hz and change between samples.
inline constexpr FaultKind kRotorsSlow{"rotors_slow", "1", Always};
// A column keeps its value while the vehicle moves. Repaired: leaves these rows out where
// positions are lost.
inline constexpr FaultKind kStuck{"stuck", "s", Always};
// Positions that are exactly 0 0 0, or poses of another set of markers. Repaired: leaves these
// rows out.
inline constexpr FaultKind kTrackingLost{"tracking_lost", "s"};
// Samples shared a stamp and were spread when the log was converted.
inline constexpr FaultKind kSharedStamps{"shared_stamps", "1"};
// Rows were left out when the log was converted; fatal from 20 % on.
inline constexpr FaultKind kRowsLost{"rows_lost", "1"};

// Clocks, and what they have in common.

// A stream covers too little of the flight.
inline constexpr FaultKind kCover{"cover", "1", Always};
// No attitude is logged.
inline constexpr FaultKind kAttitudeMissing{"attitude_missing", "1", Always};
// A stream lasts 1000 times as long as the others or a power of that; its stamps are in ms us or
// ns.
inline constexpr FaultKind kTimeUnit{"time_unit", "1"};
// The stamps of the whole log have another unit or rate; turns and accelerations show it together.
inline constexpr FaultKind kTimeScale{"time_scale", "1"};
// Quarters of the flight come at another time than mocap; or the IMU's stamps jump while mocap
// runs through.
inline constexpr FaultKind kClockJump{"clock_jump", "s", Always};
// Turn rates or positions come late or early against the gyroscope. Repaired: shifts the stream.
inline constexpr FaultKind kClockOffset{"clock_offset", "s", OfHarmfulLag, true};
// A clock runs faster or slower than the gyroscope's by up to 0.01 s/s.
inline constexpr FaultKind kClockDrift{"clock_drift", "s/s", OfPlaceDrift};
// Positions come late against the accelerometer. Repaired: shifts the stream.
inline constexpr FaultKind kPositionLate{"position_late", "s"};

// Attitude, gyroscope and accelerometer.

// Turn rates of two streams have nothing in common; one may be of another flight.
inline constexpr FaultKind kRatesDisagree{"rates_disagree", "1"};
// Components in another order or the inverse rotation. Repaired: reorders or inverts.
inline constexpr FaultKind kQuaternionForm{"quaternion_form", "1"};
// Angles turn in another order, or one has another sign or unit. Repaired: rereads them.
inline constexpr FaultKind kAngleForm{"angle_form", "1"};
// Gyroscope and accelerometer are turned or mirrored against the attitudes. Repaired: turns them.
inline constexpr FaultKind kImuAxes{"imu_axes", "deg"};
// The body of an attitude is turned or mirrored. Repaired: turns it.
inline constexpr FaultKind kBodyAxes{"body_axes", "deg"};
// Z up where forward-right-down is stated. Repaired: turns the body; forward as assumed in the
// text.
inline constexpr FaultKind kBodyUp{"body_up", "deg"};
// Z up where north-east-down is stated. Repaired: turns the earth; heading as assumed in the text.
inline constexpr FaultKind kEarthUp{"earth_up", "deg"};
// Turn rates are in another unit or scaled. Repaired: scales.
inline constexpr FaultKind kGyroScale{"gyro_scale", "1", OfOtherUnit};
// Rotations of the attitude are scaled against the gyroscope.
inline constexpr FaultKind kAttitudeScale{"attitude_scale", "1"};
// The accelerometer's numbers are in the earth's axes or without gravity. Repaired: makes a force
// of them, by an attitude in the same rows.
inline constexpr FaultKind kNotSpecificForce{"not_specific_force", "m/s^2"};
// The accelerometer reads less than half of gravity.
inline constexpr FaultKind kGravityMissing{"gravity_missing", "m/s^2"};
// A specific force points sideways once turned to earth.
inline constexpr FaultKind kGravityDirection{"gravity_direction", "deg"};
// The accelerometer reads another gravity while the vehicle lies still.
inline constexpr FaultKind kGravityAtRest{"gravity_at_rest", "1"};
// The gyroscope turns while the vehicle lies still.
inline constexpr FaultKind kGyroBiasAtRest{"gyro_bias_at_rest", "rad/s"};
// The accelerometer is turned against the gyroscope; or its x and y are exchanged or of the other
// sign. Repaired: turns or exchanges where the flight shows it.
inline constexpr FaultKind kAccelerometerAxes{"accelerometer_axes", "deg"};
// Specific force is in another unit or scaled. Repaired: scales; by a known unit's factor within 5
// %.
inline constexpr FaultKind kAccelerometerScale{"accelerometer_scale", "1", Always, true};
// A bias beyond what sensors have.
inline constexpr FaultKind kAccelerometerBias{"accelerometer_bias", "m/s^2"};
// An axis of the accelerometer reads another multiple of the force that positions show.
inline constexpr FaultKind kLateralForce{"lateral_force", "1", Always};

// Positions.

// Positions against the accelerometer are turned or mirrored. Repaired: turns them.
inline constexpr FaultKind kPositionAxes{"position_axes", "deg"};
// Distances are in another unit. Repaired: scales where it differs by more than 20 %.
inline constexpr FaultKind kPositionScale{"position_scale", "1"};
// An axis of the fixes scatters about mocap far more than its sigma.
inline constexpr FaultKind kPositionSpread{"position_spread", "m", Always};
// Fixes of one gate differ from mocap by three times what others do.
inline constexpr FaultKind kGateApart{"gate_apart", "m"};
// North of positions is not that of attitude.csv; from 10 deg on. Repaired: turns the heading.
inline constexpr FaultKind kHeadingOffset{"heading_offset", "deg", Always};
// The attitude's heading is off by more in the second half of the flight as by a drift from zero.
inline constexpr FaultKind kHeadingDrift{"heading_drift", "deg/s", Always, true};

// Rotors.

// Rotors turn the body as in another order than the vehicle states. Repaired: reorders where no
// other order fits alike.
inline constexpr FaultKind kRotorOrder{"rotor_order", "1"};
// One rotor spins the other way than the vehicle states.
inline constexpr FaultKind kRotorSpin{"rotor_spin", "rotors"};
// All rotors spin the other way. Repaired: reverses them.
inline constexpr FaultKind kRotorSpinsReversed{"rotor_spins_reversed", "rotors"};
// Speeds in rpm or revolutions per second. Repaired: converts.
inline constexpr FaultKind kRotorUnit{"rotor_unit", "1"};
// Thrust by k_f and speeds is another multiple of mass times specific force.
inline constexpr FaultKind kRotorThrust{"rotor_thrust", "1", Always};

}  // namespace fault
}  // namespace trueline
