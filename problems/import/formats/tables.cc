#include <fmt/ranges.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <map>

#include "problems/common/app.h"
#include "problems/common/error.h"
#include "problems/import/formats/blackbox_header.h"
#include "problems/import/formats/csv_table.h"
#include "problems/log/text_file.h"
#include "problems/log/units.h"
#include "problems/log/unpacked.h"

namespace trueline {
namespace {

namespace fs = std::filesystem;
using Texts = std::vector<std::string>;

// Paths of fields within the messages of ROS, by which a topic's name ends before them.
const Texts kRosFields = SplitList(
    "header.stamp header.seq header.frame_id angular_velocity linear_acceleration "
    "angular_velocity_covariance linear_acceleration_covariance orientation_covariance "
    "orientation pose.pose.position pose.pose.orientation pose.covariance pose.position "
    "pose.orientation transform.translation transform.rotation twist.twist.linear "
    "twist.twist.angular twist.covariance twist.linear twist.angular position_covariance "
    "latitude longitude altitude status.status voltage percentage motor_speed "
    "angular_velocities position point vector",
    ' ');

// A type of message by fields that no other type has together.
struct RosShape {
  const char* type;
  std::array<const char*, 2> fields;
};
constexpr auto kRosShapes = std::to_array<RosShape>({
    {"sensor_msgs/Imu", {"angular_velocity.x", "linear_acceleration.x"}},
    {"sensor_msgs/NavSatFix", {"latitude", "longitude"}},
    {"nav_msgs/Odometry", {"pose.pose.position.x", "twist.twist.linear.x"}},
    {"geometry_msgs/PoseWithCovarianceStamped",
     {"pose.pose.position.x", "pose.pose.orientation.x"}},
    {"geometry_msgs/PoseStamped", {"pose.position.x", "pose.orientation.x"}},
    {"geometry_msgs/TransformStamped", {"transform.translation.x", "transform.rotation.x"}},
    {"sensor_msgs/BatteryState", {"voltage", "percentage"}},
    {"mav_msgs/MotorSpeed", {"motor_speed[0]", "motor_speed[3]"}},
    {"mav_msgs/Actuators", {"angular_velocities[0]", "angular_velocities[3]"}},
});

// Topics of PX4 that a file's name ends with.
constexpr auto kPx4Topics = std::to_array<std::string_view>(
    {"sensor_combined", "vehicle_attitude", "vehicle_gps_position", "sensor_gps",
     "vehicle_visual_odometry", "vehicle_mocap_odometry", "estimator_visual_odometry_aligned",
     "vehicle_local_position", "vehicle_attitude_groundtruth", "actuator_motors",
     "vehicle_local_position_groundtruth", "actuator_outputs", "battery_status", "distance_sensor",
     "esc_status", "sensor_accel", "sensor_gyro", "vehicle_acceleration",
     "vehicle_angular_velocity"});

struct TableChannel {
  std::string name, type;
  int instance = 0;
  std::vector<TableColumn> columns;
  std::optional<TimeColumns> time;
  std::optional<std::size_t> instance_column;
  bool only_changes = false;  // its last values are repeated until there are new ones

  bool Has(std::string_view field) const {
    return std::any_of(columns.begin(), columns.end(),
                       [&](const TableColumn& column) { return column.name == field; });
  }
};

struct Table {
  std::string file;
  CsvLayout layout;
  std::vector<TableChannel> channels;

