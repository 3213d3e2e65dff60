// Errors in maps and foreign files name the place and the remedy.
#include "problems/import/import_map.h"
#include "tests/import/import_files.h"

namespace trueline {
namespace {

constexpr char kMap[] =
    "inputs:\n"
    "  log: {time: {column: t, unit: s}}\n"
    "streams:\n"
    "  imu:\n"
    "    accel: {columns: [a, b, c], unit: m/s^2}\n"
    "    gyro: {columns: [a, b, c], unit: rad/s}\n";
constexpr char kCsv[] = "t,a,b,c\n1,0,0,1\n2,0,0,1\n3,0,0,1\n";

std::string Replaced(std::string text, const std::string& from, const std::string& to) {
  return text.replace(text.find(from), from.size(), to);
}

std::string MapError(const std::string& from, const std::string& to) {
  return ImportFiles().Error(Replaced(kMap, from, to), kCsv);
}

std::string CsvError(const std::string& from, const std::string& to) {
  return ImportFiles().Error(kMap, Replaced(kCsv, from, to));
}

TEST(BadMap, AGoodOneHasNoError) { EXPECT_EQ(ImportFiles().Error(kMap, kCsv), "no error"); }

// A text of the good map, or of the good table, that is replaced by another.
struct Replacement {
  const char *from, *to, *said, *remedy = "";
};
const Replacement kInMap[] = {
    {"streams:", "strems: {}\nstreams:", "map.yaml:3: 'strems': unknown key", "known here:"},
    {"unit: rad/s}", "unt: rad/s}", "map.yaml:6: 'streams.imu.gyro.unt': unknown key"},
    {"unit: s}", "units: s}", "map.yaml:2: 'inputs.log.time.units'"},
    {"unit: m/s^2", "unit: gee", "map.yaml:5: 'streams.imu.accel.unit': 'gee' is not known here",
     "use one of: m/s^2, g"},
    {"[a, b, c], unit: rad", "[a, b, w], unit: rad", "map.yaml:6: there is no column 'w' in",
     "its header has: t, a, b, c"},
    {"[a, b, c], unit: rad", "[a, b, 9], unit: rad", "map.yaml:6: there is no column 9 in"},
    // 64 bits of nanoseconds hold 292 years.
    {"unit: s}", "unit: s, offset: 1e10}",
     "map.yaml:2: 'inputs.log.time.offset': is beyond the 9e9 s"},
    {"unit: s}", "unit: s, scale: 1e11}", "log.csv:2: column 't': a time of 1e+11 s is beyond",
     "correct 'unit', 'scale' or 'offset'"},
    {"  imu:\n", "  imu:\n    body: {axes: [x, y, -z]}\n", "map.yaml:5", "not right-handed; check"},
    {"streams:", "earth: NEU\nstreams:",
     "map.yaml:3: 'earth': 'NEU' is not known; use one of: ENU, NED, NWU"},
    {"  imu:", "  imu2:", "key 'streams.imu' is missing; add it"},
    {"streams:", "cut: {from: 50}\nstreams:", "map.yaml: 'cut' leaves nothing", "widen it"},
    {"streams:", "cut: {airborne: {min_height: 1}}\nstreams:",
     "'cut.airborne' needs the stream 'mocap'"},
    {"streams:", "fixes_from_mocap: {}\nstreams:",
     "map.yaml:3: 'fixes_from_mocap': needs the stream 'mocap'"},
    {"streams:", "fixes_from_mocap: {outlier_share: 2}\nstreams:", "map.yaml:3",
     "'outlier_share' must be within 0 and 1"},
};
const Replacement kInCsv[] = {
    {"\n1,0", "\n9100000000,0", "log.csv:2: column 't': a time of"},
    {"2,0,0,1", "2,0,,1", "log.csv:3: column 'b'", "set 'skip_missing: true'"},
    {"2,0,0,1", "2,0,nan,1", "log.csv:3: column 'b': found 'nan'", "skip_missing"},
    {"2,0,0,1", "2,0,fast,1",
     "log.csv:3: column 'b': 'fast' is no number; repair or remove the line"},
    {"3,0,0,1", "1.5,0,0,1", "log.csv:4: column 't': 1.500000000 s does not come after",
     "'unsorted: sort'"},
    {"2,0,0,1", ",0,0,1", "log.csv:3: column 't': the time stamp is"},
    {"2,0,0,1", "2,0,0", "log.csv:3: found 3 fields where the first row has 4"},
};

TEST(BadMap, MistakesAreNamedWithPlaceAndRemedy) {
  for (const Replacement& r : kInMap) {
    EXPECT_THAT(MapError(r.from, r.to), AllOf(HasSubstr(r.said), HasSubstr(r.remedy)));
  }
  for (const Replacement& r : kInCsv) {
    EXPECT_THAT(CsvError(r.from, r.to), AllOf(HasSubstr(r.said), HasSubstr(r.remedy)));
  }
}

TEST(BadMap, WrongNumberOfColumns) {
  EXPECT_THAT(MapError("[a, b, c], unit: rad", "[a, b], unit: rad"),
              HasSubstr("map.yaml:6: 'streams.imu.gyro.columns': needs 3 columns, found 2"));
  for (const char* range :
       {"\"a[2147483647..2147483647]\"", "\"a[1e300..1e300]\"", "\"a[-1..1]\""}) {
    EXPECT_THAT(MapError("[a, b, c], unit: rad", std::string(range) + ", unit: rad"),
                HasSubstr("map.yaml:6: 'streams.imu.gyro.columns': must be a list of columns"));
  }
}

// Rows of such a sigma would be written and then refused, by the name of a file that is not kept.
TEST(BadMap, SigmaThatIsNotPositive) {
  for (const char* sigma : {"0", "-0.1", "1.0e-9"}) {
    EXPECT_THAT(MapError("  imu:\n", fmt::format("  fixes:\n    position: {{columns: [a, b, c]}}\n"
                                                 "    sigma: {{constant: {}}}\n  imu:\n",
                                                 sigma)),
                AllOf(HasSubstr("map.yaml:6: 'streams.fixes.sigma.constant': found"),
                      HasSubstr("a standard deviation must be positive, 1e-06 m or more")))
        << sigma;
  }
}

TEST(BadMap, NoSuchFile) {
  const ImportFiles files;
  const ImportMap map = ReadImportMap(files.Write("map.yaml", kMap));
  EXPECT_THAT(ErrorOf([&] { ConvertLog(map, {"/nowhere.csv"}, {}); }),
              HasSubstr("/nowhere.csv: cannot be opened"));
}

TEST(BadCsv, CutOffLastLineIsDropped) {
  const FlightLog log = ImportFiles().Convert(kMap, std::string(kCsv) + "4,0,0");
  EXPECT_EQ(log.imu.size(), 3U);
  EXPECT_THAT(log.warnings, ElementsAre(HasSubstr("log.csv:5: the last line is cut off")));
}

TEST(BadCsv, SigmaThatIsNotPositive) {
  const auto fixes = [](const std::string& more) {
    return Replaced(
        kMap, "  imu:\n",
        "  fixes: {position: {columns: [a, b, c]}, sigma: {column: c}" + more + "}\n  imu:\n");
  };
  const std::string csv = Replaced(kCsv, "2,0,0,1", "2,0,0,0");
  EXPECT_THAT(ImportFiles().Error(fixes(""), csv),
              AllOf(HasSubstr("log.csv:3: column 'c': found 0; a standard deviation must be"),
                    HasSubstr("set 'skip_missing: true'")));
  const FlightLog log = ImportFiles().Convert(fixes(", skip_missing: true"), csv);
  EXPECT_EQ(log.fixes.size(), 2U);
  EXPECT_EQ(log.imu.size(), 3U);
  EXPECT_THAT(log.warnings, ElementsAre("fixes: rows left out: 1 with missing values"));
}

TEST(BadCsv, Empty) {
  EXPECT_THAT(ImportFiles().Error(kMap, ""), HasSubstr("log.csv: ends within its header"));
  EXPECT_THAT(ImportFiles().Error(kMap, "t,a,b,c\n"), HasSubstr("log.csv: has no rows"));
}

TEST(FixFlags, RefuseWhatCantBe) {
  const ImportFiles files;
  const ImportMap map = ReadImportMap(files.Write("map.yaml", kMap));
  const std::map<std::string, double> none = {{"min_count", -1}, {"sigma_floor", -1.0}};
  EXPECT_FALSE(OverrideFixes(map, none, "").has_value());
  EXPECT_THAT(ErrorOf([&] { OverrideFixes(map, none, "0.9<x"); }),
              AllOf(HasSubstr("--straights: '0.9<x' is no condition"), HasSubstr("-0.9<x<0.9")));
  EXPECT_THAT(ErrorOf([&] { OverrideFixes(map, none, "auto"); }), HasSubstr("reads no mocap"));
}

}  // namespace
}  // namespace trueline
