// trueline-effects: what it lists.
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include <array>
#include <cstdio>
#include <filesystem>
#include <string>

namespace trueline {
namespace {

TEST(EffectsApp, DescribesTheTermsOfTheOpenCatalogue) {
  const auto program = std::filesystem::path(TRUELINE_TEST_APPS_DIR) / "trueline-effects";
  if (!std::filesystem::exists(program)) GTEST_SKIP() << program << " is not built";
  std::FILE* pipe = popen((program.string() + " --id=term").c_str(), "r");
  ASSERT_NE(pipe, nullptr);
  std::string text;
  std::array<char, 256> line;
  while (std::fgets(line.data(), line.size(), pipe) != nullptr) text += line.data();
  EXPECT_EQ(pclose(pipe), 0);
  EXPECT_THAT(text, testing::StartsWith("term: where, with, size"));
}

}  // namespace
}  // namespace trueline