  bool HasTime() const {
    return std::any_of(channels.begin(), channels.end(),
                       [](const TableChannel& channel) { return channel.time.has_value(); });
  }
};

// A column's name split into topic and field.
struct Placed {
  std::string topic, field;
};

// "q.00" and "q/0" as "q[0]"; no unit in brackets, no marks before it.
std::string PlainName(std::string name, std::string* unit) {
  name.erase(0, std::min(name.find_first_not_of("#%* "), name.size()));
  const std::size_t bracket = name.find_last_of("[(");
  const bool closed = name.ends_with(']') || name.ends_with(')');
  const bool is_element = bracket != std::string::npos && bracket + 1 < name.size() &&
                          std::isdigit(static_cast<unsigned char>(name[bracket + 1])) != 0;
  if (closed && bracket != std::string::npos && bracket > 0 && !is_element) {
    *unit = name.substr(bracket + 1, name.size() - bracket - 2);
    name = std::string(TrimmedField(std::string_view(name).substr(0, bracket)));
  }
  const std::size_t digits = name.find_last_not_of("0123456789");
  constexpr std::size_t kMostDigits = 3;  // of an element; a name may be a number
  if (digits != std::string::npos && digits > 0 && digits + 1 < name.size() &&
      name.size() - digits <= kMostDigits + 1 && (name[digits] == '.' || name[digits] == '/')) {
    name = fmt::format("{}[{}]", name.substr(0, digits), std::stoi(name.substr(digits + 1)));
  }
  return name;
}

bool StartsField(std::string_view rest, std::string_view field) {
  return rest.starts_with(field) &&
         (rest.size() == field.size() || rest[field.size()] == '.' || rest[field.size()] == '[');
}

bool IsMessageName(std::string_view name) {
  return name.size() >= 2 && name.size() <= 24 &&
         std::all_of(name.begin(), name.end(), [](unsigned char c) {
           return std::isupper(c) != 0 || std::isdigit(c) != 0 || c == '_';
         });
}

// The topic ends before a field of ROS, at the last slash, or after a name of capitals, as in
// "IMU.AccX". Other names with points are those of one topic.
Placed PlaceOf(const std::string& name) {
  std::string dotted = name;
  std::replace(dotted.begin(), dotted.end(), '/', '.');
  for (std::size_t at = 0; at != std::string::npos && at < dotted.size();) {
    const std::string_view rest = std::string_view(dotted).substr(at);
    const bool is_field = std::any_of(kRosFields.begin(), kRosFields.end(),
                                      [&](const std::string& f) { return StartsField(rest, f); });
    if (is_field) {
      std::string topic = name.substr(0, at > 0 ? at - 1 : 0);
      if (topic == "field") topic.clear();  // of rostopic echo -p
      return {topic, std::string(rest)};
    }
    at = dotted.find('.', at);
    if (at != std::string::npos) ++at;
  }
  const std::size_t slash = name.rfind('/');
  if (slash != std::string::npos && slash > 0)
    return {name.substr(0, slash), name.substr(slash + 1)};
  const std::size_t point = name.find('.');
  if (point != std::string::npos && IsMessageName(name.substr(0, point))) {
    return {name.substr(0, point), name.substr(point + 1)};
  }
  return {"", name};
}

std::string StemOf(const std::string& file) {
  fs::path name = fs::path(file).filename();
  while (name.has_extension() && name.extension() != name) name = name.stem();
  return name.string();
}

// Divides the number of an instance from a name: "GPS[1]", "vehicle_attitude_0", "x.01".
void SplitInstance(TableChannel* channel) {
  std::string& name = channel->name;
  const std::size_t end = name.ends_with(']') ? name.size() - 1 : name.size();
  const std::size_t digits = name.find_last_not_of("0123456789", end - 1);
  if (digits == std::string::npos || digits + 1 >= end || digits == 0 || end - digits > 3) return;
  if (std::string_view("[_.").find(name[digits]) == std::string_view::npos) return;
  channel->instance = std::stoi(name.substr(digits + 1, end - digits - 1));
  name.resize(digits);
}

// The first rows, which show times and how full columns are.
std::vector<Texts> FirstRows(const std::string& file, const CsvLayout& layout) {
  constexpr std::size_t kRows = 3000;
  LineReader lines(file);
  std::string_view line;
  for (int i = 0; i < layout.LinesBeforeRows(); ++i) lines.Next(&line);
  ValueSplitter splitter(layout.separators);
  std::vector<std::string_view> texts;
  std::vector<Texts> rows;
  while (rows.size() < kRows && lines.NextFilled(&line)) {
    splitter.Split(line, &texts);
    if (texts.size() == layout.columns.size()) rows.emplace_back(texts.begin(), texts.end());
  }
  return rows;
}

// Channels by topic, in the order of their first columns. Times of the file's own topic are those
// of topics without one.
Table MakeTable(const std::string& file) {
  Table table{file, GuessCsvLayout(file), {}};
  const std::vector<Texts> rows = FirstRows(file, table.layout);
  std::map<std::string, std::size_t> by_topic;
  for (std::size_t i = 0; i < table.layout.columns.size(); ++i) {
    std::string unit = table.layout.units.empty() ? "" : table.layout.units[i];
    const Placed placed = PlaceOf(PlainName(table.layout.columns[i], &unit));
    const auto [found, is_new] = by_topic.try_emplace(placed.topic, table.channels.size());
    if (is_new) {
      table.channels.push_back({placed.topic, "", 0, {}, std::nullopt, std::nullopt, false});
    }
    table.channels[found->second].columns.push_back({i, placed.field, unit});
  }
  std::optional<TimeColumns> common = table.layout.time;
  if (common && common->frame == 0.0) common.reset();
  for (TableChannel& channel : table.channels) {
    std::vector<std::size_t> own;
    for (const TableColumn& column : channel.columns) own.push_back(column.index);
    channel.time = FindTimeColumns(table.layout, own, rows, channel.name.empty());
    if (channel.name.empty() || !common) common = channel.time ? channel.time : common;
  }
  // A topic of nothing but times is that of the file.
  std::erase_if(table.channels, [&](const TableChannel& channel) {
    return table.channels.size() > 1 && channel.columns.size() == 1 && channel.time;
  });
  for (TableChannel& channel : table.channels) {
    if (!channel.time) channel.time = common;
    if (channel.name.empty()) channel.name = StemOf(file);
  }
  return table;
}

bool Any(const std::vector<Table>& tables, const std::vector<std::string_view>& fields) {
  return std::all_of(fields.begin(), fields.end(), [&](std::string_view field) {
    return std::any_of(tables.begin(), tables.end(), [&](const Table& table) {
      return std::any_of(table.channels.begin(), table.channels.end(),
                         [&](const TableChannel& channel) { return channel.Has(field); });
    });
  });
}

// --- What the formats' own readers would give

void SetTimeUnit(int exponent, TableChannel* channel) {
  if (channel->time) channel->time->exponent = exponent;
}

void MakeULog(TableChannel* channel) {
  std::string_view known;
  SplitInstance(channel);
  for (const std::string_view topic : kPx4Topics) {
    if (channel->name.ends_with(topic) && topic.size() > known.size()) known = topic;
  }
  if (!known.empty()) channel->name = known;
  SetTimeUnit(3, channel);
}

void MakeDataFlash(TableChannel* channel) {
  SplitInstance(channel);
  if (channel->Has("AccX") && channel->Has("GyrX")) channel->name = "IMU";
  if (channel->Has("Roll") && channel->Has("DesRoll")) channel->name = "ATT";
  if (channel->Has("Lat") && channel->Has("Status")) channel->name = "GPS";
  for (const TableColumn& column : channel->columns) {
    if (column.name == "I") channel->instance_column = column.index;
    if (channel->time && column.name == "TimeUS") *channel->time = {column.index, 3, std::nullopt};
    if (channel->time && column.name == "TimeMS") *channel->time = {column.index, 6, std::nullopt};
  }
}

void MakeRos(TableChannel* channel) {
  for (const RosShape& shape : kRosShapes) {
    if (!channel->Has(shape.fields[0]) || !channel->Has(shape.fields[1])) continue;
    channel->type = shape.type;
    return;
  }
  for (const std::string_view position : {"pose.position", "pose.pose.position", "point",
                                          "transform.translation", "position", "vector"}) {
    if (!channel->Has(fmt::format("{}.x", position))) continue;
    channel->type = "geometry_msgs/PointStamped";
    for (TableColumn& column : channel->columns) {
      if (StartsField(column.name, position)) {
        column.name = "point" + column.name.substr(position.size());
      }
    }
    return;
  }
}

// Groups of variables may be in files of their own.
void MakeCrazyflie(TableChannel* channel) {
  const bool accel = channel->Has("acc.x"), gyro = channel->Has("gyro.x");
  if (accel == gyro || channel->columns.size() > 12) {
    channel->name = accel || !channel->Has("stateEstimate.x") ? "fixedFrequency" : "stateEstimate";
  } else {
    channel->name = accel ? "estAcceleration" : "estGyroscope";
  }
}

// Head lines are `"name","value"`.
BlackboxHeader HeaderOf(const Table& table) {
  BlackboxHeader header;
  LineReader lines(table.file);
  std::string_view line;
  for (int i = 0; i < table.layout.skip_lines && lines.Next(&line); ++i) {
    std::string name(TrimmedField(line.substr(0, line.find(','))));
    const std::size_t comma = line.find(',');
    if (comma == std::string_view::npos) continue;
    header.settings[name] = TrimmedField(line.substr(comma + 1));
  }
  return header;
}

// The counts of one g: as stated, else by the size of the accelerometer's numbers, which is a power
// of two.
double CountsOfG(const BlackboxHeader& header, const std::vector<Texts>& rows,
                 const TableChannel& channel) {
  if (const double stated = header.Number("acc_1G", 0, 0.0); stated > 0.0) return stated;
  std::vector<double> squares;
  for (const Texts& row : rows) {
    double sum = 0.0;
    for (const TableColumn& column : channel.columns) {
      double value = 0.0;
      const bool is_axis = column.name.starts_with("accSmooth[") && column.unit.empty();
      if (is_axis && ParseNumber(row[column.index], &value)) sum += value * value;
    }
    if (sum > 0.0) squares.push_back(sum);
  }
  if (squares.empty()) return 0.0;
  std::nth_element(squares.begin(), squares.begin() + squares.size() / 2, squares.end());
  return std::exp2(std::round(std::log2(std::sqrt(squares[squares.size() / 2]))));
}

void MakeBlackbox(Table* table) {
  const std::vector<Texts> rows = FirstRows(table->file, table->layout);
  std::vector<TableChannel> gps;
  for (TableChannel& channel : table->channels) {
    SetTimeUnit(3, &channel);
    channel.name = "main";
    BlackboxHeader header = HeaderOf(*table);
    header.settings["acc_1G"] = fmt::format("{}", CountsOfG(header, rows, channel));
    const std::vector<TableColumn> raw = channel.columns;
    for (const BlackboxDerived& derived : DerivedBlackboxFields(header)) {
      for (const TableColumn& column : raw) {
        if (column.name != derived.raw) continue;
        TableColumn made{column.index, derived.name, derived.unit, derived.scale, derived.shift};
        if (UnitFactor("m/s^2", column.unit) || column.unit == "m/s/s") {
          made.scale = (column.unit == "g" ? 1.0 : 1.0 / kStandardGravity);
        } else if (column.unit == "rad/s") {
          made.scale = 180.0 / M_PI;
        } else if (column.unit == "V" || column.unit == "deg/s") {
          made.scale = 1.0;
        }
        channel.columns.push_back(made);
      }
    }
    TableChannel fix{"gps", "", 0, {}, channel.time, std::nullopt, true};
    for (TableColumn column : raw) {
      if (!column.name.starts_with("GPS_")) continue;
      double first = 0.0;
      for (const Texts& row : rows) {
        if (ParseNumber(row[column.index], &first) && first != 0.0) break;
      }
      // Degrees are read as counts of 1e-7.
      const bool in_degrees = column.name.starts_with("GPS_coord") && std::abs(first) <= 180.0;
      if (in_degrees) column.scale = 1e7;
      fix.columns.push_back(column);
    }
    if (!fix.columns.empty()) gps.push_back(fix);
  }
  table->channels.insert(table->channels.end(), gps.begin(), gps.end());
}

// A format by fields that its tables have, and what makes its channels of theirs.
struct TableShape {
  std::vector<std::string_view> fields;
  const char* format;
  void (*make)(TableChannel* channel);
};
const TableShape kTableShapes[] = {
    {{"accelerometer_m_s2[0]", "gyro_rad[0]"}, "ulog", MakeULog},
    {{"AccX", "GyrX", "TimeUS"}, "dataflash", MakeDataFlash},
    {{"AccX", "GyrX", "TimeMS"}, "dataflash", MakeDataFlash},
    {{"gyroADC[0]"}, "blackbox", nullptr},
    {{"angular_velocity.x", "linear_acceleration.x"}, "ros2", MakeRos},
    {{"acc.x", "gyro.x"}, "crazyflie", MakeCrazyflie},
    {{"stateEstimate.x", "motor.m1"}, "crazyflie", MakeCrazyflie},
    {{"stateEstimate.x", "controller.cmd_thrust"}, "crazyflie", MakeCrazyflie},
    {{"stateEstimateZ.x", "ctrlLee.omegax"}, "crazyflie", MakeCrazyflie},
};

// The format that the names are of, and the channels as that has them.
const char* MakeFormat(std::vector<Table>* tables) {
  for (const TableShape& shape : kTableShapes) {
    if (!Any(*tables, shape.fields)) continue;
    for (Table& table : *tables) {
      if (shape.make == nullptr) MakeBlackbox(&table);
      for (TableChannel& channel : table.channels) {
        if (shape.make != nullptr) shape.make(&channel);
      }
    }
    return shape.format;
  }
  return kTablesFormat;
}

std::vector<Table> MakeTables(const std::vector<std::string>& files, const char** key) {
  std::vector<Table> tables;
  for (const std::string& file : files) tables.push_back(MakeTable(file));
  // One name of the time means one unit, which the file with most rows a second shows best.
  std::map<std::string, std::pair<double, int>> units;  // step and unit by name
  const auto each_time = [&](const auto& visit) {
    for (Table& table : tables) {
      for (TableChannel& channel : table.channels) {
        if (channel.time && !channel.time->is_stated) {
          const std::string name = table.layout.columns[channel.time->column];
          visit(name.substr(name.find_last_of("./") + 1), &*channel.time);
        }
      }
    }
  };
  each_time([&](const std::string& name, TimeColumns* time) {
    auto& [step, exponent] = units.try_emplace(name, 1e300, 9).first->second;
    if (time->step > 0.0 && time->step < step)
      std::tie(step, exponent) = {time->step, time->exponent};
  });
  each_time([&](const std::string& name, TimeColumns* time) {
    if (units[name].first < 1e300) time->exponent = units[name].second;
  });
  *key = MakeFormat(&tables);
  return tables;
}

// The rows of one file, one after the other.
class TableRows {
 public:
  TableRows(const Table& table, MessageSink* sink)
      : table_(table), lines_(table.file), splitter_(table.layout.separators), sink_(sink) {
    std::string_view line;
    for (int i = 0; i < table.layout.LinesBeforeRows(); ++i) lines_.Next(&line);
    places_.resize(table.channels.size());
    previous_.resize(table.channels.size());
    Next();
  }

