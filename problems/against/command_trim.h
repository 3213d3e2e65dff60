// The trim of a flight: what its motors are commanded to hold it in the air. It needs positions and
// commands alone; attitude and battery voltage sharpen it.
#pragma once

#include <Eigen/Core>
#include <optional>
#include <string>
#include <vector>

#include "problems/log/flight_log.h"

namespace trueline {

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

}  // namespace trueline
