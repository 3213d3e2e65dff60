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

// Least-squares sums of the angular acceleration over the squared channels, once the terms that are
// no rotor's and the sum of all channels are fitted. A mixer may hold the channels in fewer
// directions than there are rotors: six rotors that follow thrust and three moments span four. Then
// the effects of single rotors are not determined, and only what a direction of the span does is.
class MomentSums {
 public:
  MomentSums(Eigen::MatrixXd squares, Eigen::Matrix3Xd moments);

  // Whether the channels move in as many directions as there are rotors.
  bool spans_all() const { return spans_all_; }
  // Sum of the squares of the acceleration about `axis` that a multiple of `effects`, one for each
  // channel, explains; negative where the multiple is.
  double Explained(int axis, const Eigen::RowVectorXd& effects) const;
  // Cosine between the effects found and `effects` in the metric of the channels' motion.
  double Cosine(int axis, const Eigen::RowVectorXd& effects) const;

 private:
  Eigen::MatrixXd squares_;   // of channels by channels
  Eigen::Matrix3Xd moments_;  // of accelerations by channels
  Eigen::Vector3d free_;      // what all channels explain together, by axis
  bool spans_all_ = false;
};

struct RotorLayout {
  std::string stream;  // rotors or motors
  double lag = 0.0;  // s, by which the body follows late; positive: the channels' stamps are early
  Eigen::Vector3d explained =
      Eigen::Vector3d::Zero();  // share of the angular acceleration, by axis
  // In the order of the channels; sigmas are infinite where the channels do not span all rotors.
  std::vector<RotorEffect> rotors;
  std::vector<MomentSums> without;  // the flight less one of its parts each
  std::optional<MomentSums> all;    // the whole flight

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
