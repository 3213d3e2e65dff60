// State of an inspection in progress: the log as recorded, the log as repaired so far, and the
// findings. Each step below looks at the repaired log and adds to all three.
#pragma once

#include <fmt/format.h>

#include <optional>
#include <utility>

#include "problems/common/units.h"
#include "problems/inspection/clear.h"
#include "problems/inspection/inspection.h"
#include "problems/inspection/motion.h"

namespace trueline {

// An attitude whose turn rates were compared with those of the gyroscope.
struct RateWitness {
  std::string stream;
  VectorMatch match;
  Eigen::Matrix3d turn;  // plain: its rates = turn * those of the gyroscope
};

// A unit that was read as the SI unit, and what makes SI of its numbers.
struct KnownUnit {
  const char* si;
  const char* name;
  double factor;
};
// The unit whose factor is nearest to `factor`, which errs by a usual bias of a sensor (5 %) and by
// `error` of its logarithm; null if there is none.
const KnownUnit* UnitNear(const std::string& si, double factor, double error = 0.0);
// ": the factor of g (9.80665) but for a usual bias, which is used"; empty for null.
std::string UnitText(const KnownUnit* unit);

struct Examination {
  const FlightLog& log;
  const FileAttitudes& sources;
  FlightLog fixed;
  Inspection result;
  std::vector<RateWitness> rates;
  // Streams whose attitude only repeats that of attitude.csv.
  std::vector<std::string> copies = {};
  // Streams whose clock drifts, which no repair undoes.
  std::vector<std::string> drifting = {};
  // rad: a force is turned only by more. Wider where an axis of the accelerometer reads another
  // multiple of it, so that it points elsewhere.
  double other_axes = kOtherAxes;