  bool AtEnd() const { return at_end_; }
  TimeNs time() const { return time_; }

  void Emit() {
    for (std::size_t i = 0; i < table_.channels.size(); ++i) EmitTo(i);
    Next();
  }

 private:
  void Next() {
    at_end_ = !lines_.NextFilled(&line_);
    if (at_end_) return;
    splitter_.Split(line_, &texts_);
    if (texts_.size() != table_.layout.columns.size()) return;
    for (const TableChannel& channel : table_.channels) {
      if (channel.time && channel.time->Read(texts_, &time_)) break;
    }
  }

  void EmitTo(std::size_t i) {
    const TableChannel& channel = table_.channels[i];
    if (texts_.size() != table_.layout.columns.size()) return;  // blank, or cut off
    std::string values;
    for (const TableColumn& column : channel.columns) {
      const bool is_time = channel.time && channel.time->column == column.index;
      if (!is_time) values += texts_[column.index];
      if (channel.only_changes) values += ',';
    }
    if (values.empty()) return;
    if (channel.only_changes && previous_[i] == values) return;
    if (channel.only_changes) previous_[i] = values;
    double number = channel.instance;
    if (channel.instance_column) ParseNumber(texts_[*channel.instance_column], &number);
    const int instance = std::clamp(static_cast<int>(number), 0, 255);
    const auto [place, is_new] = places_[i].try_emplace(instance, 0);
    if (is_new) {
      place->second = sink_->AddChannel(
          {channel.name, instance, channel.type, table_.file + std::to_string(i)}, [&] {
            return std::make_unique<TableDecoder>(channel.columns, table_.layout.separators,
                                                  table_.layout.columns.size());
          });
    }
    TimeNs time = 0;
    if (channel.time && !channel.time->Read(texts_, &time)) time = time_;
    sink_->Add(place->second, time, line_);
  }

