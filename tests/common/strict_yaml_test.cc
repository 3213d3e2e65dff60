#include "problems/common/strict_yaml.h"

#include "tests/common/test_files.h"

namespace trueline {
namespace {

YamlMap Parse(const std::string& text) { return YamlMap(YAML::Load(text), "test.yaml", ""); }

TEST(StrictYaml, ReadsRequiredAndOptionalValues) {
  const YamlMap map = Parse("{speed: 1.8, list: [1, 2, 3]}");
  EXPECT_EQ(map.Get<double>("speed"), 1.8);
  EXPECT_EQ(map.Get<double>("noise", 0.5), 0.5);
  EXPECT_EQ(map.GetVector3("list"), Eigen::Vector3d(1, 2, 3));
  map.Finish();
}

TEST(StrictYaml, NamesFileLineAndKeyOfAnUnknownKey) {
  const YamlMap map = Parse("speed: 1.8\nsped: 2.0\n");
  map.Get<double>("speed");
  const std::string error = ErrorOf([&] { map.Finish(); });
  EXPECT_THAT(error, HasSubstr("test.yaml:2"));
  EXPECT_THAT(error, HasSubstr("sped"));
  EXPECT_THAT(error, HasSubstr("known here: speed"));
}

TEST(StrictYaml, RefusesKeysThatOccurTwiceAndNumbersThatAreNone) {
  const YamlMap twice = Parse("speed: 1\nspeed: 2\n");
  twice.Get<double>("speed");
  EXPECT_THAT(ErrorOf([&] { twice.Finish(); }), HasSubstr("occurs twice"));
  const YamlMap list = Parse("? [a, b]\n: 1\n");
  EXPECT_THAT(ErrorOf([&] { list.Finish(); }), HasSubstr("a key must be a text"));
  const YamlMap numbers = Parse("{speed: .nan, place: [0, .inf, 0]}");
  EXPECT_THAT(ErrorOf([&] { numbers.Get<double>("speed"); }), HasSubstr("finite"));
  EXPECT_THAT(ErrorOf([&] { numbers.GetVector3("place"); }), HasSubstr("finite"));
  EXPECT_THAT(ErrorOf([&] { numbers.Get<std::vector<double>>("place"); }), HasSubstr("'place'"));
  const YamlMap rows = Parse("rows: [[0, 1], [.nan, 2]]");
  using Rows = std::vector<std::array<double, 2>>;
  EXPECT_THAT(ErrorOf([&] { rows.Get<Rows>("rows"); }), HasSubstr("finite"));
}

TEST(StrictYaml, NamesMissingKeysAndWrongKinds) {
  const YamlMap map = Parse("imu:\n  rate: fast\n");
  EXPECT_THAT(ErrorOf([&] { map.Get<double>("speed"); }), HasSubstr("'speed' is missing"));
  const YamlMap imu = map.Child("imu");
  EXPECT_THAT(ErrorOf([&] { imu.Get<double>("rate"); }), HasSubstr("test.yaml:2: 'imu.rate'"));
}

}  // namespace
}  // namespace trueline
