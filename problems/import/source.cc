#include "problems/import/source.h"

#include <cmath>

#include "problems/common/error.h"

namespace trueline {
namespace {

// One number for all columns, or one for each.
std::vector<double> ReadForEach(const YamlMap& map, const std::string& key, double fallback,
                                std::size_t count) {
  const YAML::Node node = map.RawNode(key);
  if (!map.Has(key)) return std::vector<double>(count, fallback);
  if (node.IsScalar()) return std::vector<double>(count, map.Get<double>(key));
  auto values = map.Get<std::vector<double>>(key);
  if (values.size() != count) {
    map.Fail(key, fmt::format("needs one number or {}, found {}", count, values.size()));
  }
  return values;
}

}  // namespace

double ReadUnit(const YamlMap& map, const char* si) {
  const std::string unit = map.Get<std::string>("unit", si);
  if (const auto factor = UnitFactor(si, unit)) return *factor;
  map.Fail("unit", fmt::format("'{}' is not known here; use one of: {}", unit, KnownUnits(si)));
}

SourceColumn::SourceColumn(const YAML::Node& node, const std::string& map_file)
    : where_(fmt::format("{}:{}", map_file, node.Mark().line + 1)) {
  if (node.IsMap()) {
    const YamlMap map(node, map_file, "column");
    constant_ = map.Get<double>("constant");
    map.Finish();
  } else if (node.IsScalar()) {
    name_ = node.Scalar();
  } else {
    throw InputError(where_ + ": a column is a name, a number from 1, or {constant: value}");
  }
}

void SourceColumn::Bind(const ForeignCsv& csv) {
  if (!constant_) index_ = csv.IndexOf(name_, where_);
}

double SourceColumn::Value(const ForeignCsv& csv) const {
  return constant_ ? *constant_ : csv.Number(index_);
}

std::vector<SourceColumn> ReadColumns(const YamlMap& map, const std::string& key, int count) {
  const YAML::Node node = map.RawNode(key);
  if (!map.Has(key)) map.Fail(key, "is missing; give a list of columns");
  if (!node.IsSequence()) map.Fail(key, "must be a list of columns");
  if (node.size() == 0 || (count > 0 && node.size() != static_cast<std::size_t>(count))) {
    map.Fail(key, fmt::format("needs {} columns, found {}", count > 0 ? count : 1, node.size()));
  }
  std::vector<SourceColumn> columns;
  for (const YAML::Node& item : node) columns.emplace_back(item, map.file());
  return columns;
}

NumberSource::NumberSource(const YamlMap& map, const char* si, int count)
    : columns_(ReadColumns(map, "columns", count)),
      scale_(ReadForEach(map, "scale", 1.0, columns_.size())),
      offset_(ReadForEach(map, "offset", 0.0, columns_.size())) {
  const double unit = ReadUnit(map, si);
  for (std::size_t i = 0; i < columns_.size(); ++i) {
    // A constant is given in SI.
    scale_[i] = columns_[i].is_constant() ? 1.0 : scale_[i] * unit;
  }
}

NumberSource NumberSource::Single(const YamlMap& map, const char* si) {
  if (map.Has("constant")) {
    const NumberSource source(map.Get<double>("constant"));
    map.Finish();
    return source;
  }
  NumberSource source;
  map.Get<std::string>("column");
  source.columns_ = {SourceColumn(map.RawNode("column"), map.file())};
  source.scale_ = {map.Get<double>("scale", 1.0) * ReadUnit(map, si)};
  source.offset_ = {map.Get<double>("offset", 0.0)};
  map.Finish();
  return source;
}

void NumberSource::Bind(const ForeignCsv& csv) {
  for (SourceColumn& column : columns_) column.Bind(csv);
}

std::vector<double> NumberSource::Values(const ForeignCsv& csv) const {
  std::vector<double> values(columns_.size());
  for (std::size_t i = 0; i < columns_.size(); ++i) {
    values[i] = scale_[i] * columns_[i].Value(csv) + offset_[i];
  }
  return values;
}

SourceAttitude::SourceAttitude(const YamlMap& map, const SourceAxes& axes)
    : is_quaternion_(map.Has("quaternion")) {
  if (is_quaternion_ == map.Has("euler")) {
    map.Fail("quaternion", "give either 'quaternion' or 'euler' for the attitude");
  }
  const YamlMap columns = map.Child(is_quaternion_ ? "quaternion" : "euler");
  const std::array<const char*, 4> quaternion = {"w", "x", "y", "z"};
  const std::array<const char*, 4> euler = {"roll", "pitch", "yaw", nullptr};
  for (std::size_t i = 0; i < 4; ++i) {
    const char* key = is_quaternion_ ? quaternion[i] : euler[i];
    if (key == nullptr) continue;
    if (!columns.Has(key)) columns.Fail(key, "is missing; give its column");
    columns_[i] = SourceColumn(columns.RawNode(key), map.file());
  }
  scale_ = columns.Get<double>("scale", 1.0);
  if (!is_quaternion_) scale_ *= ReadUnit(columns, "rad");
  columns.Finish();
  const SourceAxes own = ReadAxes(map, axes);
  to_earth_ = Eigen::Quaterniond(own.earth);
  from_body_ = Eigen::Quaterniond(own.body).conjugate();
}

void SourceAttitude::Bind(const ForeignCsv& csv) {
  for (std::size_t i = 0; i < (is_quaternion_ ? 4U : 3U); ++i) columns_[i].Bind(csv);
}

std::optional<Eigen::Quaterniond> SourceAttitude::Value(const ForeignCsv& csv) const {
  const auto source = is_quaternion_ ? FromQuaternion(csv) : FromEuler(csv);
  if (!source) return std::nullopt;
  return (to_earth_ * *source * from_body_).normalized();
}

std::optional<Eigen::Quaterniond> SourceAttitude::FromQuaternion(const ForeignCsv& csv) const {
  constexpr double kTolerance = 0.03;  // of a norm of columns rounded to few digits
  const Eigen::Quaterniond q(scale_ * columns_[0].Value(csv), scale_ * columns_[1].Value(csv),
                             scale_ * columns_[2].Value(csv), scale_ * columns_[3].Value(csv));
  const double norm = q.norm();
  if (!std::isfinite(norm) || norm == 0.0) return std::nullopt;
  if (std::abs(norm - 1.0) > kTolerance) {
    csv.Fail(columns_[0].index(), fmt::format("the quaternion's norm is {:.4g}, not 1; check its "
                                              "columns and 'scale' in the map",
                                              norm));
  }
  return q.normalized();
}

std::optional<Eigen::Quaterniond> SourceAttitude::FromEuler(const ForeignCsv& csv) const {
  const Eigen::Vector3d angles(columns_[0].Value(csv), columns_[1].Value(csv),
                               columns_[2].Value(csv));
  if (!angles.allFinite()) return std::nullopt;
  return Eigen::AngleAxisd(scale_ * angles.z(), Eigen::Vector3d::UnitZ()) *
         Eigen::AngleAxisd(scale_ * angles.y(), Eigen::Vector3d::UnitY()) *
         Eigen::AngleAxisd(scale_ * angles.x(), Eigen::Vector3d::UnitX());
}

}  // namespace trueline
