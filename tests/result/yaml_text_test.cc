// Values of result files: numbers are short, and numbers and texts read back as they were.
#include "problems/result/yaml_text.h"

#include <gtest/gtest.h>

#include <cmath>
#include <limits>

namespace trueline {
namespace {

TEST(YamlText, NumbersAreShort) {
  YAML::Node node;
  node["sigma"] = Rounded(0.0268, 3);
  node["value"] = Rounded(-0.59624, 6);
  node["p"] = Rounded(1e-5, 3);
  EXPECT_EQ(TextOf(node), "sigma: 0.0268\nvalue: -0.59624\np: 1.0e-05\n");
}

TEST(YamlText, NumbersReadBack) {
  for (const double value : {0.0, -1.5, 3e22, 1.25e-9, 123456.0}) {
    EXPECT_DOUBLE_EQ(YAML::Load(Rounded(value, 6)).as<double>(), value);
  }
  EXPECT_TRUE(std::isnan(YAML::Load(Rounded(std::nan(""), 3)).as<double>()));
  EXPECT_EQ(YAML::Load(Rounded(-std::numeric_limits<double>::infinity(), 3)).as<double>(),
            -std::numeric_limits<double>::infinity());
}

TEST(YamlText, QuotedTextReadsBack) {
  for (const std::string text :
       {"a: b # c", "say \"quick\"", "back\\slash\\", "line\nbreak\ttab", ""}) {
    const YAML::Node node = YAML::Load("{source: " + Quoted(text) + ", seed: 3}");
    EXPECT_EQ(node["source"].as<std::string>(), text);
    EXPECT_EQ(node["seed"].as<int>(), 3);
  }
}

}  // namespace
}  // namespace trueline
