#include "problems/import/source.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <map>
#include <numbers>
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

using Names = std::map<std::string, std::vector<std::string>>;

const Names kEarthFrames = {
    {"NED", {"x", "y", "z"}}, {"ENU", {"y", "x", "-z"}}, {"NWU", {"x", "-y", "-z"}}};
const Names kBodyFrames = {{"FRD", {"x", "y", "z"}}, {"FLU", {"x", "-y", "-z"}}};

Eigen::Matrix3d AxesMatrix(const YamlMap& map, const std::string& key,
                           const std::vector<std::string>& axes) {
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Zero();
  if (axes.size() != 3) map.Fail(key, "needs three axes, such as [z, -x, -y]");
  for (Eigen::Index row = 0; row < 3; ++row) {
    std::string axis = axes[static_cast<std::size_t>(row)];
    const double sign = axis.starts_with('-') ? -1.0 : 1.0;
    if (axis.starts_with('-') || axis.starts_with('+')) axis.erase(0, 1);
    if (axis != "x" && axis != "y" && axis != "z") {
      map.Fail(key, fmt::format("'{}' is no axis; use x, y, z, -x, -y or -z", axis));
    }
    rotation(row, axis[0] - 'x') = sign;
  }
  if (std::abs(rotation.determinant() - 1.0) > 1e-9) {
    map.Fail(key, "the axes are not right-handed; check their order and signs");
  }
  return rotation;
}

// Rounded digits are made orthogonal again.
Eigen::Matrix3d ReadMatrix(const YamlMap& map) {
  if (!map.Has("matrix")) return Eigen::Matrix3d::Identity();
  const auto rows = map.Get<std::vector<std::array<double, 3>>>("matrix");
  if (rows.size() != 3) map.Fail("matrix", "needs three rows of three numbers");
  Eigen::Matrix3d matrix;
  for (Eigen::Index row = 0; row < 3; ++row) {
    matrix.row(row) = Eigen::RowVector3d(rows[static_cast<std::size_t>(row)].data());
  }
  if (!(matrix * matrix.transpose()).isIdentity(1e-3)) {
    map.Fail("matrix", "is not orthogonal: its rows must be unit vectors at right angles");
  }
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(matrix, Eigen::ComputeFullU | Eigen::ComputeFullV);
  return svd.matrixU() * svd.matrixV().transpose();
}

Eigen::Matrix3d ReadFrame(const YamlMap& map, const std::string& key, const Names& names,
                          const Eigen::Matrix3d& fallback) {
  const YAML::Node node = map.RawNode(key);
  if (!map.Has(key)) return fallback;
  if (node.IsScalar()) {
    std::vector<std::string> known;
    for (const auto& [name, axes] : names) known.push_back(name);
    return AxesMatrix(map, key, names.at(map.GetChoice(key, known, "")));
  }
  const YamlMap general = map.Child(key);
  const auto axes = general.Get<std::vector<std::string>>("axes");
  const double yaw = general.Get<double>("yaw_deg", 0.0) * std::numbers::pi / 180.0;
  const Eigen::Matrix3d matrix = ReadMatrix(general);
  general.Finish();
  const Eigen::AngleAxisd turn(yaw, Eigen::Vector3d::UnitZ());
  return matrix * turn.toRotationMatrix() * AxesMatrix(general, "axes", axes);
}

}  // namespace

const std::vector<std::string>& AngleOrders() {
  static const std::vector<std::string> kOrders = {"zyx", "xyz", "vector", "zxy",
                                                   "yxz", "xzy", "yzx"};
  return kOrders;
}

Eigen::Quaterniond TurnBy(const Eigen::Vector3d& angles, const std::string& order) {
  if (order == "vector") {
    return Eigen::Quaterniond(Eigen::AngleAxisd(angles.norm(), angles.stableNormalized()));
  }
  Eigen::Quaterniond q = Eigen::Quaterniond::Identity();
  for (const char axis : order) {
    q = q * Eigen::AngleAxisd(angles[axis - 'x'], Eigen::Vector3d::Unit(axis - 'x'));
  }
  return q;
}

Eigen::Vector3d AnglesOf(const Eigen::Quaterniond& q, const std::string& order) {
  if (order == "vector") {
    const Eigen::AngleAxisd turn(q);
    return turn.angle() * turn.axis();
  }
  const Eigen::Matrix3d m = q.toRotationMatrix();
  const int i = order[0] - 'x', j = order[1] - 'x', k = order[2] - 'x';
  const double sign = (j - i + 3) % 3 == 1 ? 1.0 : -1.0;
  Eigen::Vector3d angles;
  angles[i] = std::atan2(-sign * m(j, k), m(k, k));
  angles[j] = std::asin(std::clamp(sign * m(i, k), -1.0, 1.0));
  angles[k] = std::atan2(-sign * m(i, j), m(i, i));
  return angles;
}

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
  constexpr double kMost = 1e6;  // the last index that a range may name
  if (!numbers || !(from >= 0.0 && to < kMost && to - from < 64.0)) return range;
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

