// What the reference flights of a vehicle say of the next one: the trim to expect, and how far
// flights scatter about it within a session and between sessions.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "problems/log/flight_log.h"

namespace trueline {

// The trim of a flight: what its motors are commanded to hold it in the air. It needs positions and
// commands alone; attitude and battery voltage sharpen it.

// Commands count as thrust, up to one factor: motors.csv as it is (one column: the total thrust),
// or the squares of rotor speeds where no commands are logged.
struct CommandTrim {
  std::string log;                // its folder or file
  bool is_speed = false;          // of rotor speeds, which know of no battery
  Eigen::VectorXd command;        // by channel: mean command of level, steady flight
  Eigen::VectorXd sigma;          // relative standard error of it, from blocks of a second
  Eigen::VectorXd saturated;      // share of samples at full command
  double seconds = 0.0;           // of steady flight
  double tilt = 0.0;              // by what the thrust of it exceeds that of a hover, as a share
  std::optional<double> voltage;  // V, mean over the steady flight
  std::optional<double> mass;     // kg, as the log states it

  std::vector<std::string> warnings;

  int channels() const { return static_cast<int>(command.size()); }
};

// A sample is steady while the vehicle is high above its floor (the height at which the motors
// stand still; without such samples the whole log is flight) and climbs slowly. The mean
// is multiplied by that of the cosine of the tilt, which makes it the command of level flight.
// Samples at full command are lower bounds: mean and spread are those of a normal distribution cut
// off there (Tobin 1958). Throws InputError for a log without commands or positions, NoUsableResult
// for one without a few seconds of steady flight.
CommandTrim TrimOf(const FlightLog& log);

double TotalOf(const ChannelsSample& sample);

// A vehicle whose commands add up to less does not fly.
double AirborneTotal(const std::vector<ChannelsSample>& commands);

// m, from which on it is clear of the floor: -infinity where the log is all flight.
double LeastHeight(const FlightLog& log);

// Mean of a normal distribution by samples of which those at `full` or above are bounds.
double CensoredMean(const std::vector<double>& values, double full);

// Standard deviations of ln(command): one that all channels share, and one of each channel's own.
struct TrimScatter {
  double common = 0.0, own = 0.0;
  double dof = 0.0;  // degrees of freedom that it is known by

  Eigen::MatrixXd Cov(int channels) const;
  double OfOneChannel() const;
};

// What small quadrotors scatter by (CrazyPAD: 0.9 % within a session, 3.3 % between sessions, by
// motor).
struct UsualScatter {
  TrimScatter within = {0.005, 0.007}, between = {0.025, 0.022};
};

struct ReferenceFlight {
  CommandTrim trim;
  int session = -1;  // as stated by the user; -1: found by the trims
};

struct References {
  int flights = 0;
  std::vector<int> session_of;              // by flight, from 0
  std::vector<Eigen::VectorXd> ln_command;  // mean of each session, at `ln_voltage`
  std::vector<int> size;                    // flights of each session
  TrimScatter within, between;
  bool between_is_usual = false;          // one session: not learned
  std::optional<double> ln_voltage;       // of V, mean
  double slope = 0.0, slope_sigma = 0.0;  // of ln(command) by ln(voltage)

  int sessions() const { return static_cast<int>(ln_command.size()); }
};

// Throws InputError if flights differ in their channels.
void RequireSameChannels(const std::vector<ReferenceFlight>& flights);

// ln(command / mass) where all flights state their mass, else ln(command).
Eigen::VectorXd LnCommand(const CommandTrim& trim, bool by_mass);

// Flights without a stated session are of one where some chain of them differs by less than
// `kSessionGap` from flight to flight in every channel. The scatter is that of the flights, drawn
// to the usual one, which counts as much as `kUsualCounts` flights or sessions. The flights have
// the same channels.
References LearnFrom(const std::vector<ReferenceFlight>& flights, bool by_mass,
                     const UsualScatter& usual = {});

inline constexpr double kSessionGap = 0.025;
inline constexpr double kUsualCounts = 6.0;

}  // namespace trueline
