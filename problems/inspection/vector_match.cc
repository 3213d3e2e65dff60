#include "problems/inspection/vector_match.h"

#include <Eigen/Dense>
#include <algorithm>
#include <array>
#include <cmath>

#include "cost_functions/models/rotation.h"
#include "problems/inspection/clear.h"
#include "problems/inspection/drifting_match.h"
#include "problems/inspection/motion.h"
#include "problems/trajectory/mocap_path.h"

namespace trueline {
namespace {

std::vector<Eigen::Matrix3d> MakePermutations() {
  std::vector<Eigen::Matrix3d> all;
  std::array<int, 3> order = {0, 1, 2};
  do {
    for (int signs = 0; signs < 8; ++signs) {
      Eigen::Matrix3d m = Eigen::Matrix3d::Zero();
      for (int i = 0; i < 3; ++i)
        m(i, order[static_cast<std::size_t>(i)]) = signs >> i & 1 ? -1 : 1;
      all.push_back(m);
    }
  } while (std::next_permutation(order.begin(), order.end()));
  std::stable_sort(all.begin(), all.end(), [](const Eigen::Matrix3d& a, const Eigen::Matrix3d& b) {
    return a.determinant() > b.determinant();
  });
  return all;
}

}  // namespace

std::optional<VectorMatch> MatchVectors(const PairsAt& pairs, const LagSearch& search) {
  const std::optional<SteadyMatch> steady = MatchSteady(pairs, search);
  if (!steady) return std::nullopt;
  if (search.reach > 0.0 && steady->shown < kCovers * kBlocks) {
    if (const auto drifting = MatchDrifting(pairs, *steady, search)) return drifting;
  }
  return steady->match;
}

double JackknifeSigma(const std::vector<double>& values) {
  double mean = 0.0, sum = 0.0;
  for (const double value : values) mean += value / static_cast<double>(values.size());
  for (const double value : values) sum += (value - mean) * (value - mean);
  return std::sqrt(sum * static_cast<double>(values.size() - 1) /
                   static_cast<double>(values.size()));
}

Eigen::Vector3d TurnBetween(const Eigen::Matrix3d& a, const Eigen::Matrix3d& b) {
  Eigen::Matrix3d turn = a * b.transpose();
  if (turn.determinant() < 0.0) turn = -turn;
  return RotationVector(Eigen::Quaterniond(turn));
}

bool IsHeading(const Eigen::Matrix3d& turn) {
  return turn.determinant() > 0.0 && turn(2, 2) > 0.97;
}

double HeadingIn(const Eigen::Matrix3d& turn) {
  return std::atan2(turn(1, 0) - turn(0, 1), turn(0, 0) + turn(1, 1));
}

bool Differs(const VectorMatch& match, const Eigen::Matrix3d& other, double least) {
  if ((match.turn.determinant() > 0.0) != (other.determinant() > 0.0)) return true;
  const Eigen::Vector3d turn = TurnBetween(match.turn, other);
  const Eigen::SelfAdjointEigenSolver<Eigen::Matrix3d> axes(match.turn_cov);
  for (int i = 0; i < 3; ++i) {
    const double along = std::abs(axes.eigenvectors().col(i).dot(turn));
    const double sigma = std::sqrt(std::max(0.0, axes.eigenvalues()[i]));
    if (along > std::max(least, kShown * sigma)) return true;
  }
  return false;
}

const std::vector<Eigen::Matrix3d>& SignedPermutations() {
  static const std::vector<Eigen::Matrix3d> all = MakePermutations();
  return all;
}

Eigen::Matrix3d PlainTurn(const VectorMatch& match, double least) {
  if (!Differs(match, Eigen::Matrix3d::Identity(), least)) return Eigen::Matrix3d::Identity();
  const Eigen::Matrix3d* best = nullptr;
  double nearest = std::numeric_limits<double>::infinity();
  for (const Eigen::Matrix3d& candidate : SignedPermutations()) {
    if (Differs(match, candidate, least)) continue;
    const double angle = TurnBetween(match.turn, candidate).norm();
    if (angle < nearest) {
      nearest = angle;
      best = &candidate;
    }
  }
  return best != nullptr ? *best : match.turn;
}

PairsAt FixPairs(const FlightLog& log) {
  return [&log](double lag) {
    const LogClock clock(log);
    std::vector<VectorPair> pairs;
    const std::size_t every = std::max<std::size_t>(1, log.fixes.size() / kMostPairs);
    for (std::size_t i = 0; i < log.fixes.size(); i += every) {
      const Fix& fix = log.fixes[i];
      if (const auto p = PositionAt(log.mocap, fix.t - FromSeconds(lag))) {
        pairs.push_back({clock(fix.t), fix.p_E, *p});
      }
    }
    return pairs;
  };
}

}  // namespace trueline
