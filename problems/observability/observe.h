// Observability results: exact ones for a kind of motion, numerical ones for one flight.
#pragma once

#include <cstdint>
#include <functional>
#include <optional>
#include <string>
#include <vector>

#include "problems/common/strict_yaml.h"
#include "problems/log/flight_log.h"
#include "problems/observability/assessment.h"
#include "problems/observability/imu_driven_system.h"
#include "problems/observability/rank.h"
#include "problems/observability/rotor_driven_system.h"
#include "problems/rotor/rotor_vehicle.h"
#include "problems/trajectory/limits.h"
#include "problems/trajectory/rotor_flight.h"

namespace trueline {

// The exact rank of a system, at random points.

// The exact observability of the model of Li et al. 2019: which of its nine parameters are
// observable from position fixes.

// The vehicle's rotation during the flight.
enum class Turning {
  kAny,    // roll, pitch and yaw vary
  kNoYaw,  // roll and pitch vary, heading does not
  kPitch,  // only pitch varies: straight ahead and back
  kNone    // attitude is constant
};

// As RotorDrivenRank. Thrust varies except for kNone, where it is constant.
RankReport ImuDrivenRank(const ImuDrivenSystem& system, const std::vector<int>& states,
                         Turning turning, std::uint64_t seed = 0);

// The exact observability of the rotor-driven model (Boehm et al. 2020, table I), by its motion.
enum class Motion {
  kVarying,   // any state, inputs that vary
  kConstant,  // any state, constant inputs
  kHover,     // trim: no rotation, no acceleration, any constant velocity
  kVertical,  // straight up and down
  kStraight   // in the vertical plane of the body's x axis, pitching
};

// Rank and null space for `states` (error states; all others are known), with null vectors in
// physical units at a point near `nominal` (kStates numbers). The rank is the larger one of two
// random points; it is wrong with a probability below 1e-14. Throws InputError if the vehicle
// cannot fly the motion.
RankReport RotorDrivenRank(const RotorDrivenSystem& system, const std::vector<double>& nominal,
                           const std::vector<int>& states, Motion motion, std::uint64_t seed = 0);

// A manoeuvre that would improve the estimate of a state.
struct Advice {
  int state = 0;
  std::string manoeuvre;
  double sigma = 0.0;  // with this manoeuvre added to the flight; the state's unit
};

struct CaseResult {
  std::string name;
  std::string sensors;
  std::string inputs;           // the motion or the flight, in words
  std::vector<StateInfo> info;  // of all error states of the system
  int states = 0;               // numbers of the state vector (a quaternion counts four)
  RankReport rank;

  // Of a flight only (rank.exact is false):
  double duration = 0.0;            // s
  double horizon = 0.0;             // s, over which the motion model is trusted
  std::vector<double> sigma;        // Cramer-Rao with the horizon, by position in rank.states; NaN
                                    // for trajectory states
  std::vector<double> sigma_whole;  // the same without the horizon: the model is exact throughout
  GramianScores scores;             // of the constants that are seen, columns scaled
  std::vector<Advice> advice;
  std::vector<std::string> warnings;
};

struct FlightQuestion {
  std::string name;
  std::string flight;         // in words
  std::vector<int> states;    // error states asked about
  std::vector<double> scale;  // usual standard deviation of each error state; empty: typical sizes
  double horizon = 0.2;       // s, over which the motion model is trusted
  double step = 0.01;         // s, of integration
};

CaseResult ObserveRotorMotion(const RotorDrivenSystem& system, const RotorVehicle& vehicle,
                              const std::string& name, const std::vector<int>& states,
                              Motion motion);
CaseResult ObserveImuMotion(const ImuDrivenSystem& system, const std::string& name,
                            const std::vector<int>& states, Turning turning);

// System: RotorDrivenSystem or ImuDrivenSystem.
template <class System>
CaseResult ObserveFlight(const System& system, const NominalFlight& flight,
                         const FlightQuestion& question);

// For each constant that the flight does not show, or shows worst relative to its scale: the simple
// manoeuvre of 10 s within `limits` that reduces its sigma most.
void AdviseRotorFlight(const RotorDrivenSystem& system, const RotorVehicle& vehicle,
                       const NominalFlight& flight, const FlightQuestion& question,
                       const FlightLimits& limits, CaseResult* result);

// observability.yaml, and the table for standard output.
std::string ObservabilityYaml(const std::vector<CaseResult>& cases, const std::string& source);

// One block for each case: rank, null space in words and numbers, sigmas, advice.
std::string ObservabilityTable(const std::vector<CaseResult>& cases);
std::string ObservabilityBrief(const std::vector<CaseResult>& cases);  // a line a case

// Runs the questions of a configuration (config/observe/*.yaml), or those about a log, one by one.

// Called with each case's name before it runs.
using StepNotice = std::function<void(const std::string&)>;

// All cases of a configuration, in its order. Throws InputError naming file, line and key.
std::vector<CaseResult> RunObserveConfig(const YamlMap& config, const StepNotice& progress);

// Assesses one flight, one case for each applicable model: the rotor-driven model if the log has
// rotor speeds and a vehicle with rotors (`vehicle`, if given, replaces the log's), and that of Li
// et al. if it has attitude and positions, or where it is the only one that can be asked: the
// program's own filter then gives the attitude. Throws InputError if neither applies.
std::vector<CaseResult> RunObserveLog(const FlightLog& log, const std::optional<YamlMap>& config,
                                      const StepNotice& progress);

}  // namespace trueline
