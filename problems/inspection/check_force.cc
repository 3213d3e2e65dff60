#include <algorithm>
#include <array>
#include <cmath>
#include <utility>

#include "problems/inspection/clear.h"
#include "problems/inspection/examination.h"
#include "problems/log/attitude_cursor.h"

namespace trueline {
namespace {

constexpr double kNoGravity = 0.3;  // of the readings' size, their mean where gravity is taken out
constexpr double kStandardGravity = 9.80665;  // m/s^2

// What the accelerometer's numbers may be. Gravity that was taken out points along +z of the
// attitude's earth (1), or along -z where that has z up (-1).
struct Meaning {
  bool in_earth;
  double gravity_removed, scale;
};

// The first is as read. Numbers without gravity do not show their unit by their mean.
std::vector<Meaning> AllMeanings() {
  std::vector<Meaning> all = {{false, 0.0, 1.0}, {true, 0.0, 1.0}};
  for (const bool in_earth : {false, true}) {
    for (const double sign : {1.0, -1.0}) {
      for (const double scale : {1.0, kStandardGravity, 1.0 / kStandardGravity}) {
        all.push_back({in_earth, sign, scale});
      }
    }
  }
  return all;
}

// Thrust points along the body's z, so that only the right meaning leaves little across. m/s^2,
// rms, of each; none for one that the mean of the numbers contradicts.
std::vector<std::optional<double>> ForcesAcross(const Examination& e, const std::string& by,
                                                const std::vector<Meaning>& all) {
  const std::vector<AttitudeSample> attitude = AttitudesOf(e.fixed, by);
  const Eigen::Matrix3d to_earth = EarthFromBodyAsRead(e.sources, by);
  AttitudeCursor cursor(attitude);
  std::vector<double> squares(all.size(), 0.0);
  std::array<Eigen::Vector3d, 2> sums = {Eigen::Vector3d::Zero(), Eigen::Vector3d::Zero()};
  double square = 0.0, n = 0.0;
  for (const ImuSample& sample : e.fixed.imu) {
    Eigen::Quaterniond q;
    if (!cursor.At(sample.t, kAttitudeGap, &q)) continue;
    const Eigen::Vector3d down = e.log.gravity * (q.conjugate() * Eigen::Vector3d::UnitZ()),
                          turned = q.conjugate() * to_earth * sample.accel;
    for (std::size_t i = 0; i < all.size(); ++i) {
      const Eigen::Vector3d& read = all[i].in_earth ? turned : sample.accel;
      squares[i] += (all[i].scale * read - all[i].gravity_removed * down).head<2>().squaredNorm();
    }
    sums[0] += q * sample.accel;
    sums[1] += sample.accel;
    square += sample.accel.squaredNorm();
    n += 1.0;
  }
  std::vector<std::optional<double>> across(all.size());
  // Turned by hand it feels gravity alone, the same in earth as read, and across its z.
  const bool flies =
      n > 0.0 && square / n - (sums[0] / n).squaredNorm() > kMuchLess * squares[0] / n;
  for (std::size_t i = 0; i < all.size() && n > 0.0; ++i) {
    const double mean = sums[all[i].in_earth ? 1 : 0].norm() / n;
    const bool removed = mean < kNoGravity * std::sqrt(square / n);
    const bool may_be = flies && removed == (all[i].gravity_removed != 0.0);
    if (i == 0 || may_be) across[i] = std::sqrt(squares[i] / n);
  }
  return across;
}

}  // namespace

void CheckForce(Examination* e) {
  if (e->rates.empty()) return;
  const std::string& by = e->rates.front().stream;
  const std::vector<Meaning> all = AllMeanings();
  const auto across = ForcesAcross(*e, by, all);
  std::size_t best = 0;
  for (std::size_t i = 1; i < all.size(); ++i) {
    if (across[i] && across[best] && *across[i] < *across[best]) best = i;
  }
  if (best == 0 || *across[best] > kMuchLess * *across[0] ||
      *across[0] - *across[best] < kOtherScale * e->log.gravity) {
    return;
  }
  const Meaning& meaning = all[best];
  Finding finding{"not_specific_force", "imu", Level::kFatal, *across[0], "m/s^2", *across[0]};
  finding.text = fmt::format(
      "the accelerometer's numbers are{}{}: so read, {:.2f} m/s^2 (rms) of the force are across "
      "the thrust, as read {:.2f}",
      meaning.in_earth ? " in the earth's axes" : "",
      meaning.gravity_removed == 0.0 ? ""
      : meaning.in_earth             ? " and without gravity"
                                     : " without gravity",
      *across[best], *across[0]);
  finding.remedy =
      "log the specific force in the body's axes, or state the `attitude` beside the columns of "
      "`accel` (and `gravity: removed`, `axes: body`)";
  const auto source = e->sources.find(by);
  if (source == e->sources.end() || !source->second.is_beside_imu) return e->Add(finding);
  e->AddRepaired(finding, {.accel_scale = meaning.scale,
                           .force_by = by,
                           .force_in_earth = meaning.in_earth,
                           .gravity_removed = meaning.gravity_removed});
}

}  // namespace trueline