  const Table& table_;
  LineReader lines_;
  ValueSplitter splitter_;
  MessageSink* sink_;
  std::vector<std::map<int, std::size_t>> places_;  // of channels, by instance
  std::vector<std::string> previous_;
  std::string_view line_;
  std::vector<std::string_view> texts_;
  TimeNs time_ = 0;
  bool at_end_ = false;
};

// In the order of time, as a logger of all files would have written them.
void WalkTables(const fs::path& paths, MessageSink* sink) {
  const char* key = nullptr;
  const std::vector<Table> tables = MakeTables(SplitPaths(paths.string()), &key);
  std::vector<std::unique_ptr<TableRows>> rows;
  for (const Table& table : tables) {
    if (!table.layout.warning.empty()) sink->Warn(table.file + ": " + table.layout.warning);
    if (!table.HasTime() && tables.size() > 1) {
      const std::string& why = table.layout.time_problem;
      sink->Warn(table.file + ": " +
                 (why.empty() ? "no column has the name of a time or rises from row to row; name "
                                "one, as in 't [s]'"
                              : why) +
                 ". It is left out");
      continue;
    }
    rows.push_back(std::make_unique<TableRows>(table, sink));
  }
  for (;;) {
    TableRows* first = nullptr;
    for (const auto& one : rows) {
      if (!one->AtEnd() && (first == nullptr || one->time() < first->time())) first = one.get();
    }
    if (first == nullptr) return;
    first->Emit();
  }
}

constexpr std::array<LogFormat, 6> kTableFormats = {{
    {"ulog", "tables of a PX4 ULog", WalkTables},
    {"dataflash", "tables of an ArduPilot log", WalkTables},
    {"blackbox", "table of a Betaflight blackbox", WalkTables},
    {"ros2", "tables of ROS messages", WalkTables},
    {"crazyflie", "tables of a Crazyflie", WalkTables},
    {kTablesFormat, "tables of text", WalkTables},
}};

}  // namespace

std::unique_ptr<Recording> OpenTables(const std::vector<std::string>& files) {
  const char* key = nullptr;
  MakeTables(files, &key);
  for (const LogFormat& format : kTableFormats) {
    if (std::string_view(format.key) == key) {
      return std::make_unique<Recording>(JoinPaths(files), format);
    }
  }
  return nullptr;
}

std::string JoinPaths(const std::vector<std::string>& files) {
  return fmt::format("{}", fmt::join(files, ","));
}

std::vector<std::string> TablesIn(const std::vector<std::string>& files) {
  std::vector<std::string> all;
  for (const std::string& file : files) {
    std::vector<std::string> tables;
    const fs::path folder = Unpacked(file);
    if (fs::is_directory(folder)) {
      for (const auto& entry : fs::directory_iterator(folder)) {
        const std::string name = entry.path().filename().string();
        const bool is_table = name.ends_with(".csv") || name.find(".csv.") != std::string::npos;
        if (entry.is_regular_file() && is_table) tables.push_back(entry.path().string());
      }
    }
    std::sort(tables.begin(), tables.end());
    if (tables.empty()) tables.push_back(file);
    all.insert(all.end(), tables.begin(), tables.end());
  }
  return all;
}

}  // namespace trueline
