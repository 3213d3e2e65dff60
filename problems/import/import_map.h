// The YAML column map of trueline-convert: how a foreign log becomes a native one.
//
//   name: "{stem}"           # of the log; {stem} is the name of the first file
//   dataset: where it is from
//   gravity: 9.81            # m/s^2
//   environment: indoors     # or outdoors; indoors no wind is looked for
//   mocap_clock: imu         # mocap, and fixes sampled from it, are moved by what accelerations
//                            # show (AlignMocap); own: the stamps are kept
//   inputs:                  # one for each file of --in, in this order
//     board:                 # a name of your own
//       delimiter: ","       # or ";", "|", tab, space (runs of blanks)
//       decimal: "."         # or ",", beside another delimiter
//       skip_lines: 0        # before the header
//       header: true         # false: no names, columns by number
//       units_line: false    # true: the line below the names states units; it is skipped
//       time: {column: t, unit: s, scale: 1, offset: 0}   # offset in s, also by file: {"*a*": 1.5}
//       unsorted: refuse     # or drop, or sort: rows whose time does not increase
//     flight: {format: [ros1, ros2, mcap]}  # a recording of one of these formats, or several
//                            # tables of it (or of `tables`), in place of CSV;
//                            # its time is that of measurement unless `time` names another field,
//                            # and `unsorted` is sort
//   earth: NWU               # axes of the source unless a stream says otherwise (see source.h)
//   body: FLU
//   streams:                 # each may state input, time, earth, body, new_where, accept, expect,
//                            # skip_missing, unsorted, leave_out: [[from, until], ...] in s
//     imu:
//       accel: {columns: [ax, ay, az], unit: g}
//       gyro: {columns: [gx, gy, gz], unit: deg/s}  # `input: other`: from another CSV input, whose
//                            # values are interpolated at the times of this stream
//     attitude: {quaternion: {w: qw, x: qx, y: qy, z: qz}}  # or euler: {roll, pitch, yaw, unit,
//                            # order: zyx}, of the rotations; vector: three numbers are one
//     fixes:
//       position: {columns: [19, 20, {constant: -1.5}]}
//       sigma: {constant: 0.15}
//       gate: {column: 36}
//       new_where: [19, 20, 50]
//       time: {column: 50, unit: ms}
//       velocity: {columns: [vx, vy, vz]}  # in place of `position`: is integrated to one
//     mocap:    {position: {columns: [px, py, pz], unit: m, earth: ENU}, quaternion: {...}}
//     pose:     like mocap, of the pose sensor
//     rotors:   {columns: [m1, m2, m3, m4], unit: rpm}
//     motors:   {columns: [u1, u2, u3, u4], scale: 1.5259e-5}   # or one column, the total thrust;
//                            # mix: [[1, -0.5, 0.5, 1], ...]: rows of weights of the columns
//     battery:  {column: vbat, unit: V}
//     range:    {column: sonar, unit: m}
//
// Streams of a recording state their `channel`, [name, pattern*, ...], the first that has records
// counts, or the `type` of its messages, of which the channel with most rows counts. `with: [name]`
// adds the last values of other channels; `optional: true` lets the log lack it. Columns are
// fields: "q[0]", "q[0..3]". A list of streams means the first of which the log has ten usable
// rows, or a tenth of the rows of another. `prefer: [pattern*, ...]` names channels that count
// before those of all streams of the list, `avoid` those that count after them; letters of either
// case fit.
//
//     fixes:    {channel: GPS, position: {geodetic: [Lat, Lng, Alt]}, ...}  # deg and m, by scale;
//                            # NED about the first one
//   cut: {from: 2, to: 30, relative_to: start, airborne: {min_height: 0.5, margin: 0.5}}
//   gates: [...]             # as in log.yaml, in NED
//   vehicle: {...}           # as in log.yaml
//   fixes_from_mocap:        # for logs without a detector; the keys of FixSamplerOptions and
//     straights:             # where, by file name; the first pattern that matches
//       "*oval*": {boxes: [{x: [-0.9, 0.9], heading_deg: 0}]}   # in E
//       "*": {curvature: {max_curvature: 0.3, flattest_share: 0.4}}
//
// `inverse: true` beside a quaternion's columns: they are the rotation from earth to body.
//
// A column is given by name, by number from 1, or as {constant: value in SI}. Values become scale *
// unit * column + offset. `accel` and `gyro` may be given in earth axes: their `attitude`
// (quaternion or euler) rotates them back. With `gravity: removed` beside it, gravity was taken out
// of `accel` and comes back; with `axes: body` it is given in those axes all the same. Unknown keys
// are errors.
#pragma once

#include <array>
#include <filesystem>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "problems/import/foreign_csv.h"
#include "problems/import/row_filter.h"
#include "problems/import/source.h"
#include "problems/log/flight_log.h"
#include "problems/trajectory/mocap_path.h"
#include "problems/trajectory/straight.h"