  bool IsCopy(const std::string& stream) const;
  bool Drifts(const std::string& stream) const;
  // What is repaired in a stream so far.
  StreamRepair RepairOf(const std::string& stream) const;
  // Adds to what is repaired in a stream; `repaired` holds the change alone.
  void Repair(const std::string& stream, const StreamRepair& change);
  void Add(Finding finding) { result.findings.push_back(std::move(finding)); }
  // The finding, with its sentence and its remedy; with the change of its stream that repairs it.
  void Add(Finding finding, const std::string& text, const std::string& remedy);
  void AddRepaired(Finding finding, const StreamRepair& change);
  void AddRepaired(Finding finding, const std::string& text, const std::string& remedy,
                   const StreamRepair& change);
};

// The attitudes of a stream of the repaired log: attitude, mocap or pose.
std::vector<AttitudeSample> AttitudesOf(const FlightLog& log, const std::string& stream);

// Streams whose attitude repeats that of attitude.csv.
void FindCopies(Examination* e);
// Time that the streams of a log share with its IMU; whether there is an attitude, unless rotor
// speeds may drive the model.
void CheckCover(const FlightLog& log, Examination* e);
// That the log has no attitude.
std::optional<Finding> MissingAttitude(const FlightLog& log);
// Rows that are no measurement, or repeat, or were lost or moved by the conversion.
void CheckRows(Examination* e);
// Streams that stand still while the vehicle turns.
void CheckFrozen(Examination* e);
// When the IMU's clock jumps, which looks like a gap, while a stream of another clock runs through.
std::optional<TimeNs> CheckImuJump(Examination* e);
// Whether all stamps have another unit, by turns and accelerations together; repairs them.
void CheckTimeScale(Examination* e);
// Clock and quaternion form of attitude, mocap and pose, by turn rates.
void CheckRates(Examination* e);
// The turns of a stream's attitude over a longer time than a filter smooths, against the
// gyroscope's, as stamped.
std::optional<VectorMatch> MatchLongTurns(const Examination& e, const std::string& stream);
// Which of gyroscope, accelerometer and attitudes are turned in the body.
void CheckBodies(Examination* e);
// The accelerometer's axes, scale and bias, by position or by gravity.
void CheckAccelerometer(Examination* e);
// Whether the accelerometer's numbers are in the earth's axes or lack gravity.
void CheckForce(Examination* e);
// Up and down of earth and body.
void CheckVertical(Examination* e);
// Whether the accelerometer reads gravity, by the median of its size.
bool ReadsGravity(const FlightLog& log);
// Whether gravity is read, and points down, once all is repaired; repairs that leave it sideways
// are withdrawn.
void CheckGravity(Examination* e);
// Heading of the attitude's earth against that of positions.
void CheckHeading(Examination* e);
// Axes, scale and clock of positions, by the accelerometer.
void CheckPositions(Examination* e);
// Clock or axes of the fixes, by mocap with the same origin.
void CheckPlacement(Examination* e);
// One column of the fixes that differs from mocap's far more than the others.
void CheckSpread(Examination* e);
// Whether a part of the fixes fits mocap at another lag than the rest.
void CheckClockJump(Examination* e);
// Order and spin of rotors, by the body's angular acceleration; clock of rotors and motors.
void CheckRotors(Examination* e);
// Readings while the vehicle lies still.
void CheckRest(Examination* e);

// Adds a finding if the clock of a stream drifts against that of `reference`, by more than `least`
// (s/s); a note if the match does not show it.
void AddClockDrift(Examination* e, const std::string& stream, const VectorMatch& match,
                   const std::string& reference, double least);

// Adds `finding`, whose stream, error and level are stated, as an offset of the stream's clock (its
// stamps are too large by `lag`, s), and moves the stream.
void AddClockOffset(Examination* e, double lag, Finding finding, const std::string& text);

// A finding of the accelerometer's axes, which are turned so.
void AddAccelerometerAxes(Examination* e, const Eigen::Matrix3d& turn, double error,
                          const std::string& text);

// Adds `finding` that a stream's numbers times `factor` are right, and repairs that scale: by the
// exact factor, and as a fatal fault, where `unit` is the one that they are in.
void AddScale(Examination* e, double StreamRepair::*scale, double factor, const KnownUnit* unit,
              Finding finding, const std::string& text);
// Of the accelerometer's readings; `why` explains it.
void AddAccelerometerScale(Examination* e, double factor, double sigma, const std::string& why);

// Adds `finding`, whose stream and error are stated, as one of the stream's axes of position, which
// differ from the right ones by `turn`, and turns the positions back.
void AddPositionAxes(Examination* e, const Eigen::Matrix3d& turn, Finding finding,
                     const std::string& text);

inline constexpr double kFixLagReach = 1.5;  // s, of fixes against mocap

// Removes the fixes of gates that differ from mocap by far more than those of the other gates, at
// the lag that suits most fixes. A note names each gate and its displacement: a gate that stands
// off the map moves its own fixes; a clock, turned axes or a scale move the fixes of all gates.
void LeaveOutGatesApart(Examination* e);
// Whether `change` of the fixes makes their median distance from mocap clearly smaller in both
// halves of the flight, and explains more than a displacement of each gate does. Where it is of
// some fixes, these must then agree with mocap as well as the others.
bool BringsFixesToMocap(const Examination& e, const StreamRepair& change);

// Whether a matrix only exchanges axes and their signs.
bool IsSignedPermutation(const Eigen::Matrix3d& m);
// deg, by which a rotation turns; 180 if `turn` is a reflection.
double TurnSize(const Eigen::Matrix3d& turn);
// Of axes that are turned by `size` (deg): an attitude may err by as much as a small turn.
Level LevelOfTurn(double size);
// m/s^2, by which a specific force the size of gravity is off where it is turned by `angle` (rad).
double ErrorOfTurn(const Examination& e, double angle);
// Of a fault that makes an error (m/s^2) of the specific force, and of a stream that is late by it.
Level LevelOfError(double error);
Level LevelOfLag(const VectorMatch& match, double error);
// rad, between a specific force and that of level flight, along -z.
double LeanOf(const Eigen::Vector3d& force);

// Texts shared by the steps.
// "multiply its stamps by ... and add ..."; drift in s/s, about the log's start.
std::string DriftRemedy(const FlightLog& log, double drift);
std::string AxesText(const Eigen::Matrix3d& turn);  // "(y, -x, z)", or a rotation vector in deg
std::string LateText(double seconds);               // "0.030 s later"
std::string OrElseText(const VectorMatch& match);   // ", or 6.030 s later, as laps repeat"

}  // namespace trueline
