#include "problems/inspection/position_witness.h"

#include <algorithm>
#include <boost/math/tools/minima.hpp>
#include <cmath>
#include <limits>
#include <utility>

#include "problems/inspection/clear.h"
#include "problems/inspection/force_fit.h"
#include "problems/log/samples.h"

namespace trueline {

std::vector<AttitudeSample> WithoutFollowing(const FlightLog& log,
                                             const std::vector<AttitudeSample>& attitude,
                                             double gain) {
  constexpr double kMemory = 20.0;  // s, after which an error of the integral is forgotten
  std::vector<AttitudeSample> corrected = attitude;
  Eigen::Vector2d tilt = Eigen::Vector2d::Zero();  // m/s^2
  AttitudeCursor cursor(attitude);
  std::size_t next = 0;
  for (std::size_t i = 0; i < log.imu.size(); ++i) {
    Eigen::Quaterniond q;
    if (cursor.At(log.imu[i].t, kAttitudeGap, &q) && i > 0) {
      const double dt = SecondsBetween(log.imu[i - 1].t, log.imu[i].t);
      tilt += dt * (gain * (q * log.imu[i].accel).head<2>() - tilt / kMemory);
    }
    for (; next < corrected.size() && corrected[next].t <= log.imu[i].t; ++next) {
      const Eigen::Vector3d turn = Eigen::Vector3d(tilt.y(), -tilt.x(), 0.0) / log.gravity;
      const double angle = turn.norm();
      if (angle == 0.0) continue;
      corrected[next].q_Ep_I = Eigen::AngleAxisd(angle, turn / angle) * corrected[next].q_Ep_I;
    }
  }
  return corrected;
}

std::optional<FollowingFit> FitFollowing(const FlightLog& log,
                                         const std::vector<AttitudeSample>& attitude,
                                         const MatchOfAttitude& of, double VectorMatch::*by) {
  constexpr int kBits = 8;  // of the logarithm
  const auto rest = [&](double logarithm) {
    const auto match = of(WithoutFollowing(log, attitude, std::exp(logarithm)));
    return match ? RestOf((*match).*by) : 1.0;
  };
  const double gain = std::exp(boost::math::tools::brent_find_minima(rest, std::log(kLowestGain),
                                                                     std::log(kHighestGain), kBits)
                                   .first);
  auto match = of(WithoutFollowing(log, attitude, gain));
  if (!match) return std::nullopt;
  return FollowingFit{gain, std::move(*match)};
}

namespace {

constexpr double kPoseNoise = 0.002;               // m
constexpr double kBendNoise = 0.5;                 // m/s^2, wanted of a bend at most
constexpr double kShortest = 0.2, kLongest = 2.0;  // s, half width of a bend

double NoiseOf(const FlightLog& log, const std::string& stream) {
  return stream == "fixes" && !log.fixes.empty() ? MedianSigma(log.fixes) : kPoseNoise;
}

// Of three equal errors of position; a bend is (1, -2, 1) over the half width's square.
double HalfWidth(double noise) {
  return std::clamp(std::sqrt(std::sqrt(6.0) * noise / kBendNoise), kShortest, kLongest);
}

}  // namespace

std::optional<PositionWitness> PositionWitnessOf(const Examination& e, const std::string& stream,
                                                 double wider) {
  PositionWitness witness{stream, stream == "fixes" ? "attitude" : stream, {}, {}, 0.0};
  if (stream == "fixes" && e.fixed.attitude.size() < kFewest && e.fixed.mocap.size() >= kFewest) {
    witness.of_attitude = "mocap";
  }
  witness.attitude = AttitudesOf(e.fixed, witness.of_attitude);
  if (witness.attitude.size() < kFewest) return std::nullopt;
  witness.noise = NoiseOf(e.fixed, stream);
  witness.bends = BendsOfStream(e.fixed, stream, wider);
  if (witness.bends.size() < kFewest) return std::nullopt;
  return witness;
}

std::vector<Bend> BendsOfStream(const FlightLog& log, const std::string& stream, double wider) {
  return BendsOf(PositionsOf(log, stream), LogClock(log), wider * HalfWidth(NoiseOf(log, stream)),
                 kMostPairs);
}

std::optional<VectorMatch> MatchBends(const FlightLog& log,
                                      const std::vector<AttitudeSample>& attitude,
                                      const std::vector<Bend>& bends, const LagSearch& search) {
  const RunningIntegral<3> force = ForceIntegral(log, attitude);
  return MatchVectors(AccelerationPairs(force, bends), search);
}

double ResidualOfTurnedBends(const FlightLog& log, const std::vector<AttitudeSample>& attitude,
                             std::vector<Bend> bends) {
  const auto match = MatchBends(log, attitude, bends);
  if (!match) return std::numeric_limits<double>::infinity();
  TurnBends(match->turn.transpose(), &bends);
  return ForceResidual(BodyForce(log, attitude), bends, Eigen::Matrix3d::Identity());
}

bool IsOfAhrs(const Examination& e, const PositionWitness& witness) {
  return witness.of_attitude == "attitude" || e.IsCopy(witness.of_attitude);
}

std::optional<FollowingFit> FollowingOf(const Examination& e, const PositionWitness& witness,
                                        double reach) {
  const auto match = [&](const std::vector<AttitudeSample>& attitude) {
    return MatchBends(e.fixed, attitude, witness.bends, {reach});
  };
  return FitFollowing(e.fixed, witness.attitude, match, &VectorMatch::correlation);
}

double RmsAcceleration(const std::vector<Bend>& bends) {
  double squares = 0.0;
  for (const Bend& bend : bends) squares += bend.acceleration.squaredNorm();
  return std::sqrt(squares / static_cast<double>(bends.size()));
}

void TurnBends(const Eigen::Matrix3d& turn, std::vector<Bend>* bends) {
  for (Bend& bend : *bends) bend.acceleration = turn * bend.acceleration;
}

std::optional<std::vector<Bend>> InEarthOfAttitude(const Examination& e,
                                                   const PositionWitness& witness) {
  const auto match = MatchBends(e.fixed, witness.attitude, witness.bends);
  if (!match) return std::nullopt;
  std::vector<Bend> bends = witness.bends;
  if (witness.stream != "fixes") return bends;
  if (match->correlation < kAlike) return std::nullopt;
  const Eigen::Matrix3d yaw =
      Eigen::AngleAxisd(HeadingIn(match->turn), Eigen::Vector3d::UnitZ()).toRotationMatrix();
  TurnBends(yaw.transpose(), &bends);
  return bends;
}

void TurnLikePositions(const Examination& e, const PositionWitness& witness,
                       std::vector<Bend>* bends) {
  const auto match = MatchBends(e.fixed, witness.attitude, *bends);
  if (!match || match->correlation < kAlike) return;
  TurnBends(PlainTurn(*match, kOtherAxes).transpose(), bends);
}

}  // namespace trueline