SourceAttitude::SourceAttitude(const YamlMap& map, const SourceAxes& axes) {
  constexpr std::array<const char*, 3> kForms = {"quaternion", "euler", "matrix"};
  for (const char* form : kForms) {
    if (!map.Has(form)) continue;
    if (!form_.empty())
      map.Fail(form, "give one form of the attitude, 'quaternion', 'euler' or 'matrix'");
    form_ = form;
  }
  if (form_.empty())
    map.Fail("quaternion", "give 'quaternion', 'euler' or 'matrix' for the attitude");
  const YamlMap columns = map.Child(form_);
  if (form_ == "matrix") columns_ = ReadColumns(columns, "columns", 9);
  for (const char* key : form_ == "matrix"  ? std::vector<const char*>()
                         : form_ == "euler" ? std::vector<const char*>{"roll", "pitch", "yaw"}
                                            : std::vector<const char*>{"w", "x", "y", "z"}) {
    if (!columns.Has(key)) columns.Fail(key, "is missing; give its column");
    columns_.emplace_back(columns.RawNode(key), map.file());
  }
  if (form_ == "euler") order_ = columns.GetChoice("order", AngleOrders(), "zyx");
  scale_ = form_ == "euler"
               ? ReadForEach(columns, "scale", 1.0, 3)
               : std::vector<double>(columns_.size(), columns.Get<double>("scale", 1.0));
  const double unit = form_ == "euler" ? ReadUnit(columns, "rad") : 1.0;
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
  for (SourceColumn& column : columns_) column.Bind(row);
}

bool SourceAttitude::HasAny(const ForeignRow& row) const {
  return std::any_of(columns_.begin(), columns_.end(),
                     [&](const SourceColumn& column) { return std::isfinite(column.Value(row)); });
}

std::optional<Eigen::Quaterniond> SourceAttitude::Value(const ForeignRow& row,
                                                        std::optional<double>* bad_norm) const {
  const auto source = form_ == "quaternion" ? FromQuaternion(row, bad_norm)
                      : form_ == "euler"    ? FromEuler(row)
                                            : FromMatrix(row, bad_norm);
  if (!source) return std::nullopt;
  return (to_earth_ * (inverse_ ? source->conjugate() : *source) * from_body_).normalized();
}

InputError SourceAttitude::NormError(const ForeignRow& row, double norm) const {
  return row.ErrorIn(columns_[0].index(),
                     fmt::format("the {}'s norm is {:.4g}, not 1; check its columns and 'scale' in "
                                 "the map",
                                 form_, norm));
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
  return TurnBy(angles, order_);
}

// The nearest rotation, unless the numbers are none (a determinant or a norm far from that of one).
std::optional<Eigen::Quaterniond> SourceAttitude::FromMatrix(
    const ForeignRow& row, std::optional<double>* bad_norm) const {
  constexpr double kTolerance = 0.03;
  Eigen::Matrix3d m;
  for (int i = 0; i < 9; ++i) {
    m(i / 3, i % 3) =
        scale_[static_cast<std::size_t>(i)] * columns_[static_cast<std::size_t>(i)].Value(row);
  }
  if (!m.allFinite() || m.isZero(0.0)) return std::nullopt;
  const Eigen::JacobiSVD<Eigen::Matrix3d> svd(m, Eigen::ComputeFullU | Eigen::ComputeFullV);
  const Eigen::Matrix3d nearest = svd.matrixU() * svd.matrixV().transpose();
  if ((m - nearest).norm() > kTolerance || nearest.determinant() < 0.0) {
    *bad_norm = std::cbrt(m.determinant());
    return std::nullopt;
  }
  return Eigen::Quaterniond(nearest);
}

YAML::Node AxesNode(const Eigen::Matrix3d& axes) {
  YAML::Node names, rows, node;
  const Eigen::Matrix3d whole = axes.array().round();
  const bool named = (axes - whole).norm() < 1e-9 && whole.determinant() > 0.5;
  for (Eigen::Index i = 0; i < 3; ++i) {
    Eigen::Index axis = i;
    if (named) whole.row(i).cwiseAbs().maxCoeff(&axis);
    names.push_back(std::string(named && whole(i, axis) < 0.0 ? "-" : "") + "xyz"[axis]);
    YAML::Node row;
    for (Eigen::Index k = 0; k < 3; ++k) row.push_back(fmt::format("{:.9g}", axes(i, k)));
    rows.push_back(row);
  }
  node["axes"] = names;
  if (!named) node["matrix"] = rows;
  node.SetStyle(YAML::EmitterStyle::Flow);
  return node;
}

SourceAxes ReadAxes(const YamlMap& map, const SourceAxes& fallback) {
  return {ReadFrame(map, "earth", kEarthFrames, fallback.earth),
          ReadFrame(map, "body", kBodyFrames, fallback.body)};
}

}  // namespace trueline
