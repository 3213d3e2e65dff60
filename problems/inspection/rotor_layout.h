// Where rotors sit and which way they spin, from what their speeds do to the body's rates.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "problems/inspection/motion.h"

namespace trueline {

// d(angular acceleration) / d(squared channel) by body axis, with one standard deviation.
struct RotorEffect {
  Eigen::Vector3d value, sigma;
};

struct RotorLayout {
  std::string stream;  // rotors or motors
  double lag = 0.0;  // s, by which the body follows late; positive: the channels' stamps are early
  Eigen::Vector3d explained =
      Eigen::Vector3d::Zero();      // share of the angular acceleration, by axis
  std::vector<RotorEffect> rotors;  // in the order of the channels

  // Right of the centre, in front of it: +1 or -1; 0 where the flight does not show it at 3 sigma.
  int RightOf(std::size_t i) const { return Sign(i, 0, -1.0); }
  int FrontOf(std::size_t i) const { return Sign(i, 1, 1.0); }
  int SpinOf(std::size_t i) const { return Sign(i, 2, -1.0); }  // +1 clockwise seen from above

 private:
  int Sign(std::size_t i, int axis, double sign) const;
};

// Lags (s) that motors and filters have by themselves.
struct UsualLag {
  double least, most;
};

// Regression of the gyroscope's angular acceleration on the squared channels, with products of the
// rates beside them, at the lag within `reach` (s) that explains most; outside of the usual ones
// only if most parts of the flight agree. No value for more than eight channels, or too little
// time.
std::optional<RotorLayout> FindLayout(const FlightLog& log,
                                      const std::vector<ChannelsSample>& channels,
                                      const UsualLag& usual, double reach);

}  // namespace trueline
