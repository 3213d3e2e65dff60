#include "problems/import/source.h"

#include <cmath>
#include <numeric>

#include "problems/common/error.h"
#include "problems/log/csv_text.h"

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

YAML::Node ExpandColumns(const YAML::Node& range) {
  if (!range.IsScalar()) return range;
  const std::string& text = range.Scalar();
  const std::size_t bracket = text.find('['), dots = text.find("..");
  if (bracket == std::string::npos || dots == std::string::npos || !text.ends_with(']')) {
    return range;
  }
  double from = 0.0, to = 0.0;
  const bool numbers =
      ParseNumber(std::string_view(text).substr(bracket + 1, dots - bracket - 1), &from) &&
      ParseNumber(std::string_view(text).substr(dots + 2, text.size() - dots - 3), &to);
  if (!numbers || !(to - from < 64.0)) return range;
  YAML::Node list;
  for (int i = static_cast<int>(from); i <= static_cast<int>(to); ++i) {
    list.push_back(fmt::format("{}[{}]", text.substr(0, bracket), i));
  }
  return list;
}

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

void SourceColumn::Bind(const ForeignRow& row) {
  if (!constant_) index_ = row.IndexOf(name_, where_);
}

double SourceColumn::Value(const ForeignRow& row) const {
  return constant_ ? *constant_ : row.Number(index_);
}

std::vector<SourceColumn> ReadColumns(const YamlMap& map, const std::string& key, int count) {
  YAML::Node node = map.RawNode(key);
  if (!map.Has(key)) map.Fail(key, "is missing; give a list of columns");
  node.reset(ExpandColumns(node));
  if (!node.IsSequence()) map.Fail(key, "must be a list of columns");
  if (node.size() == 0 || (count > 0 && node.size() != static_cast<std::size_t>(count))) {
    map.Fail(key, fmt::format("needs {} columns, found {}", count > 0 ? count : 1, node.size()));
  }
  std::vector<SourceColumn> columns;
  for (const YAML::Node& item : node) columns.emplace_back(item, map.file());
  return columns;
}

NumberSource::NumberSource(const YamlMap& map, const char* si, int count, const char* key)
    : columns_(ReadColumns(map, key, count)),
      scale_(ReadForEach(map, "scale", 1.0, columns_.size())),
      offset_(ReadForEach(map, "offset", 0.0, columns_.size())) {
  const double unit = ReadUnit(map, si);
  for (std::size_t i = 0; i < columns_.size(); ++i) {
    // A constant is given in SI.
    scale_[i] = columns_[i].is_constant() ? 1.0 : scale_[i] * unit;
  }
  if (count != 0 || !map.Has("mix")) return;
  mix_ = map.Get<std::vector<std::vector<double>>>("mix");
  for (const std::vector<double>& row : mix_) {
    if (row.size() == columns_.size()) continue;
    map.Fail("mix", fmt::format("each row needs {} weights, one a column, found {}",
                                columns_.size(), row.size()));
  }
}

NumberSource NumberSource::Single(const YamlMap& map, const char* si) {
  if (map.Has("constant")) {
    NumberSource source(map.Get<double>("constant"));
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

void NumberSource::Bind(const ForeignRow& row) {
  for (SourceColumn& column : columns_) column.Bind(row);
}

std::optional<double> NumberSource::Constant() const {
  if (columns_.size() != 1 || !columns_.front().is_constant()) return std::nullopt;
  return scale_.front() * *columns_.front().constant() + offset_.front();
}

std::vector<double> NumberSource::Values(const ForeignRow& row) const {
  std::vector<double> values(columns_.size());
  for (std::size_t i = 0; i < columns_.size(); ++i) {
    values[i] = scale_[i] * columns_[i].Value(row) + offset_[i];
  }
  if (mix_.empty()) return values;
  std::vector<double> mixed;
  for (const std::vector<double>& weights : mix_) {
    mixed.push_back(std::inner_product(weights.begin(), weights.end(), values.begin(), 0.0));
  }
  return mixed;
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
  scale_ = is_quaternion_ ? std::vector<double>(4, columns.Get<double>("scale", 1.0))
                          : ReadForEach(columns, "scale", 1.0, 3);
  const double unit = is_quaternion_ ? 1.0 : ReadUnit(columns, "rad");
  for (double& scale : scale_) scale *= unit;
  inverse_ = columns.Get<bool>("inverse", false);
  columns.Finish();
  axes_ = ReadAxes(map, axes);
  for (const auto& [key, turn] : {std::pair{"earth", axes_.earth}, {"body", axes_.body}}) {
    if (turn.determinant() < 0.0) map.Fail(key, "is left-handed: an attitude can't be mirrored");
  }
  to_earth_ = Eigen::Quaterniond(axes_.earth);
  from_body_ = Eigen::Quaterniond(axes_.body).conjugate();
}

void SourceAttitude::Bind(const ForeignRow& row) {
  for (std::size_t i = 0; i < (is_quaternion_ ? 4U : 3U); ++i) columns_[i].Bind(row);
}

std::optional<Eigen::Quaterniond> SourceAttitude::Value(const ForeignRow& row,
                                                        std::optional<double>* bad_norm) const {
  const auto source = is_quaternion_ ? FromQuaternion(row, bad_norm) : FromEuler(row);
  if (!source) return std::nullopt;
  return (to_earth_ * (inverse_ ? source->conjugate() : *source) * from_body_).normalized();
}

InputError SourceAttitude::NormError(const ForeignRow& row, double norm) const {
  return row.ErrorIn(columns_[0].index(),
                     fmt::format("the quaternion's norm is {:.4g}, not 1; check its "
                                 "columns and 'scale' in the map",
                                 norm));
}

std::optional<Eigen::Quaterniond> SourceAttitude::FromQuaternion(
    const ForeignRow& row, std::optional<double>* bad_norm) const {
  constexpr double kTolerance = 0.03;  // of a norm of columns rounded to few digits
  const auto value = [&](std::size_t i) { return scale_[i] * columns_[i].Value(row); };
  const Eigen::Quaterniond q(value(0), value(1), value(2), value(3));
  const double norm = q.norm();
  if (!std::isfinite(norm) || norm == 0.0) return std::nullopt;
  if (std::abs(norm - 1.0) > kTolerance) {
    *bad_norm = norm;
    return std::nullopt;
  }
  return q.normalized();
}

std::optional<Eigen::Quaterniond> SourceAttitude::FromEuler(const ForeignRow& row) const {
  const auto value = [&](std::size_t i) { return scale_[i] * columns_[i].Value(row); };
  const Eigen::Vector3d angles(value(0), value(1), value(2));
  if (!angles.allFinite()) return std::nullopt;
  return Eigen::AngleAxisd(angles.z(), Eigen::Vector3d::UnitZ()) *
         Eigen::AngleAxisd(angles.y(), Eigen::Vector3d::UnitY()) *
         Eigen::AngleAxisd(angles.x(), Eigen::Vector3d::UnitX());
}

}  // namespace trueline
