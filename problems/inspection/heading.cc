#include "problems/inspection/heading.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <complex>
#include <limits>
#include <vector>

#include "problems/common/units.h"
#include "problems/inspection/clear.h"
#include "problems/inspection/excerpt.h"
#include "problems/inspection/motion.h"
#include "problems/inspection/position_witness.h"
#include "problems/result/statistics.h"
#include "problems/vgd/passes.h"
#include "problems/vgd/rough_path.h"

namespace trueline {
namespace {

using Complex = std::complex<double>;  // north + i east

constexpr double kGainStep = 1.4;     // from one gain that is tried to the next
constexpr double kLeastNoise = 0.03;  // m/s, of a change of velocity
constexpr std::size_t kLeastArcs = 8;
constexpr int kAngles = 120;  // that are tried
constexpr double kAngleStep = 2.0 * M_PI / kAngles;

// Velocity over a span, by positions and by the specific force from an unknown start.
struct Span {
  double from, to;     // s
  Complex p, v, sure;  // m (of the middle), m/s, m/s
  Complex x, y;        // s, integrals of the body's axes, like `sure`
  double Middle() const { return 0.5 * (from + to); }
  Complex At(double t) const { return p + (t - Middle()) * v; }
};

// From one span to the next.
struct Arc {
  Complex seen, sure;  // m/s
  Complex x, y;        // s
  double time;         // s
  std::size_t span;    // at its end
};

// The specific force and the body's axes in the earth of attitude.csv.
struct Integrals {
  RunningIntegral<3> force, north, east;

