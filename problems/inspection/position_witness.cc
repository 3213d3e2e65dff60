#include "problems/inspection/position_witness.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "problems/common/units.h"
#include "problems/inspection/clear.h"
#include "problems/inspection/force_fit.h"
#include "problems/log/fixes.h"

namespace trueline {
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
  witness.bends = BendsOf(PositionsOf(e.fixed, stream), LogClock(e.fixed),
                          wider * HalfWidth(witness.noise), kMostPairs);
  if (witness.bends.size() < kFewest) return std::nullopt;
  return witness;
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
