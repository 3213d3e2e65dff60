#include "problems/inspection/heading.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <complex>

#include "problems/common/units.h"
#include "problems/inspection/motion.h"
#include "problems/vgd/line_fit.h"
#include "problems/vgd/passes.h"

namespace trueline {
namespace {

using Complex = std::complex<double>;  // north + i east

constexpr double kLeastFit = 0.5;      // of the changes' square that is explained
constexpr double kFilterGain = 0.05;   // 1/s, prior sigma of k
constexpr double kSteadyForce = 0.15;  // m/s^2, prior sigma of b, each axis
constexpr double kLeastNoise = 0.03;   // m/s, of a change of velocity
constexpr double kNoHeading = 10.0 * kDegree;
constexpr double kClearlyLess = 0.8;  // of the share that is left unexplained
constexpr std::size_t kLeastArcs = 8;
constexpr std::size_t kHeadingBlocks = 10;

// Velocity over a span, by positions and by the specific force from an unknown start.
struct Span {
  double t;            // s, of the middle
  Complex p, v, sure;  // m, m/s, m/s
};

// From one span to the next.
struct Arc {
  Complex seen, sure, moved;  // m/s, m/s, m
  double time;                // s
};

void AddSpan(double from, double to, const Eigen::Vector3d& p, const Eigen::Vector3d& v,
             const RunningIntegral<3>& force, std::vector<Span>* spans) {
  if (!(to > from) || !force.Knows(from, to)) return;
  const Eigen::Vector3d sure = (force.At(to) - force.At(from)) / (to - from);
  spans->push_back({0.5 * (from + to), {p.x(), p.y()}, {v.x(), v.y()}, {sure.x(), sure.y()}});
}

std::vector<Span> SpansOfPasses(const FlightLog& log, const RunningIntegral<3>& force) {
  const LogClock clock(log);
  std::vector<Span> spans;
  for (const Pass& pass : FindPasses(log.fixes, {})) {
    const TimeNs middle = pass.begin + (pass.end - pass.begin) / 2;
    const LineFit line = FitLine(log.fixes, pass.first, pass.last, middle);
    AddSpan(clock(pass.begin), clock(pass.end), line.p, line.v, force, &spans);
  }
  return spans;
}

// Spans of `length` (s), one every `step`.
std::vector<Span> SpansOfStream(const FlightLog& log, const std::vector<PositionSample>& positions,
                                const RunningIntegral<3>& force, double length, double step) {
  const LogClock clock(log);
  std::vector<Span> spans;
  for (std::size_t i = 0, k = 0; i < positions.size();) {
    const double from = clock(positions[i].t);
    while (k < positions.size() && clock(positions[k].t) < from + length) ++k;
    if (k == positions.size()) break;
    const double to = clock(positions[k].t);
    const Eigen::Vector3d &first = positions[i].p_E, &last = positions[k].p_E;
    if (to - from < 2.0 * length) {
      AddSpan(from, to, 0.5 * (first + last), (last - first) / (to - from), force, &spans);
    }
    while (i < positions.size() && clock(positions[i].t) < from + step) ++i;
    k = std::max(k, i);
  }
  return spans;
}

std::vector<Arc> ArcsOf(const std::vector<Span>& spans) {
  const double longest = PassOptions().max_arc;
  std::vector<Arc> arcs;
  for (std::size_t i = 1; i < spans.size(); ++i) {
    const Span &a = spans[i - 1], &b = spans[i];
    if (b.t - a.t > longest) continue;
    arcs.push_back({b.v - a.v, b.sure - a.sure, b.p - a.p, b.t - a.t});
  }
  return arcs;
}

// Least squares for Re c, Im c, k, Re b, Im b.
using Normal5 = Eigen::Matrix<double, 5, 5>;
using Vector5 = Eigen::Matrix<double, 5, 1>;
struct ArcFit {
  Vector5 x;
  Normal5 covariance;
  double left, all;  // squares of the changes, (m/s)^2
  double Angle() const { return std::atan2(x[1], x[0]); }
};

ArcFit FitArcs(const std::vector<Arc>& arcs, double noise, std::size_t without) {
  Normal5 a = Normal5::Zero();
  Vector5 b = Vector5::Zero();
  a.diagonal() << 0.0, 0.0, std::pow(noise / kFilterGain, 2),
      Eigen::Vector2d::Constant(std::pow(noise / kSteadyForce, 2));
  double all = 0.0;
  const auto block = [&](std::size_t i) { return i * kHeadingBlocks / arcs.size(); };
  Eigen::Matrix<double, 2, 5> j;
  for (std::size_t i = 0; i < arcs.size(); ++i) {
    if (block(i) == without) continue;
    const Arc& arc = arcs[i];
    j << arc.sure.real(), -arc.sure.imag(), arc.moved.real(), arc.time, 0.0,  //
        arc.sure.imag(), arc.sure.real(), arc.moved.imag(), 0.0, arc.time;
    const Eigen::Vector2d seen(arc.seen.real(), arc.seen.imag());
    a += j.transpose() * j;
    b += j.transpose() * seen;
    all += seen.squaredNorm();
  }
  const Vector5 x = a.ldlt().solve(b);
  return {x, noise * noise * a.inverse(), std::max(0.0, all - b.dot(x)), all};
}

std::optional<Heading> HeadingByArcs(const std::vector<Arc>& arcs) {
  if (arcs.size() < kLeastArcs) return std::nullopt;
  const double n = 2.0 * static_cast<double>(arcs.size());
  double noise = kLeastNoise;
  ArcFit fit = FitArcs(arcs, noise, kHeadingBlocks);
  for (int pass = 0; pass < 3; ++pass) {
    noise = std::max(kLeastNoise, std::sqrt(fit.left / (n - 5.0)));
    fit = FitArcs(arcs, noise, kHeadingBlocks);
  }
  if (!(fit.left < kLeastFit * fit.all) || fit.x.head<2>().norm() < 0.5) return std::nullopt;
  std::vector<double> without;
  for (std::size_t block = 0; block < kHeadingBlocks; ++block) {
    const double angle = FitArcs(arcs, noise, block).Angle();
    without.push_back(std::remainder(angle - fit.Angle(), 2.0 * M_PI));
  }
  // Across c, by the noise and the priors.
  const Eigen::Vector2d across =
      Eigen::Vector2d(-fit.x[1], fit.x[0]) / fit.x.head<2>().squaredNorm();
  const double by_noise = std::sqrt(across.dot(fit.covariance.topLeftCorner<2, 2>() * across));
  return Heading{fit.Angle(), std::max(by_noise, JackknifeSigma(without)), fit.left / fit.all};
}

// The eight signed permutations of x and y, with z times `z`.
std::vector<Eigen::Matrix3d> LateralTurns(double z) {
  std::vector<Eigen::Matrix3d> turns;
  for (Eigen::Matrix3d m : SignedPermutations()) {
    if (m(2, 2) != 1.0) continue;
    m(2, 2) = z;
    turns.push_back(m);
  }
  return turns;
}

}  // namespace

std::optional<Heading> HeadingOf(const FlightLog& log, const std::string& stream) {
  const RunningIntegral<3> force = ForceIntegral(log, log.attitude);
  if (stream == "mocap") {
    return HeadingByArcs(ArcsOf(SpansOfStream(log, PositionsOf(log.mocap), force, 0.4, 1.0)));
  }
  const std::vector<Arc> of_passes = ArcsOf(SpansOfPasses(log, force));
  if (of_passes.size() >= kLeastArcs) return HeadingByArcs(of_passes);
  return HeadingByArcs(ArcsOf(SpansOfStream(log, PositionsOf(log.fixes), force, 2.0, 2.0)));
}

std::optional<TurnedForce> BestLateralTurn(const FlightLog& log, const std::string& stream,
                                           double z) {
  FlightLog turned = log;
  std::optional<TurnedForce> best;
  double second = 1.0;
  for (const Eigen::Matrix3d& turn : LateralTurns(z)) {
    for (std::size_t i = 0; i < log.imu.size(); ++i) turned.imu[i].accel = turn * log.imu[i].accel;
    const auto heading = HeadingOf(turned, stream);
    if (!heading || std::abs(heading->angle) > kNoHeading) continue;
    if (best && heading->left >= best->heading.left) {
      second = std::min(second, heading->left);
      continue;
    }
    if (best) second = std::min(second, best->heading.left);
    best = TurnedForce{turn, *heading, false};
  }
  if (best) best->clear = best->heading.left < kClearlyLess * second;
  return best;
}

}  // namespace trueline