  explicit Integrals(const FlightLog& log)
      : force(ForceIntegral(log, log.attitude)),
        north(AxisIntegral(log, log.attitude, 0)),
        east(AxisIntegral(log, log.attitude, 1)) {}
};

void AddSpan(double from, double to, const Eigen::Vector3d& p, const Eigen::Vector3d& v,
             const Integrals& integrals, std::vector<Span>* spans) {
  if (!(to > from) || !integrals.force.Knows(from, to)) return;
  const Eigen::Vector3d sure = integrals.force.Mean(from, to);
  const Eigen::Vector3d north = integrals.north.Mean(from, to);
  const Eigen::Vector3d east = integrals.east.Mean(from, to);
  spans->push_back({from,
                    to,
                    {p.x(), p.y()},
                    {v.x(), v.y()},
                    {sure.x(), sure.y()},
                    {north.x(), east.x()},
                    {north.y(), east.y()}});
}

std::vector<Span> SpansOfPasses(const FlightLog& log, const Integrals& integrals) {
  const LogClock clock(log);
  std::vector<Span> spans;
  for (const Pass& pass : FindPasses(log.fixes, {})) {
    const TimeNs middle = pass.begin + (pass.end - pass.begin) / 2;
    const LineFit line = FitLine(log.fixes, pass.first, pass.last, middle);
    AddSpan(clock(pass.begin), clock(pass.end), line.p, line.v, integrals, &spans);
  }
  return spans;
}

// Spans of `length` (s), one every `step`.
std::vector<Span> SpansOfStream(const FlightLog& log, const std::vector<PositionSample>& positions,
                                const Integrals& integrals, double length, double step) {
  const LogClock clock(log);
  std::vector<Span> spans;
  for (std::size_t i = 0, k = 0; i < positions.size();) {
    const double from = clock(positions[i].t);
    while (k < positions.size() && clock(positions[k].t) < from + length) ++k;
    if (k == positions.size()) break;
    const double to = clock(positions[k].t);
    const Eigen::Vector3d &first = positions[i].p_E, &last = positions[k].p_E;
    if (to - from < 2.0 * length) {
      AddSpan(from, to, 0.5 * (first + last), (last - first) / (to - from), integrals, &spans);
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
    const double time = b.Middle() - a.Middle();
    if (time <= longest)
      arcs.push_back({b.v - a.v, b.sure - a.sure, b.x - a.x, b.y - a.y, time, i});
  }
  return arcs;
}

// The velocity that an attitude filter of gain k misses, du/dt = k (v - u): the filter takes the
// low-passed acceleration du/dt for tilt. v is constant within spans. Between them v is the cubic's
// that joins their positions and velocities.
class MissedVelocity {
 public:
  MissedVelocity(const std::vector<Span>& spans, double gain) : gain_(gain) {
    // A slow filter has the mean velocity. A fast one forgets where it starts.
    const Span &first = spans.front(), &last = spans.back();
    u_ = (last.p - first.p) / (last.Middle() - first.Middle());
    for (std::size_t i = 0; i < spans.size(); ++i) {
      if (i > 0) FollowGap(spans[i - 1], spans[i]);
      const Span& span = spans[i];
      means_.push_back(Follow(span.to - span.from, [&](double) { return span.v; }));
    }
  }

  // m/s, mean of u over each span.
  const std::vector<Complex>& means() const { return means_; }

 private:
  // Returns the mean of u over `length` (s). `velocity` takes the share of the length.
  template <class Velocity>
  Complex Follow(double length, const Velocity& velocity) {
    const int steps = std::max(1, static_cast<int>(std::ceil(length / kCoarseStep)));
    const double share = -std::expm1(-gain_ * length / steps);
    Complex sum = 0.0;
    for (int i = 0; i < steps; ++i) {
      const Complex before = u_;
      u_ += share * (velocity((i + 0.5) / steps) - u_);
      sum += 0.5 * (before + u_);
    }
    return sum / static_cast<double>(steps);
  }

  void FollowGap(const Span& a, const Span& b) {
    const double length = b.from - a.to;
    if (!(length > 0.0)) return;
    const Complex mean = (b.At(b.from) - a.At(a.to)) / length;
    Follow(length, [&](double s) {
      return 6.0 * s * (1.0 - s) * mean + (1.0 - s) * (1.0 - 3.0 * s) * a.v +
             s * (3.0 * s - 2.0) * b.v;
    });
  }

  double gain_;  // 1/s
  Complex u_;    // m/s
  std::vector<Complex> means_;
};

// Sums of least squares for Re c, Im c, Re b, Im b and the two of d, with k given; `all`: (m/s)^2,
// squares of the changes with k's part.
struct ArcSums : NormalSums<6> {
  double all = 0.0;
};

ArcSums SumArcs(const std::vector<Arc>& arcs, const std::vector<Complex>& missed,
                std::size_t without) {
  ArcSums sums;
  const auto block = [&](std::size_t i) { return i * kBlocks / arcs.size(); };
  Eigen::Matrix<double, 2, 6> j;
  for (std::size_t i = 0; i < arcs.size(); ++i) {
    if (block(i) == without) continue;
    const Arc& arc = arcs[i];
    j << arc.sure.real(), -arc.sure.imag(), arc.time, 0.0, arc.x.real(), arc.y.real(),  //
        arc.sure.imag(), arc.sure.real(), 0.0, arc.time, arc.x.imag(), arc.y.imag();
    const Complex rest = arc.seen - (missed[arc.span] - missed[arc.span - 1]);
    sums.Add(j.row(0).transpose(), rest.real());
    sums.Add(j.row(1).transpose(), rest.imag());
    sums.all += std::norm(arc.seen);
  }
  return sums;
}

// (m/s)^2 that c of this angle, |c|, b and d leave, the priors' part included.
double LeftAtAngle(const ArcSums& sums, double noise, double angle) {
  using Vector5 = Eigen::Matrix<double, 5, 1>;
  Eigen::Matrix<double, 6, 5> turn = Eigen::Matrix<double, 6, 5>::Zero();  // of |c|, b and d
  turn(0, 0) = std::cos(angle);
  turn(1, 0) = std::sin(angle);
  turn.bottomRightCorner<4, 4>().setIdentity();
  const auto weight = [&](double sigma) { return noise * noise / (sigma * sigma); };
  Vector5 weights;
  weights << weight(kOtherScale), Eigen::Vector4d::Constant(weight(kBodyBias));
  Eigen::Matrix<double, 5, 5> a = turn.transpose() * sums.a * turn;
  a.diagonal() += weights;
  Vector5 b = turn.transpose() * sums.b;
  b[0] += weights[0];  // |c| is 1
  return std::max(0.0, sums.yy + weights[0] - b.dot(a.ldlt().solve(b)));
}

// The gains of an attitude filter that are tried.
std::vector<double> Gains() {
  std::vector<double> gains = {0.0};
  for (double gain = kLowestGain; gain <= kHighestGain; gain *= kGainStep) gains.push_back(gain);
  return gains;
}

// The best gain at an angle of c.
struct AngleFit {
  double angle;  // rad
  double cost;   // of the gain's prior, too; 1 is one sigma
  double left;   // (m/s)^2
};

struct AngleProfile {
  std::vector<AngleFit> fits;  // from -180 deg on
  std::size_t best = 0;

  const AngleFit& Best() const { return fits[best]; }
  double CostBeyondBest(std::size_t i) const { return fits[i].cost - Best().cost; }
  // The parabola through the best angle and its neighbours.
  double Curvature() const { return Beside(1) - 2.0 * Best().cost + Beside(kAngles - 1); }
  double Angle() const {
    return Best().angle +
           kAngleStep * ParabolaVertex(-Beside(kAngles - 1), -Best().cost, -Beside(1));
  }

 private:
  double Beside(std::size_t steps) const { return fits[(best + steps) % kAngles].cost; }
};

AngleProfile ProfileOf(const std::vector<ArcSums>& of_gains, double noise, double gain_sigma) {
  const std::vector<double> gains = Gains();
  AngleProfile profile;
  for (int i = 0; i < kAngles; ++i) {
    const int from_zero = i - kAngles / 2;
    AngleFit best{from_zero * kAngleStep, std::numeric_limits<double>::infinity(), 0.0};
    for (std::size_t g = 0; g < gains.size(); ++g) {
      const double left = LeftAtAngle(of_gains[g], noise, best.angle);
      const double cost = left / (noise * noise) + std::pow(gains[g] / gain_sigma, 2);
      if (cost < best.cost) best = {best.angle, cost, left};
    }
    profile.fits.push_back(best);
    if (best.cost < profile.Best().cost) profile.best = profile.fits.size() - 1;
  }
  return profile;
}

// rad, by the cost alone; of several minima, by the spread between them.
double SigmaOf(const AngleProfile& profile) {
  double weights = 0.0, squares = 0.0;
  for (std::size_t i = 0; i < profile.fits.size(); ++i) {
    const double weight = std::exp(-0.5 * profile.CostBeyondBest(i));
    const double off = std::remainder(profile.fits[i].angle - profile.Angle(), 2.0 * M_PI);
    weights += weight;
    squares += weight * off * off;
  }
  // Narrower than the steps between angles.
  const double at_best = kAngleStep * std::sqrt(2.0 / std::max(1e-9, profile.Curvature()));
  return at_best < kAngleStep ? at_best : std::sqrt(squares / weights);
}

// The sums of every gain, for all arcs but those of the block `without`.
std::vector<ArcSums> SumsOfGains(const std::vector<Arc>& arcs,
                                 const std::vector<MissedVelocity>& missed, std::size_t without) {
  std::vector<ArcSums> sums;
  sums.reserve(missed.size());
  for (const MissedVelocity& of_gain : missed) {
    sums.push_back(SumArcs(arcs, of_gain.means(), without));
  }
  return sums;
}

std::optional<Heading> HeadingBySpans(const std::vector<Span>& spans, double gain_sigma) {
  const std::vector<Arc> arcs = ArcsOf(spans);
  if (arcs.size() < kLeastArcs) return std::nullopt;
  std::vector<MissedVelocity> missed;
  for (const double gain : Gains()) missed.emplace_back(spans, gain);
  const std::vector<ArcSums> sums = SumsOfGains(arcs, missed, kBlocks);
  const double freedom = 2.0 * static_cast<double>(arcs.size()) - 7.0;
  double noise = kLeastNoise;
  AngleProfile profile = ProfileOf(sums, noise, gain_sigma);
  for (int pass = 0; pass < 3; ++pass) {
    noise = std::max(kLeastNoise, std::sqrt(profile.Best().left / freedom));
    profile = ProfileOf(sums, noise, gain_sigma);
  }
  const double left = profile.Best().left / sums.front().all;
  if (!(left < kMajority)) return std::nullopt;
  std::vector<double> without;
  for (std::size_t block = 0; block < kBlocks; ++block) {
    const auto part = ProfileOf(SumsOfGains(arcs, missed, block), noise, gain_sigma);
    without.push_back(std::remainder(part.Angle() - profile.Angle(), 2.0 * M_PI));
  }
  double none = std::numeric_limits<double>::infinity();
  for (std::size_t i = 0; i < profile.fits.size(); ++i) {
    if (std::abs(profile.fits[i].angle) > kAbsorbedHeading) continue;
    none = std::min(none, profile.CostBeyondBest(i));
  }
  return Heading{std::remainder(profile.Angle(), 2.0 * M_PI),
                 std::max(SigmaOf(profile), JackknifeSigma(without)), left, std::sqrt(none)};
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

// The heading with an attitude filter in order, and with one of any gain.
struct HeadingPair {
  Heading ordinary, any;

  bool IsShown(double least) const {
    const double a = std::abs(ordinary.angle), b = std::abs(any.angle);
    const double apart = std::abs(std::remainder(ordinary.angle - any.angle, 2.0 * M_PI));
    const bool zero_between = apart > std::max(a, b);
    return std::min(a, b) > least && !zero_between && ordinary.none_excluded > kLikely &&
           any.none_excluded > kShown;
  }
  bool IsPrecise() const {
    return std::abs(ordinary.angle) > kShown * ordinary.sigma &&
           std::abs(any.angle) > kShown * any.sigma;
  }
};

Finding OffsetOf(const Heading& heading, double gravity) {
  const double error = gravity * std::abs(std::sin(heading.angle));
  const double size = heading.angle / kDegree, sigma = heading.sigma / kDegree;
  const Level level = LevelOfTurn(std::abs(size));
  return {&fault::kHeadingOffset, "attitude", level, size, error, sigma};
}

void AddOffset(Examination* e, const std::string& stream, const HeadingPair& pair) {
  const Heading& heading = pair.ordinary;
  Finding finding = OffsetOf(heading, e->log.gravity);
  finding.text = fmt::format(
      "north of {}.csv is turned by {:.0f} +- {:.1g} deg from that of attitude.csv, by "
      "changes of velocity: a calibration takes up to {:.0f} deg for an error of the AHRS",
      stream, finding.size, finding.sigma, kAbsorbedHeading / kDegree);
  if (!pair.IsPrecise()) {
    finding.text += fmt::format(
        ". The turn is uncertain: {:.0f} +- {:.0f} deg if the attitude filter takes acceleration "
        "for tilt",
        pair.any.angle / kDegree, pair.any.sigma / kDegree);
    finding.remedy = "check the attitude's north in the map";
    e->Add(finding);
    return;
  }
  // Axes are named in quarter turns; a calibration finds the rest.
  const double quarter = 0.5 * M_PI * std::round(heading.angle / (0.5 * M_PI));
  const bool is_quarter = quarter != 0.0 && std::abs(heading.angle - quarter) < kAbsorbedHeading;
  const double angle = is_quarter ? quarter : heading.angle;
  finding.remedy =
      fmt::format("turn the attitude's earth by {:+.1f} deg about down", angle / kDegree);
  const Eigen::AngleAxisd turn(angle, Eigen::Vector3d::UnitZ());
  const StreamRepair change{.earth = turn.toRotationMatrix()};
  for (const std::string& copy : e->copies) e->Repair(copy, change);
  e->AddRepaired(finding, change);
}

// The headings of both halves of a flight by `shape` times one size: the best size, and chi square.
struct HalvesFit {
  double size, chi2;
};
HalvesFit FitHalves(const Heading& first, const Heading& second, const Eigen::Vector2d& shape) {
  const Eigen::Vector2d sigma(first.sigma, second.sigma);
  const Eigen::Vector2d angle = Eigen::Vector2d(first.angle, second.angle).cwiseQuotient(sigma);
  const Eigen::Vector2d unit = shape.cwiseQuotient(sigma);
  const double size = unit.dot(angle) / unit.squaredNorm();
  return {size, (angle - size * unit).squaredNorm()};
}

// A heading that grows from zero is no offset that a map could turn.
bool AddDrift(Examination* e, const std::string& stream) {
  const std::vector<ImuSample>& imu = e->fixed.imu;
  const TimeNs from = imu.front().t, middle = imu[imu.size() / 2].t, to = imu.back().t;
  const auto first = HeadingOf(PartOf(e->fixed, from, middle), stream, kOrdinaryGain);
  auto second = HeadingOf(PartOf(e->fixed, middle, to), stream, kOrdinaryGain);
  if (!first || !second) return false;
  // Beside half a turn one may be positive and the other negative.
  second->angle = first->angle + std::remainder(second->angle - first->angle, 2.0 * M_PI);
  const HalvesFit offset = FitHalves(*first, *second, {1.0, 1.0}),
                  drift = FitHalves(*first, *second, {0.25, 0.75});
  if (offset.chi2 < drift.chi2) return false;
  const double seconds = SecondsBetween(from, to);
  const double sigma = std::hypot(first->sigma, second->sigma) / (0.5 * seconds);
  e->Add(
      {&fault::kHeadingDrift, "attitude", Level::kBiases, drift.size / kDegree / seconds,
       e->log.gravity * std::abs(std::sin(drift.size)), sigma / kDegree},
      fmt::format(
          "the heading of attitude.csv drifts rather than being turned: north of {}.csv is off by "
          "{:.0f} +- {:.1g} deg in the first half of the flight, by {:.0f} +- {:.1g} deg in the "
          "second",
          stream, first->angle / kDegree, first->sigma / kDegree, second->angle / kDegree,
          second->sigma / kDegree),
      "trueline diagnose tells a drift from an error that goes with the heading");
  return true;
}

// Passes alone do not tell an attitude of another heading from an accelerometer of other axes.
void AddUndecided(Examination* e, const std::string& stream, const Heading& heading,
                  const TurnedForce& other) {
  Finding finding = OffsetOf(heading, e->log.gravity);
  finding.level = Level::kFatal;
  finding.text = fmt::format(
      "the changes of velocity of {}.csv do not fit attitude and accelerometer as read: either "
      "north of attitude.csv is turned by {:.0f} +- {:.1g} deg ({:.0f} % explained), or the "
      "accelerometer's axes are {} ({:.0f} %). The log does not show which of the two is wrong",
      stream, finding.size, finding.sigma, 100.0 * (1.0 - heading.left), AxesText(other.turn),
      100.0 * (1.0 - other.heading.left));
  finding.remedy = "check the axes of the accelerometer and the attitude's north in the map";
  e->Add(finding);
}

void NoteUndecided(Examination* e, const std::string& stream, const HeadingPair& pair) {
  e->result.notes.push_back(fmt::format(
      "the heading of {}.csv against that of attitude.csv: {:.0f} +- {:.0f} deg for an attitude "
      "filter in order, {:.0f} +- {:.0f} deg for one that may take acceleration for tilt "
      "(ahrs_acceleration_error). An offset of the heading and such a filter look alike here",
      stream, pair.ordinary.angle / kDegree, pair.ordinary.sigma / kDegree,
      pair.any.angle / kDegree, pair.any.sigma / kDegree));
}

// An attitude filter that takes acceleration for tilt turns at other rates than the gyroscope,
// which looks like a small turn of the IMU.
bool MayFollowAcceleration(const Examination& e) {
  const Eigen::Matrix3d turn = e.RepairOf("imu").gyro;
  return !IsIdentity(turn) && TurnSize(turn) < kTurnByFilter / kDegree;
}

}  // namespace

std::optional<Heading> HeadingOf(const FlightLog& log, const std::string& stream,
                                 double gain_sigma) {
  const Integrals integrals(log);
  const auto of_stream = [&](const std::vector<PositionSample>& positions, double length,
                             double step) {
    return HeadingBySpans(SpansOfStream(log, positions, integrals, length, step), gain_sigma);
  };
  if (stream == "mocap") return of_stream(PositionsOf(log, stream), 0.4, 1.0);
  const std::vector<Span> of_passes = SpansOfPasses(log, integrals);
  if (ArcsOf(of_passes).size() >= kLeastArcs) return HeadingBySpans(of_passes, gain_sigma);
  return of_stream(PositionsOf(log, stream), 2.0, 2.0);
}

std::optional<TurnedForce> BestLateralTurn(const FlightLog& log, const std::string& stream,
                                           double z) {
  FlightLog turned = log;
  std::optional<TurnedForce> best;
  double second = 1.0;
  for (const Eigen::Matrix3d& turn : LateralTurns(z)) {
    for (std::size_t i = 0; i < log.imu.size(); ++i) turned.imu[i].accel = turn * log.imu[i].accel;
    const auto heading = HeadingOf(turned, stream, kOrdinaryGain);
    if (!heading || std::abs(heading->angle) > kOtherAxes) continue;
    if (best && heading->left >= best->heading.left) {
      second = std::min(second, heading->left);
      continue;
    }
    if (best) second = std::min(second, best->heading.left);
    best = TurnedForce{turn, *heading, false};
  }
  if (best) best->clear = best->heading.left < kExplains * second;
  return best;
}

void CheckHeading(Examination* e) {
  if (e->fixed.attitude.size() < kFewest) return;
  for (const char* stream : {"mocap", "fixes"}) {
    // By another clock, which may be a lap off, they are compared once that is repaired.
    if (e->RepairOf(stream).time_offset != 0.0) continue;
    const auto heading = HeadingOf(e->fixed, stream, kOrdinaryGain);
    if (!heading) continue;
    const bool small = std::abs(heading->angle) < e->other_axes;
    if (small && heading->sigma < kAbsorbedHeading) return;
    const auto any = HeadingOf(e->fixed, stream, kAnyGain);
    if (!any) continue;
    const HeadingPair pair{*heading, *any};
    if (!pair.IsShown(e->other_axes) || MayFollowAcceleration(*e)) {
      NoteUndecided(e, stream, pair);
      return;
    }
    if (AddDrift(e, stream)) return;
    const auto other =
        std::string(stream) == "fixes" ? BestLateralTurn(e->fixed, stream, 1.0) : std::nullopt;
    if (other && other->heading.left < kAlikeRest * heading->left) {
      AddUndecided(e, stream, *heading, *other);
    } else {
      AddOffset(e, stream, pair);
    }
    return;
  }
  if (e->fixed.fixes.empty() && e->fixed.mocap.empty()) return;
  e->result.notes.emplace_back(
      "the heading of the positions against that of attitude.csv: the acceleration does not show "
      "it");
}

}  // namespace trueline
