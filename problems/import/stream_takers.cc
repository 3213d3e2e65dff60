#include "problems/import/stream_takers.h"

#include <algorithm>
#include <cmath>

namespace trueline {
namespace {

bool Finite(const std::vector<double>& values) {
  return std::all_of(values.begin(), values.end(), [](double x) { return std::isfinite(x); });
}

// Samples are made by the maps below: Bind() the sources, then Convert() row by row. Stamps are
// set by the caller.

void BindSources(const ForeignCsv& csv, ImuMap* map) {
  map->accel.Bind(csv);
  map->gyro.Bind(csv);
  if (map->accel_attitude) map->accel_attitude->Bind(csv);
}

std::optional<ImuSample> Convert(const ForeignCsv& csv, const ImuMap& map) {
  ImuSample sample{0, map.accel_axes * map.accel.Vector3(csv),
                   map.gyro_axes * map.gyro.Vector3(csv)};
  if (map.accel_attitude) {
    const auto q_E_B = map.accel_attitude->Value(csv);
    if (!q_E_B) return std::nullopt;
    sample.accel = q_E_B->conjugate() * sample.accel;
  }
  if (!sample.accel.allFinite() || !sample.gyro.allFinite()) return std::nullopt;
  return sample;
}

void BindSources(const ForeignCsv& csv, AttitudeMap* map) { map->attitude.Bind(csv); }

std::optional<AttitudeSample> Convert(const ForeignCsv& csv, const AttitudeMap& map) {
  const auto q = map.attitude.Value(csv);
  if (!q) return std::nullopt;
  return AttitudeSample{0, *q};
}

void BindSources(const ForeignCsv& csv, FixMap* map) {
  map->position.Bind(csv);
  map->sigma.Bind(csv);
  map->gate.Bind(csv);
}

std::optional<Fix> Convert(const ForeignCsv& csv, const FixMap& map) {
  const Eigen::Vector3d p = map.axes * map.position.Vector3(csv);
  const double sigma = map.sigma.Value(csv);
  const double gate = map.gate.Value(csv);
  if (!p.allFinite() || !std::isfinite(sigma) || !std::isfinite(gate)) return std::nullopt;
  return Fix{0, p, sigma, static_cast<int>(std::lround(gate))};
}

void BindSources(const ForeignCsv& csv, PoseMap* map) {
  map->position.Bind(csv);
  map->attitude.Bind(csv);
}

std::optional<PoseSample> Convert(const ForeignCsv& csv, const PoseMap& map) {
  const Eigen::Vector3d p = map.axes * map.position.Vector3(csv);
  const auto q = map.attitude.Value(csv);
  if (!p.allFinite() || !q) return std::nullopt;
  return PoseSample{0, p, *q};
}

void BindSources(const ForeignCsv& csv, ChannelsMap* map) { map->values.Bind(csv); }

std::optional<ChannelsSample> Convert(const ForeignCsv& csv, const ChannelsMap& map) {
  ChannelsSample sample{0, map.values.Values(csv)};
  if (!Finite(sample.values)) return std::nullopt;
  return sample;
}

void BindSources(const ForeignCsv& csv, ScalarMap* map) { map->value.Bind(csv); }

std::optional<ScalarSample> Convert(const ForeignCsv& csv, const ScalarMap& map) {
  const ScalarSample sample{0, map.value.Value(csv)};
  if (!std::isfinite(sample.value)) return std::nullopt;
  return sample;
}

class TakerList {
 public:
  explicit TakerList(const std::vector<std::string>& files) : files_(files) {}

  template <class Map, class Sample>
  void Add(const std::string& name, const std::optional<Map>& map, std::vector<Sample>* samples) {
    if (!map) return;
    const auto own = std::make_shared<Map>(*map);  // bound to its file, shared by both functions
    takers_.push_back(
        {map->input, std::make_unique<StreamImport<Sample>>(
                         name, *map, files_[map->input],
                         [own](const ForeignCsv& csv) { BindSources(csv, own.get()); },
                         [own](const ForeignCsv& csv) { return Convert(csv, *own); }, samples)});
  }

  std::vector<StreamTaker> Release() { return std::move(takers_); }

 private:
  const std::vector<std::string>& files_;
  std::vector<StreamTaker> takers_;
};

}  // namespace

std::vector<StreamTaker> MakeTakers(const ImportMap& map, const std::vector<std::string>& files,
                                    const std::optional<double>& fix_sigma, FlightLog* log) {
  std::optional<FixMap> fixes = map.fixes;
  if (fixes && fix_sigma) fixes->sigma = ScalarSource(*fix_sigma);
  TakerList list(files);
  list.Add("imu", map.imu, &log->imu);
  list.Add("attitude", map.attitude, &log->attitude);
  list.Add("fixes", fixes, &log->fixes);
  list.Add("pose", map.pose, &log->pose);
  list.Add("mocap", map.mocap, &log->mocap);
  list.Add("rotors", map.rotors, &log->rotors);
  list.Add("motors", map.motors, &log->motors);
  list.Add("battery", map.battery, &log->battery);
  list.Add("range", map.range, &log->range);
  return list.Release();
}

}  // namespace trueline