namespace trueline {

struct TimeSource {
  SourceColumn column;
  bool of_row = false;           // a recording's own time, in place of a column
  int exponent = 9;              // of its unit, for ParseTime()
  std::optional<double> factor;  // s for a count of one, where `scale` is given
  // s, added; the first pattern that fits the file's name.
  std::vector<std::pair<std::string, double>> offset_by_file;
};

// What happens to a row whose time does not come after that of the row before.
enum class Unsorted { kRefuse, kDrop, kSort };

struct InputMap {
  std::string name;
  std::vector<std::string> formats;  // of LogFormat, any of which it may have; none: CSV
  CsvDialect dialect;
  TimeSource time;
  Unsorted unsorted = Unsorted::kRefuse;
};

struct Series;

// Where the values of one field of a stream come from.
struct FieldSource {
  std::string key;       // of Field
  NumberSource numbers;  // in the source's axes
  // An attitude's source, or that of the attitude which takes a vector to the body's specific
  // force.
  std::optional<SourceAttitude> attitude;
  Eigen::Matrix3d axes = Eigen::Matrix3d::Identity();  // from the source's to the native ones
  bool geodetic = false;                               // latitude and longitude in deg, height in m
  bool is_velocity = false;                            // integrated to a position
  bool in_earth = false, without_gravity = false;      // of a vector of the body with an attitude
  std::optional<std::size_t> input = {};               // of another file, joined by time
  std::shared_ptr<const Series> series = {};           // what was read there
};

// Vectors by time, of a file beside the stream's own.
struct Series {
  std::vector<TimeNs> t;
  std::vector<Eigen::Vector3d> values;

  // Between the samples around `time`; none where they are missing or far apart.
  std::optional<Eigen::Vector3d> At(TimeNs time) const;
};

struct StreamMap {
  std::size_t input = 0;  // index of InputMap
  // Of a recording: names or patterns of channels, of which the first is taken that has records, or
  // the type of its messages.
  std::vector<std::string> channels;
  std::string type;
  // Patterns of channels that count before all others, and after all others.
  std::vector<std::string> prefer, avoid;
  std::vector<std::string> with;     // names of further channels, whose last record completes a row
  std::vector<std::size_t> channel;  // places of the channel and of these, once found
  bool optional = false;             // a recording may lack it
  std::vector<StreamMap> otherwise;  // in its place, in order, where its channel or columns lack

  TimeSource time;
  Unsorted unsorted = Unsorted::kRefuse;
  // The stream itself, then those in its place.
  std::vector<StreamMap> Alternatives() const;

  // Skip rows with a value that is missing or can't be, as a quaternion whose norm is not 1,
  // instead of an error.
  bool skip_missing = false;
  RowFilter filter;
  std::vector<std::array<double, 2>> leave_out;  // s, after offsets: rows from .. until ..
  std::vector<FieldSource> fields;               // in the order of the stream's declaration
};

struct CutOptions {
  std::optional<double> from, to;    // s
  bool relative_to_start = true;     // of the first IMU sample; otherwise the log's own clock
  std::optional<double> min_height;  // m above the first mocap sample; first to last time above it
  double margin = 0.0;               // s left away at both ends of that
};

struct StraightsMap {
  std::string pattern;             // of file names
  std::vector<StraightBox> boxes;  // none: found by curvature
  CurvatureOptions curvature;
};

struct FixesFromMocap {
  FixSamplerOptions sampler;
  StraightLimits limits;
  std::vector<StraightsMap> straights;
};

struct ImportMap {
  std::string file;  // the map's own path
  std::string name, dataset;
  double gravity = 9.81;
  std::string environment;  // as in log.yaml
  bool mocap_on_imu_clock = false;
  std::vector<InputMap> inputs;
  std::vector<Gate> gates;
  std::optional<Vehicle> vehicle;
  CutOptions cut;
  std::optional<FixesFromMocap> fixes_from_mocap;
  std::map<std::string, StreamMap> streams;  // by name
};

// Whether `pattern` (with * and ?) matches a file's name without its folder.
bool Fits(const std::string& pattern, const std::string& path);

// Throws InputError naming file, line and key.
ImportMap ReadImportMap(const std::filesystem::path& path);
ImportMap ReadImportMapText(const std::string& text, const std::string& name);

// The `streams` and `time` sections of a column map.

// Without a column, which only a recording may lack, it is the rows' own time plus the offset.
TimeSource ReadTimeSource(const YamlMap& map, bool is_csv);

// The key `unsorted`, of an input or a stream.
Unsorted ReadUnsorted(const YamlMap& map, Unsorted fallback);

// Every stream that the map has, by name; `axes` are those of the whole map.
std::map<std::string, StreamMap> ReadStreamsMap(const YamlMap& map, const SourceAxes& axes,
                                                const std::vector<InputMap>& inputs);

// The `fixes_from_mocap` section of a column map.

FixesFromMocap ReadFixesFromMocap(const YamlMap& map);

// The keys of FixSamplerOptions, where `map` has them; the others keep their defaults.
FixSamplerOptions ReadFixSamplerOptions(const YamlMap& map);

// A condition "low<x<high" on one axis of E as a box; `where` names its origin, for the error.
StraightBox ParseBoxCondition(const std::string& condition, const std::string& where);

// Settings of the fixes sampled from mocap; flags override those of the map: `numbers` by the keys
// of FixSamplerOptions, of which a negative one keeps the map's, and `straights`: "auto", or
// conditions on axes of E with ';' between, all of which hold. No value if neither the map nor a
// flag asks for sampled fixes. Throws InputError for an impossible setting, or if the log has real
// fixes or no mocap.
std::optional<FixesFromMocap> OverrideFixes(const ImportMap& map,
                                            const std::map<std::string, double>& numbers,
                                            const std::string& straights);

}  // namespace trueline
