#include "problems/trajectory/mocap_path.h"

#include <algorithm>
#include <cmath>

#include "problems/common/error.h"

namespace trueline {

std::vector<Eigen::Vector3d> PathVelocity(const std::vector<PoseSample>& mocap,
                                          TimeNs half_window) {
  std::vector<Eigen::Vector3d> velocity(mocap.size(), Eigen::Vector3d::Zero());
  std::size_t first = 0;
  std::size_t last = 0;
  for (std::size_t i = 0; i < mocap.size(); ++i) {
    while (mocap[i].t - mocap[first].t > half_window) ++first;
    while (last + 1 < mocap.size() && mocap[last + 1].t - mocap[i].t <= half_window) ++last;
    // At least the neighbours, if the record is slow or has a gap.
    const std::size_t from = std::min(first, i > 0 ? i - 1 : 0);
    const std::size_t to = std::min(std::max(last, i + 1), mocap.size() - 1);
    const double span = SecondsBetween(mocap[from].t, mocap[to].t);
    if (span > 0.0) velocity[i] = (mocap[to].p_E - mocap[from].p_E) / span;
  }
  return velocity;
}

std::optional<Eigen::Vector3d> PositionAt(const std::vector<PoseSample>& mocap, TimeNs t,
                                          double max_gap) {
  const auto after = std::ranges::lower_bound(mocap, t, {}, &PoseSample::t);
  if (after == mocap.end()) return std::nullopt;
  if (after->t == t) return after->p_E;
  if (after == mocap.begin()) return std::nullopt;
  const auto before = std::prev(after);
  const double span = SecondsBetween(before->t, after->t);
  if (span > max_gap) return std::nullopt;
  const double share = SecondsBetween(before->t, t) / span;
  return (1.0 - share) * before->p_E + share * after->p_E;
}

namespace {

void Require(bool holds, const char* option, const char* remedy) {
  if (!holds) throw InputError(fmt::format("fix sampling: '{}' {}", option, remedy));
}

std::vector<TimeNs> RandomTimes(const Straight& straight, int count, Random* random) {
  std::vector<TimeNs> times(static_cast<std::size_t>(count));
  const auto span = static_cast<double>(straight.to - straight.from);
  for (TimeNs& t : times) t = straight.from + std::llround(random->Uniform(0.0, span));
  std::sort(times.begin(), times.end());
  return times;
}

// Error of one axis in units of sigma.
double UnitError(const FixSamplerOptions& options, Random* random) {
  return options.student_dof > 0.0 ? random->StudentT(options.student_dof) : random->Normal();
}

Eigen::Vector3d DrawFixError(const FixSamplerOptions& options, double sigma, Random* random) {
  if (options.outlier_share > 0.0 && random->Bernoulli(options.outlier_share)) {
    return options.outlier_size * random->NormalVector3();
  }
  Eigen::Vector3d error;
  for (double& axis : error) axis = sigma * UnitError(options, random);
  return error;
}

}  // namespace

void FixSamplerOptions::Check() const {
  Require(min_count >= 1, "min_count", "must be at least 1");
  Require(max_count >= min_count, "max_count", "must not be below min_count");
  Require(sigma_factor >= 0.0, "sigma_factor", "must not be negative");
  Require(sigma_floor > 0.0, "sigma_floor", "must be positive (m)");
  Require(student_dof >= 0.0, "student_dof", "must not be negative; 0 is Gaussian");
  Require(outlier_share >= 0.0 && outlier_share <= 1.0, "outlier_share", "must be within 0 and 1");
  Require(outlier_size >= 0.0, "outlier_size", "must not be negative (m)");
  Require(max_gap > 0.0, "max_gap", "must be positive (s)");
}

std::vector<Fix> SampleFixes(const std::vector<PoseSample>& mocap,
                             const std::vector<Straight>& straights,
                             const FixSamplerOptions& options, Random& random) {
  options.Check();
  std::vector<Fix> fixes;
  for (const Straight& straight : straights) {
    const int count = random.UniformInt(options.min_count, options.max_count);
    for (const TimeNs t : RandomTimes(straight, count, &random)) {
      const auto truth = PositionAt(mocap, t, options.max_gap);
      if (!truth) continue;
      const double distance = (*truth - straight.gate.position).norm();
      const double sigma = std::max(options.sigma_floor, options.sigma_factor * distance);
      const Eigen::Vector3d error = DrawFixError(options, sigma, &random);
      if (!fixes.empty() && t <= fixes.back().t) continue;  // stamps of a stream rise strictly
      fixes.push_back({t, *truth + error, sigma, straight.gate.id});
    }
  }
  return fixes;
}

}  // namespace trueline
