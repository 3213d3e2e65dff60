#include "problems/trajectory/trajectory_config.h"

#include <fmt/ranges.h>

#include <cmath>
#include <limits>
#include <utility>

#include "problems/common/error.h"
#include "problems/common/units.h"
#include "problems/trajectory/limits.h"

namespace trueline {
namespace {

Eigen::Vector4d Get4(const YamlMap& map, const std::string& key, bool required) {
  const auto values = required ? map.Get<std::vector<double>>(key)
                               : map.Get<std::vector<double>>(key, {0.0, 0.0, 0.0, 0.0});
  if (values.size() != 4) map.Fail(key, "needs 4 numbers: x, y, z, yaw");
  return Eigen::Map<const Eigen::Vector4d>(values.data());
}

double Speed(const YamlMap& map, const std::string& key, double fallback) {
  if (map.Has(key) && map.Has(key + "_rpm")) {
    map.Fail(key, fmt::format("is stated in rad/s and as {}_rpm; keep one", key));
  }
  const double rpm = map.Get<double>(key + "_rpm", fallback / kRpm);
  return map.Get<double>(key, rpm * kRpm);
}

}  // namespace

FlightLimits ReadLimits(const YamlMap& map) {
  FlightLimits limits;
  limits.travel = map.Get<double>("travel", limits.travel);
  limits.rate = map.Get<double>("rate", limits.rate);
  const bool by_axis = map.Has("roll") || map.Has("pitch");
  limits.roll = map.Get<double>("roll", limits.roll);
  limits.pitch = map.Get<double>("pitch", limits.pitch);
  limits.tilt =
      map.Get<double>("tilt", by_axis ? std::numeric_limits<double>::infinity() : limits.tilt);
  limits.min_speed = Speed(map, "min_speed", limits.min_speed);
  limits.max_speed = Speed(map, "max_speed", limits.max_speed);
  if (!(limits.travel > 0.0)) map.Fail("travel", "must be positive, in m");
  if (!(limits.rate > 0.0)) map.Fail("rate", "must be positive, in rad/s");
  const std::pair<const char*, double> angles[] = {
      {"tilt", limits.tilt}, {"roll", limits.roll}, {"pitch", limits.pitch}};
  for (const auto& [key, angle] : angles) {
    const bool given = map.Has(key) || std::isfinite(angle);
    if (given && !(angle > 0.0 && angle < 0.5 * M_PI)) map.Fail(key, "must be in (0, pi/2) rad");
  }
  if (!(limits.min_speed >= 0.0 && limits.max_speed > limits.min_speed)) {
    map.Fail("max_speed", "rotor speeds need 0 <= min_speed < max_speed");
  }
  map.Finish();
  return limits;
}

namespace {

// Beside the configuration, or from where the program runs.
PiecewisePolynomial ReadStoredTrajectory(const YamlMap& map) {
  const std::filesystem::path file = map.Get<std::string>("file");
  map.Finish();
  const std::filesystem::path beside = std::filesystem::path(map.file()).parent_path() / file;
  return ReadTrajectoryFile(std::filesystem::exists(file) ? file : beside);
}

}  // namespace

PiecewisePolynomial ReadTrajectory(const YamlMap& map, const RotorVehicle& vehicle,
                                   const FlightLimits& limits) {
  const std::string kind =
      map.GetChoice("kind", {"hover", "lissajous", "random", "file"}, "lissajous");
  if (kind == "file") return ReadStoredTrajectory(map);
  const double duration = map.Get<double>("duration", 20.0);
  const bool random = kind == "random";
  const std::uint64_t seed = random ? map.Get<std::uint64_t>("seed", 0) : 0;
  Lissajous figure;
  if (kind == "lissajous") {
    figure = {Get4(map, "amplitude", true), Get4(map, "frequency", true),
              Get4(map, "phase", false)};
  }
  if (!(duration > 0.0 && duration <= 600.0)) map.Fail("duration", "must be in (0, 600] s");
  map.Finish();
  if (!random) return LissajousPath(figure, duration);
  return RandomFeasibleFlight(vehicle, duration, limits, seed);
}

std::string TrajectoryYaml(const PiecewisePolynomial& path) {
  std::string text =
      "# Piece i from breaks[i] to breaks[i + 1] (s): sum_j c[j] (t - breaks[i])^j for x, y, z (m, "
      "NED) and yaw (rad)\nframe: NED\n";
  text += fmt::format("breaks: [{:.17g}]\npieces:\n", fmt::join(path.breaks(), ", "));
  for (const FlatMatrix& c : path.coefficients()) {
    const char* names[] = {"x", "y", "z", "yaw"};
    for (int i = 0; i < kFlatOutputs; ++i) {
      const Eigen::RowVectorXd row = c.row(i);
      text += fmt::format("{}{}: [{:.17g}]\n", i == 0 ? "  - " : "    ", names[i],
                          fmt::join(row.data(), row.data() + row.size(), ", "));
    }
  }
  return text;
}

PiecewisePolynomial ReadTrajectoryFile(const std::filesystem::path& file) {
  return TrajectoryOf(YamlMap::FromFile(file));
}

PiecewisePolynomial TrajectoryOf(const YamlMap& map) {
  map.GetChoice("frame", {"NED"}, "NED");
  const auto breaks = map.Get<std::vector<double>>("breaks");
  std::vector<FlatMatrix> coefficients;
  for (const YamlMap& piece : map.Children("pieces")) {
    FlatMatrix c;
    int row = 0;
    for (const char* name : {"x", "y", "z", "yaw"}) {
      const auto values = piece.Get<std::vector<double>>(name);
      if (row == 0) c.resize(kFlatOutputs, static_cast<Eigen::Index>(values.size()));
      if (values.empty() || static_cast<Eigen::Index>(values.size()) != c.cols()) {
        piece.Fail(name, "every output of a piece needs the same number of coefficients");
      }
      c.row(row++) = Eigen::Map<const Eigen::RowVectorXd>(values.data(), c.cols());
    }
    piece.Finish();
    coefficients.push_back(c);
  }
  map.Finish();
  if (coefficients.empty() || breaks.size() != coefficients.size() + 1) {
    map.Fail("breaks", fmt::format("needs one more than the {} pieces", coefficients.size()));
  }
  for (std::size_t i = 1; i < breaks.size(); ++i) {
    if (!(breaks[i] > breaks[i - 1])) map.Fail("breaks", "must increase");
  }
  return {breaks, coefficients};
}

std::string TrajectoryCsv(const RotorFlight& flight, double rate) {
  std::string text =
      "t [s],x [m],y [m],z [m],yaw [rad],vx [m/s],vy [m/s],vz [m/s],qw [1],qx [1],qy [1],qz [1],"
      "wx [rad/s],wy [rad/s],wz [rad/s]";
  const auto rotors = flight.vehicle().speeds_from_wrench.rows();
  for (Eigen::Index i = 1; i <= rotors; ++i) text += fmt::format(",w{} [rad/s]", i);
  text += "\n";
  const PiecewisePolynomial& path = flight.path();
  const int steps = static_cast<int>(std::floor(path.duration() * rate + 1e-9));
  for (int k = 0; k <= steps; ++k) {
    const double t = path.start() + k / rate;
    const NominalPoint point = flight.At(t);
    const double* x = point.x.data();
    text += fmt::format(
        "{:.6f},{:.6f},{:.6f}", t,
        fmt::join(x + RotorDrivenModel::kPosition, x + RotorDrivenModel::kPosition + 3, ","),
        path.Expand(t, 0)(3, 0));
    text += fmt::format(
        ",{:.6f},{:.9f},{:.6f}",
        fmt::join(x + RotorDrivenModel::kVelocity, x + RotorDrivenModel::kVelocity + 3, ","),
        fmt::join(x, x + 4, ","),
        fmt::join(x + RotorDrivenModel::kRate, x + RotorDrivenModel::kRate + 3, ","));
    for (const double u : point.u) text += fmt::format(",{:.3f}", std::sqrt(std::max(u, 0.0)));
    text += "\n";
  }
  return text;
}

}  // namespace trueline
