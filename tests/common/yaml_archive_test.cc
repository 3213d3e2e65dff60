// One description reads and writes: round trip, units, defaults, and errors that name the key.
#include "problems/common/yaml_archive.h"

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

}  // namespace archive_test
}  // namespace trueline
