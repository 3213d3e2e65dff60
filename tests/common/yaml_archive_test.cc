// One description reads and writes: round trip, units, defaults, and errors that name the key.
#include "problems/common/yaml_archive.h"

#include "problems/common/strict_yaml.h"
#include "problems/common/units.h"
#include "tests/common/test_files.h"

namespace trueline {
namespace archive_test {

enum class Colour { kRed, kBlue };

struct Inner {
  int count = 2;
};

struct Options {
  double length = 1.5;           // m
  double angle = 3.0 * kDegree;  // rad
  Eigen::Vector3d bias{0.1, -0.2, 0.3};
  Colour colour = Colour::kBlue;
  Inner inner;
};

void Serialize(YamlArchive* a, Inner* inner) { a->Count("count", &inner->count); }

void Serialize(YamlArchive* a, Options* o) {
  a->Positive("length_m", &o->length);
  a->NotNegative("angle_deg", &o->angle, kDegree);
  a->Require(o->angle < M_PI, "angle_deg", "must be below 180");
  a->Value("bias", &o->bias);
  a->Choice("colour", &o->colour, {{"red", Colour::kRed}, {"blue", Colour::kBlue}});
  a->Nested("inner", &o->inner);
}

Options Read(const std::string& text) {
  return FromYaml<Options>(YamlMap(YAML::Load(text), "file.yaml", ""));
}

std::string ErrorIn(const std::string& text) {
  return ErrorOf([&] { Read(text); });
}

TEST(YamlArchive, ReadsBackWhatItWrites) {
  Options options{2.5, 10.0 * kDegree, {1.0, 2.0, 3.0}, Colour::kRed, {7}};
  const YAML::Node node = ToYaml(options);
  EXPECT_NEAR(node["angle_deg"].as<double>(), 10.0, 1e-12);
  EXPECT_EQ(node["colour"].as<std::string>(), "red");
  const Options back = FromYaml<Options>(YamlMap(node, "file.yaml", ""));
  EXPECT_EQ(back.length, 2.5);
  EXPECT_NEAR(back.angle, options.angle, 1e-15);
  EXPECT_EQ(back.bias, options.bias);
  EXPECT_EQ(back.colour, Colour::kRed);
  EXPECT_EQ(back.inner.count, 7);
}

TEST(YamlArchive, KeysLeftOutKeepTheirDefaults) {
  const Options options = Read("inner: {count: 3}");
  EXPECT_EQ(options.length, 1.5);
  EXPECT_EQ(options.colour, Colour::kBlue);
  EXPECT_EQ(options.inner.count, 3);
}

TEST(YamlArchive, ErrorsNameFileLineAndKey) {
  EXPECT_THAT(ErrorIn("bias: [0, 0, 0]\nlength_m: 0"),
              AllOf(HasSubstr("file.yaml:2"), HasSubstr("'length_m'"), HasSubstr("found 0")));
  EXPECT_THAT(ErrorIn("angle_deg: 200"), HasSubstr("must be below 180"));
  EXPECT_THAT(ErrorIn("bias: [0, .inf, 0]"), HasSubstr("must be finite numbers"));
  EXPECT_THAT(ErrorIn("colour: green"), HasSubstr("'green' is not known; use one of: red, blue"));
  EXPECT_THAT(ErrorIn("inner: {count: 0}"), HasSubstr("'inner.count': must be 1 or more"));
  EXPECT_THAT(ErrorIn("inner: {size: 1}"),
              HasSubstr("'inner.size': unknown key; known here: count"));
}

// --- Maps: what is read, and what is refused.

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

}  // namespace archive_test
}  // namespace trueline